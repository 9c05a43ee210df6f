#include "daemon-tracking/fusion/space_mouse_tracker.h"

#include <algorithm>
#include <cmath>

#include "daemon-tracking/source/space_mouse/space_mouse_report.h"

namespace handloft::tracking {

Eigen::Vector3d SpaceMouseTracker::world(const std::array<std::int16_t, 3>& raw) const {
  const double dead = std::clamp(limits_.dead_zone, 0.0, 0.9);
  const double scale = limits_.full_scale > 0.0 ? limits_.full_scale : 1.0;
  const auto normalise = [&](std::int16_t value) {
    const double part = std::clamp(value / scale, -1.0, 1.0);
    const double above = std::abs(part) - dead;
    return above <= 0.0 ? 0.0 : std::copysign(above / (1.0 - dead), part);
  };
  // The cap's y is towards the designer and its z down: half a turn about x, for pushing and twisting alike.
  return {normalise(raw[0]), -normalise(raw[1]), -normalise(raw[2])};
}

void SpaceMouseTracker::stamp(TimePoint time) {
  state_.present = true;
  state_.time = std::max(state_.time, time);
}

void SpaceMouseTracker::take_alone() {
  if (!half_) return;
  state_.translation = world(half_->translation);
  stamp(half_->time);
  half_.reset();
}

Status SpaceMouseTracker::consume(const DeviceBytes& bytes) {
  const auto report = parse_space_mouse_report(bytes.bytes);
  if (!report) return report.error();
  advance(bytes.arrival_time);
  switch (report->part) {
    case SpaceMousePart::translation:
      take_alone();  // The one before had no rotation.
      half_ = Half{bytes.arrival_time, report->translation};
      break;
    case SpaceMousePart::rotation:
      take_alone();
      state_.rotation = world(report->rotation);
      stamp(bytes.arrival_time);
      break;
    case SpaceMousePart::both:
      half_.reset();
      state_.translation = world(report->translation);
      state_.rotation = world(report->rotation);
      stamp(bytes.arrival_time);
      break;
    case SpaceMousePart::buttons:
      state_.buttons = report->buttons;
      stamp(bytes.arrival_time);
      break;
    case SpaceMousePart::other:
      break;
  }
  return {};
}

void SpaceMouseTracker::advance(TimePoint time) {
  if (half_ && time - half_->time > limits_.pair_within) take_alone();
}

void SpaceMouseTracker::device_gone(TimePoint time) {
  const TimePoint newest = std::max(state_.time, time);
  half_.reset();
  state_ = {};
  state_.time = newest;
}

}  // namespace handloft::tracking
