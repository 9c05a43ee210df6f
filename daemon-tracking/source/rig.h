#pragma once
// The rig: which cameras, tags and colours there are. Written by calibration, read by every stage (and, for
// the simulated rig, what is drawn).

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon-tracking/source/camera_calibration.h"

namespace handloft::tracking {

enum class Finger : std::uint8_t { thumb = 0, index, middle, ring, little };
inline constexpr int finger_count = 5;

/// An AprilTag of family 36h11 on a body. Tag frame: centre of the tag, x right and y up as the tag is read,
/// z out of the printed face. `edge_m` is the edge of the black border square.
struct TagPlacement {
  int id = 0;
  double edge_m = 0.04;
  Eigen::Isometry3d body_from_tag = Eigen::Isometry3d::Identity();
};

/// The colour of a fingertip's cap, as BT.601 full-range YCbCr (the JPEG's own), 0..255.
struct FingertipColour {
  Finger finger = Finger::thumb;
  double y = 128, cb = 128, cr = 128;
  /// Standard deviations of the learned colour model in (Cb, Cr).
  double sigma_cb = 8, sigma_cr = 8;
};

struct Rig {
  std::vector<CameraCalibration> cameras;
  std::vector<TagPlacement> table_tags;  ///< Body frame = world.
  std::vector<TagPlacement> head_tags;   ///< Body frame = head: x right, y up, z backwards (OpenGL eye axes).
  std::array<FingertipColour, finger_count> colours;
  double fingertip_radius_m =
      0.008;  ///< A cap is seen as a sphere of this radius; its centre is the fingertip.
};

/// The rig used when nothing else is configured: two table cameras, one head camera, four table tags, a head
/// rig of non-coplanar tags, five well separated hues.
Rig default_rig();

}  // namespace handloft::tracking
