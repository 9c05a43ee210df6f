#include "server-model/interaction/transform_gesture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server-model/interaction/pointing.h"

namespace handloft::interaction {

double TransformGesture::scale_for(double potentiometer) const {
  const double turned = potentiometer - dial_;
  const double beyond =
      std::copysign(std::max(0.0, std::abs(turned) - workbench_.options.dial_slack), turned);
  return std::exp2(workbench_.options.scale_octaves * beyond);
}

v1::Operation TransformGesture::operation(const FistWay& way) const {
  v1::Operation operation;
  v1::TransformEntities& transform = *operation.mutable_transform();
  transform.add_entities(entity_);
  set_vec3(*transform.mutable_pivot(), pivot_);
  set_vec3(*transform.mutable_translation(), way.translation);
  if (grip_ == Grip::fist) {
    transform.mutable_rotation()->set_w(way.turn.w());
    transform.mutable_rotation()->set_x(way.turn.x());
    transform.mutable_rotation()->set_y(way.turn.y());
    transform.mutable_rotation()->set_z(way.turn.z());
    transform.set_scale(scale_for(way.potentiometer));
  }
  return operation;
}

Result<Preview> TransformGesture::on_frame(const HandFrame& frame) {
  const bool by_fist = grip_ == Grip::fist;
  const auto at = by_fist ? frame.fist_centre : pen_tip(frame.sample);
  if (!at) return Preview::unseen;
  let_go_ = false;
  const auto before = std::exchange(last_, at).value_or(*at);
  if (entity_.empty()) {
    entity_ = workbench_.selected_shape();
    if (entity_.empty()) entity_ = workbench_.nearest_entity(before, *at);
    if (entity_.empty()) return Preview::same;
    pivot_ = *at;
    dial_ = frame.sample.potentiometer;
    if (by_fist) fist_.on_frame(frame);
    return Preview::changed;
  }
  FistWay way;
  if (by_fist) {
    way = fist_.on_frame(frame);
    pivot_ = fist_.grasped_at();
  } else {
    way.translation = *at - pivot_;
  }
  if (auto status = air_.set(operation(way)); !status) return status.error();
  return Preview::changed;
}

void TransformGesture::let_go(std::optional<TimePoint> since) {
  if (std::exchange(let_go_, true)) return;  // The first that it has gone over to.
  opened_ = since;
}

Result<std::optional<model::Submitted>> TransformGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  if (grip_ == Grip::fist && let_go_ && opened_) {
    const auto way = fist_.at_release(opened_);
    if (!way) {
      air_.cancel();
      return std::optional<model::Submitted>();
    }
    if (auto status = air_.set(operation(*way)); !status) return status.error();
  }
  auto submitted = air_.commit();
  if (submitted && *submitted) workbench_.active = entity_;
  return submitted;
}

HandActivity TransformGesture::activity() const {
  return {entity_.empty() ? "" : "moving", entity_, {}, {}};
}

}  // namespace handloft::interaction
