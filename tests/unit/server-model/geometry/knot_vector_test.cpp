#include "server-model/geometry/knot_vector.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "bspline_samples.h"

namespace handloft::geometry {
namespace {

using samples::Kind;
using samples::Random;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

std::vector<double> functions(const KnotVector& knots, double u, int order) {
  std::vector<double> values(static_cast<std::size_t>((order + 1) * (knots.degree() + 1)));
  const double inside = knots.wrap(u);
  basis_functions(knots, knots.span(inside), inside, order, values);
  return values;
}

TEST(KnotVector, FunctionsOfTheNurbsBook) {
  // Piegl and Tiller, Ex2.3 and Ex2.4: U = {0,0,0,1,2,3,4,4,5,5,5}, p = 2, u = 5/2.
  const auto knots = KnotVector::open(2, {0, 0, 0, 1, 2, 3, 4, 4, 5, 5, 5});
  ASSERT_TRUE(knots.ok());
  EXPECT_EQ(knots->control_count(), 8);
  EXPECT_EQ(knots->span(2.5), 4);
  const std::vector<double> values = functions(*knots, 2.5, 3);
  const std::vector<double> expected = {1.0 / 8, 6.0 / 8, 1.0 / 8, -0.5, 0, 0.5, 1, -2, 1, 0, 0, 0};
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_DOUBLE_EQ(values[i], expected[i]) << i;
}

TEST(KnotVector, SpansOfOpenOnes) {
  const auto knots = KnotVector::open(2, {0, 0, 0, 1, 2, 3, 4, 4, 5, 5, 5});
  EXPECT_EQ(knots->span(0), 2);
  EXPECT_EQ(knots->span(4), 7);
  EXPECT_EQ(knots->span(5), 7);
  EXPECT_EQ(knots->span(-3), 2);
  EXPECT_EQ(knots->span(nan), 2);
  EXPECT_EQ(knots->span(infinity), 7);
  EXPECT_EQ(knots->spans(), (std::vector<int>{2, 3, 4, 5, 7}));
  EXPECT_EQ(knots->multiplicity(4), 2);
  EXPECT_EQ(knots->multiplicity(4.5), 0);
  EXPECT_DOUBLE_EQ(knots->greville(3), 2.5);
}

TEST(KnotVector, PeriodicOnesWrap) {
  const auto knots = KnotVector::uniform_periodic(3, 8);
  ASSERT_TRUE(knots.ok());
  EXPECT_EQ(knots->control_count(), 8);
  EXPECT_EQ(knots->function_count(), 11);
  EXPECT_EQ(knots->control_of(9), 1);
  EXPECT_EQ(knots->lower(), 0);
  EXPECT_EQ(knots->upper(), 1);
  EXPECT_EQ(knots->wrap(1), 0);
  EXPECT_DOUBLE_EQ(knots->wrap(-0.25), 0.75);
  EXPECT_DOUBLE_EQ(knots->wrap(17.5), 0.5);
  EXPECT_EQ(knots->wrap(infinity), 0);
  EXPECT_EQ(knots->wrap(-1e-300), 0);  // Rounds to a whole period.
  EXPECT_EQ(knots->span(1), knots->span(0));
}

TEST(KnotVector, UniformKnots) {
  const auto knots = KnotVector::uniform(3, 6);
  const double third = 1.0 / 3;
  EXPECT_EQ(knots->knots(), (std::vector<double>{0, 0, 0, 0, third, 2 * third, 1, 1, 1, 1}));
  EXPECT_EQ(KnotVector::uniform(3, 4)->spans().size(), 1U);
}

TEST(KnotVector, FunctionsSumToOneAndTheirDerivativesToNone) {
  Random random(1);
  for (const Kind kind : samples::kinds) {
    for (const int degree : {1, 2, 3, 5, 9, 24}) {
      const KnotVector knots = samples::random_knots(random, kind, degree);
      for (const double u : samples::parameters(knots, 30)) {
        const std::vector<double> values = functions(knots, u, 2);
        const auto width = static_cast<std::ptrdiff_t>(degree + 1);
        EXPECT_NEAR(std::accumulate(values.begin(), values.begin() + width, 0.0), 1, 1e-14);
        for (std::ptrdiff_t i = 0; i < width; ++i) EXPECT_GE(values[static_cast<std::size_t>(i)], -1e-15);
        for (std::ptrdiff_t k = 1; k <= 2; ++k) {
          double scale = 1;
          for (auto v = values.begin() + k * width; v != values.begin() + (k + 1) * width; ++v) {
            scale = std::max(scale, std::abs(*v));
          }
          EXPECT_NEAR(std::accumulate(values.begin() + k * width, values.begin() + (k + 1) * width, 0.0), 0,
                      1e-13 * scale);
        }
      }
    }
  }
}

TEST(KnotVector, TablesHoldTheFunctions) {
  Random random(2);
  const KnotVector knots = samples::random_knots(random, Kind::periodic, 3);
  const std::vector<double> us = {-4, 0, 0.7, 1.9, 12.5};
  const BasisTable table = tabulate(knots, us, 2);
  ASSERT_EQ(table.size(), us.size());
  for (std::size_t i = 0; i < us.size(); ++i) {
    const std::vector<double> values = functions(knots, us[i], 2);
    EXPECT_EQ(table.first_function[i], knots.span(us[i]) - 3);
    for (int k = 0; k <= 2; ++k) {
      for (std::size_t j = 0; j < 4; ++j) {
        EXPECT_EQ(table.at(i, k)[j], values[static_cast<std::size_t>(k) * 4 + j]);
      }
    }
  }
}

TEST(KnotVector, NearlyEqualKnotsBecomeEqual) {
  const auto knots = KnotVector::open(2, {0, 0, 1e-16, 0.5, 0.5 + 1e-16, 1 - 1e-16, 1, 1});
  ASSERT_TRUE(knots.ok()) << knots.error().describe();
  EXPECT_EQ(knots->multiplicity(0), 3);
  EXPECT_EQ(knots->multiplicity(0.5), 2);
}

struct BadKnots {
  const char* name;
  int degree;
  std::vector<double> knots;
  const char* field;
};

class BadKnotVector : public testing::TestWithParam<BadKnots> {};

TEST_P(BadKnotVector, IsRefused) {
  const auto made = KnotVector::open(GetParam().degree, GetParam().knots);
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(made.error().field, GetParam().field);
}

INSTANTIATE_TEST_SUITE_P(
    KnotVector, BadKnotVector,
    testing::Values(BadKnots{"degree_0", 0, {0, 1}, "degree"}, BadKnots{"degree_25", 25, {0, 1}, "degree"},
                    BadKnots{"none", 1, {}, "knots"}, BadKnots{"too_few", 2, {0, 0, 0, 1, 1}, "knots"},
                    BadKnots{"descends", 1, {0, 0, 2, 1, 3, 3}, "knots[3]"},
                    BadKnots{"nan", 1, {0, 0, nan, 1, 1}, "knots[2]"},
                    BadKnots{"infinite", 1, {0, 0, 1, infinity}, "knots[3]"},
                    BadKnots{"no_length", 1, {2, 2, 2, 2}, "knots"},
                    BadKnots{"length_of_rounding", 1, {1e9, 1e9, 1e9 + 1e-6, 1e9 + 1e-6}, "knots"},
                    BadKnots{"end_too_often", 1, {0, 0, 0, 1, 1}, "knots"},
                    BadKnots{"torn", 2, {0, 0, 0, 1, 1, 1, 2, 2, 2}, "knots"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(KnotVector, BadPeriodsAreRefused) {
  EXPECT_TRUE(KnotVector::periodic(1, {-1, 0, 1, 2, 3}).ok());
  const auto broken = KnotVector::periodic(1, {-0.5, 0, 1, 2, 3});
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.error().field, "knots[2]");
  EXPECT_FALSE(KnotVector::periodic(1, {-1, 0, 1, 2}).ok());
  EXPECT_FALSE(KnotVector::periodic(1, {0, 0, 0, 1, 1, 1}).ok());
}

TEST(KnotVector, AbsurdSizesAreRefused) {
  for (const int n : {-1, 0, 3, KnotVector::max_control_count + 1, std::numeric_limits<int>::max()}) {
    EXPECT_FALSE(KnotVector::uniform(3, n).ok()) << n;
    EXPECT_FALSE(KnotVector::uniform_periodic(3, n).ok()) << n;
  }
}

}  // namespace
}  // namespace handloft::geometry
