#pragma once
// The open hand that presses lays points (A1), mirrored when symmetry is on (A12), on the active shape or on
// a new one; the fit of a shape that shows points and surface follows while they arrive.

#include <string>

#include "server-model/interaction/air_operation.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class StrokeGesture final : public Gesture {
 public:
  /// `workbench` must outlive it.
  explicit StrokeGesture(Workbench& workbench) : workbench_(workbench), air_(workbench) {}
  ~StrokeGesture() override { release_id(); }

  Result<Preview> on_frame(const HandFrame& frame) override;
  Result<std::optional<model::Submitted>> commit() override;
  void cancel() override;
  bool begun() const override { return begun_; }
  HandActivity activity() const override { return {"laying points", entity_, {}, {}}; }
  std::string_view name() const override { return "stroke"; }

 private:
  v1::Operation new_stroke() const;
  std::string next_shape_id() const;
  /// Gives a shape that the stroke makes an id that is free now.
  void choose_id(v1::AddPoints& add);
  void release_id();

  Workbench& workbench_;
  AirOperation air_;
  std::string entity_;
  bool begun_ = false;
  std::string promised_;  ///< The id that this gesture holds in Claims::shape_ids; empty: none.
};

}  // namespace handloft::interaction
