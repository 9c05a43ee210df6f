#pragma once
// The pointing hand draws a boundary while it presses (A24): an approximately closed curve in the air, inside
// of which the surface is seen from then on. A new press draws another curve in its place (a mere tap does
// not); what stands when the hand stops pointing is kept. While the curve is open nothing is previewed, and
// one that is still open then is refused.
//
// It acts on the selected shape when one is selected; else on the first one that the fingertip comes within
// reach of; else, drawn far from all, on the shape that a gesture acted on last.

#include <optional>
#include <string>
#include <vector>

#include "server-model/interaction/air_operation.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class BoundaryGesture final : public Gesture {
 public:
  /// `workbench` must outlive it.
  explicit BoundaryGesture(Workbench& workbench) : workbench_(workbench), air_(workbench) {}

  Result<Preview> on_frame(const HandFrame& frame) override;
  Result<std::optional<model::Submitted>> commit() override;
  void cancel() override { air_.cancel(); }
  bool begun() const override { return air_.operation().has_set_boundary(); }
  HandActivity activity() const override;
  std::string_view name() const override { return "boundary"; }

 private:
  Status address(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  Workbench& workbench_;
  AirOperation air_;
  std::string entity_;
  std::vector<Eigen::Vector3d> curve_;  ///< Of this press.
  double length_m_ = 0;
  bool pen_down_ = false;
  bool met_ = false;  ///< entity_ was within reach or selected; it stays.
  std::optional<Eigen::Vector3d> last_tip_;
};

}  // namespace handloft::interaction
