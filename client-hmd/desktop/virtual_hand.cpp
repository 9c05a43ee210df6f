#include "client-hmd/desktop/virtual_hand.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "common/codec/fingertips.h"

namespace handloft::client {
namespace {

/// As of a hand that holds a ball: the pentagon's circumradius.
constexpr double pentagon_m = 0.02;
/// The server refuses hands 10 m from the table; the pentagon needs some of it.
constexpr double farthest_m = 9.0;
/// FistOptions::turn_slack_rad.
constexpr double turn_slack_rad = 0.05;
/// Steps of the glove's sensors (A1).
constexpr double highest_raw = 1023.0;

struct Axes {
  glm::dvec3 right, up;
};

/// Two unit vectors across `direction`. Which two is a matter of taste, but it must not jump while the
/// direction is the same.
Axes across(const glm::dvec3& direction) {
  const glm::dvec3 least =
      std::abs(direction.z) < 0.9 ? glm::dvec3(0.0, 0.0, 1.0) : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 right = glm::normalize(glm::cross(least, direction));
  return {right, glm::cross(direction, right)};
}

double within(double value, double low, double high) {
  return std::isfinite(value) ? std::clamp(value, low, high) : low;
}

bool is_place(const glm::dvec3& at) {
  // Written so that what is no number is none.
  return std::abs(at.x) <= farthest_m && std::abs(at.y) <= farthest_m && std::abs(at.z) <= farthest_m;
}

glm::dvec3 unit_or_up(const glm::dvec3& direction) {
  const double length = glm::length(direction);
  return length > 1e-9 && std::isfinite(length) ? direction / length : glm::dvec3(0.0, 0.0, 1.0);
}

codec::FingertipRecord tip_at(const glm::dvec3& at) {
  codec::FingertipRecord tip;
  tip.state = v1::TRACKING_TRACKED;
  tip.position_m = {at.x, at.y, at.z};
  return tip;
}

codec::Fingertips fingertips(const HandPose& pose) {
  const Axes axes = across(unit_or_up(pose.direction));
  const bool pointing = pose.gesture == v1::GESTURE_POINTING;
  constexpr auto index = static_cast<std::size_t>(v1::FINGER_INDEX);
  const int corners =
      pointing ? static_cast<int>(codec::fingertip_count) - 1 : static_cast<int>(codec::fingertip_count);
  codec::Fingertips tips;
  int corner = 0;
  for (std::size_t i = 0; i < tips.size(); ++i) {
    if (pointing && i == index) {
      tips[i] = tip_at(pose.cursor);
      continue;
    }
    const double angle = glm::two_pi<double>() * corner++ / corners;
    const glm::dvec3 offset = pentagon_m * (std::cos(angle) * axes.right + std::sin(angle) * axes.up);
    tips[i] = tip_at(pose.cursor + pose.turn * offset);
  }
  return tips;
}

}  // namespace

glm::dquat told_turn(const glm::dquat& meant) {
  const glm::dquat shortest = meant.w < 0.0 ? -meant : meant;
  const double angle = glm::angle(shortest);
  if (!(angle > 1e-6) || angle >= 2.0 * turn_slack_rad) return shortest;
  return glm::angleAxis(turn_slack_rad + angle / 2.0, glm::axis(shortest));
}

v1::TrackingFrame hand_frame(const HandPose& pose, std::uint64_t sequence) {
  if (!is_place(pose.cursor)) return no_hand_frame(pose.time, sequence);
  v1::TrackingFrame frame = no_hand_frame(pose.time, sequence);
  v1::HandState& hand = *frame.add_hands();
  codec::pack_fingertips(fingertips(pose), hand);
  hand.set_gesture(pose.gesture);
  hand.set_pressure(within(pose.pressure, 0.0, 1.0));
  hand.set_pressure_raw(static_cast<std::uint32_t>(std::lround(hand.pressure() * highest_raw)));
  hand.set_pressing(pose.pressing);
  hand.set_potentiometer(within(pose.potentiometer, 0.0, 1.0));
  hand.set_potentiometer_raw(static_cast<std::uint32_t>(std::lround(hand.potentiometer() * highest_raw)));
  if (pose.thumb_laid) hand.set_contacts(1U << v1::CONTACT_PAD_THUMB);
  return frame;
}

v1::TrackingFrame no_hand_frame(TimePoint time, std::uint64_t sequence) {
  v1::TrackingFrame frame;
  frame.set_sequence(sequence);
  frame.set_capture_time_ns(to_ns(time));
  frame.set_publish_time_ns(to_ns(time));
  return frame;
}

}  // namespace handloft::client
