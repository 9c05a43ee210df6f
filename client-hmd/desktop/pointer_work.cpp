#include "client-hmd/desktop/pointer_work.h"

#include <algorithm>
#include <cmath>

namespace handloft::client {
namespace {

/// Before the shape's points, which lie a few millimetres about its surface, but within a hand's reach
/// (InteractionOptions::reach_m).
constexpr double approach_m = 0.015;
/// The pointer's way by which a push knows its direction.
constexpr double direction_m = 0.0005;
/// Between two looks at the surface under the pointer.
constexpr double step_px = 6.0;
constexpr double most_steps = 400.0;

}  // namespace

PointerWork PointerWork::begin(DesktopTool tool, bool along_normal, const Cursor& cursor,
                               const PointerPlace& place, const PointerWorld& world, const HandTouch& touch,
                               HandStream& hand) {
  PointerWork work;
  work.tool_ = tool;
  work.along_normal_ = along_normal;
  work.last_ = place;
  work.start_px_ = place.at_px;
  work.start_ = cursor.at;
  work.holds_icon_ = tool == DesktopTool::push && cursor.over && !cursor.over->icon.empty();
  // A profile begins on the shape that is under the pointer: the plane goes through it there.
  if (tool == DesktopTool::draw && !cursor.on_shape && cursor.over) work.start_ = cursor.over->at;
  work.at_ = work.start_;
  work.plane_ = work_plane(world.settings.plane, work.start_, world.eye);
  work.axis_ = cursor.on_shape && work.is_fist() ? cursor.normal : work.plane_.normal;
  if (tool == DesktopTool::push && !work.holds_icon_) return work;
  work.begun_ = true;
  hand.begin(tool, place.time, work.start_, work.axis_, touch);
  return work;
}

std::optional<glm::dvec3> PointerWork::place_at(const glm::dvec2& at_px, const PointerWorld& world) {
  if (is_fist()) {
    if (along_normal_) return start_ + along_line(world.eye, start_, axis_, start_px_, at_px) * axis_;
    const auto from = on_plane(plane_, world.eye, start_px_);
    const auto to = on_plane(plane_, world.eye, at_px);
    if (!from || !to) return std::nullopt;
    return start_ + *to - *from;
  }
  if (world.settings.snaps) {
    if (const auto point = world.picker.snap(world.scene, world.eye, at_px)) return point->at;
  }
  const auto over = world.picker.pick(world.scene, world.eye, at_px);
  // From point to point it would jump.
  if (sticks_to(world.settings, tool_, over) && over->on_surface) {
    plane_.origin = over->at;  // Beyond the shape's edge it goes on at this depth.
    return over->at;
  }
  return on_plane(plane_, world.eye, at_px);
}

void PointerWork::begin_push(TimePoint time, const HandTouch& touch, HandStream& hand) {
  const glm::dvec3 way = at_ - start_;
  if (!(glm::length(way) >= direction_m)) return;
  if (along_normal_) {
    if (glm::dot(way, axis_) < 0.0) axis_ = -axis_;
  } else {
    axis_ = glm::normalize(way);
  }
  begun_ = true;
  hand.begin(tool_, time, start_ - approach_m * axis_, axis_, touch);
}

void PointerWork::step_to(const PointerPlace& place, const PointerWorld& world, const HandTouch& touch,
                          HandStream& hand) {
  const auto at = place_at(place.at_px, world);
  if (!at) return;
  at_ = *at;
  if (!begun_) begin_push(place.time, touch, hand);
  if (begun_) hand.move(place.time, at_, touch);
}

void PointerWork::move(const PointerPlace& place, const PointerWorld& world, const HandTouch& touch,
                       HandStream& hand) {
  const glm::dvec2 way = place.at_px - last_.at_px;
  const Duration time = place.time - last_.time;
  const int steps = static_cast<int>(std::clamp(std::ceil(glm::length(way) / step_px), 1.0, most_steps));
  for (int i = 1; i < steps && !is_fist(); ++i) {
    const double share = static_cast<double>(i) / steps;
    step_to({last_.time + from_seconds(to_seconds(time) * share), last_.at_px + share * way}, world, touch,
            hand);
  }
  step_to(place, world, touch, hand);
  last_ = place;
}

void PointerWork::touch(TimePoint time, const HandTouch& touch, HandStream& hand) {
  if (begun_) hand.move(time, at_, touch);
}

void PointerWork::turn(TimePoint time, const glm::dquat& by, HandStream& hand) {
  if (!begun_ || !is_fist()) return;
  turn_ = glm::normalize(by * turn_);
  hand.turn(time, turn_);
}

void PointerWork::skip(const glm::dvec2& by_px) {
  start_px_ += by_px;
  last_.at_px += by_px;
}

void PointerWork::end(TimePoint time, const HandTouch& touch, HandStream& hand, HandStream::Ending ending) {
  if (begun_) hand.end(time, at_, touch, ending);
}

}  // namespace handloft::client
