#include "server-model/geometry/bspline_refine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "bspline_samples.h"

namespace handloft::geometry {
namespace {

using samples::Kind;
using samples::Random;
using samples::Weights;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Every kind, degree 1 .. 6, rational and not.
template <typename Test>
void for_curves(const Test& test) {
  Random random(7);
  for (const Kind kind : samples::kinds) {
    for (int p = 1; p <= 6; ++p) {
      for (const Weights weights : {Weights::none, Weights::random}) {
        SCOPED_TRACE(testing::Message() << "kind " << static_cast<int>(kind) << " degree " << p << " weights "
                                        << static_cast<int>(weights));
        test(samples::random_curve(random, kind, p, weights), random);
      }
    }
  }
}

TEST(BSplineRefine, InsertedKnotsKeepACurve) {
  for_curves([](const BSplineCurve& curve, Random& random) {
    std::vector<double> added;
    for (int i = 0; i < 5; ++i) {
      added.push_back(samples::uniform(random, curve.knots.lower(), curve.knots.upper()));
    }
    if (curve.knots.degree() > 1) added.push_back(added[0]);
    const auto refined = insert_knots(curve, added);
    ASSERT_TRUE(refined.ok()) << refined.error().describe();
    EXPECT_TRUE(check(*refined).ok());
    EXPECT_EQ(refined->knots.control_count(), curve.knots.control_count() + static_cast<int>(added.size()));
    EXPECT_EQ(refined->knots.lower(), curve.knots.lower());
    EXPECT_EQ(refined->knots.upper(), curve.knots.upper());
    EXPECT_LT(samples::difference(curve, *refined), 1e-13);
  });
}

TEST(BSplineRefine, InsertedKnotIsRemovedAgain) {
  for_curves([](const BSplineCurve& curve, Random& random) {
    const double knot = samples::uniform(random, curve.knots.lower(), curve.knots.upper());
    const auto refined = insert_knots(curve, std::vector<double>{knot});
    ASSERT_TRUE(refined.ok());
    const auto back = remove_knot(*refined, knot, 1e-11);
    if (curve.knots.is_periodic() && curve.knots.control_count() <= curve.knots.degree()) {
      ASSERT_FALSE(back.ok());
      EXPECT_EQ(back.error().code, ErrorCode::failed_precondition);
      return;
    }
    ASSERT_TRUE(back.ok()) << back.error().describe();
    EXPECT_EQ(back->control.size(), curve.control.size());
    EXPECT_LT(samples::difference(curve, *back), 1e-11);
  });
}

TEST(BSplineRefine, KnotThatShapesTheCurveStays) {
  // D: negative control of removal. The polygon's corner (0.5, 1) cannot be spared; by 1 m it can.
  const BSplineCurve tent{
      KnotVector::open(1, {0, 0, 0.5, 1, 1}).value(), {{0, 0, 0}, {0.5, 1, 0}, {1, 0, 0}}, {}};
  const auto kept = remove_knot(tent, 0.5, 0.9);
  ASSERT_FALSE(kept.ok());
  EXPECT_EQ(kept.error().code, ErrorCode::failed_precondition);
  const auto removed = remove_knot(tent, 0.5, 1.0 + 1e-12);
  ASSERT_TRUE(removed.ok());
  EXPECT_NEAR(samples::difference(tent, *removed), 1.0, 1e-12);
}

TEST(BSplineRefine, ElevatedDegreeKeepsACurve) {
  for_curves([](const BSplineCurve& curve, Random&) {
    const auto raised = elevate_degree(curve, 2);
    ASSERT_TRUE(raised.ok()) << raised.error().describe();
    EXPECT_TRUE(check(*raised).ok());
    EXPECT_EQ(raised->knots.degree(), curve.knots.degree() + 2);
    EXPECT_EQ(raised->knots.is_periodic(), curve.knots.is_periodic());
    EXPECT_LT(samples::difference(curve, *raised), 1e-12);
    // Continuity is kept: every knot two times more.
    for (const int s : curve.knots.spans()) {
      const double knot = curve.knots.knots()[static_cast<std::size_t>(s)];
      if (knot == curve.knots.lower()) continue;
      EXPECT_EQ(raised->knots.multiplicity(knot), curve.knots.multiplicity(knot) + 2);
    }
  });
}

TEST(BSplineRefine, PartsOfACurveAreTheCurve) {
  for_curves([](const BSplineCurve& curve, Random& random) {
    const double at = samples::uniform(random, curve.knots.lower(), curve.knots.upper());
    const auto parts = split(curve, at);
    ASSERT_TRUE(parts.ok()) << parts.error().describe();
    if (curve.knots.is_periodic()) {
      ASSERT_EQ(parts->size(), 1U);
      EXPECT_LT(samples::difference(parts->front(), curve), 1e-13);
      EXPECT_LT((parts->front().control.front() - parts->front().control.back()).norm(), 1e-14);
    } else {
      ASSERT_EQ(parts->size(), 2U);
      EXPECT_EQ((*parts)[0].control.back(), (*parts)[1].control.front());
      for (const BSplineCurve& part : *parts) EXPECT_LT(samples::difference(part, curve), 1e-13);
    }
  });
}

TEST(BSplineRefine, ClampedCurveIsTheCurve) {
  for_curves([](const BSplineCurve& curve, Random&) {
    const BSplineCurve open = clamped(curve);
    EXPECT_FALSE(open.knots.is_periodic());
    EXPECT_EQ(open.knots.multiplicity(open.knots.lower()), curve.knots.degree() + 1);
    EXPECT_EQ(open.knots.multiplicity(open.knots.upper()), curve.knots.degree() + 1);
    for (const double u : samples::parameters(curve.knots, 40)) {
      EXPECT_LT((open.evaluate(u) - curve.evaluate(u)).norm(), 1e-13);
    }
    EXPECT_LT((open.control.front() - curve.evaluate(curve.knots.lower())).norm(), 1e-13);
  });
}

}  // namespace
}  // namespace handloft::geometry
