// Places along curves and over regions, and the loads of sculpt_rows.h.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server-model/geometry/gauss_rule.h"
#include "server-model/geometry/region_border.h"
#include "server-model/geometry/sculpt_places.h"
#include "server-model/geometry/sculpt_rows.h"

namespace handloft::geometry {

namespace {

/// Cuts closer than this part of a segment are one.
constexpr double least_piece = 1e-9;
/// Tangents whose sine is below this span no plane.
constexpr double least_sine = 1e-9;

/// A straight part of the polyline within one span of each direction.
struct Piece {
  Vec2 from, to;
  double t_from = 0, t_to = 0;
  int degree = 1;
};

void add_cuts(const KnotVector& knots, double from, double to, std::vector<double>& cuts) {
  for (const double knot :
       knots_between(knots, std::min(from, to), std::max(from, to), max_curve_places + 1)) {
    const double at = (knot - from) / (to - from);
    if (at > 0 && at < 1) cuts.push_back(at);
  }
}

bool inside(const KnotVector& knots, double u) {
  const double beyond = knots.is_periodic() ? max_turns * knots.length() : 0;
  return u >= knots.lower() - beyond && u <= knots.upper() + beyond;
}

Result<std::vector<Piece>> pieces(const BSplineSurface& rest, std::span<const Vec2> polyline) {
  if (polyline.size() < 2 || polyline.size() > max_curve_places)
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} corners, expected 2 to {}", polyline.size(), max_curve_places),
                      "polyline");
  double length = 0;
  for (std::size_t i = 0; i < polyline.size(); ++i) {
    // Comparisons with NaN are false.
    if (!inside(rest.u, polyline[i].x()) || !inside(rest.v, polyline[i].y()))
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found ({}, {}), expected parameters of the surface", polyline[i].x(), polyline[i].y()),
          fmt::format("polyline[{}]", i));
    if (i > 0) length += (polyline[i] - polyline[i - 1]).norm();
  }
  if (!(length > 0))
    return make_error(ErrorCode::invalid_argument, "found one place only, expected a length", "polyline");
  std::vector<Piece> result;
  double done = 0;
  for (std::size_t i = 0; i + 1 < polyline.size(); ++i) {
    const Vec2& from = polyline[i];
    const Vec2 step = polyline[i + 1] - from;
    const double part = step.norm();
    if (part <= least_piece * length) continue;
    std::vector<double> cuts{0, 1};
    add_cuts(rest.u, from.x(), polyline[i + 1].x(), cuts);
    add_cuts(rest.v, from.y(), polyline[i + 1].y(), cuts);
    std::sort(cuts.begin(), cuts.end());
    int degree = std::max(rest.u.degree(), rest.v.degree());
    if (step.x() == 0) degree = rest.v.degree();
    if (step.y() == 0) degree = rest.u.degree();
    double last = 0;
    for (const double cut : cuts) {
      if (cut - last <= least_piece) continue;
      result.push_back({from + last * step, from + cut * step, (done + last * part) / length,
                        (done + cut * part) / length, degree});
      last = cut;
    }
    if (result.size() > max_curve_places) return result;  // along() says so.
    done += part;
  }
  return result;
}

// `ends`: the polyline's own ends too, with no weight.
Result<std::vector<CurvePlace>> along(const BSplineSurface& rest, std::span<const Vec2> polyline, bool ends) {
  const Result<std::vector<Piece>> parts = pieces(rest, polyline);
  if (!parts) return parts.error();
  std::vector<CurvePlace> places;
  if (ends) places.push_back({0, polyline.front(), 0});
  for (const Piece& piece : *parts) {
    const GaussRule rule = gauss_rule(piece.degree + 1);
    for (std::size_t g = 0; g < rule.node.size(); ++g) {
      const double s = (1 + rule.node[g]) / 2;
      const Vec2 uv = piece.from + s * (piece.to - piece.from);
      const SurfaceDerivatives d = rest.derivatives(uv.x(), uv.y(), 1);
      const Vec3 tangent = d.su * (piece.to.x() - piece.from.x()) + d.sv * (piece.to.y() - piece.from.y());
      places.push_back(
          {piece.t_from + s * (piece.t_to - piece.t_from), uv, rule.weight[g] / 2 * tangent.norm()});
    }
    if (places.size() > max_curve_places)
      return make_error(
          ErrorCode::resource_exhausted,
          fmt::format("found more than {} places, expected a shorter curve or fewer knots", max_curve_places),
          "polyline");
  }
  if (ends) places.push_back({1, polyline.back(), 0});
  return places;
}

// The breaks of [lower, upper], of open directions within the domain.
std::vector<double> breaks(const KnotVector& knots, double lower, double upper) {
  const double from = knots.is_periodic() ? lower : std::max(lower, knots.lower());
  const double to = knots.is_periodic() ? upper : std::min(upper, knots.upper());
  std::vector<double> result{from};
  const std::vector<double> between =
      knots_between(knots, from, to, static_cast<std::size_t>(KnotVector::max_control_count));
  result.insert(result.end(), between.begin(), between.end());
  result.push_back(to);
  return result;
}

}  // namespace

SurfaceFunctional merged(std::vector<std::pair<std::uint32_t, double>> terms) {
  std::stable_sort(terms.begin(), terms.end(),
                   [](const auto& x, const auto& y) { return x.first < y.first; });
  SurfaceFunctional functional;
  for (const auto& [point, value] : terms) {
    if (!functional.point.empty() && functional.point.back() == point) {
      functional.value.back() += value;
    } else {
      functional.point.push_back(point);
      functional.value.push_back(value);
    }
  }
  return functional;
}

Result<std::vector<CurvePlace>> collocation_places(const BSplineSurface& rest,
                                                   std::span<const Vec2> polyline) {
  return along(rest, polyline, true);
}

Result<std::vector<CurvePlace>> line_quadrature(const BSplineSurface& rest, std::span<const Vec2> polyline) {
  return along(rest, polyline, false);
}

Result<std::vector<CurvePlace>> area_quadrature(const BSplineSurface& rest, const UvRectangle& region) {
  if (const auto points = points_over(rest, region); !points) return points.error();
  const std::vector<double> us = breaks(rest.u, region.lower.x(), region.upper.x());
  const std::vector<double> vs = breaks(rest.v, region.lower.y(), region.upper.y());
  const GaussRule ru = gauss_rule(rest.u.degree() + 1);
  const GaussRule rv = gauss_rule(rest.v.degree() + 1);
  std::vector<CurvePlace> places;
  for (std::size_t i = 0; i + 1 < us.size(); ++i) {
    for (std::size_t j = 0; j + 1 < vs.size(); ++j) {
      const double half_u = (us[i + 1] - us[i]) / 2;
      const double half_v = (vs[j + 1] - vs[j]) / 2;
      for (std::size_t a = 0; a < ru.node.size(); ++a) {
        for (std::size_t b = 0; b < rv.node.size(); ++b) {
          const Vec2 uv(us[i] + half_u * (1 + ru.node[a]), vs[j] + half_v * (1 + rv.node[b]));
          const SurfaceDerivatives d = rest.derivatives(uv.x(), uv.y(), 1);
          places.push_back({0, uv, half_u * ru.weight[a] * half_v * rv.weight[b] * d.su.cross(d.sv).norm()});
        }
      }
    }
  }
  return places;
}

Result<SculptLoad> point_load(const BSplineSurface& rest, const Vec2& uv, const Vec3& force) {
  if (!force.allFinite())
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "force");
  Result<SurfaceFunctional> functional = functional_at(rest, uv, 0, 0);
  if (!functional) return functional.error();
  return SculptLoad{std::move(*functional), force};
}

Result<std::array<SculptLoad, 2>> moment_loads(const BSplineSurface& rest, const Vec2& uv,
                                               const Vec3& moment) {
  if (!moment.allFinite())
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "moment");
  Result<SurfaceFunctional> along_u = functional_at(rest, uv, 1, 0);
  Result<SurfaceFunctional> along_v = functional_at(rest, uv, 0, 1);
  if (!along_u) return along_u.error();
  if (!along_v) return along_v.error();
  const SurfaceDerivatives d = rest.derivatives(uv.x(), uv.y(), 1);
  const Vec3 cross = d.su.cross(d.sv);
  if (!(cross.norm() > least_sine * d.su.norm() * d.sv.norm()))
    return make_error(ErrorCode::failed_precondition,
                      "found parallel tangents, expected a tangent plane to turn", "uv");
  const Vec3 normal = cross.normalized();
  const Vec3 normal_part = moment.dot(normal) * normal;
  const Vec3 turning = (moment - normal_part) + normal_part / 2;
  const Vec3 reciprocal_u = d.sv.cross(normal) / cross.norm();
  const Vec3 reciprocal_v = normal.cross(d.su) / cross.norm();
  return std::array<SculptLoad, 2>{SculptLoad{std::move(*along_u), turning.cross(reciprocal_u)},
                                   SculptLoad{std::move(*along_v), turning.cross(reciprocal_v)}};
}

Result<std::vector<SculptLoad>> motion_loads(const BSplineSurface& rest, std::span<const CurvePlace> places,
                                             const Eigen::Isometry3d& motion, double stiffness) {
  if (!motion.matrix().allFinite())
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "motion");
  if (!(stiffness >= 0) || !std::isfinite(stiffness))
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected 0 N/m or more", stiffness),
                      "stiffness");
  double total = 0;
  Vec3 centre = Vec3::Zero();
  for (const CurvePlace& place : places) {
    total += place.weight_m;
    centre += place.weight_m * rest.evaluate(place.uv.x(), place.uv.y());
  }
  if (!(total > 0) || !std::isfinite(total))
    return make_error(ErrorCode::invalid_argument, "found no extent in space, expected a length or area",
                      "places");
  centre /= total;
  // c - c' = [motion of the centre] + (R - 1) (c' - centre).
  std::array<std::vector<std::pair<std::uint32_t, double>>, 4> terms;
  for (const CurvePlace& place : places) {
    const Result<SurfaceFunctional> functional = functional_at(rest, place.uv, 0, 0);
    if (!functional) return functional.error();
    const Vec3 arm = rest.evaluate(place.uv.x(), place.uv.y()) - centre;
    const double part = place.weight_m / total;
    for (std::size_t i = 0; i < functional->point.size(); ++i) {
      const double value = part * functional->value[i];
      terms[0].emplace_back(functional->point[i], value);
      for (std::size_t axis = 0; axis < 3; ++axis)
        terms[axis + 1].emplace_back(functional->point[i], value * arm[static_cast<Eigen::Index>(axis)]);
    }
  }
  const Mat3 turn = motion.rotation() - Mat3::Identity();
  std::vector<SculptLoad> loads;
  loads.push_back({merged(std::move(terms[0])), stiffness * (motion * centre - centre)});
  for (std::size_t axis = 0; axis < 3; ++axis)
    loads.push_back(
        {merged(std::move(terms[axis + 1])), stiffness * turn.col(static_cast<Eigen::Index>(axis))});
  return loads;
}

}  // namespace handloft::geometry
