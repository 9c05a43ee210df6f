#include "server-model/exchange/stroke_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace handloft::exchange {
namespace {

using geometry::Vec3;

Vec3 position_of(const codec::TiltControlPoint& point) {
  return {static_cast<double>(point.position[0]), static_cast<double>(point.position[1]),
          static_cast<double>(point.position[2])};
}

}  // namespace

geometry::Mat3 StrokePlacement::y_up_to_z_up() {
  geometry::Mat3 swap;
  swap << 1, 0, 0,  //
      0, 0, 1,      //
      0, 1, 0;
  return swap;
}

Result<ImportedStrokes> import_strokes(const codec::TiltFile& file, const StrokePlacement& placement) {
  if (!std::isfinite(placement.scale_m_per_unit) || placement.scale_m_per_unit <= 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected metres per unit above 0", placement.scale_m_per_unit),
                      "scale");
  }
  if (!placement.rotation.allFinite() || !placement.translation.allFinite()) {
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "placement");
  }
  std::uint32_t first_ms = std::numeric_limits<std::uint32_t>::max();
  for (const codec::TiltStroke& stroke : file.strokes) {
    for (const codec::TiltControlPoint& point : stroke.points) first_ms = std::min(first_ms, point.time_ms);
  }

  ImportedStrokes result;
  result.strokes.reserve(file.strokes.size());
  for (std::size_t s = 0; s < file.strokes.size(); ++s) {
    ImportedStroke stroke;
    stroke.points.reserve(file.strokes[s].points.size());
    for (std::size_t i = 0; i < file.strokes[s].points.size(); ++i) {
      const codec::TiltControlPoint& source = file.strokes[s].points[i];
      StrokePoint point;
      point.position =
          placement.translation + placement.rotation * (placement.scale_m_per_unit * position_of(source));
      point.pressure = std::clamp(static_cast<double>(source.pressure), 0.0, 1.0);
      point.time_s = static_cast<double>(source.time_ms - first_ms) * 1e-3;
      if (!point.position.allFinite() || !std::isfinite(point.pressure)) {
        return make_error(ErrorCode::data_corrupt, "found a number that is not finite",
                          fmt::format("strokes[{}].points[{}]", s, i));
      }
      result.lower = result.point_count == 0 ? point.position : Vec3(result.lower.cwiseMin(point.position));
      result.upper = result.point_count == 0 ? point.position : Vec3(result.upper.cwiseMax(point.position));
      ++result.point_count;
      stroke.points.push_back(point);
    }
    result.strokes.push_back(std::move(stroke));
  }
  return result;
}

Result<StrokePlacement> placement_into(const codec::TiltFile& file, const Vec3& lower, const Vec3& upper) {
  if (!lower.allFinite() || !upper.allFinite() || (upper - lower).minCoeff() <= 0) {
    return make_error(ErrorCode::invalid_argument, "found a box without a finite volume", "box");
  }
  StrokePlacement placement;
  placement.scale_m_per_unit = 1.0;
  const Result<ImportedStrokes> unscaled = import_strokes(file, placement);
  if (!unscaled.ok()) return unscaled.error();
  if (unscaled->point_count == 0) {
    return make_error(ErrorCode::failed_precondition, "the file has no points to place", "strokes");
  }
  const Vec3 size = unscaled->upper - unscaled->lower;
  double scale = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    if (size[k] > 0) scale = std::min(scale, (upper[k] - lower[k]) / size[k]);
  }
  // One single point has no size: keep it at the usual scale.
  placement.scale_m_per_unit = std::isfinite(scale) ? scale : StrokePlacement{}.scale_m_per_unit;
  const Vec3 middle = 0.5 * (unscaled->lower + unscaled->upper) * placement.scale_m_per_unit;
  placement.translation = 0.5 * (lower + upper) - middle;
  placement.translation.z() = lower.z() - unscaled->lower.z() * placement.scale_m_per_unit;
  return placement;
}

}  // namespace handloft::exchange
