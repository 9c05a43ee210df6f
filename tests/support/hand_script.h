#pragma once
// A hand made of numbers: tracking frames as handloft-trackd would publish them, one method call a frame.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "proto/tracking.pb.h"

namespace handloft::test {

class HandScript {
 public:
  /// Frames come at 30 a second, as in A1.
  static constexpr std::int64_t frame_ns = 33'333'333;

  /// The five fingertips of a hand whose fingertips' mean is `centre`.
  static std::array<Eigen::Vector3d, 5> fingertips(const Eigen::Vector3d& centre) {
    std::array<Eigen::Vector3d, 5> tips;
    const std::array<Eigen::Vector3d, 5> offsets{
        Eigen::Vector3d(-0.04, 0.03, 0.0), Eigen::Vector3d(-0.02, -0.02, 0.01),
        Eigen::Vector3d(0.0, -0.03, 0.0), Eigen::Vector3d(0.02, -0.01, -0.01),
        Eigen::Vector3d(0.04, 0.03, 0.0)};
    for (std::size_t i = 0; i < tips.size(); ++i) tips[i] = centre + offsets[i];
    return tips;
  }

  v1::TrackingFrame hand(const Eigen::Vector3d& centre, v1::Gesture gesture, bool pressing = false,
                         double pressure = 0.0) {
    v1::TrackingFrame frame = empty();
    v1::HandState& state = *frame.add_hands();
    state.set_gesture(gesture);
    state.set_pressing(pressing);
    state.set_pressure(pressure);
    const auto tips = fingertips(centre);
    for (const Eigen::Vector3d& tip : tips) {
      state.add_fingertip_states(v1::TRACKING_TRACKED);
      for (const double coordinate : tip) state.add_fingertip_positions(coordinate);
    }
    return frame;
  }
  v1::TrackingFrame laying(const Eigen::Vector3d& centre, double pressure = 0.5) {
    return hand(centre, v1::GESTURE_OPEN, true, pressure);
  }
  v1::TrackingFrame resting(const Eigen::Vector3d& centre = {0.0, 0.0, 0.1}) {
    return hand(centre, v1::GESTURE_OPEN);
  }
  v1::TrackingFrame closed(const Eigen::Vector3d& centre, double pressure = 0.5, double potentiometer = 0.5) {
    return with_potentiometer(hand(centre, v1::GESTURE_CLOSED, pressure > 0, pressure), potentiometer);
  }
  /// With the tip of the index finger at `tip`.
  v1::TrackingFrame pointing(const Eigen::Vector3d& tip, bool pressing = true) {
    const Eigen::Vector3d offset = fingertips(Eigen::Vector3d::Zero())[1];
    return hand(tip - offset, v1::GESTURE_POINTING, pressing, pressing ? 0.5 : 0.0);
  }
  v1::TrackingFrame touching(double x, double y) { return hand({x, y, 0.0}, v1::GESTURE_ON_TABLE); }
  static v1::TrackingFrame with_potentiometer(v1::TrackingFrame frame, double potentiometer) {
    frame.mutable_hands(0)->set_potentiometer(potentiometer);
    return frame;
  }
  /// Nothing seen: a frame without a hand.
  v1::TrackingFrame empty() {
    v1::TrackingFrame frame;
    frame.set_sequence(++sequence_);
    frame.set_capture_time_ns(time_ns_ += frame_ns);
    return frame;
  }

 private:
  std::uint64_t sequence_ = 0;
  std::int64_t time_ns_ = 1'000'000'000;
};

/// `frame` with the hand of `other` as its second one.
inline v1::TrackingFrame with_second_hand(v1::TrackingFrame frame, const v1::TrackingFrame& other) {
  *frame.add_hands() = other.hands(0);
  return frame;
}

/// `frame` with its hand turned about its centre.
inline v1::TrackingFrame turned(v1::TrackingFrame frame, const Eigen::Matrix3d& rotation) {
  v1::HandState& hand = *frame.mutable_hands(0);
  const int count = hand.fingertip_positions_size() / 3;
  Eigen::Map<Eigen::Matrix3Xd> tips(hand.mutable_fingertip_positions()->mutable_data(), 3, count);
  const Eigen::Vector3d centre = tips.rowwise().mean();
  tips = ((rotation * (tips.colwise() - centre)).colwise() + centre).eval();
  return frame;
}

/// `frame` with its hand's fingertips so many times as far from the middle finger's: a fist that opens. Their
/// mean goes along, since the middle finger is at the hand's edge.
inline v1::TrackingFrame opened(v1::TrackingFrame frame, double times) {
  v1::HandState& hand = *frame.mutable_hands(0);
  const int count = hand.fingertip_positions_size() / 3;
  Eigen::Map<Eigen::Matrix3Xd> tips(hand.mutable_fingertip_positions()->mutable_data(), 3, count);
  constexpr int middle = 2;
  const Eigen::Vector3d fixed = tips.col(middle);
  tips = ((times * (tips.colwise() - fixed)).colwise() + fixed).eval();
  return frame;
}

/// `frame` of which the daemon tells that its gesture began so many frames before it.
inline v1::TrackingFrame since(v1::TrackingFrame frame, double frames) {
  const auto ns = static_cast<std::int64_t>(frames * static_cast<double>(HandScript::frame_ns));
  frame.mutable_hands(0)->set_gesture_since_ns(frame.capture_time_ns() - ns);
  return frame;
}

/// Takes a fingertip out of sight.
inline v1::TrackingFrame without_finger(v1::TrackingFrame frame, int finger) {
  frame.mutable_hands(0)->set_fingertip_states(finger, v1::TRACKING_LOST);
  frame.mutable_hands(0)->set_fingertip_positions(3 * finger, 9.0);  // whatever stands there must not be used
  return frame;
}

}  // namespace handloft::test
