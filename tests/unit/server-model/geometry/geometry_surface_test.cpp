#include "server-model/geometry/polynomial_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

TEST(PolynomialSurface, A4_OrderOfEq2) {
  const std::array<Monomial, 6> expected{{{0, 0}, {1, 0}, {0, 1}, {1, 1}, {2, 0}, {0, 2}}};
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(monomials(2)[k].x_power, expected[k].x_power) << k;
    EXPECT_EQ(monomials(2)[k].y_power, expected[k].y_power) << k;
  }
  const std::array<Monomial, 4> cubic{{{2, 1}, {1, 2}, {3, 0}, {0, 3}}};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(monomials(3)[6 + k].x_power, cubic[k].x_power) << k;
    EXPECT_EQ(monomials(3)[6 + k].y_power, cubic[k].y_power) << k;
  }
}

TEST(PolynomialSurface, A4_ValueByHand) {
  // 1 + 2x + 3y + 4xy + 5x^2 + 6y^2 at (2, -1): 1 + 4 - 3 - 8 + 20 + 6 = 20.
  const auto surface = PolynomialSurface::from_coefficients(2, std::array{1., 2., 3., 4., 5., 6.});
  ASSERT_TRUE(surface.ok());
  EXPECT_DOUBLE_EQ(surface->value(2, -1), 20);
  EXPECT_EQ(surface->coefficients(), (std::vector{1., 2., 3., 4., 5., 6.}));
}

TEST(PolynomialSurface, A4_ScaledCoefficientsExpandToTheSameFunction) {
  std::mt19937_64 random(5);
  for (int degree = min_degree; degree <= max_degree; ++degree) {
    const PolynomialSurface scaled = test::random_surface(random, degree, {{0.03, -0.02}, {0.08, 0.05}});
    const auto expanded = PolynomialSurface::from_coefficients(degree, scaled.coefficients());
    ASSERT_TRUE(expanded.ok());
    for (int i = 0; i < 50; ++i) {
      const double x = test::uniform(random, -0.1, 0.1);
      const double y = test::uniform(random, -0.1, 0.1);
      EXPECT_NEAR(scaled.value(x, y), expanded->value(x, y), 1e-12 * (1 + std::abs(scaled.value(x, y))));
    }
  }
}

TEST(PolynomialSurface, A11_TenTimesBeyondItsDataItIsThePolynomial) {
  std::mt19937_64 random(6);
  for (int degree = min_degree; degree <= max_degree; ++degree) {
    const PolynomialSurface surface = test::random_surface(random, degree, {{0.03, -0.02}, {0.08, 0.05}});
    const std::span<const double> c = surface.scaled_coefficients();
    for (const double u : {-10.0, 10.0}) {
      for (const double v : {-10.0, 10.0}) {
        const double x = 0.03 + 0.08 * u;
        const double y = -0.02 + 0.05 * v;
        double sum = 0;  // Written out in the scaled variables.
        double summands = 0;
        for (std::size_t k = 0; k < c.size(); ++k) {
          const Monomial& term = monomials(degree)[k];
          const double summand = c[k] * std::pow(u, term.x_power) * std::pow(v, term.y_power);
          sum += summand;
          summands += std::abs(summand);
        }
        EXPECT_NEAR(surface.value(x, y), sum, 1e-13 * summands) << degree;
        EXPECT_NEAR(surface.normal(x, y).norm(), 1, 1e-15);
      }
    }
  }
}

TEST(PolynomialSurface, DerivativesConvergeWithSecondOrderDifferences) {
  std::mt19937_64 random(7);
  const PolynomialSurface f = test::random_surface(random, 5, {{0, 0}, {1, 1}}, 1.0);
  const HeightDerivatives d = f.derivatives(0.3, -0.4);
  double previous = 0;
  for (const double h : {1e-2, 5e-3, 2.5e-3}) {
    const double dx = (f.value(0.3 + h, -0.4) - f.value(0.3 - h, -0.4)) / (2 * h);
    const double dxy = (f.value(0.3 + h, -0.4 + h) - f.value(0.3 + h, -0.4 - h) - f.value(0.3 - h, -0.4 + h) +
                        f.value(0.3 - h, -0.4 - h)) /
                       (4 * h * h);
    EXPECT_NEAR(dxy, d.dxy, 200 * h * h);
    const double error = std::abs(dx - d.dx);
    if (previous > 0) {
      EXPECT_NEAR(previous / error, 4, 0.2);
    }
    previous = error;
  }
}

TEST(PolynomialSurface, PrincipalCurvaturesOfAParaboloidsApex) {
  const auto surface = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 3., -2.});
  const PrincipalCurvatures k = surface->principal_curvatures(0, 0);
  EXPECT_DOUBLE_EQ(k.maximum, 6);
  EXPECT_DOUBLE_EQ(k.minimum, -4);
}

TEST(PolynomialSurface, PrincipalCurvaturesDoNotDependOnTheFrame) {
  // A parabolic cylinder z = x^2 has curvature 2 / (1 + 4 x^2)^(3/2) across and 0 along, in any direction.
  const double c = std::cos(0.4);
  const double s = std::sin(0.4);
  const auto turned =
      PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 2 * c * s, c * c, s * s});
  const double x = 0.7;
  const PrincipalCurvatures k = turned->principal_curvatures(c * x, s * x);
  EXPECT_NEAR(k.maximum, 2 / std::pow(1 + 4 * x * x, 1.5), 1e-14);
  EXPECT_NEAR(k.minimum, 0, 1e-8);
}

TEST(PolynomialSurface, BatchIsBitwiseTheSingleValue) {
  std::mt19937_64 random(8);
  const PolynomialSurface f = test::random_surface(random, 3, {{0, 0}, {1, 1}});
  std::vector<Vec2> xy;
  for (int i = 0; i < 33; ++i) xy.emplace_back(test::uniform(random, -1, 1), test::uniform(random, -1, 1));
  std::vector<double> values(xy.size());
  f.evaluate(xy, values);
  for (std::size_t i = 0; i < xy.size(); ++i) EXPECT_EQ(values[i], f.value(xy[i].x(), xy[i].y()));
}

TEST(PolynomialSurface, BadInputIsRefusedWithItsField) {
  EXPECT_EQ(PolynomialSurface::from_coefficients(0, std::array{1.}).error().field, "degree");
  EXPECT_EQ(PolynomialSurface::from_coefficients(7, std::vector<double>(36)).error().field, "degree");
  EXPECT_EQ(PolynomialSurface::from_coefficients(2, std::array{1., 2.}).error().field, "coefficients");
  std::array<double, 3> c{1, std::numeric_limits<double>::infinity(), 0};
  EXPECT_EQ(PolynomialSurface::from_coefficients(1, c).error().field, "coefficients[1]");
  EXPECT_EQ(PolynomialSurface::from_scaled(1, {{0, 0}, {0, 1}}, std::array{0., 0., 0.}).error().field, "box");
}

}  // namespace
}  // namespace handloft::geometry
