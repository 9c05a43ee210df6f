#include "server-model/geometry/bspline_curve.h"

#include <fmt/format.h>

#include <algorithm>

#include "server-model/geometry/bspline_checks.h"

namespace handloft::geometry {

std::array<Vec3, 4> BSplineCurve::derivatives(double u, int order) const {
  std::array<Vec3, 4> c = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  order = std::clamp(order, 0, 3);
  std::array<double, 4 * (static_cast<std::size_t>(KnotVector::max_degree) + 1)> basis;
  const double inside = knots.wrap(u);
  const int span = knots.span(inside);
  basis_functions(knots, span, inside, order, basis);
  const auto width = static_cast<std::size_t>(knots.degree()) + 1;
  std::array<double, 4> w = {0, 0, 0, 0};
  for (std::size_t i = 0; i < width; ++i) {
    const auto point =
        static_cast<std::size_t>(knots.control_of(span - knots.degree() + static_cast<int>(i)));
    const double weight = is_rational() ? weights[point] : 1;
    for (std::size_t k = 0; k <= static_cast<std::size_t>(order); ++k) {
      const double part = basis[k * width + i] * weight;
      c[k] += part * control[point];
      w[k] += part;
    }
  }
  if (!is_rational()) return c;
  c[0] /= w[0];
  c[1] = (c[1] - w[1] * c[0]) / w[0];
  c[2] = (c[2] - 2 * w[1] * c[1] - w[2] * c[0]) / w[0];
  c[3] = (c[3] - 3 * w[1] * c[2] - 3 * w[2] * c[1] - w[3] * c[0]) / w[0];
  for (auto k = static_cast<std::size_t>(order) + 1; k < c.size(); ++k) c[k].setZero();
  return c;
}

Vec3 BSplineCurve::evaluate(double u) const {
  return derivatives(u, 0)[0];
}

Status check(const BSplineCurve& curve) {
  return detail::check_control(static_cast<std::size_t>(curve.knots.control_count()), curve.control,
                               curve.weights);
}

}  // namespace handloft::geometry
