#include "server-model/geometry/polynomial_surface.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace handloft::geometry {
namespace {

constexpr std::array<Monomial, max_coefficients> make_monomials() {
  std::array<Monomial, max_coefficients> terms{};
  std::size_t k = 1;  // terms[0] is the constant.
  for (int degree = 1; degree <= max_degree; ++degree) {
    for (int y_power = 1; y_power < degree; ++y_power) terms[k++] = {degree - y_power, y_power};
    terms[k++] = {degree, 0};
    terms[k++] = {0, degree};
  }
  return terms;
}
constexpr std::array<Monomial, max_coefficients> monomial_table = make_monomials();

static_assert(monomial_index(1, 1) == 3 && monomial_index(2, 0) == 4 && monomial_index(0, 2) == 5);

using Powers = std::array<double, max_degree + 1>;

inline void powers_of(double u, int degree, Powers& powers) {
  powers[0] = 1;
  for (int k = 1; k <= degree; ++k) {
    powers[static_cast<std::size_t>(k)] = powers[static_cast<std::size_t>(k - 1)] * u;
  }
}

double binomial(int n, int k) {
  double value = 1;
  for (int i = 1; i <= k; ++i) value = value * (n - k + i) / i;
  return value;
}

Status check_coefficients(int degree, std::span<const double> coefficients) {
  if (degree < min_degree || degree > max_degree) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected {}..{}", degree, min_degree, max_degree), "degree");
  }
  const auto expected = static_cast<std::size_t>(coefficient_count(degree));
  if (coefficients.size() != expected) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {} numbers, expected {} for degree {}", coefficients.size(), expected, degree),
        "coefficients");
  }
  for (std::size_t i = 0; i < expected; ++i) {
    if (!std::isfinite(coefficients[i])) {
      return make_error(ErrorCode::invalid_argument, "found a number that is not finite",
                        fmt::format("coefficients[{}]", i));
    }
  }
  return {};
}

}  // namespace

std::span<const Monomial> monomials(int degree) {
  assert(degree >= 0 && degree <= max_degree);
  return std::span(monomial_table).first(static_cast<std::size_t>(coefficient_count(degree)));
}

void evaluate_monomials(int degree, double u, double v, double* out) {
  Powers us;
  Powers vs;
  powers_of(u, degree, us);
  powers_of(v, degree, vs);
  *out++ = 1;
  for (int d = 1; d <= degree; ++d) {
    for (int j = 1; j < d; ++j)
      *out++ = us[static_cast<std::size_t>(d - j)] * vs[static_cast<std::size_t>(j)];
    *out++ = us[static_cast<std::size_t>(d)];
    *out++ = vs[static_cast<std::size_t>(d)];
  }
}

Result<PolynomialSurface> PolynomialSurface::from_coefficients(int degree,
                                                               std::span<const double> coefficients) {
  return from_scaled(degree, Box2{Vec2::Zero(), Vec2::Ones()}, coefficients);
}

Result<PolynomialSurface> PolynomialSurface::from_scaled(int degree, const Box2& box,
                                                         std::span<const double> coefficients) {
  if (Status status = check_coefficients(degree, coefficients); !status.ok()) return status.error();
  if (!box.centre.allFinite() || !box.half_extent.allFinite() || box.half_extent.minCoeff() <= 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found half extents {} x {}, expected finite numbers > 0",
                                  box.half_extent.x(), box.half_extent.y()),
                      "box");
  }
  PolynomialSurface surface;
  surface.degree_ = degree;
  surface.box_ = box;
  std::copy(coefficients.begin(), coefficients.end(), surface.scaled_.begin());
  return surface;
}

std::vector<double> PolynomialSurface::coefficients() const {
  // u^i v^j = ((x - cx)/sx)^i ((y - cy)/sy)^j, expanded by the binomial theorem.
  std::vector<double> result(static_cast<std::size_t>(coefficient_count(degree_)), 0.0);
  const std::span<const Monomial> terms = monomials(degree_);
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const auto [i, j] = terms[k];
    const double scale = scaled_[k] / (std::pow(box_.half_extent.x(), i) * std::pow(box_.half_extent.y(), j));
    for (int a = 0; a <= i; ++a) {
      const double x_part = binomial(i, a) * std::pow(-box_.centre.x(), i - a);
      for (int b = 0; b <= j; ++b) {
        result[monomial_index(a, b)] += scale * x_part * binomial(j, b) * std::pow(-box_.centre.y(), j - b);
      }
    }
  }
  return result;
}

double PolynomialSurface::value(double x, double y) const {
  Powers us;
  Powers vs;
  powers_of((x - box_.centre.x()) / box_.half_extent.x(), degree_, us);
  powers_of((y - box_.centre.y()) / box_.half_extent.y(), degree_, vs);
  double sum = scaled_[0];
  std::size_t k = 1;
  for (int d = 1; d <= degree_; ++d) {
    for (int j = 1; j < d; ++j) {
      sum += scaled_[k++] * us[static_cast<std::size_t>(d - j)] * vs[static_cast<std::size_t>(j)];
    }
    sum += scaled_[k++] * us[static_cast<std::size_t>(d)];
    sum += scaled_[k++] * vs[static_cast<std::size_t>(d)];
  }
  return sum;
}

void PolynomialSurface::evaluate(std::span<const Vec2> xy, std::span<double> values) const {
  assert(xy.size() == values.size());
  for (std::size_t i = 0; i < xy.size(); ++i) values[i] = value(xy[i].x(), xy[i].y());
}

HeightDerivatives PolynomialSurface::derivatives(double x, double y) const {
  Powers us;
  Powers vs;
  const double sx = box_.half_extent.x();
  const double sy = box_.half_extent.y();
  powers_of((x - box_.centre.x()) / sx, degree_, us);
  powers_of((y - box_.centre.y()) / sy, degree_, vs);
  const auto power = [](const Powers& p, int k) { return k < 0 ? 0.0 : p[static_cast<std::size_t>(k)]; };
  HeightDerivatives d;
  const std::span<const Monomial> terms = monomials(degree_);
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const auto [i, j] = terms[k];
    const double c = scaled_[k];
    d.value += c * power(us, i) * power(vs, j);
    d.dx += c * i * power(us, i - 1) * power(vs, j);
    d.dy += c * j * power(us, i) * power(vs, j - 1);
    d.dxx += c * i * (i - 1) * power(us, i - 2) * power(vs, j);
    d.dxy += c * i * j * power(us, i - 1) * power(vs, j - 1);
    d.dyy += c * j * (j - 1) * power(us, i) * power(vs, j - 2);
  }
  d.dx /= sx;
  d.dy /= sy;
  d.dxx /= sx * sx;
  d.dxy /= sx * sy;
  d.dyy /= sy * sy;
  return d;
}

Vec2 PolynomialSurface::gradient(double x, double y) const {
  const HeightDerivatives d = derivatives(x, y);
  return {d.dx, d.dy};
}

Vec3 PolynomialSurface::normal(double x, double y) const {
  const HeightDerivatives d = derivatives(x, y);
  // stableNormalized: far outside of the data the slope's square may overflow.
  return Vec3(-d.dx, -d.dy, 1.0).stableNormalized();
}

PrincipalCurvatures PolynomialSurface::principal_curvatures(double x, double y) const {
  // First fundamental form E, F, G and second L, M, N of the graph; curvatures = H +- sqrt(H^2 - K).
  const HeightDerivatives d = derivatives(x, y);
  const double e = 1 + d.dx * d.dx;
  const double f = d.dx * d.dy;
  const double g = 1 + d.dy * d.dy;
  const double w2 = 1 + d.dx * d.dx + d.dy * d.dy;
  const double w = std::sqrt(w2);
  const double mean = (e * d.dyy - 2 * f * d.dxy + g * d.dxx) / (2 * w2 * w);
  const double gauss = (d.dxx * d.dyy - d.dxy * d.dxy) / (w2 * w2);
  const double root = std::sqrt(std::max(0.0, mean * mean - gauss));
  return {mean - root, mean + root};
}

PolynomialSurface PolynomialSurface::flipped_y() const {
  PolynomialSurface flipped = *this;
  flipped.box_.centre.y() = -box_.centre.y();
  const std::span<const Monomial> terms = monomials(degree_);
  for (std::size_t k = 0; k < terms.size(); ++k) {
    if (terms[k].y_power % 2 != 0) flipped.scaled_[k] = -scaled_[k];
  }
  return flipped;
}

bool PolynomialSurface::operator==(const PolynomialSurface& other) const {
  return degree_ == other.degree_ && box_.centre == other.box_.centre &&
         box_.half_extent == other.box_.half_extent && scaled_ == other.scaled_;
}

}  // namespace handloft::geometry
