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

Result<Preview> TransformGesture::on_frame(const HandFrame& frame) {
  const auto at = grip_ == Grip::fist ? frame.fist_centre : pen_tip(frame.sample);
  if (!at) return Preview::unseen;
  const auto before = std::exchange(last_, at).value_or(*at);
  if (entity_.empty()) {
    entity_ = workbench_.selected_shape();
    if (entity_.empty()) entity_ = workbench_.nearest_entity(before, *at);
    if (entity_.empty()) return Preview::same;
    pivot_ = *at;
    grasped_ = fingertip_positions(frame.sample);
    dial_ = frame.sample.potentiometer;
    return Preview::changed;
  }
  v1::Operation operation;
  v1::TransformEntities& transform = *operation.mutable_transform();
  transform.add_entities(entity_);
  set_vec3(*transform.mutable_pivot(), pivot_);
  set_vec3(*transform.mutable_translation(), *at - pivot_);
  if (grip_ == Grip::fist) {
    if (const auto turn = hand_turn(grasped_, fingertip_positions(frame.sample))) turn_ = *turn;
    transform.mutable_rotation()->set_w(turn_.w());
    transform.mutable_rotation()->set_x(turn_.x());
    transform.mutable_rotation()->set_y(turn_.y());
    transform.mutable_rotation()->set_z(turn_.z());
    transform.set_scale(scale_for(frame.sample.potentiometer));
  }
  if (auto status = air_.set(std::move(operation)); !status) return status.error();
  return Preview::changed;
}

Result<std::optional<model::Submitted>> TransformGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  auto submitted = air_.commit();
  if (submitted && *submitted) workbench_.active = entity_;
  return submitted;
}

HandActivity TransformGesture::activity() const {
  return {entity_.empty() ? "" : "moving", entity_, {}, {}};
}

}  // namespace handloft::interaction
