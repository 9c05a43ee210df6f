#include "server-model/geometry/sculpt_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "server-model/geometry/region_border.h"
#include "server-model/geometry/sculpt_places.h"

namespace handloft::geometry {

namespace {

Status check_finite(const Vec3& value, const char* field) {
  if (value.allFinite()) return {};
  return make_error(ErrorCode::invalid_argument, "found a number that is not finite", field);
}

std::pair<int, int> derivative_orders(PointAspect aspect) {
  switch (aspect) {
    case PointAspect::position:
      return {0, 0};
    case PointAspect::tangent_u:
      return {1, 0};
    case PointAspect::tangent_v:
      return {0, 1};
    case PointAspect::second_u:
      return {2, 0};
    case PointAspect::second_v:
      return {0, 2};
    case PointAspect::twist:
      return {1, 1};
  }
  return {-1, -1};  // surface_functional() says what is wrong.
}

// By control value of one direction: does one of its functions reach into [lower, upper], and out of it.
struct Reach {
  std::vector<bool> in, out;
};

// Of an open direction what a function has beyond the ends does not count.
Reach reach_open(const KnotVector& knots, double lower, double upper) {
  const auto n = static_cast<std::size_t>(knots.control_count());
  const double eps = same_parameter * knots.length();
  Reach result{std::vector<bool>(n, false), std::vector<bool>(n, false)};
  for (std::size_t i = 0; i < n; ++i) {
    const double from = std::max(knots.knots()[i], knots.lower());
    const double to =
        std::min(knots.knots()[i + static_cast<std::size_t>(knots.degree()) + 1], knots.upper());
    if (!(from < to)) continue;
    result.in[i] = from < upper - eps && to > lower + eps;
    result.out[i] = from < lower - eps || to > upper + eps;
  }
  return result;
}

// Of a closed direction all images of a function count.
Reach reach_closed(const KnotVector& knots, double lower, double upper) {
  const auto n = static_cast<std::size_t>(knots.control_count());
  const double period = knots.length();
  const double eps = same_parameter * period;
  if (upper - lower >= period - eps) return {std::vector<bool>(n, true), std::vector<bool>(n, false)};
  Reach result{std::vector<bool>(n, false), std::vector<bool>(n, true)};
  for (std::size_t i = 0; i < n; ++i) {
    const double from = knots.knots()[i];
    const double to = knots.knots()[i + static_cast<std::size_t>(knots.degree()) + 1];
    const double last_turn = std::ceil((upper - from) / period);
    // NOLINTNEXTLINE(clang-analyzer-security.FloatLoopCounter): whole turns, which doubles count exactly.
    for (double turn = std::floor((lower - to) / period); turn <= last_turn; ++turn) {
      const double start = from + turn * period, end = to + turn * period;
      if (start < upper - eps && end > lower + eps) result.in[i] = true;
      if (start >= lower - eps && end <= upper + eps) result.out[i] = false;
    }
  }
  return result;
}

Reach reach(const KnotVector& knots, double lower, double upper) {
  return knots.is_periodic() ? reach_closed(knots, lower, upper) : reach_open(knots, lower, upper);
}

bool meets(const KnotVector& knots, double lower, double upper) {
  if (!std::isfinite(lower) || !std::isfinite(upper) || !(lower < upper)) return false;
  if (!knots.is_periodic()) return lower < knots.upper() && upper > knots.lower();
  return lower >= knots.lower() - knots.length() && upper <= knots.upper() + knots.length() &&
         upper - lower <= knots.length() * (1 + same_parameter);
}

Status check_region(const BSplineSurface& rest, const UvRectangle& region) {
  if (meets(rest.u, region.lower.x(), region.upper.x()) && meets(rest.v, region.lower.y(), region.upper.y()))
    return {};
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found [{}, {}] x [{}, {}], expected an extent within the surface",
                                region.lower.x(), region.upper.x(), region.lower.y(), region.upper.y()),
                    "region");
}

}  // namespace

Result<SurfaceFunctional> functional_at(const BSplineSurface& rest, const Vec2& uv, int a, int b) {
  if (!uv.allFinite())
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "uv");
  return surface_functional(rest, uv.x(), uv.y(), a, b);
}

Result<SculptRow> point_row(const BSplineSurface& rest, const Vec2& uv, PointAspect aspect,
                            const Vec3& target) {
  if (const Status status = check_finite(target, "target"); !status) return status.error();
  const auto [a, b] = derivative_orders(aspect);
  Result<SurfaceFunctional> functional = functional_at(rest, uv, a, b);
  if (!functional) return functional.error();
  return SculptRow{std::move(*functional), target, std::nullopt, 0};
}

Result<std::array<SculptRow, 2>> normal_rows(const BSplineSurface& rest, const Vec2& uv, const Vec3& normal) {
  if (const Status status = check_finite(normal, "normal"); !status) return status.error();
  const double length = normal.stableNorm();
  if (!(length > 0)) return make_error(ErrorCode::invalid_argument, "found no length", "normal");
  Result<SurfaceFunctional> along_u = functional_at(rest, uv, 1, 0);
  Result<SurfaceFunctional> along_v = functional_at(rest, uv, 0, 1);
  if (!along_u) return along_u.error();
  if (!along_v) return along_v.error();
  const Vec3 unit = normal / length;
  return std::array<SculptRow, 2>{SculptRow{std::move(*along_u), Vec3::Zero(), unit, 0},
                                  SculptRow{std::move(*along_v), Vec3::Zero(), unit, 0}};
}

Result<SurfaceFunctional> curve_functional(const BSplineCurve& curve, double u, int a) {
  if (!std::isfinite(u))
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "u");
  if (a < 0 || a > 2)
    return make_error(ErrorCode::invalid_argument, fmt::format("found derivative {}, expected 0..2", a),
                      "derivative");
  const double inside = curve.knots.wrap(u);
  const int span = curve.knots.span(inside);
  const auto width = static_cast<std::size_t>(curve.knots.degree()) + 1;
  std::vector<double> basis(3 * width);
  basis_functions(curve.knots, span, inside, 2, basis);
  std::vector<std::pair<std::uint32_t, double>> terms;
  std::array<double, 3> w{};
  for (std::size_t i = 0; i < width; ++i) {
    const int control = curve.knots.control_of(span - curve.knots.degree() + static_cast<int>(i));
    terms.emplace_back(static_cast<std::uint32_t>(control), basis[static_cast<std::size_t>(a) * width + i]);
    if (!curve.is_rational()) continue;
    for (std::size_t k = 0; k < 3; ++k)
      w[k] += curve.weights[static_cast<std::size_t>(control)] * basis[k * width + i];
  }
  if (curve.is_rational()) {
    for (std::size_t i = 0; i < width; ++i) {
      const double weight = curve.weights[terms[i].first];
      const double r0 = weight * basis[i] / w[0];
      const double r1 = (weight * basis[width + i] - w[1] * r0) / w[0];
      const double r2 = (weight * basis[2 * width + i] - 2 * w[1] * r1 - w[2] * r0) / w[0];
      terms[i].second = a == 0 ? r0 : a == 1 ? r1 : r2;
    }
  }
  return merged(std::move(terms));
}

Result<SculptRow> curve_point_row(const BSplineCurve& rest, double u, int derivative, const Vec3& target) {
  if (const Status status = check_finite(target, "target"); !status) return status.error();
  Result<SurfaceFunctional> functional = curve_functional(rest, u, derivative);
  if (!functional) return functional.error();
  return SculptRow{std::move(*functional), target, std::nullopt, 0};
}

Result<std::vector<SculptRow>> curve_rows(const BSplineSurface& rest, std::span<const CurvePlace> places,
                                          std::span<const Vec3> targets, double tolerance_m) {
  if (targets.size() != places.size())
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected {}: one a place", targets.size(), places.size()),
                      "targets");
  if (!(tolerance_m >= 0))
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected 0 m or more", tolerance_m),
                      "tolerance_m");
  std::vector<SculptRow> rows;
  rows.reserve(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    Result<SculptRow> row = point_row(rest, places[i].uv, PointAspect::position, targets[i]);
    if (!row) return row.error();
    row->tolerance = tolerance_m;
    rows.push_back(std::move(*row));
  }
  return rows;
}

Result<std::vector<SculptRow>> spring_rows(const BSplineSurface& rest, std::span<const CurvePlace> places,
                                           std::span<const Vec3> targets, double stiffness) {
  if (!(stiffness > 0) || !std::isfinite(stiffness))
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected more than 0 N/m", stiffness), "stiffness");
  double whole = 0;
  for (const CurvePlace& place : places) whole += place.weight_m;
  if (!(whole > 0) || !std::isfinite(whole))
    return make_error(ErrorCode::invalid_argument, "found no extent in space, expected an area", "places");
  Result<std::vector<SculptRow>> rows = curve_rows(rest, places, targets, 0);
  if (!rows) return rows.error();
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!(places[i].weight_m > 0)) continue;  // Of a pole: it has no share.
    (*rows)[i].tolerance = std::numeric_limits<double>::infinity();
    (*rows)[i].yield = whole / (stiffness * places[i].weight_m);
  }
  std::vector<SculptRow> sharing;
  for (SculptRow& row : *rows)
    if (row.yield > 0 && std::isfinite(row.yield)) sharing.push_back(std::move(row));
  return sharing;
}

Result<std::vector<std::uint32_t>> points_over(const BSplineSurface& rest, const UvRectangle& region) {
  if (const Status status = check_region(rest, region); !status) return status.error();
  const Reach u = reach(rest.u, region.lower.x(), region.upper.x());
  const Reach v = reach(rest.v, region.lower.y(), region.upper.y());
  std::vector<std::uint32_t> points;
  for (std::size_t i = 0; i < u.in.size(); ++i)
    for (std::size_t j = 0; j < v.in.size(); ++j)
      if (u.in[i] && v.in[j]) points.push_back(static_cast<std::uint32_t>(i * v.in.size() + j));
  return points;
}

Result<std::vector<std::uint32_t>> points_outside(const BSplineSurface& rest, const UvRectangle& region) {
  if (const Status status = check_region(rest, region); !status) return status.error();
  const Reach u = reach(rest.u, region.lower.x(), region.upper.x());
  const Reach v = reach(rest.v, region.lower.y(), region.upper.y());
  std::vector<std::uint32_t> points;
  for (std::size_t i = 0; i < u.out.size(); ++i)
    for (std::size_t j = 0; j < v.out.size(); ++j)
      if (u.out[i] || v.out[j]) points.push_back(static_cast<std::uint32_t>(i * v.out.size() + j));
  return points;
}

Result<std::vector<SculptRow>> region_rows(const BSplineSurface& rest, const UvRectangle& region,
                                           std::span<const Vec3> targets) {
  const Result<std::vector<std::uint32_t>> points = points_over(rest, region);
  if (!points) return points.error();
  if (targets.size() != points->size())
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected {}: one a control point of the region", targets.size(),
                                  points->size()),
                      "targets");
  std::vector<SculptRow> rows;
  rows.reserve(points->size());
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (const Status status = check_finite(targets[i], "targets"); !status) return status.error();
    rows.push_back({{{(*points)[i]}, {1.0}}, targets[i], std::nullopt, 0});
  }
  return rows;
}

Result<std::vector<SculptRow>> region_rows(const BSplineSurface& rest, const UvRectangle& region,
                                           const Eigen::Isometry3d& motion) {
  const Result<std::vector<std::uint32_t>> points = points_over(rest, region);
  if (!points) return points.error();
  std::vector<Vec3> targets;
  targets.reserve(points->size());
  for (const std::uint32_t point : *points) targets.push_back(motion * rest.control[point]);
  return region_rows(rest, region, targets);
}

}  // namespace handloft::geometry
