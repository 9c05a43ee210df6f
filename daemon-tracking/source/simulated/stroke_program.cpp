#include "daemon-tracking/source/simulated/stroke_program.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <memory>

namespace handloft::tracking {
namespace {

using Eigen::Vector3d;

constexpr double idle_s = 1.0;
/// What counts as the strokes' usual top speed: single jumps of a recording must not slow all of it down.
constexpr double speed_quantile = 0.99;

struct Bounds {
  Vector3d low = Vector3d::Constant(INFINITY), high = Vector3d::Constant(-INFINITY);
};

Result<Bounds> check(const std::vector<Stroke>& strokes, const StrokeProgramOptions& options) {
  Bounds bounds;
  std::size_t count = 0;
  for (std::size_t s = 0; s < strokes.size(); ++s) {
    for (std::size_t p = 0; p < strokes[s].size(); ++p) {
      const StrokePoint& point = strokes[s][p];
      const auto field = [&](const char* name) { return fmt::format("strokes[{}][{}].{}", s, p, name); };
      if (++count > options.max_points) {
        return make_error(ErrorCode::resource_exhausted,
                          fmt::format("found more than {} points", options.max_points), "strokes");
      }
      if (!point.position_m.allFinite()) {
        return make_error(ErrorCode::invalid_argument, "found a value that is not finite",
                          field("position_m"));
      }
      if (!(point.pressure >= 0.0 && point.pressure <= 1.0)) {
        return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected 0..1", point.pressure),
                          field("pressure"));
      }
      if (!std::isfinite(point.time_s) || (p > 0 && point.time_s < strokes[s][p - 1].time_s)) {
        return make_error(ErrorCode::invalid_argument,
                          fmt::format("found {}, expected finite and not before the last", point.time_s),
                          field("time_s"));
      }
      bounds.low = bounds.low.cwiseMin(point.position_m);
      bounds.high = bounds.high.cwiseMax(point.position_m);
    }
  }
  if (count == 0)
    return make_error(ErrorCode::invalid_argument, "found no points, expected at least one", "strokes");
  if (!(bounds.high - bounds.low).allFinite()) {
    return make_error(ErrorCode::invalid_argument, "the strokes' box is not finite", "strokes");
  }
  return bounds;
}

double top_speed(const std::vector<Stroke>& strokes, double scale) {
  std::vector<double> speeds;
  for (const Stroke& stroke : strokes) {
    for (std::size_t p = 1; p < stroke.size(); ++p) {
      const double dt = stroke[p].time_s - stroke[p - 1].time_s;
      const double way = scale * (stroke[p].position_m - stroke[p - 1].position_m).norm();
      if (dt > 0) speeds.push_back(way / dt);
    }
  }
  if (speeds.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(speed_quantile * static_cast<double>(speeds.size() - 1));
  std::nth_element(speeds.begin(), speeds.begin() + at, speeds.end());
  return speeds[static_cast<std::size_t>(at)];
}

/// A placed stroke with times from 0, linear between its points.
struct Placed {
  std::vector<double> time_s;
  std::vector<Vector3d> position_m;
  std::vector<double> pressure;

  std::size_t interval(double t) const {
    const auto after = std::upper_bound(time_s.begin(), time_s.end(), t);
    const auto index = after == time_s.begin() ? 0 : static_cast<std::size_t>(after - time_s.begin()) - 1;
    return std::min(index, time_s.size() - 2);
  }
  double weight(std::size_t i, double t) const {
    const double span = time_s[i + 1] - time_s[i];
    return span > 0 ? std::clamp((t - time_s[i]) / span, 0.0, 1.0) : 1.0;
  }
};

std::shared_ptr<const Placed> place_stroke(const Stroke& stroke, const StrokePlacement& placement,
                                           const StrokeProgramOptions& options) {
  auto placed = std::make_shared<Placed>();
  double clock = 0.0;
  for (std::size_t p = 0; p < stroke.size(); ++p) {
    const Vector3d position = placement.place(stroke[p].position_m);
    if (p > 0) {
      // The rare jump above the limit is slowed down by itself.
      const double way = (position - placed->position_m.back()).norm();
      clock += std::max((stroke[p].time_s - stroke[p - 1].time_s) * placement.time_stretch,
                        way / options.fastest_m_s);
    }
    placed->time_s.push_back(clock);
    placed->position_m.push_back(position);
    placed->pressure.push_back(stroke[p].pressure);
  }
  if (clock < options.shortest_stroke_s) {
    placed->time_s.push_back(options.shortest_stroke_s);
    placed->position_m.push_back(placed->position_m.back());
    placed->pressure.push_back(placed->pressure.back());
  }
  return placed;
}

}  // namespace

Result<StrokeProgram> stroke_program(const std::vector<Stroke>& strokes,
                                     const StrokeProgramOptions& options) {
  const Result<Bounds> bounds = check(strokes, options);
  if (!bounds) return bounds.error();
  StrokePlacement placement;
  const double edge = (bounds->high - bounds->low).maxCoeff();
  placement.scale = edge > 0 ? options.box_m / edge : 1.0;
  if (!std::isfinite(placement.scale)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("the strokes' box of {} m is too small to scale", edge), "strokes");
  }
  placement.from_centre_m = (bounds->low + bounds->high) / 2;
  placement.centre_m = options.centre_m;
  placement.speed_p99_m_s = top_speed(strokes, placement.scale);
  placement.time_stretch = std::max(1.0, placement.speed_p99_m_s / options.fastest_m_s);

  StrokeProgram result{HandProgram(options.hand), placement};
  result.program.idle(idle_s);
  for (std::size_t s = 0; s < strokes.size(); ++s) {
    if (strokes[s].empty()) continue;
    const auto placed = place_stroke(strokes[s], placement, options);
    const double duration = placed->time_s.back();
    result.program.timed_stroke(
        fmt::format("stroke {}", s + 1),
        [placed, duration](double u) -> Vector3d {
          const std::size_t i = placed->interval(u * duration);
          const double w = placed->weight(i, u * duration);
          return (1 - w) * placed->position_m[i] + w * placed->position_m[i + 1];
        },
        duration,
        [placed, duration](double u) {
          const std::size_t i = placed->interval(u * duration);
          const double w = placed->weight(i, u * duration);
          return (1 - w) * placed->pressure[i] + w * placed->pressure[i + 1];
        });
  }
  result.program.touch(PaletteCommand::fit);
  result.program.idle(idle_s);
  return result;
}

}  // namespace handloft::tracking
