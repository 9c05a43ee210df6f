#include "server-model/geometry/bezier_patch.h"

#include <array>
#include <cmath>

namespace handloft::geometry {
namespace {

double binomial(int n, int k) {
  if (k < 0 || k > n) return 0;
  double value = 1;
  for (int i = 1; i <= k; ++i) value = value * (n - k + i) / i;
  return value;
}

using Ordinates = std::array<std::array<double, max_degree + 1>, max_degree + 1>;

/// [i][k]: the k-th Bernstein ordinate of degree N of w^i, w running from `low` to `high`. That is its polar
/// form at k arguments `high` and N - k arguments `low`: sum_m C(k,m) C(N-k,i-m) high^m low^(i-m) / C(N,i).
Ordinates bernstein_ordinates(int degree, double low, double high) {
  Ordinates ordinates{};
  for (int i = 0; i <= degree; ++i) {
    for (int k = 0; k <= degree; ++k) {
      double sum = 0;
      for (int m = 0; m <= i; ++m) {
        sum += binomial(k, m) * binomial(degree - k, i - m) * std::pow(high, m) * std::pow(low, i - m);
      }
      ordinates[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] = sum / binomial(degree, i);
    }
  }
  return ordinates;
}

Vec3 de_casteljau(std::array<Vec3, max_degree + 1> points, int degree, double t) {
  for (int level = degree; level > 0; --level) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(level); ++i) {
      points[i] = (1 - t) * points[i] + t * points[i + 1];
    }
  }
  return points[0];
}

}  // namespace

Vec3 BezierPatch::evaluate(double u, double v) const {
  std::array<Vec3, max_degree + 1> row;
  std::array<Vec3, max_degree + 1> column;
  for (int i = 0; i <= degree; ++i) {
    for (int j = 0; j <= degree; ++j) row[static_cast<std::size_t>(j)] = at(i, j);
    column[static_cast<std::size_t>(i)] = de_casteljau(row, degree, v);
  }
  return de_casteljau(column, degree, u);
}

Result<BezierPatch> to_bezier_patch(const PolynomialSurface& surface, const Frame& frame, const Box2& box) {
  if (!box.centre.allFinite() || !box.half_extent.allFinite() || box.half_extent.minCoeff() <= 0) {
    return make_error(ErrorCode::invalid_argument, "found a box without a finite area", "box");
  }
  const int n = surface.degree();
  const Box2& scale = surface.box();
  const Vec2 low = (box.lower() - scale.centre).cwiseQuotient(scale.half_extent);
  const Vec2 high = (box.upper() - scale.centre).cwiseQuotient(scale.half_extent);
  const Ordinates in_u = bernstein_ordinates(n, low.x(), high.x());
  const Ordinates in_v = bernstein_ordinates(n, low.y(), high.y());
  const std::span<const Monomial> terms = monomials(n);
  const std::span<const double> c = surface.scaled_coefficients();

  BezierPatch patch;
  patch.degree = n;
  patch.control.reserve(static_cast<std::size_t>(n + 1) * static_cast<std::size_t>(n + 1));
  for (int k = 0; k <= n; ++k) {
    for (int l = 0; l <= n; ++l) {
      double z = 0;
      for (std::size_t t = 0; t < terms.size(); ++t) {
        z += c[t] * in_u[static_cast<std::size_t>(terms[t].x_power)][static_cast<std::size_t>(k)] *
             in_v[static_cast<std::size_t>(terms[t].y_power)][static_cast<std::size_t>(l)];
      }
      // x and y are linear in the parameters: their ordinates are evenly spaced.
      const Vec2 step(static_cast<double>(k) / n, static_cast<double>(l) / n);
      const Vec2 xy = box.lower() + 2 * step.cwiseProduct(box.half_extent);
      patch.control.push_back(frame.to_world({xy.x(), xy.y(), z}));
      if (!patch.control.back().allFinite()) {
        return make_error(ErrorCode::invalid_argument, "the surface is not finite over the box", "surface");
      }
    }
  }
  return patch;
}

}  // namespace handloft::geometry
