#pragma once
// The closed hand pushes points with the modification disk (A13, A14), and those around them as far as the
// potentiometer says (A15 to A17); it may be turned while the hand pushes. The whole way of the disk is one
// operation.
//
// The disk faces the shape that it comes near: whichever side of the fist is turned to the shape's nearest
// place when it first comes within reach is the side that pushes, for the whole gesture. So a shape is pushed
// back from its other side without turning the hand over, and nothing is ever pulled.

#include <optional>
#include <string>

#include "server-model/interaction/air_operation.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class PushGesture final : public Gesture {
 public:
  /// `workbench` must outlive it.
  explicit PushGesture(Workbench& workbench)
      : workbench_(workbench), disk_(workbench.options.disk), air_(workbench) {}

  Result<Preview> on_frame(const HandFrame& frame) override;
  Result<std::optional<model::Submitted>> commit() override;
  void cancel() override { air_.cancel(); }
  bool begun() const override { return begun_; }
  HandActivity activity() const override;
  std::string_view name() const override { return "push"; }

 private:
  /// The disk of this frame, facing as it does in this gesture; nullopt: the fist is not seen well enough.
  std::optional<geometry::DiskPose> pose_of(const HandFrame& frame);
  /// Settles which shape is pushed and by which side, once one is within reach.
  bool acquire(const geometry::DiskPose& from, const geometry::DiskPose& to);
  v1::DiskPose message_of(const geometry::DiskPose& pose, TimePoint time) const;

  Workbench& workbench_;
  geometry::ModificationDisk disk_;
  AirOperation air_;
  std::string entity_;  ///< Empty: not near any shape yet.
  double side_ = 1.0;   ///< Of the fist that pushes, once `entity_` is settled: 1 or -1.
  std::optional<geometry::DiskPose> last_;
  TimePoint last_time_;
  bool begun_ = false;
};

}  // namespace handloft::interaction
