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

/// All kinds in both directions, with and without weights.
template <typename Test>
void for_surfaces(const Test& test) {
  Random random(21);
  for (const Kind in_u : samples::kinds) {
    for (const Kind in_v : samples::kinds) {
      for (const Weights weights : {Weights::none, Weights::random}) {
        SCOPED_TRACE(testing::Message()
                     << static_cast<int>(in_u) << static_cast<int>(in_v) << static_cast<int>(weights));
        const int p = 1 + static_cast<int>(random() % 4);
        const int q = 1 + static_cast<int>(random() % 4);
        test(samples::random_surface(random, in_u, in_v, p, q, weights), random);
      }
    }
  }
}

const KnotVector& along(const BSplineSurface& surface, Direction direction) {
  return direction == Direction::u ? surface.u : surface.v;
}

TEST(BSplineRefine, SurfacesKeepTheirShapeThroughAll) {
  for_surfaces([](const BSplineSurface& surface, Random& random) {
    for (const Direction direction : {Direction::u, Direction::v}) {
      const KnotVector& knots = along(surface, direction);
      const double knot = samples::uniform(random, knots.lower(), knots.upper());
      const auto refined = insert_knots(surface, direction, std::vector<double>{knot});
      ASSERT_TRUE(refined.ok()) << refined.error().describe();
      EXPECT_LT(samples::difference(surface, *refined), 1e-13);
      const auto back = remove_knot(*refined, direction, knot, 1e-11);
      if (back.ok()) {
        EXPECT_LT(samples::difference(surface, *back), 1e-11);
        EXPECT_EQ(back->control.size(), surface.control.size());
      } else {
        EXPECT_TRUE(knots.is_periodic() && knots.control_count() <= knots.degree());
      }
      const auto raised = elevate_degree(surface, direction, 1);
      ASSERT_TRUE(raised.ok()) << raised.error().describe();
      EXPECT_LT(samples::difference(surface, *raised), 1e-12);
      const auto parts = split(surface, direction, knot);
      ASSERT_TRUE(parts.ok()) << parts.error().describe();
      EXPECT_EQ(parts->size(), knots.is_periodic() ? 1U : 2U);
      for (const BSplineSurface& part : *parts) EXPECT_LT(samples::difference(part, surface), 1e-13);
    }
    const BSplineSurface open = clamped(surface);
    EXPECT_FALSE(open.u.is_periodic() || open.v.is_periodic());
    EXPECT_LT((open.at(0, 0) - surface.evaluate(surface.u.lower(), surface.v.lower())).norm(), 1e-13);
    for (const double u : samples::parameters(surface.u, 9)) {
      for (const double v : samples::parameters(surface.v, 9)) {
        EXPECT_LT((open.evaluate(u, v) - surface.evaluate(u, v)).norm(), 1e-13);
      }
    }
  });
}

TEST(BSplineRefine, BezierPatchesTileTheSurface) {
  for_surfaces([](const BSplineSurface& surface, Random&) {
    const std::vector<BSplineSurface> patches = bezier_patches(surface);
    const std::size_t columns = surface.v.spans().size();
    ASSERT_EQ(patches.size(), surface.u.spans().size() * columns);
    for (std::size_t k = 0; k < patches.size(); ++k) {
      const BSplineSurface& patch = patches[k];
      EXPECT_EQ(patch.u.control_count(), surface.u.degree() + 1);
      EXPECT_EQ(patch.v.control_count(), surface.v.degree() + 1);
      for (const double s : {0.0, 0.3, 0.9}) {
        const double u = patch.u.lower() + s * patch.u.length();
        const double v = patch.v.lower() + (1 - s) * 0.99 * patch.v.length();
        EXPECT_LT((patch.evaluate(u, v) - surface.evaluate(u, v)).norm(), 1e-13);
      }
      // Neighbours share their edge to the bit.
      if ((k + 1) % columns == 0) continue;
      const BSplineSurface& next = patches[k + 1];
      for (int i = 0; i < patch.u.control_count(); ++i) {
        EXPECT_EQ(patch.at(i, patch.v.control_count() - 1), next.at(i, 0));
      }
    }
  });
}

TEST(BSplineRefine, AgreesWithOcctToTheControlPoint) {
  Random random(31);
  for (int round = 0; round < 20; ++round) {
    const BSplineSurface surface =
        samples::random_surface(random, Kind::clamped, Kind::clamped, 1 + round % 4, 3,
                                round % 2 == 0 ? Weights::none : Weights::random);
    const auto agree = [](const BSplineSurface& ours, const Handle(Geom_BSplineSurface) & theirs) {
      ASSERT_EQ(ours.u.control_count(), theirs->NbUPoles());
      ASSERT_EQ(ours.v.control_count(), theirs->NbVPoles());
      for (int i = 0; i < ours.u.control_count(); ++i) {
        for (int j = 0; j < ours.v.control_count(); ++j) {
          EXPECT_LT((ours.at(i, j) - samples::to_vec(theirs->Pole(i + 1, j + 1).XYZ())).norm(), 1e-12);
          if (ours.is_rational()) {
            EXPECT_NEAR(ours.weights[ours.index(i, j)], theirs->Weight(i + 1, j + 1), 1e-12);
          }
        }
      }
    };
    const double knot = samples::uniform(random, surface.u.lower(), surface.u.upper());
    const auto refined = insert_knots(surface, Direction::u, std::vector<double>{knot});
    const Handle(Geom_BSplineSurface) oracle = samples::to_occt(surface);
    oracle->InsertUKnot(knot, 1, 1e-15);
    ASSERT_TRUE(refined.ok());
    agree(*refined, oracle);
    // Removal, with OCCT's inserted knot.
    int index = 1;
    while (std::abs(oracle->UKnot(index) - knot) > 1e-15) ++index;
    ASSERT_TRUE(oracle->RemoveUKnot(index, 0, 1e-6));
    agree(*remove_knot(*refined, Direction::u, knot, 1e-9), oracle);
    const Handle(Geom_BSplineSurface) higher = samples::to_occt(surface);
    higher->IncreaseDegree(surface.u.degree() + 2, surface.v.degree() + 1);
    const auto raised_u = elevate_degree(surface, Direction::u, 2);
    ASSERT_TRUE(raised_u.ok());
    agree(*elevate_degree(*raised_u, Direction::v, 1), higher);
  }
}

TEST(BSplineRefine, LineElevatedByHand) {
  // Degree 1 -> 3: control points at thirds.
  const BSplineCurve line{KnotVector::uniform(1, 2).value(), {{0, 0, 0}, {3, 6, 9}}, {}};
  const auto cubic = elevate_degree(line, 2);
  ASSERT_TRUE(cubic.ok());
  ASSERT_EQ(cubic->control.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT((cubic->control[static_cast<std::size_t>(i)] - Vec3(i, 2 * i, 3 * i)).norm(), 1e-15);
  }
}

TEST(BSplineRefine, ScaledDomainIsAsLongAsTheSurface) {
  // D2. 2 m along u, 0.5 m along v; round v it is a polygon of 4 m.
  BSplineSurface plate{KnotVector::uniform(1, 3).value(), KnotVector::uniform(1, 2).value(), {}, {}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 2; ++j) plate.control.emplace_back(i, 0.5 * j, 0);
  }
  EXPECT_DOUBLE_EQ(mean_row_length(plate, Direction::u), 2);
  EXPECT_DOUBLE_EQ(mean_row_length(plate, Direction::v), 0.5);
  const BSplineSurface scaled = scaled_domain(plate);
  EXPECT_EQ(scaled.u.lower(), 0);
  EXPECT_DOUBLE_EQ(scaled.u.upper(), 2);
  EXPECT_DOUBLE_EQ(scaled.v.upper(), 0.5);
  EXPECT_LT((scaled.evaluate(1.3, 0.2) - plate.evaluate(0.65, 0.4)).norm(), 1e-15);
  EXPECT_NEAR(scaled.derivatives(0.3, 0.2, 1).su.norm(), 1, 1e-15);

  BSplineSurface tube{KnotVector::uniform_periodic(1, 4).value(), KnotVector::uniform(1, 2).value(), {}, {}};
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 2; ++j) {
      tube.control.emplace_back(i == 1 || i == 2 ? 1 : 0, i >= 2 ? 1 : 0, j);
    }
  }
  EXPECT_DOUBLE_EQ(mean_row_length(tube, Direction::u), 4);
  EXPECT_DOUBLE_EQ(scaled_domain(tube).u.length(), 4);

  BSplineSurface flat = plate;
  for (Vec3& p : flat.control) p.y() = 0;
  EXPECT_EQ(scaled_domain(flat).v, flat.v);
}

TEST(BSplineRefine, BadRequestsAreRefused) {
  const BSplineCurve circle = samples::circle();
  const auto code = [](const auto& result) {
    return result.ok() ? ErrorCode::internal : result.error().code;
  };
  constexpr auto invalid = ErrorCode::invalid_argument;
  for (const double bad : {-0.1, 1.1, nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(code(insert_knots(circle, std::vector<double>{bad})), invalid);
    EXPECT_EQ(code(remove_knot(circle, bad, 1)), invalid);
    EXPECT_EQ(code(split(circle, bad)), invalid);
  }
  EXPECT_EQ(code(insert_knots(circle, std::vector<double>{0.25})), invalid);  // A third time at degree 2.
  EXPECT_EQ(code(insert_knots(circle, std::vector<double>{0.0})), invalid);
  EXPECT_EQ(code(insert_knots(circle, std::vector<double>(1000, 0.3))), invalid);
  EXPECT_EQ(code(remove_knot(circle, 0.25, -1)), invalid);
  EXPECT_EQ(code(remove_knot(circle, 0.25, nan)), invalid);
  EXPECT_EQ(code(remove_knot(circle, 0.0, 1)), invalid);
  EXPECT_EQ(code(split(circle, 0)), invalid);
  EXPECT_EQ(code(split(circle, 1)), invalid);
  EXPECT_EQ(code(elevate_degree(circle, 0)), invalid);
  EXPECT_EQ(code(elevate_degree(circle, 23)), invalid);
  EXPECT_EQ(code(elevate_degree(circle, std::numeric_limits<int>::max())), invalid);
  BSplineCurve broken = circle;
  broken.control[2].x() = nan;
  EXPECT_EQ(code(insert_knots(broken, std::vector<double>{0.3})), invalid);
  EXPECT_EQ(code(elevate_degree(broken, 1)), invalid);
  EXPECT_EQ(code(split(broken, 0.3)), invalid);
  EXPECT_TRUE(insert_knots(circle, {}).ok());
}

TEST(BSplineRefine, UnclampedEndsCanBeClampedByInsertion) {
  Random random(41);
  const BSplineCurve curve = samples::random_curve(random, Kind::unclamped, 3, Weights::none);
  const auto refined = insert_knots(curve, std::vector<double>(3, curve.knots.lower()));
  ASSERT_TRUE(refined.ok()) << refined.error().describe();
  EXPECT_EQ(refined->control.size(), curve.control.size());
  EXPECT_LT((refined->control.front() - curve.evaluate(curve.knots.lower())).norm(), 1e-14);
  EXPECT_LT(samples::difference(curve, *refined), 1e-13);
}

TEST(BSplineRefine, HighestDegreesHold) {
  Random random(51);
  BSplineCurve curve{KnotVector::uniform(20, 21).value(), {}, {}};
  for (int i = 0; i < 21; ++i) curve.control.emplace_back(i, samples::uniform(random, -1, 1), 0);
  const auto raised = elevate_degree(curve, 4);
  ASSERT_TRUE(raised.ok());
  EXPECT_EQ(raised->knots.degree(), KnotVector::max_degree);
  EXPECT_LT(samples::difference(curve, *raised), 1e-12 * 20);
  EXPECT_FALSE(elevate_degree(*raised, 1).ok());
  const auto parts = split(*raised, 0.37);
  ASSERT_TRUE(parts.ok());
  for (const BSplineCurve& part : *parts) EXPECT_LT(samples::difference(part, curve), 1e-12 * 20);
}

}  // namespace
}  // namespace handloft::geometry
