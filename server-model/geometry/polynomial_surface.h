#pragma once
// A polynomial height field z = f(x, y) of total degree N = 1..6 over the base plane of a frame (A4, eq. 2):
//   N = 2:  f = a0 + a1 x + a2 y + a3 xy + a4 x^2 + a5 y^2.
// The order is exactly that; degree d > 2 continues it: first the mixed terms with falling power of x, then
// x^d and y^d (N = 3 adds x^2 y, x y^2, x^3, y^3). So the coefficients of a lower degree are a prefix.
// Internally the polynomial is kept in u = (x - cx) / sx, v = (y - cy) / sy over the box of its data, where
// the monomials are well conditioned (A6); coefficients() expands to the order of eq. 2 in metres. The
// surface is unbounded: it may be evaluated anywhere (A11).

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

inline constexpr int min_degree = 1;
inline constexpr int max_degree = 6;

/// (N+1)(N+2)/2.
constexpr int coefficient_count(int degree) {
  return (degree + 1) * (degree + 2) / 2;
}
inline constexpr int max_coefficients = coefficient_count(max_degree);

/// The term x^x_power y^y_power.
struct Monomial {
  int x_power = 0;
  int y_power = 0;
};

/// Position of x^i y^j in the order of eq. 2. Precondition: i, j >= 0 and i + j <= max_degree.
constexpr std::size_t monomial_index(int i, int j) {
  const int degree = i + j;
  if (degree == 0) return 0;
  const auto before = static_cast<std::size_t>(coefficient_count(degree - 1));
  if (j == 0) return before + static_cast<std::size_t>(degree) - 1;
  if (i == 0) return before + static_cast<std::size_t>(degree);
  return before + static_cast<std::size_t>(j) - 1;
}

/// The coefficient_count(degree) terms in the order of eq. 2. Precondition: degree in 0..max_degree.
std::span<const Monomial> monomials(int degree);

/// All monomials of the degree at (u, v), in order. `out` holds coefficient_count(degree) numbers.
void evaluate_monomials(int degree, double u, double v, double* out);

/// f and its derivatives at a point: 1, 1/m for the second ones.
struct HeightDerivatives {
  double value = 0;
  double dx = 0, dy = 0;
  double dxx = 0, dxy = 0, dyy = 0;
};

/// Normal curvatures in 1/m, seen from +z: a bowl (z = x^2) is positive.
struct PrincipalCurvatures {
  double minimum = 0;
  double maximum = 0;
};

class PolynomialSurface {
 public:
  /// The plane z = 0.
  PolynomialSurface() = default;

  /// From eq. 2's coefficients in the local frame, metres. Errors: invalid_argument for a degree
  /// outside 1..6, a wrong count or a number that is not finite.
  static Result<PolynomialSurface> from_coefficients(int degree, std::span<const double> coefficients);

  /// From coefficients in the centred and scaled variables. `box.half_extent` components must be > 0.
  static Result<PolynomialSurface> from_scaled(int degree, const Box2& box,
                                               std::span<const double> coefficients);

  int degree() const { return degree_; }
  /// The box to which the variables are scaled: that of the data of a fit.
  const Box2& box() const { return box_; }
  std::span<const double> scaled_coefficients() const {
    return {scaled_.data(), static_cast<std::size_t>(coefficient_count(degree_))};
  }
  /// a0, a1, ... in the order of eq. 2, in the frame's metres.
  std::vector<double> coefficients() const;

  double value(double x, double y) const;
  /// values[i] = f(xy[i]). Precondition: equal sizes.
  void evaluate(std::span<const Vec2> xy, std::span<double> values) const;
  HeightDerivatives derivatives(double x, double y) const;
  Vec2 gradient(double x, double y) const;
  /// Unit normal (-f_x, -f_y, 1) / |...| in the frame; z > 0.
  Vec3 normal(double x, double y) const;
  PrincipalCurvatures principal_curvatures(double x, double y) const;

  /// The point (x, y, f(x, y)), in the frame and in the world.
  Vec3 point(double x, double y) const { return {x, y, value(x, y)}; }
  Vec3 world_point(const Frame& frame, double x, double y) const { return frame.to_world(point(x, y)); }
  Vec3 world_normal(const Frame& frame, double x, double y) const {
    return frame.direction_to_world(normal(x, y));
  }

  /// The same function seen from a frame that is turned about y = 0, (x, y) -> (x, -y): what symmetry needs.
  PolynomialSurface flipped_y() const;

  bool operator==(const PolynomialSurface& other) const;

 private:
  int degree_ = min_degree;
  Box2 box_{Vec2::Zero(), Vec2::Ones()};
  std::array<double, max_coefficients> scaled_{};
};

}  // namespace handloft::geometry
