#include "server-model/geometry/bspline_surface.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "server-model/geometry/bspline_checks.h"
#include "server-model/geometry/fit_checks.h"

namespace handloft::geometry {
namespace {

constexpr double min_weight = 1e-60, max_weight = 1e60;
constexpr auto width_limit = static_cast<std::size_t>(KnotVector::max_degree) + 1;

/// The functions of one direction that do not vanish at a parameter, and the control values they belong to.
struct Active {
  Active(const KnotVector& knots, double parameter, int order)
      : width(static_cast<std::size_t>(knots.degree()) + 1) {
    const double inside = knots.wrap(parameter);
    const int span = knots.span(inside);
    basis_functions(knots, span, inside, order, basis);
    int control = knots.control_of(span - knots.degree());
    for (std::size_t i = 0; i < width; ++i) {
      index[i] = static_cast<std::size_t>(control);
      if (++control == knots.control_count()) control = 0;
    }
  }
  double value(int derivative, std::size_t i) const {
    return basis[static_cast<std::size_t>(derivative) * width + i];
  }

  std::size_t width;
  std::array<double, 4 * width_limit> basis;
  std::array<std::size_t, width_limit> index;
};

/// A sum over the active control points, in homogeneous form.
struct Homogeneous {
  Vec3 p = Vec3::Zero();
  double w = 0;
};

Homogeneous sum(const BSplineSurface& surface, const Active& in_u, const Active& in_v, int a, int b) {
  Homogeneous total;
  const auto columns = static_cast<std::size_t>(surface.v.control_count());
  for (std::size_t i = 0; i < in_u.width; ++i) {
    Homogeneous row;
    const std::size_t first = in_u.index[i] * columns;
    for (std::size_t j = 0; j < in_v.width; ++j) {
      const std::size_t point = first + in_v.index[j];
      double part = in_v.value(b, j);
      if (surface.is_rational()) {
        part *= surface.weights[point];
        row.w += part;
      }
      row.p += part * surface.control[point];
    }
    total.p += in_u.value(a, i) * row.p;
    total.w += in_u.value(a, i) * row.w;
  }
  return total;
}

/// How far a place is moved inward to find a normal, of the domain.
constexpr double first_step = 1e-7, last_step = 0.1, step_factor = 10;
/// Below this, of the surface's extent here, a tangent is rounding; so is the sine of an angle between two.
constexpr double tangent_noise = 1e-10;

/// Not of unit length; zero where the tangents give none.
Vec3 regular_normal(const BSplineSurface& surface, double u, double v) {
  const Active in_u(surface.u, u, 0);
  const Active in_v(surface.v, v, 0);
  const Vec3& origin =
      surface.control[in_u.index[0] * static_cast<std::size_t>(surface.v.control_count()) + in_v.index[0]];
  double extent = 0;
  for (std::size_t i = 0; i < in_u.width; ++i) {
    for (std::size_t j = 0; j < in_v.width; ++j) {
      const std::size_t point =
          in_u.index[i] * static_cast<std::size_t>(surface.v.control_count()) + in_v.index[j];
      extent = std::max(extent, (surface.control[point] - origin).lpNorm<Eigen::Infinity>());
    }
  }
  const SurfaceDerivatives d = surface.derivatives(u, v, 1);
  const double along_u = d.su.stableNorm();
  const double along_v = d.sv.stableNorm();
  if (!(along_u * surface.u.length() > tangent_noise * extent) ||
      !(along_v * surface.v.length() > tangent_noise * extent)) {
    return Vec3::Zero();
  }
  const Vec3 normal = (d.su / along_u).cross(d.sv / along_v);
  return normal.norm() > tangent_noise ? normal : Vec3::Zero();
}

}  // namespace

Vec3 BSplineSurface::evaluate(double at_u, double at_v) const {
  const Homogeneous place = sum(*this, Active(u, at_u, 0), Active(v, at_v, 0), 0, 0);
  return is_rational() ? Vec3(place.p / place.w) : place.p;
}

SurfaceDerivatives BSplineSurface::derivatives(double at_u, double at_v, int order) const {
  order = std::clamp(order, 0, 2);
  const Active in_u(u, at_u, order);
  const Active in_v(v, at_v, order);
  const Homogeneous s = sum(*this, in_u, in_v, 0, 0);
  Homogeneous su, sv, suu, suv, svv;
  if (order >= 1) {
    su = sum(*this, in_u, in_v, 1, 0);
    sv = sum(*this, in_u, in_v, 0, 1);
  }
  if (order >= 2) {
    suu = sum(*this, in_u, in_v, 2, 0);
    suv = sum(*this, in_u, in_v, 1, 1);
    svv = sum(*this, in_u, in_v, 0, 2);
  }
  if (!is_rational()) return {s.p, su.p, sv.p, suu.p, suv.p, svv.p};
  // The quotient rule, order by order (The NURBS Book, eq. 4.20).
  SurfaceDerivatives d;
  d.s = s.p / s.w;
  if (order >= 1) {
    d.su = (su.p - su.w * d.s) / s.w;
    d.sv = (sv.p - sv.w * d.s) / s.w;
  }
  if (order >= 2) {
    d.suu = (suu.p - 2 * su.w * d.su - suu.w * d.s) / s.w;
    d.suv = (suv.p - su.w * d.sv - sv.w * d.su - suv.w * d.s) / s.w;
    d.svv = (svv.p - 2 * sv.w * d.sv - svv.w * d.s) / s.w;
  }
  return d;
}

Vec3 BSplineSurface::normal(double at_u, double at_v) const {
  at_u = u.wrap(at_u);
  at_v = v.wrap(at_v);
  Vec3 normal = regular_normal(*this, at_u, at_v);
  const double inward_u = at_u < u.lower() + u.length() / 2 ? u.length() : -u.length();
  const double inward_v = at_v < v.lower() + v.length() / 2 ? v.length() : -v.length();
  for (double step = first_step; normal.isZero(0) && step <= last_step; step *= step_factor) {
    normal = regular_normal(*this, at_u + step * inward_u, at_v + step * inward_v);
  }
  return normal.isZero(0) ? normal : Vec3(normal.normalized());
}

namespace detail {

Status check_control(std::size_t expected, std::span<const Vec3> control, std::span<const double> weights) {
  if (control.size() != expected) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} control points, expected {}", control.size(), expected),
                      "control");
  }
  if (!weights.empty() && weights.size() != expected) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} weights, expected {} or none", weights.size(), expected),
                      "weights");
  }
  for (std::size_t i = 0; i < control.size(); ++i) {
    if (!(control[i].cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= max_coordinate_m)) {
      return make_error(ErrorCode::invalid_argument, "found a coordinate that is no finite length",
                        fmt::format("control[{}]", i));
    }
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!(weights[i] >= min_weight && weights[i] <= max_weight)) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected {} to {}", weights[i], min_weight, max_weight),
                        fmt::format("weights[{}]", i));
    }
  }
  return {};
}

}  // namespace detail

Status check(const BSplineSurface& surface) {
  return detail::check_control(static_cast<std::size_t>(surface.u.control_count()) *
                                   static_cast<std::size_t>(surface.v.control_count()),
                               surface.control, surface.weights);
}

Result<SurfaceFunctional> surface_functional(const BSplineSurface& surface, double u, double v, int a,
                                             int b) {
  const int highest = surface.is_rational() ? 2 : 3;
  if (a < 0 || b < 0 || a > highest || b > highest || a + b > highest) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found derivative ({}, {}), expected a sum of 0..{}", a, b, highest),
                      "derivative");
  }
  const Active in_u(surface.u, u, a);
  const Active in_v(surface.v, v, b);
  // Derivatives of the denominator, [k][l].
  std::array<std::array<double, 3>, 3> w{};
  if (surface.is_rational()) {
    for (int k = 0; k <= a; ++k) {
      for (int l = 0; l <= b; ++l) {
        w[static_cast<std::size_t>(k)][static_cast<std::size_t>(l)] = sum(surface, in_u, in_v, k, l).w;
      }
    }
  }
  std::vector<std::pair<std::uint32_t, double>> terms;
  terms.reserve(in_u.width * in_v.width);
  for (std::size_t i = 0; i < in_u.width; ++i) {
    for (std::size_t j = 0; j < in_v.width; ++j) {
      const std::size_t point =
          in_u.index[i] * static_cast<std::size_t>(surface.v.control_count()) + in_v.index[j];
      double value = in_u.value(a, i) * in_v.value(b, j);
      if (surface.is_rational()) {
        // R = weight N / W by the same quotient rule, with one number in the place of the point.
        const double weight = surface.weights[point];
        const auto n = [&](int k, int l) { return weight * in_u.value(k, i) * in_v.value(l, j); };
        const double r = n(0, 0) / w[0][0];
        const auto ru = [&] { return (n(1, 0) - w[1][0] * r) / w[0][0]; };
        const auto rv = [&] { return (n(0, 1) - w[0][1] * r) / w[0][0]; };
        if (a + b == 0) value = r;
        if (a == 1 && b == 0) value = ru();
        if (a == 0 && b == 1) value = rv();
        if (a == 2) value = (n(2, 0) - 2 * w[1][0] * ru() - w[2][0] * r) / w[0][0];
        if (b == 2) value = (n(0, 2) - 2 * w[0][1] * rv() - w[0][2] * r) / w[0][0];
        if (a == 1 && b == 1) value = (n(1, 1) - w[1][0] * rv() - w[0][1] * ru() - w[1][1] * r) / w[0][0];
      }
      terms.emplace_back(static_cast<std::uint32_t>(point), value);
    }
  }
  // A periodic direction with few control points meets some of them twice.
  std::stable_sort(terms.begin(), terms.end(),
                   [](const auto& x, const auto& y) { return x.first < y.first; });
  SurfaceFunctional functional;
  functional.point.reserve(terms.size());
  functional.value.reserve(terms.size());
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

}  // namespace handloft::geometry
