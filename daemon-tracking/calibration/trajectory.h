#pragma once
// What moves calibrates what stands still (T4, T11): a body with tags, the head rig, carried about before
// free-running cameras. Its way is a cubic B-spline over time (Furgale, Rehder, Siegwart, IROS 2013), every
// frame is compared with it at that frame's own time, so that no two frames need to be simultaneous. Out come
// the tags' places on the body, where the head's own camera sits on it, by how much each camera's clock
// differs, and how long a picture's rows take. Pure; deterministic.

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/calibration/extrinsics.h"
#include "daemon-tracking/source/calibration_file.h"
#include "daemon-tracking/vision/observation.h"

namespace handloft::tracking {

/// The tags of one frame: the body's before a table camera, the table's before the head's own.
struct TagSight {
  std::uint32_t camera = 0;
  TimePoint time;  ///< As the camera's frames are stamped now, its present time offset included.
  std::vector<TagDetection> tags;
};

struct TrajectoryInput {
  std::vector<CameraCalibration> cameras;  ///< Lenses and the table cameras' poses are taken as known.
  std::vector<TagPlacement> body_tags;     ///< Where they should be; where the search begins.
  std::vector<TagPlacement> table_tags;
  std::vector<TagSight> sights;
};

enum class Estimate : std::uint8_t { keep, find };

struct TrajectoryOptions {
  Estimate body_tags = Estimate::find;
  Estimate head_camera = Estimate::find;
  Estimate time_offsets = Estimate::find;
  Estimate row_times = Estimate::keep;
  double knot_s = 0.1;      ///< A head nods at less than 2 Hz; a wave of 4 Hz still fits.
  double longest_s = 20.0;  ///< Of the sights: the liveliest stretch of this length is used.
  double corner_sigma_px = 0.3;
  double huber_sigmas = 3.0;
  double body_sigma_m = 0.03, body_sigma_rad = 0.3;  ///< Of a paper rig, glued by hand, about its drawing.
  double largest_offset_s = 0.2;
  std::size_t min_sights = 30;
  double good_rms_px = 0.6, usable_rms_px = 1.5;
  double good_offset_sigma_s = 0.0005, usable_offset_sigma_s = 0.002;
  double good_tag_sigma_m = 0.0005, usable_tag_sigma_m = 0.002;
};

struct CameraTiming {
  double offset_s = 0.0, offset_sigma_s = 0.0;  ///< To be added to the camera's stamps; the first is 0.
  double row_s = 0.0, row_sigma_s = 0.0;
  double rms_px = 0.0;
  std::size_t corners = 0;
  StepResult result;  ///< Of the offset.
};

/// Whether the offset is told well enough to be used: by a good step, or as far from 0 as two of its sigmas.
/// Else the one in use stays: a guess would only add its error.
bool worth_using(const CameraTiming& timing);

struct TrajectoryCalibration {
  std::vector<CameraTiming> cameras;    ///< One per camera.
  std::vector<TagPlacement> body_tags;  ///< In the frame in which the given ones are best met.
  /// Per tag; 0 for the one that carries the frame (and where tags are kept), nullopt where none of the
  /// frames that were used shows it: it is left where it was said to be.
  std::vector<std::optional<double>> tag_sigma_m;
  std::vector<Eigen::Isometry3d> head_from_camera;  ///< Per camera; as given for table cameras.
  double rms_px = 0.0;
  double speed_px_s = 0.0;  ///< Mean speed of corners over all frames: what the offsets live of.
  StepResult result;        ///< Of the tags' places.
};

/// Errors: invalid_argument for what doesn't fit together; failed_precondition with the reason and what to do
/// when the body was seen too little or too seldom by more than one tag.
Result<TrajectoryCalibration> calibrate_on_the_move(const TrajectoryInput& input,
                                                    const TrajectoryOptions& options = {});

}  // namespace handloft::tracking
