#pragma once
// The hand on the palette's "Exponent" cell (A22): touching it goes one step on, and turning the
// potentiometer while the hand lies there sets the exponent live, all over its range. What stands when the
// hand leaves is one operation.

#include <optional>
#include <string>

#include "server-model/interaction/air_operation.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class ExponentGesture final : public Gesture {
 public:
  /// On the active shape. `workbench` must outlive it.
  explicit ExponentGesture(Workbench& workbench)
      : workbench_(workbench), air_(workbench), entity_(workbench.active_shape()) {}

  Result<Preview> on_frame(const HandFrame& frame) override;
  Result<std::optional<model::Submitted>> commit() override;
  void cancel() override { air_.cancel(); }
  bool begun() const override { return dial_.has_value(); }
  HandActivity activity() const override;
  std::string_view name() const override { return "exponent"; }

 private:
  double step_after(double exponent) const;

  Workbench& workbench_;
  AirOperation air_;
  std::string entity_;
  double exponent_ = 0;
  std::optional<double> dial_;  ///< Of the potentiometer when the hand touched the cell.
  bool turned_ = false;
};

}  // namespace handloft::interaction
