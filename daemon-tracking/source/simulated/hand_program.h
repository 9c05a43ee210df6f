#pragma once
// What the simulated hand does: a timeline of strokes, touches of the palette and moves between them, made of
// minimum-jerk motions (Flash and Hogan 1985: natural reaching). Any instant can be asked for; the same seed
// gives the same hand. During a stroke the CENTROID of the five fingertips is exactly on the stroke's path.

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/table_palette.h"
#include "daemon-tracking/source/rig.h"

namespace handloft::tracking {

enum class HandPose : std::uint8_t { open, closed, pointing, on_table };

/// The hand at an instant. World frame, metres.
struct HandState {
  bool present = true;
  HandPose pose = HandPose::open;  ///< What the contacts say; the fingers may be on their way.
  Eigen::Isometry3d world_from_palm =
      Eigen::Isometry3d::Identity();                         ///< x right, y towards the fingertips, z up.
  std::array<Eigen::Vector3d, finger_count> fingertips_m{};  ///< Centres of the coloured caps.
  std::array<Eigen::Vector3d, finger_count> middle_joints_m{};
  std::array<Eigen::Vector3d, finger_count> knuckles_m{};
  std::uint16_t contacts = 0;  ///< Bits of `Contact`, ideal: no bounce.
  double pressure = 0.0;       ///< 0..1
  double potentiometer = 0.5;  ///< 0..1

  Eigen::Vector3d centroid_m() const;  ///< Of the fingertips.
};

/// What happens when, for tests and for the demo's log.
struct HandEvent {
  enum class Kind { stroke, touch, idle, push, draw };
  Kind kind = Kind::idle;
  double begin_s = 0,
         end_s = 0;  ///< A stroke: from its first to its last point. A touch: while on the table. A push or a
                     ///< drawing: while the hand has its pose and follows its path.
  std::string label;  ///< "top 3", "Fit"
};

struct HandOptions {
  std::uint64_t seed = 1;
  /// RMS of the physiological tremor of each fingertip; relative to the others, so that the centroid stays on
  /// its path.
  double tremor_m = 0.0003;
  double transition_speed_m_s = 0.24;  ///< Mean; a minimum-jerk move peaks at 1.875 times its mean.
  double shortest_transition_s = 0.45;
  double tap_s = 0.12;   ///< How long the thumb lies on its pad when it taps.
  double touch_s = 0.4;  ///< How long the hand lies on a palette cell.
  double fingertip_rest_m =
      0.008;  ///< Height of the cap's centre when the hand lies on the table: its radius.
};

class HandProgram {
 public:
  explicit HandProgram(HandOptions options = {});

  /// The state at `time_s` since the start of the program; clamped to its ends.
  HandState at(double time_s) const;
  double duration_s() const { return duration_s_; }
  const std::vector<HandEvent>& events() const { return events_; }

  // Building, in order of time. Moves from where the hand is are inserted by themselves.

  /// Stays where it is, swaying a little.
  void idle(double duration_s);
  /// Follows `path` (centroid, metres, parameter 0..1 over the stroke) with minimum-jerk timing in
  /// `duration_s`, open hand, with pressure `pressure(u)` in 0..1. `tilt`: orientation of the palm.
  void stroke(std::string label, std::function<Eigen::Vector3d(double)> path, double duration_s,
              std::function<double(double)> pressure,
              const Eigen::Quaterniond& tilt = Eigen::Quaterniond::Identity());
  /// The same with the path's and pressure's parameter running uniformly in time (recorded strokes have their
  /// own timing).
  void timed_stroke(std::string label, std::function<Eigen::Vector3d(double)> path, double duration_s,
                    std::function<double(double)> pressure,
                    const Eigen::Quaterniond& tilt = Eigen::Quaterniond::Identity());
  /// Moves all five fingertips as `fingertips` says (world, metres, parameter 0..1 uniform in time): a
  /// recorded hand. Open all the while. The rest of the hand follows by the rigid motion that suits the
  /// fingertips best.
  void follow_fingertips(std::string label,
                         std::function<std::array<Eigen::Vector3d, finger_count>(double)> fingertips,
                         double duration_s, std::function<double(double)> pressure);
  /// Closes in the air beside `path(0)`, follows `path` (centroid) closed, with minimum-jerk timing, while
  /// the thumb turns the potentiometer to `potentiometer`, and opens again where it ends (A13, A16). The palm
  /// stays still while the fingers fold and unfold, and nothing is pressed then.
  void push(std::string label, std::function<Eigen::Vector3d(double)> path, double duration_s,
            std::function<double(double)> pressure, double potentiometer,
            const Eigen::Quaterniond& tilt = Eigen::Quaterniond::Identity());
  /// The same without pressing, while the fist turns by `turn`, evenly with the path's minimum-jerk timing,
  /// about its fingertips' centroid: a hand that has taken hold of something.
  void drag(std::string label, std::function<Eigen::Vector3d(double)> path, double duration_s,
            const Eigen::Quaterniond& turn = Eigen::Quaterniond::Identity());
  /// Like `push` with a pointing hand: the INDEX fingertip follows `path` (A18, A24), but for its tremor.
  /// From each of `thumb_taps`, fractions of the path, the thumb's pad is closed for `HandOptions::tap_s`.
  void draw(std::string label, std::function<Eigen::Vector3d(double)> path, double duration_s,
            std::function<double(double)> pressure,
            const Eigen::Quaterniond& tilt = Eigen::Quaterniond::Identity(),
            const std::vector<double>& thumb_taps = {});
  /// Lies down on a palette cell and rises again; turns to the cell's page first, as `touch` of "More".
  void touch(PaletteCommand command);
  /// Goes to a place with a pose and stays there for `hold_s`.
  void gesture(HandPose pose, const Eigen::Vector3d& centroid_m, double hold_s);

 private:
  struct Posture {
    Eigen::Vector3d centroid_m{-0.02, -0.06, 0.13};
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
    Eigen::Quaterniond tilt = Eigen::Quaterniond::Identity();
    HandPose pose = HandPose::open;
    double potentiometer = 0.5;  ///< At rest.
  };
  struct Segment {
    double begin_s = 0, duration_s = 0;
    std::function<Eigen::Vector3d(double)> centroid_m;  ///< Of the time's fraction, 0..1.
    std::function<double(double)> pressure;             ///< Likewise; empty: none.
    /// Likewise; when there, it says where the fingertips are, and `centroid_m` is their mean.
    std::function<std::array<Eigen::Vector3d, finger_count>(double)> fingertips_m;
    Posture from, to;                          ///< Pose and tilt go smoothly from one to the other.
    std::vector<double> taps_s;                ///< When the thumb is laid down, since `begin_s`.
    HandPose contact_pose = HandPose::open;    ///< What the contacts say,
    HandPose contact_before = HandPose::open;  ///< and until this fraction of the time:
    double contact_from = 0.0;
  };
  void move_to(const Posture& target);
  void act(HandEvent::Kind kind, std::string label, std::function<Eigen::Vector3d(double)> path,
           double duration_s, std::function<double(double)> pressure, const Posture& with,
           const Eigen::Quaterniond& last_tilt, const std::vector<double>& thumb_taps = {});
  void lie_down(const PaletteCell& cell);
  void append(Segment segment);
  void follow(std::string label, std::function<Eigen::Vector3d(double)> path, double duration_s,
              std::function<double(double)> pressure, const Posture& begin, const Posture& end);
  std::array<Eigen::Vector3d, finger_count> tremor_at(double time_s) const;

  HandOptions options_;
  std::vector<std::shared_ptr<const Segment>>
      segments_;  ///< Shared: a program is copied into several devices.
  std::vector<HandEvent> events_;
  Posture now_;
  double duration_s_ = 0;
  int palette_page_ = first_palette_page;  ///< That the table will show then.
};

}  // namespace handloft::tracking
