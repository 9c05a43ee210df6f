#pragma once
// Lets the simulated hand move as a recorded one did: five fingertips by optical motion capture, hidden
// markers bridged in a straight line. Nobody recorded a pressure, so it is made of the hand's height: the
// lower, the harder; above its usual height the hand hovers.

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/simulated/hand_program.h"

namespace handloft::tracking {

/// Fingertips as recorded: metres, axes as the recording has them, z up.
struct HandMotion {
  double rate_hz = 100.0;
  std::vector<std::array<std::optional<Eigen::Vector3d>, finger_count>> frames;  ///< Absent: hidden.
};

/// Reads a tab-separated export of motion capture: a header with FREQUENCY, a line of column names that
/// begins with "Frame" and has "thumb_tip X", "index_tip X", ... (Y and Z beside them), then a line a frame,
/// millimetres; empty, NaN or all zero: hidden. Errors: io, data_corrupt (no such columns, a bad frequency,
/// no frames), resource_exhausted.
Result<HandMotion> read_hand_motion(const std::filesystem::path& path);

struct MotionProgramOptions {
  HandOptions hand;
  double begin_s = 0.0;
  double longest_s = 3600.0;           ///< No more of the motion than this.
  Eigen::Vector2d centre_m{0.0, 0.0};  ///< Over which the middle of the motion is put.
  double lowest_m = 0.03;              ///< No fingertip comes nearer to the table.
  double hover_share =
      0.75;  ///< The share of the time that the hand is lower than where its pressure begins.
  std::size_t max_frames = 1'000'000;
};

/// Idle, the motion, idle. The recording's x (its fingers' direction) becomes our y. Errors: invalid_argument
/// (fewer than two frames with all fingers known to both sides, nothing left after begin_s).
Result<HandProgram> motion_program(const HandMotion& motion, const MotionProgramOptions& options = {});

}  // namespace handloft::tracking
