// A6's accuracy check against NIST's reference data. Ours works in centred and scaled variables; the raw
// coefficients are got by the exact expansion that coefficients() makes, too.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "nist_data.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/row_qr.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

using test::digits;

constexpr int wampler_degree = 5;

/// A polynomial in one variable, embedded in two: each observation is repeated at `degree + 1` values of y,
/// on which the solution must not depend.
std::vector<WeightedPoint> wampler_points(const std::vector<double>& y) {
  std::vector<WeightedPoint> points;
  for (int row = 0; row <= wampler_degree; ++row) {
    for (std::size_t i = 0; i < y.size(); ++i) {
      points.push_back({{static_cast<double>(i), static_cast<double>(row), y[i]}, 1.0});
    }
  }
  return points;
}

/// Digits of the worst raw coefficient.
double wampler_digits(const std::vector<double>& y, const std::vector<double>& expected) {
  constexpr int degree = wampler_degree;
  const Result<PolynomialFit> fit = fit_polynomial_surface(wampler_points(y), {.degree = degree});
  if (!fit.ok() || fit->degree_reduced()) return 0;
  const std::vector<double> c = fit->surface.coefficients();
  double worst = 16;
  for (std::size_t k = 0; k < c.size(); ++k) {
    const Monomial term = monomials(degree)[k];
    if (term.y_power == 0)
      worst = std::min(worst, digits(c[k], expected[static_cast<std::size_t>(term.x_power)]));
  }
  return worst;
}

TEST(NistAccuracy, A6_Wampler1To9Digits) {
  std::vector<double> y;
  for (int x = 0; x <= 20; ++x) y.push_back(1 + x * (1 + x * (1 + x * (1 + x * (1.0 + x)))));
  EXPECT_GE(wampler_digits(y, {1, 1, 1, 1, 1, 1}), 9);
}

TEST(NistAccuracy, A6_Wampler2To12Digits) {
  std::vector<double> y;
  for (int i = 0; i <= 20; ++i) {
    const double x = 0.1 * i;
    y.push_back(1 + x * (1 + x * (1 + x * (1 + x * (1.0 + x)))));
  }
  EXPECT_GE(wampler_digits(y, {1, 0.1, 0.01, 0.001, 0.0001, 0.00001}), 12);
}

TEST(NistAccuracy, A6_Wampler5To7Digits) {
  EXPECT_GE(wampler_digits({nist::wampler5_y.begin(), nist::wampler5_y.end()}, {1, 1, 1, 1, 1, 1}), 7);
}

TEST(NistAccuracy, A6_Wampler5To12DigitsOfTheResidualSum) {
  const std::vector<double> y(nist::wampler5_y.begin(), nist::wampler5_y.end());
  const auto fit = fit_polynomial_surface(wampler_points(y), {.degree = wampler_degree});
  ASSERT_TRUE(fit.ok());
  // The statistics' mean square is that of the 21 observations, each of them there as often.
  const double sum = fit->statistics.rms * fit->statistics.rms * static_cast<double>(y.size());
  EXPECT_GE(digits(sum, nist::wampler5_residual_sum_of_squares), 12);
}

TEST(NistAccuracy, A6_LongleyTo12Digits) {
  RowQr qr(7);
  Eigen::MatrixXd rows(16, 8);
  for (Eigen::Index i = 0; i < 16; ++i) {
    const auto& source = nist::longley[static_cast<std::size_t>(i)];
    rows(i, 0) = 1;
    for (Eigen::Index k = 1; k < 7; ++k) rows(i, k) = source[static_cast<std::size_t>(k)];
    rows(i, 7) = source[0];
  }
  Eigen::MatrixXd workspace = rows;
  qr.append(workspace);
  const Eigen::VectorXd c = qr.solve(7);
  for (Eigen::Index k = 0; k < 7; ++k) {
    EXPECT_GE(digits(c[k], nist::longley_coefficients[static_cast<std::size_t>(k)]), 12) << "b" << k;
  }
  const double sum = (rows.leftCols(7) * c - rows.col(7)).squaredNorm();
  EXPECT_GE(digits(sum, nist::longley_residual_sum_of_squares), 12);
}

/// Filip's degree, 10, is beyond our surfaces': it tests the solver that they use.
class Filip : public ::testing::Test {
 protected:
  static constexpr Eigen::Index filip_terms = 11;
  static constexpr Eigen::Index filip_rows = 82;

  /// [1, u, ..., u^10 | y] with u = (x - centre) / scale.
  static Eigen::MatrixXd design(double centre, double scale) {
    Eigen::MatrixXd rows(filip_rows, filip_terms + 1);
    for (Eigen::Index i = 0; i < filip_rows; ++i) {
      const double u = (nist::filip_x[static_cast<std::size_t>(i)] - centre) / scale;
      double power = 1;
      for (Eigen::Index k = 0; k < filip_terms; ++k, power *= u) rows(i, k) = power;
      rows(i, filip_terms) = nist::filip_y[static_cast<std::size_t>(i)];
    }
    return rows;
  }

  static double residual_sum(const Eigen::MatrixXd& rows, const Eigen::VectorXd& c) {
    return (rows.leftCols(filip_terms) * c - rows.col(filip_terms)).squaredNorm();
  }
};

TEST_F(Filip, A6_CentredAndScaledQrTo12DigitsOfTheResidualSum) {
  const auto [low, high] = std::minmax_element(nist::filip_x.begin(), nist::filip_x.end());
  const Eigen::MatrixXd rows = design((*low + *high) / 2, (*high - *low) / 2);
  RowQr qr(filip_terms);
  Eigen::MatrixXd workspace = rows;
  qr.append(workspace);
  EXPECT_GE(digits(residual_sum(rows, qr.solve(filip_terms)), nist::filip_residual_sum_of_squares), 12);
}

TEST_F(Filip, A6_CentredAndScaledQrTo13DigitsOfTheRawCoefficients) {
  const auto [low, high] = std::minmax_element(nist::filip_x.begin(), nist::filip_x.end());
  const double centre = (*low + *high) / 2;
  const double scale = (*high - *low) / 2;
  Eigen::MatrixXd rows = design(centre, scale);
  RowQr qr(filip_terms);
  qr.append(rows);
  const Eigen::VectorXd scaled = qr.solve(filip_terms);
  // ((x - c) / s)^k expanded by Horner's rule over polynomials, in long double: here only the solver is
  // judged.
  std::array<long double, filip_terms> raw{};
  for (Eigen::Index k = filip_terms - 1; k >= 0; --k) {
    std::array<long double, filip_terms> next{};
    for (std::size_t i = 0; i < raw.size(); ++i) {
      next[i] -= raw[i] * static_cast<long double>(centre) / static_cast<long double>(scale);
      if (i + 1 < raw.size()) next[i + 1] += raw[i] / static_cast<long double>(scale);
    }
    next[0] += static_cast<long double>(scaled[k]);
    raw = next;
  }
  for (std::size_t k = 0; k < raw.size(); ++k) {
    EXPECT_GE(digits(static_cast<double>(raw[k]), nist::filip_coefficients[k]), 13) << "b" << k;
  }
}

TEST_F(Filip, A6_RefinedTo14DigitsInCentredAndScaledVariables) {
  using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const auto [low, high] = std::minmax_element(nist::filip_x.begin(), nist::filip_x.end());
  const Eigen::MatrixXd rows = design((*low + *high) / 2, (*high - *low) / 2);
  const LongMatrix exact_rows = rows.cast<long double>();
  const Eigen::Matrix<long double, Eigen::Dynamic, 1> reference =
      Eigen::HouseholderQR<LongMatrix>(exact_rows.leftCols(filip_terms)).solve(exact_rows.col(filip_terms));
  RowQr qr(filip_terms);
  Eigen::MatrixXd workspace = rows;
  qr.append(workspace);
  Eigen::VectorXd c = qr.solve(filip_terms);
  qr.refine(rows, c);
  for (Eigen::Index k = 0; k < filip_terms; ++k) {
    EXPECT_GE(digits(c[k], static_cast<double>(reference[k])), 14) << "c" << k;
  }
}

TEST_F(Filip, A6_NegativeControl_RawNormalEquationsKeepLessThan3Digits) {
  const Eigen::MatrixXd rows = design(0, 1);
  const Eigen::MatrixXd a = rows.leftCols(filip_terms);
  const Eigen::VectorXd c = (a.transpose() * a).ldlt().solve(a.transpose() * rows.col(filip_terms));
  EXPECT_LT(digits(c[0], nist::filip_coefficients[0]), 3);
}

}  // namespace
}  // namespace handloft::geometry
