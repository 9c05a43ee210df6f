#include "server-model/interaction/push_gesture.h"

#include <span>
#include <utility>
#include <vector>

namespace handloft::interaction {

std::optional<geometry::DiskPose> PushGesture::pose_of(const HandFrame& frame) {
  std::vector<geometry::Vec3> visible;
  for (const auto& tip : frame.sample.fingertips) {
    if (tip) visible.push_back(tip->position);
  }
  auto pose = disk_.update(visible, frame.sample.pressure);
  if (!pose || !frame.fist_centre) return std::nullopt;
  // A finger that hides must not shift the disk by its breadth: that would be a push of its own.
  pose->centre = *frame.fist_centre;
  pose->normal *= side_;
  return pose;
}

bool PushGesture::acquire(const geometry::DiskPose& from, const geometry::DiskPose& to) {
  const model::Document& document = workbench_.model.document();
  const std::string selected = workbench_.selected_shape();
  const auto near = selected.empty()
                        ? workbench_.targets.nearest(document, from.centre, to.centre)
                        : workbench_.targets.within_reach(document, selected, from.centre, to.centre);
  if (!near) return false;
  entity_ = near->entity;
  if ((near->position - from.centre).dot(from.normal) < 0) side_ = -1.0;
  return true;
}

v1::DiskPose PushGesture::message_of(const geometry::DiskPose& pose, TimePoint time) const {
  v1::DiskPose message;
  set_vec3(*message.mutable_centre(), pose.centre);
  set_vec3(*message.mutable_normal(), pose.normal);
  message.set_radius_m(pose.radius_m);
  message.set_time_ns(to_ns(time));
  return message;
}

Result<Preview> PushGesture::on_frame(const HandFrame& frame) {
  auto pose = pose_of(frame);
  if (!pose) return Preview::unseen;
  auto before = std::exchange(last_, pose);
  const TimePoint before_time = std::exchange(last_time_, frame.sample.capture_time);
  const v1::DiskPose now = message_of(*pose, frame.sample.capture_time);
  Status status;
  if (begun_) {
    status = air_.push_on(now, frame.sample.potentiometer);
  } else {
    if (!before) before = pose;
    if (!acquire(*before, *pose)) return Preview::same;
    before->normal *= side_;
    pose->normal *= side_;
    last_ = pose;
    v1::Operation operation;
    v1::PushPoints& push = *operation.mutable_push_points();
    push.add_entities(entity_);
    push.set_refit(workbench_.fits_live(entity_));
    push.set_range(frame.sample.potentiometer);
    push.set_falloff(workbench_.modes.falloff);
    *push.add_path() = message_of(*before, before_time);
    *push.add_path() = message_of(*pose, frame.sample.capture_time);
    if (before_time == TimePoint{}) push.mutable_path(0)->set_time_ns(push.path(1).time_ns());
    status = air_.set(std::move(operation));
    begun_ = true;
  }
  if (!status) return status.error();
  return Preview::changed;
}

Result<std::optional<model::Submitted>> PushGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  auto submitted = air_.commit();
  if (submitted && *submitted) workbench_.active = entity_;  // Else it met no point.
  return submitted;
}

HandActivity PushGesture::activity() const {
  return {entity_.empty() ? "" : "pushing", entity_, last_, {}};
}

}  // namespace handloft::interaction
