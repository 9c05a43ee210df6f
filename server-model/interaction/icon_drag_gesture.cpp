#include "server-model/interaction/icon_drag_gesture.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "server-model/interaction/pointing.h"
#include "server-model/model/sculpt_solve.h"

namespace handloft::interaction {

IconDragGesture::IconDragGesture(Workbench& workbench, NearIcon picked)
    : workbench_(workbench),
      picked_(std::move(picked)),
      air_(workbench),
      hold_(workbench),
      fist_(workbench.options.fist_hold) {
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

v1::Operation IconDragGesture::operation(const FistWay& way) const {
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

bool IconDragGesture::moved(const FistWay& way) const {
  return way.translation.norm() >= workbench_.options.icon_slack_m ||
         (turns_ && way.turn.angularDistance(Eigen::Quaterniond::Identity()) > 0);
}

Result<Preview> IconDragGesture::on_frame(const HandFrame& frame) {
  if (!frame.fist_centre) return Preview::unseen;
  let_go_ = false;
  const FistWay way = fist_.on_frame(frame);
  if (!std::exchange(selected_, true)) return Preview::changed;
  if (held().empty() || (!begun() && !moved(way))) return Preview::same;
  if (!hold_.renew()) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("somebody else drives icon \"{}\" by now", picked_.name.icon));
  }
  const Status status = air_.amend(operation(way));
  refused_ = status ? std::string() : status.error().message;
  return Preview::changed;
}

void IconDragGesture::let_go(std::optional<TimePoint> since) {
  if (std::exchange(let_go_, true)) return;  // The first that it has gone over to.
  opened_ = since;
}

Result<std::optional<model::Submitted>> IconDragGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  if (let_go_ && opened_) {
    const auto way = fist_.at_release(opened_);
    if (!way || !moved(*way)) {
      air_.cancel();
      return std::optional<model::Submitted>();
    }
    // It was accepted once; were it refused now, the last good one would stay.
    static_cast<void>(air_.amend(operation(*way)));
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
