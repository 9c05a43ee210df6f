#pragma once
// What one camera saw in one frame, in that camera's own pixels (distorted, as measured): the only thing that
// goes from the cameras' threads to the fusion.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/base/clock.h"
#include "daemon-tracking/source/rig.h"

namespace handloft::tracking {

/// A tag36h11 seen in a frame. Corners run counter-clockwise as the tag is read, beginning bottom left: in
/// the tag's frame (-e, -e), (e, -e), (e, e), (-e, e) with e half the edge.
struct TagDetection {
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners_px;
  double decision_margin = 0.0;  ///< The detector's contrast of the bits, 0..255
  int hamming = 0;               ///< Corrected bits
  double shortest_edge_px = 0.0;
};

/// A patch of fingertip colour.
struct FingertipBlob {
  Eigen::Vector2d centre_px;      ///< Likelihood-weighted centroid
  Eigen::Matrix2d covariance;     ///< px^2; grows for small patches and at the border of the image
  double area_px = 0.0;           ///< Full-size pixels
  Finger finger = Finger::thumb;  ///< The class that its pixels were found as
  /// Mean log likelihood of its chroma under each finger's colour model, relative to the background's.
  std::array<double, finger_count> log_likelihood{};
  bool at_border = false;
};

/// Seconds spent per stage; zeros when no clock was given (replay needs none).
struct VisionTimings {
  double decode_s = 0.0;
  double tags_s = 0.0;
  double fingertips_s = 0.0;
};

struct CameraObservation {
  std::uint32_t camera = 0;
  std::uint64_t sequence = 0;
  TimePoint capture_time;  ///< Middle of the exposure (T4); the source has added the camera's offset
  TimePoint arrival_time;
  std::vector<TagDetection> tags;
  std::vector<FingertipBlob> blobs;
  bool searched_whole_frame = false;  ///< Tags were looked for everywhere, not only where they were expected
  VisionTimings timings;
};

}  // namespace handloft::tracking
