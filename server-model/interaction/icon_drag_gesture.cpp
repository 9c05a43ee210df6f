#include "server-model/interaction/icon_drag_gesture.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "server-model/interaction/pointing.h"
#include "server-model/model/sculpt_solve.h"

namespace handloft::interaction {

IconDragGesture::IconDragGesture(Workbench& workbench, NearIcon picked)
    : workbench_(workbench), picked_(std::move(picked)), air_(workbench.model), hold_(workbench) {
  workbench_.select_icon(picked_.name);
  const model::Document& document = workbench_.model.document();
  const model::SculptPtr shape = model::as_sculpt(document.find(picked_.name.entity));
  const model::SculptIcon* icon = shape ? shape->find_icon(picked_.name.icon) : nullptr;
  if (icon == nullptr || !is_driven_by(*icon, hand_sensor)) return;
  if (!hold_.take(picked_.name)) return;
  curve_ = icon->shape == model::IconShape::curve;
  turns_ = icon->shape != model::IconShape::point || icon->role == model::IconRole::load ||
           icon->property != model::IconProperty::position;
  if (curve_) length_m_ = length_m(model::icon_outline(*icon, *shape->surface));
}

v1::Operation IconDragGesture::operation(const Way& way) const {
  v1::Operation operation;
  v1::DragIcon& drag = *operation.mutable_drag_icon();
  drag.set_entity(picked_.name.entity);
  drag.set_icon(picked_.name.icon);
  set_vec3(*drag.mutable_translation(), way.translation);
  if (curve_ && length_m_ > 0 && way.potentiometer < 1 - workbench_.options.dial_slack) {
    drag.set_held_at(picked_.along);
    drag.set_reach_m(length_m_ * std::max(way.potentiometer, workbench_.options.least_bend));
  } else if (turns_) {
    drag.mutable_rotation()->set_w(way.turn.w());
    drag.mutable_rotation()->set_x(way.turn.x());
    drag.mutable_rotation()->set_y(way.turn.y());
    drag.mutable_rotation()->set_z(way.turn.z());
  }
  return operation;
}

bool IconDragGesture::still_closing(const HandFrame& frame, const FingertipPositions& fingertips) const {
  const InteractionOptions& options = workbench_.options;
  if (frame.sample.capture_time - closed_at_ > options.fist_folds_for) return false;
  const auto opening = hand_opening(grasped_, fingertips);
  return opening && *opening < 1 - options.fist_slack;
}

Result<Preview> IconDragGesture::on_frame(const HandFrame& frame) {
  if (!frame.fist_centre) return Preview::unseen;
  const FingertipPositions fingertips = fingertip_positions(frame.sample);
  const bool first = !grasped_at_;
  if (first) closed_at_ = frame.sample.capture_time;
  if (first || still_closing(frame, fingertips)) {
    grasped_at_ = frame.fist_centre;
    grasped_ = fingertips;
    last_ = {};
    steady_.reset();
    if (first) return Preview::changed;  // It is selected now.
  }
  if (held().empty()) return Preview::same;
  if (const auto turn = hand_turn(grasped_, fingertips)) last_.turn = *turn;
  last_.time = frame.sample.capture_time;
  last_.translation = *frame.fist_centre - *grasped_at_;
  last_.potentiometer = frame.sample.potentiometer;
  const InteractionOptions& options = workbench_.options;
  const bool still =
      last_.translation.norm() < options.icon_slack_m &&
      (!turns_ || last_.turn.angularDistance(Eigen::Quaterniond::Identity()) < options.icon_slack_rad);
  if (!begun() && still) return Preview::same;
  const Status status = air_.amend(operation(last_));
  refused_ = status ? std::string() : status.error().message;
  const auto opening = hand_opening(grasped_, fingertips);
  if (status && (!opening || *opening < 1 + options.fist_slack)) steady_ = last_;
  return Preview::changed;
}

Result<std::optional<model::Submitted>> IconDragGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  if (steady_ && steady_->time < last_.time &&
      last_.time - steady_->time <= workbench_.options.fist_folds_for) {
    // Accepted once; were it refused now, the last good one would stay.
    static_cast<void>(air_.amend(operation(*steady_)));
  }
  return air_.commit();
}

HandActivity IconDragGesture::activity() const {
  const std::string& icon = picked_.name.icon;
  std::string words;
  if (held().empty()) {
    words = fmt::format("selected icon \"{}\"", icon);
  } else if (!refused_.empty()) {
    words = fmt::format("icon \"{}\" stays: {}", icon, refused_);
  } else {
    const bool bent = air_.operation().drag_icon().reach_m() > 0;
    words = fmt::format("{} icon \"{}\"", bent ? "bending" : "dragging", icon);
  }
  return {std::move(words), picked_.name.entity, {}, {}};
}

}  // namespace handloft::interaction
