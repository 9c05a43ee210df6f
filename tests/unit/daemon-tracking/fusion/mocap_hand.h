#pragma once
// Real fingertip motion (60 s of optical motion capture at 100 Hz) seen by simulated free-running 30 fps
// cameras: what T7 and T8 are measured on. The cameras stand on a 70 degree arc, 0.85 m from the middle of
// the motion, f = 600 px.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/vision/observation.h"

namespace handloft::tracking::test {

class MocapHand {
 public:
  /// Throws std::runtime_error when the file lacks the five tips.
  explicit MocapHand(const std::filesystem::path& recording);

  double duration_s() const { return static_cast<double>(frames_.size() - 1) / rate_hz; }
  /// Metres about the middle of the motion; nullopt while the marker was hidden.
  std::optional<Eigen::Vector3d> tip(Finger finger, double time_s) const;

  static constexpr double rate_hz = 100.0;

 private:
  std::vector<std::array<std::optional<Eigen::Vector3d>, finger_count>> frames_;
};

/// A rig of `cameras` table cameras on the arc.
Rig arc_rig(int cameras);

/// What the cameras would report, in order of capture: each with its own beat and phase, Gaussian pixel
/// noise, colour likelihoods that now and then (3 %) leave two neighbouring fingers equally likely.
std::vector<CameraObservation> watch(const MocapHand& hand, const Rig& rig, double noise_px,
                                     std::uint32_t seed);

/// watch() starts its clock here, so that no time is zero.
inline constexpr TimePoint mocap_start = from_ns(5'000'000'000);

}  // namespace handloft::tracking::test
