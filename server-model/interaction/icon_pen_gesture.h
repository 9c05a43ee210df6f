#pragma once
// The pointing hand adds icons to a sculpted surface (D6, D9, D11; D19, step 3) while it presses:
//
//   a tap            a point icon, where the fingertip came down. On an icon that is there: selects it.
//   a drawn line     a curve icon, smoothed and thinned (drawn_curve.h)
//   after "Icon pen" a region icon: from where the fingertip came down to where it let go, or between two
//                    taps; the first corner is kept until the hand stops pointing.
//
// Each is one AddIcon when the fingertip lets go, seen in the air while it presses, and selected afterwards.
// The icon's role and property are those that the palette has for new ones; a hand and the 3D mouse drive it.
// The surface is the selected one, else the nearest; the fingertip must come down within reach of it.

#include <optional>
#include <string>
#include <vector>

#include "server-model/interaction/air_operation.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class IconPenGesture final : public Gesture {
 public:
  /// `workbench` must outlive it.
  explicit IconPenGesture(Workbench& workbench) : workbench_(workbench), air_(workbench) {}

  Result<Preview> on_frame(const HandFrame& frame) override;
  Result<std::optional<model::Submitted>> commit() override;
  void cancel() override { air_.cancel(); }
  bool begun() const override { return air_.operation().has_add_icon(); }
  bool done() const override { return done_; }
  HandActivity activity() const override;
  std::string_view name() const override { return "icon"; }

  /// The fingertip is down, or one corner of a region is given: it must go on.
  bool busy() const { return pen_down_ || corner_; }

 private:
  Status press(const Eigen::Vector3d& tip);
  void draw(const Eigen::Vector3d& tip);
  void lift();
  void add(v1::IconShape shape, const std::vector<Eigen::Vector3d>& places);

  Workbench& workbench_;
  AirOperation air_;
  IconPen pen_ = IconPen::point_or_curve;  ///< As it was when the fingertip came down.
  std::string entity_;
  std::vector<Eigen::Vector3d> path_;  ///< Of this press.
  bool drawn_ = false;                 ///< It is more than a tap.
  bool pen_down_ = false;
  bool done_ = false;
  std::optional<Eigen::Vector3d> corner_;  ///< Of a region, given by a tap.
  IconName tapped_;                        ///< There was an icon where the fingertip came down.
  std::string refused_;                    ///< Why what is drawn so far makes no icon; empty: it does.
};

}  // namespace handloft::interaction
