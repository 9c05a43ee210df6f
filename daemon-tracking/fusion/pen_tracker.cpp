#include "daemon-tracking/fusion/pen_tracker.h"

#include <linux/input-event-codes.h>

#include <algorithm>
#include <numbers>

namespace handloft::tracking {

namespace {

constexpr double metres_per_mm = 1e-3;

double metres_per_unit(const PenAxis& axis, const PenAxis& x, double assumed_width_m) {
  if (axis.resolution > 0) return metres_per_mm / axis.resolution;
  // Tablets have square units: what is assumed of x holds for y.
  return x.resolution > 0 ? metres_per_mm / x.resolution
                          : assumed_width_m / (static_cast<double>(x.maximum) - x.minimum);
}

double part_of(const PenAxis& axis, std::int32_t value) {
  if (!axis.present) return 0.0;
  const double range = static_cast<double>(axis.maximum) - axis.minimum;
  return std::clamp((static_cast<double>(value) - axis.minimum) / range, 0.0, 1.0);
}

double tilt_rad(const PenAxis& axis, std::int32_t value) {
  if (!axis.present) return 0.0;
  const double bounded = std::clamp(value, axis.minimum, axis.maximum);
  // The kernel's documentation wants units per radian; older drivers give degrees and no resolution.
  const double rad = axis.resolution > 0 ? bounded / axis.resolution : bounded * std::numbers::pi / 180.0;
  return std::clamp(rad, -std::numbers::pi / 2, std::numbers::pi / 2);
}

}  // namespace

Status PenTracker::consume(const DeviceBytes& bytes) {
  if (bytes.kind == DeviceData::pen_facts) {
    auto facts = parse_pen_facts(bytes.bytes);
    if (!facts) return facts.error();
    facts_ = *facts;
    raw_ = {};
    state_ = {};
    state_.present = true;
    state_.time = bytes.arrival_time;
    return {};
  }
  const auto events = parse_pen_events(bytes.bytes);
  if (!events) return events.error();
  if (!facts_) return make_error(ErrorCode::failed_precondition, "events before the tablet's facts", "pen");
  for (const PenEvent& event : *events) {
    if (event.type != EV_SYN) {
      take(event);
    } else if (event.code == SYN_DROPPED) {
      ++overruns_;  // What follows up to the next SYN_REPORT puts everything right.
    } else if (event.code == SYN_REPORT) {
      const bool plausible =
          event.time <= bytes.arrival_time && event.time >= bytes.arrival_time - options_.plausible_delay;
      complete(plausible ? event.time : bytes.arrival_time);
    }
  }
  return {};
}

void PenTracker::take(const PenEvent& event) {
  const auto set_button = [&](unsigned bit) {
    raw_.buttons = event.value != 0 ? raw_.buttons | 1u << bit : raw_.buttons & ~(1u << bit);
  };
  if (event.type == EV_ABS) {
    switch (event.code) {
      case ABS_X:
        raw_.x = event.value;
        break;
      case ABS_Y:
        raw_.y = event.value;
        break;
      case ABS_PRESSURE:
        raw_.pressure = event.value;
        break;
      case ABS_TILT_X:
        raw_.tilt_x = event.value;
        break;
      case ABS_TILT_Y:
        raw_.tilt_y = event.value;
        break;
      default:
        break;
    }
  } else if (event.type == EV_KEY) {
    switch (event.code) {
      case BTN_TOOL_PEN:
        raw_.pen = event.value != 0;
        break;
      case BTN_TOOL_RUBBER:
        raw_.rubber = event.value != 0;
        break;
      case BTN_STYLUS:
        set_button(0);
        break;
      case BTN_STYLUS2:
        set_button(1);
        break;
      case BTN_STYLUS3:
        set_button(2);
        break;
      default:
        break;
    }
  }
}

void PenTracker::complete(TimePoint time) {
  state_.present = true;
  state_.time = std::max(state_.time, time);
  state_.in_proximity = raw_.pen || raw_.rubber;
  state_.eraser = raw_.rubber;
  if (!state_.in_proximity) {
    state_.pressure = 0.0;
    state_.buttons = 0;
    state_.eraser = false;
    return;  // Where it left stays.
  }
  const double x_scale = metres_per_unit(facts_->x, facts_->x, options_.assumed_width_m);
  const double y_scale = metres_per_unit(facts_->y, facts_->x, options_.assumed_width_m);
  const auto along = [](const PenAxis& axis, std::int32_t value) {
    return static_cast<double>(std::clamp(value, axis.minimum, axis.maximum));
  };
  // The kernel's y points to the designer, ours away.
  state_.position_m = {(along(facts_->x, raw_.x) - facts_->x.minimum) * x_scale,
                       (facts_->y.maximum - along(facts_->y, raw_.y)) * y_scale};
  state_.pressure = part_of(facts_->pressure, raw_.pressure);
  state_.tilt_rad = {tilt_rad(facts_->tilt_x, raw_.tilt_x), -tilt_rad(facts_->tilt_y, raw_.tilt_y)};
  state_.buttons = raw_.buttons;
}

void PenTracker::device_gone(TimePoint time) {
  const TimePoint newest = std::max(state_.time, time);
  facts_.reset();
  raw_ = {};
  state_ = {};
  state_.time = newest;
}

}  // namespace handloft::tracking
