#pragma once
// The pointing hand draws profiles while it presses (A18, A19): the surfaces follow the strokes at once, and
// their points keep their residuals.
//
// A set of strokes begins with the first press of a pointing hand and ends when the hand stops pointing. All
// strokes in between, over each other or over several places, make one operation and one step of undo, in
// which their order doesn't matter; between two of them the hand lifts by letting go of the pressure alone.
//
// They act on the selected shape when one is selected; else on the shapes whose surfaces the fingertip has
// come within reach of, divided among their footprints where there are several (A21); else, drawn far from
// all, on the shape that a gesture acted on last.

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server-model/interaction/air_operation.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class ProfileGesture final : public Gesture {
 public:
  /// `workbench` must outlive it.
  explicit ProfileGesture(Workbench& workbench) : workbench_(workbench), air_(workbench.model) {}

  Result<Preview> on_frame(const HandFrame& frame) override;
  Result<std::optional<model::Submitted>> commit() override;
  void cancel() override { air_.cancel(); }
  bool begun() const override { return air_.operation().has_modify_profile(); }
  HandActivity activity() const override;
  std::string_view name() const override { return "profile"; }

 private:
  /// Fitted shapes that the fingertip came within reach of on its way since the last frame.
  void meet_shapes(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  /// Settles whom the strokes act on; an error when there is nobody.
  Status address();

  Workbench& workbench_;
  AirOperation air_;
  /// What was drawn, without strokes too short to be meant.
  v1::Operation operation() const;

  struct Stroke {
    v1::ProfileCurve curve;
    std::vector<Eigen::Vector3d> points;  ///< The same places.
    double length_m = 0;
  };
  std::vector<Stroke> strokes_;
  bool pen_down_ = false;
  std::optional<Eigen::Vector3d> last_tip_;
  std::set<std::string> met_;
  std::string entity_;    ///< Whom, or the first of several.
  bool divided_ = false;  ///< Among all that were met.
};

}  // namespace handloft::interaction
