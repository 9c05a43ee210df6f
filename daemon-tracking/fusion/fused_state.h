#pragma once
// What the daemon knows after one more observation: one atomic snapshot per device tick (T14), in metres,
// seconds, radians, world frame (right-handed, +Z up, origin at the centre of the table board). Plain values,
// freely copied.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "common/base/clock.h"
#include "daemon-tracking/source/rig.h"

namespace handloft::tracking {

/// How well a thing is known now (T6).
enum class TrackingState : std::uint8_t {
  lost = 0,       ///< Nothing is known; values are the last ones
  predicted = 1,  ///< Not seen for a moment, carried by its motion
  single = 2,     ///< Seen by one camera only: depth rests on the past
  tracked = 3,    ///< Seen by two or more cameras within 100 ms (a head: by any view that fixes its pose)
};

/// What a pose asked for at some time rests on (T8).
enum class ResultKind : std::uint8_t { lost = 0, predicted = 1, interpolated = 2, exact = 3 };

/// Hand gestures from the glove's contact pads (T10).
enum class Gesture : std::uint8_t { unknown = 0, open, closed, pointing };

struct FusedTip {
  TrackingState state = TrackingState::lost;
  Eigen::Vector3d position_m{0, 0, 0};
  Eigen::Vector3d velocity_m_s{0, 0, 0};
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();  ///< Of the position
  std::uint32_t camera_mask = 0;  ///< Bit i: camera i contributed within the last 100 ms
};

struct FusedHead {
  TrackingState state = TrackingState::lost;
  bool position_valid = false;  ///< There is a value to draw with
  bool orientation_valid = false;
  bool position_tracked = false;  ///< It is measured now, not carried by prediction
  bool orientation_tracked = false;
  Eigen::Vector3d position_m{0, 0, 0};
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< world_from_head
  Eigen::Vector3d velocity_m_s{0, 0, 0};
  Eigen::Vector3d angular_velocity_rad_s{0, 0, 0};  ///< World frame
  /// (position m, rotation rad about the world's axes)
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Identity();
  double reprojection_rms_px = 0.0;  ///< Of the last accepted view
  std::uint32_t tags = 0;            ///< In the last accepted view
  std::uint32_t camera_mask = 0;     ///< Bit i: camera i contributed within the last 100 ms
};

struct FusedHand {
  std::array<FusedTip, finger_count> tips;  ///< thumb, index, middle, ring, little
  bool glove_present = false;
  Gesture gesture = Gesture::unknown;
  TimePoint gesture_since;      ///< Back-dated to the first edge, before debouncing (T9)
  double pressure = 0.0;        ///< Calibrated, 0..1
  std::uint16_t raw_force = 0;  ///< 0..1023
  bool pressing = false;        ///< Pressure with hysteresis: on above 8 %, off below 5 %
  TimePoint pressing_since;
  double potentiometer = 0.0;           ///< 0..1
  std::uint16_t raw_potentiometer = 0;  ///< 0..1023
  std::uint8_t battery_percent = 0;     ///< Of the last report
  std::uint8_t contacts = 0;            ///< Debounced bits as in the glove's report
  bool table_by_contact = false;        ///< The glove's table pad is closed
  TimePoint table_since;                ///< When that last changed, back-dated like gesture_since
  bool table_by_height = false;         ///< A tracked fingertip is within 5 mm of the table
};

/// A pen on its tablet (in its own plane: origin at the lower left corner of the active area, x right, y away
/// from the designer).
struct FusedPen {
  bool present = false;
  bool in_proximity = false;
  bool eraser = false;
  Eigen::Vector2d position_m{0, 0};  ///< Out of proximity: where it left
  double pressure = 0.0;             ///< 0..1
  Eigen::Vector2d tilt_rad{0, 0};    ///< Leaning to the right, away
  std::uint32_t buttons = 0;         ///< Bit 0: the first side button
  TimePoint time;                    ///< The kernel's, of the last event
};

/// A 3D mouse: -1..1 per axis, world axes as it stands before the designer.
struct FusedSpaceMouse {
  bool present = false;
  Eigen::Vector3d translation{0, 0, 0};
  Eigen::Vector3d rotation{0, 0, 0};  ///< About the axes, right-handed
  std::uint32_t buttons = 0;
  TimePoint time;  ///< Of its last report
};

struct FusedState {
  TimePoint time;              ///< The newest capture time that went in; everything below is valid at it
  std::uint64_t sequence = 0;  ///< Counts the snapshots, from 1
  std::uint32_t camera = 0;    ///< Whose observation made this snapshot
  FusedHead head;
  FusedHand hand;
  FusedPen pen;
  FusedSpaceMouse space_mouse;
};

}  // namespace handloft::tracking
