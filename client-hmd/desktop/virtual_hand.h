#pragma once
// A hand that mouse, keyboard and pen make (V6): the frame that a tracking daemon would publish of it, so
// that the model server does with it what it does with a glove (A25, "A hand of one's own" in PROTOCOL.md).
//
// Its fingertips are a regular pentagon in the plane across the direction of pushing, thumb to little finger
// round it, so that everything the server reads off a hand is what was meant:
//   their mean is the cursor to rounding (A1: where an open hand lays points; a fist's centre, A13),
//   the disk's normal is the direction of pushing (A13: Newell's area vector of the pentagon),
//   the turn between two frames is the hand's (its second extent is 21 mm, its noise none).
// A pointing hand has its index fingertip at the cursor and the other four round it, so that the mean is
// there, too.

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "common/base/clock.h"
#include "proto/tracking.pb.h"

namespace handloft::client {

/// What a hand is at one moment.
struct HandPose {
  TimePoint time;
  v1::Gesture gesture = v1::GESTURE_OPEN;
  glm::dvec3 cursor{0.0};               ///< World, metres.
  glm::dvec3 direction{0.0, 0.0, 1.0};  ///< Across the pentagon; unit.
  glm::dquat turn{1.0, 0.0, 0.0, 0.0};  ///< About the cursor, since the gesture began.
  bool pressing = false;
  double pressure = 0.5;       ///< 0..1
  double potentiometer = 1.0;  ///< 0..1
  bool thumb_laid = false;
};

/// The frame that tells of it. Numbers outside their ranges are brought into them; a cursor that is no number
/// or farther than 9 m from the table gives a frame without a hand.
v1::TrackingFrame hand_frame(const HandPose& pose, std::uint64_t sequence);

/// A frame in which the hand is lost.
v1::TrackingFrame no_hand_frame(TimePoint time, std::uint64_t sequence);

/// The server takes a little off small turns of a fist, as hands turn a little without meaning it
/// (interaction/fist_hold.h: nothing below 0.05 rad, all from 0.1 rad on). This adds it, so that a turn by
/// keys is what it says. A rotation of any size, as a unit quaternion.
glm::dquat told_turn(const glm::dquat& meant);

}  // namespace handloft::client
