#pragma once
// What holds in a fist goes along with it and turns with it (A28; D19, step 4), and nothing else may move it:
// the hand that folds its fingers to take it, and unfolds them to let it go, moves the fingertips' mean by
// 4 to 6 mm though the hand stays where it is. A glove tells of a fist when the fingertips touch the palm,
// with the last of the way still to fold; it tells that the fist opens when they have left the palm, which
// they began before. So the way counts from where the fist has folded, and ends where it began to unfold:
// both at fixed times about the edges that the glove tells of, which the daemon dates back to the first of
// their bounces (T9). Nothing is late by that: a frame between the two moves at once what the hand holds.
//
// The turn has a dead band, without a step at its end: a hand that goes somewhere turns by a few degrees
// that it does not mean, and a surface that is turned by them bends visibly.

#include <Eigen/Geometry>
#include <array>
#include <deque>
#include <optional>

#include "common/base/clock.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/hand_turn.h"

namespace handloft::interaction {

struct FistOptions {
  /// Fingers fold on for so long when they have touched the palm: a fifth of a fist's 0.45 s.
  Duration folds_for = std::chrono::milliseconds(100);
  /// Fingers have unfolded for so long when they leave the palm, and some leave it before others.
  Duration unfolds_for = std::chrono::milliseconds(120);
  /// A hand that is steady trembles by 7 to 11 Hz, and its tracking too: where it takes hold, and where it
  /// lets go, is a mean over so long,
  Duration steady_for = std::chrono::milliseconds(120);
  /// of frames no farther than this from the first, or the last, nor turned by more than is meant: a hand
  /// that moves is where it is.
  double steady_m = 0.001;
  /// Turns below this are not meant; from twice this on they count whole, and linearly between.
  double turn_slack_rad = 0.05;
};

/// Where a fist has come to since it took hold.
struct FistWay {
  TimePoint time;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  ///< The last one that was known.
  double potentiometer = 1.0;
};

class FistHold {
 public:
  explicit FistHold(FistOptions options = {}) : options_(options) {}

  /// One more frame of the closed hand, in order of time; `frame.fist_centre` must be there. The way is zero
  /// while the fist folds. A hand of which it is not known since when it is closed has folded.
  FistWay on_frame(const HandFrame& frame);

  /// Where the fist's centre was as the way began; after the first frame. It settles while a hand is steady.
  const Eigen::Vector3d& grasped_at() const { return grasp_.centre; }

  /// The way at which the fist began to unfold that opened at `opened`; nullopt: it had not folded by then.
  /// Without the time, the last one as it was.
  std::optional<FistWay> at_release(std::optional<TimePoint> opened) const;

 private:
  /// Means over steady frames.
  struct Grasp {
    TimePoint since;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    FingertipPositions first_fingertips;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    FingertipPositions fingertips;
    int frames = 0;
    std::array<int, finger_count> seen{};  ///< Frames with each fingertip.
    bool over = false;                     ///< The hand has moved, or it was steady for long enough.
  };
  void begin(const HandFrame& frame, const FingertipPositions& fingertips);
  void steady_up(const HandFrame& frame, const FingertipPositions& fingertips);

  FistOptions options_;
  bool folded_ = false;
  Grasp grasp_;
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();  ///< With what is not meant.
  std::deque<FistWay> ways_;                                  ///< Of the newest frames, oldest first.
};

/// `turn` less what FistOptions::turn_slack_rad takes off.
Eigen::Quaterniond meant_turn(const Eigen::Quaterniond& turn, double slack_rad);

}  // namespace handloft::interaction
