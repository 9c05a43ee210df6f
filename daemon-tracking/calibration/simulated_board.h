#pragma once
// A chessboard that somebody holds before simulated cameras: frames as bytes, like those of the simulated
// rig, for trying the tools without devices and for tests. Drawn through the simulation's own lens, which
// shares no code with what measures it. Each pose is held for a few frames; between two the board jumps.

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "daemon-tracking/calibration/board.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

struct SimulatedBoardOptions {
  ChessboardShape shape;
  int frames_per_pose = 3;
  double frames_per_s = 30.0;
  double noise_luma = 2.0;
  int rays = 3;         ///< Per pixel and axis.
  double spread = 1.6;  ///< Of a pixel's rays, in pixels: its own area and the lens's blur.
  int jpeg_quality = 90;
};

/// Poses all over the picture of a camera, tilted every way: what a person would do who follows the guide.
std::vector<Eigen::Isometry3d> waved_before(const CameraCalibration& camera, const ChessboardShape& shape,
                                            int poses);

/// Poses over the table that all its cameras see.
std::vector<Eigen::Isometry3d> waved_over_table(const Rig& rig, int poses);

/// world_from_board pose by pose; the frames of `cameras` (indices into the rig), in order of time.
std::unique_ptr<SampleStream> simulated_board_stream(Rig rig, std::vector<std::uint32_t> cameras,
                                                     std::vector<Eigen::Isometry3d> poses,
                                                     const SimulatedBoardOptions& options = {});

}  // namespace handloft::tracking
