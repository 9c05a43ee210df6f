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
//
// A tap of the thumb while the fingertip draws divides the stroke there by hand (A21): what follows draws the
// profile of another shape, the nearest one but that of the part before, or nobody's where no other is within
// reach. Another tap before the finger has moved on passes it to the next nearest, at last to nobody, and
// round again. Such a stroke is divided by its taps alone. Its first part is the selected shape's, or the
// nearest one's. Which shape has the part being drawn is told by activity(), as the shape acted on.

#include <map>
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
  explicit ProfileGesture(Workbench& workbench) : workbench_(workbench), air_(workbench) {}

  Result<Preview> on_frame(const HandFrame& frame) override;
  Result<std::optional<model::Submitted>> commit() override;
  void cancel() override { air_.cancel(); }
  bool begun() const override { return air_.operation().has_modify_profile(); }
  HandActivity activity() const override;
  std::string_view name() const override { return "profile"; }

 private:
  /// From one tap of the thumb to the next.
  struct Part {
    double begin_m = 0;  ///< Along the stroke.
    int passed_on = 0;   ///< By further taps at its beginning.
    /// How near shapes were, all along: the integral of reach less distance.
    std::map<std::string, double> nearness;
  };
  struct Stroke {
    v1::ProfileCurve curve;
    std::vector<Eigen::Vector3d> points;  ///< The same places.
    double length_m = 0;
    std::vector<Part> parts{Part{}};
  };

  /// Fitted shapes that the fingertip came within reach of on its way since the last frame.
  void meet_shapes(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  /// The thumb was laid down where the stroke now ends.
  void divide_here();
  /// Whose profile each part of a stroke draws; "" is nobody's.
  std::vector<std::string> owners(const Stroke& stroke) const;
  /// Settles whom the strokes act on; an error when there is nobody.
  Status address();

  Workbench& workbench_;
  AirOperation air_;
  /// What was drawn, without strokes too short to be meant.
  v1::Operation operation() const;

  std::vector<Stroke> strokes_;
  bool pen_down_ = false;
  bool thumb_laid_ = true;  ///< In the last frame; a thumb that lay there from the start taps nothing.
  std::optional<Eigen::Vector3d> last_tip_;
  std::set<std::string> met_;
  std::string entity_;    ///< Whom, or the first of several.
  bool divided_ = false;  ///< Among all that were met.
};

}  // namespace handloft::interaction
