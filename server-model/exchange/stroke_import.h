#pragma once
// Strokes drawn in the air with another program (.tilt, read by common/codec/tilt_file.h) as points of ours:
// metres on the table, pressure 0..1 as weight, time in seconds since the first point.

#include <cstddef>
#include <vector>

#include "common/base/result.h"
#include "common/codec/tilt_file.h"
#include "server-model/geometry/types.h"

namespace handloft::exchange {

/// world = translation + rotation * (scale * p). Tilt's y is up and its system left-handed; y_up_to_z_up
/// turns (x, y, z) into our (x, z, y).
struct StrokePlacement {
  double scale_m_per_unit = 0.1;  ///< Tilt units are about decimetres.
  geometry::Mat3 rotation = y_up_to_z_up();
  geometry::Vec3 translation = geometry::Vec3::Zero();

  static geometry::Mat3 y_up_to_z_up();
};

struct StrokePoint {
  geometry::Vec3 position;  ///< World, metres.
  double pressure = 0;      ///< 0..1.
  double time_s = 0;        ///< Since the earliest point of the file.
};

struct ImportedStroke {
  std::vector<StrokePoint> points;
};

struct ImportedStrokes {
  std::vector<ImportedStroke> strokes;
  std::size_t point_count = 0;
  geometry::Vec3 lower = geometry::Vec3::Zero();  ///< Bounds of all points, metres.
  geometry::Vec3 upper = geometry::Vec3::Zero();
};

/// Errors: invalid_argument for a placement that is not finite or a scale <= 0; data_corrupt for a position
/// that leaves the range of numbers.
Result<ImportedStrokes> import_strokes(const codec::TiltFile& file, const StrokePlacement& placement = {});

/// The placement that fits the strokes into a box: scaled evenly so that the largest side fits, centred in x
/// and y, standing on the box's floor. Errors: invalid_argument for a box without size; failed_precondition
/// for a file without points.
Result<StrokePlacement> placement_into(const codec::TiltFile& file, const geometry::Vec3& lower,
                                       const geometry::Vec3& upper);

}  // namespace handloft::exchange
