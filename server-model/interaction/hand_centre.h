#pragma once
// The mean of all five fingertips (A1), also while some of them are hidden: a plain mean over those that are
// seen would jump by a finger's breadth whenever one goes behind another. So each fingertip's offset from the
// mean is remembered from the last complete frame, and the hidden ones are taken to have moved along with the
// rest.

#include <Eigen/Core>
#include <array>
#include <optional>

#include "server-model/interaction/hand_sample.h"

namespace handloft::interaction {

struct HandCentreOptions {
  /// Offsets turn with the hand, which does so at up to about 1 rad/s while it draws: after this long they
  /// are a centimetre off.
  Duration offsets_valid_for = std::chrono::milliseconds(250);
  int min_fingertips = 3;  ///< Fewer tell nothing of the hand's rotation, and one bad blob would decide.
  int min_seen = 2;        ///< Of those used, not merely predicted: a hand seen by nobody lays no points.
};

class HandCentre {
 public:
  explicit HandCentre(HandCentreOptions options = {}) : options_(options) {}

  /// The exact mean when all five fingertips are there; the corrected one when at least min_fingertips are
  /// and a complete frame is no older than offsets_valid_for; nullopt otherwise. Frames must come in order of
  /// time.
  std::optional<Eigen::Vector3d> update(const HandSample& sample);

  /// The plain mean of the usable fingertips, for what needs no millimetres (which cell of the palette);
  /// nullopt below min_fingertips.
  std::optional<Eigen::Vector3d> rough(const HandSample& sample) const;

 private:
  HandCentreOptions options_;
  std::array<Eigen::Vector3d, finger_count> offsets_{};
  std::optional<TimePoint> complete_at_;
};

}  // namespace handloft::interaction
