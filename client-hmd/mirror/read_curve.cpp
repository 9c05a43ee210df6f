#include "client-hmd/mirror/read_curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

namespace handloft::client {
namespace {

constexpr std::size_t bytes_per_point = 3 * sizeof(float);

std::optional<CurveKind> read_kind(v1::Polyline::Kind kind) {
  switch (kind) {
    case v1::Polyline::CURVE:
      return CurveKind::curve;
    case v1::Polyline::PROFILE:
      return CurveKind::profile;
    case v1::Polyline::BOUNDARY:
      return CurveKind::boundary;
    default:
      return std::nullopt;
  }
}

}  // namespace

Result<SceneCurve> read_curve(const v1::Polyline& line, const CurveLimits& limits) {
  const std::string& bytes = line.points();
  if (bytes.size() % bytes_per_point != 0) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {} bytes, expected a multiple of {}", bytes.size(), bytes_per_point),
                      "points");
  }
  const std::size_t count = bytes.size() / bytes_per_point;
  if (count > limits.max_points) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {}, expected at most {}", count, limits.max_points), "points");
  }
  const std::optional<CurveKind> kind = read_kind(line.kind());
  if (!kind) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {}, expected 0..2", static_cast<int>(line.kind())), "kind");
  }
  SceneCurve curve{std::vector<Vec3f>(count), line.closed(), line.colour_rgba(), *kind};
  if (count > 0) std::memcpy(curve.points.data(), bytes.data(), bytes.size());
  const auto bad = [&limits](float v) { return !std::isfinite(v) || std::abs(v) > limits.max_coordinate_m; };
  if (std::any_of(curve.points.begin(), curve.points.end(),
                  [&bad](const Vec3f& p) { return bad(p.x) || bad(p.y) || bad(p.z); })) {
    return make_error(ErrorCode::data_corrupt, "expected finite positions in the room", "points");
  }
  return curve;
}

}  // namespace handloft::client
