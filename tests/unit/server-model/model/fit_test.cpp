// Fit and RefitPlane: A5 (frozen frame), A6, A7, A9, A10, A28.

#include <numbers>

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

TEST(Fit, A6RecoversTheSaddleThatThePointsLieOn) {
  const Document document = applied({}, {create("top"), add("top", saddle_points()), fit("top")});
  const DualPtr shape = document.find_dual("top");
  ASSERT_TRUE(shape->fitted());
  const FittedSurface& fitted = *shape->fit;
  EXPECT_EQ(fitted.surface.degree(), 2);
  EXPECT_FALSE(shape->stale);
  EXPECT_EQ(fitted.residuals_m.size(), 30U);
  EXPECT_EQ(fitted.statistics.count, 30U);
  // The grid is symmetric, so the frame is the world's, moved to the centroid, and f is the saddle itself.
  EXPECT_LT(fitted.statistics.max, 1e-15);
  for (const double x : {-0.02, 0.0, 0.015}) {
    for (const double y : {-0.01, 0.0, 0.02}) {
      const geometry::Vec3 local = fitted.frame.to_local({x, y, 0.01 + 2 * x * x - y * y});
      EXPECT_NEAR(fitted.surface.value(local.x(), local.y()), local.z(), 1e-15);
    }
  }
}

TEST(Fit, A22BoxIsTheFootprint) {
  const Document document = applied({}, {create("top"), add("top", saddle_points()), fit("top")});
  const geometry::Box2 box = document.find_dual("top")->fit->box;
  EXPECT_NEAR(box.half_extent.x(), 0.025, 1e-15);
  EXPECT_NEAR(box.half_extent.y(), 0.02, 1e-15);
}

TEST(Fit, A5A10KeepsTheFrameOfTheFirstFit) {
  Document document = applied({}, {create("top"), add("top", saddle_points()), fit("top")});
  const geometry::Frame first = document.find_dual("top")->fit->frame;
  std::vector<v1::Point> slope;
  for (int i = 1; i < 20; ++i) slope.push_back(point(0.025 + 0.01 * i, 0.003 * (i % 3), 0.01 * i));
  document = applied(document, {add("top", slope), fit("top")});
  EXPECT_EQ(document.find_dual("top")->fit->frame.rotation, first.rotation);
  EXPECT_EQ(document.find_dual("top")->fit->frame.origin, first.origin);
  EXPECT_EQ(document.find_dual("top")->fit->residuals_m.size(), 49U);
}

TEST(Fit, A10WarnsWhenThePointsLeaveThePlaneAndRefitPlaneHelps) {
  Document document = applied({}, {create("top"), add("top", saddle_points()), fit("top")});
  std::vector<v1::Point> slope;
  for (int i = 1; i < 60; ++i) slope.push_back(point(0.025 + 0.01 * i, 0.05 * (i % 5 - 2), 0.01 * i));
  document = applied(document, {add("top", slope)});
  const auto refitted = apply(document, fit("top"));
  ASSERT_TRUE(refitted.ok());
  const double drift = refitted->document.find_dual("top")->fit->frame_drift_rad;
  EXPECT_GT(drift, 20 * std::numbers::pi / 180);
  EXPECT_LT(drift, 50 * std::numbers::pi / 180);
  ASSERT_EQ(refitted->notes.size(), 1U);
  EXPECT_NE(refitted->notes[0].find("refit_plane"), std::string::npos);

  const geometry::Vec3 old_normal = refitted->document.find_dual("top")->fit->frame.normal();
  const auto renewed = apply(refitted->document, refit_plane("top"));
  ASSERT_TRUE(renewed.ok());
  EXPECT_TRUE(renewed->notes.empty());
  const FittedSurface& fresh = *renewed->document.find_dual("top")->fit;
  EXPECT_EQ(fresh.frame_drift_rad, 0.0);
  EXPECT_GT(fresh.frame.normal().dot(old_normal), 0.0);  // A5: less than 90 degrees from the former one.
}

TEST(Fit, A7LowersTheDegreeAndSaysSo) {
  // Four points carry a plane, not a quadric.
  const Document document = applied(
      {},
      {create("top"), add("top", {point(0, 0, 0), point(1, 0, 0), point(0, 0.5, 0), point(1, 0.5, 0.1)})});
  const auto result = apply(document, fit("top"));
  ASSERT_TRUE(result.ok()) << result.error().describe();
  EXPECT_EQ(result->document.find_dual("top")->fit->surface.degree(), 1);
  EXPECT_EQ(result->document.find_dual("top")->fit->requested_degree, 2U);
  ASSERT_EQ(result->notes.size(), 1U);
  EXPECT_NE(result->notes[0].find("degree 1"), std::string::npos);
}

TEST(Fit, A7RefusesWhatCarriesNoPlane) {
  const Document empty = applied({}, {create("top")});
  expect_refused(empty, fit("top"), ErrorCode::rank_deficient, "fit.entity");
  expect_refused(empty, refit_plane("top"), ErrorCode::rank_deficient, "refit_plane.entity");
  std::vector<v1::Point> line;
  std::vector<v1::Point> weightless = saddle_points();
  for (int i = 0; i < 100; ++i) line.push_back(point(0.01 * i, 0, 0));
  for (auto& one : weightless) one.set_pressure(0);
  const std::vector<v1::Point> same(100, point(0.1, 0.2, 0.3));
  for (const auto& points : {line, weightless, same}) {
    expect_refused(applied(empty, {add("top", points)}), fit("top"), ErrorCode::rank_deficient, "fit.entity");
  }
}

TEST(Fit, AFailedFitKeepsTheFormerSurface) {
  Document document = applied({}, {create("top"), add("top", saddle_points()), fit("top")});
  expect_refused(document, fit("top", 7), ErrorCode::invalid_argument, "fit.degree");
  expect_refused(document, fit("side"), ErrorCode::not_found, "fit.entity");
}

TEST(Fit, DegreeZeroKeepsTheDegree) {
  Document document = applied({}, {create("top", 3), add("top", saddle_points()), fit("top")});
  EXPECT_EQ(document.find_dual("top")->fit->surface.degree(), 3);
  document = applied(document, {fit("top", 1)});
  EXPECT_EQ(document.find_dual("top")->fit->surface.degree(), 1);
  EXPECT_GT(document.find_dual("top")->fit->statistics.rms, 1e-6);
  document = applied(document, {fit("top")});
  EXPECT_EQ(document.find_dual("top")->fit->surface.degree(), 1);
}

TEST(Fit, TheSamePointsAgainChangeNothing) {
  const Document document = applied({}, {create("top"), add("top", saddle_points()), fit("top")});
  EXPECT_TRUE(apply(document, fit("top"))->changes.empty());
  EXPECT_FALSE(apply(document, fit("top", 3))->changes.empty());
}

v1::Operation fit_and_show(const std::string& id, v1::Representation representation) {
  v1::Operation operation = fit(id);
  operation.mutable_fit()->set_show(representation);
  return operation;
}

TEST(Fit, ShowSaysWhatIsSeenAfterwards) {
  const Document before = applied({}, {create("top"), add("top", saddle_points())});
  const auto seen = [&](v1::Representation representation) {
    return applied(before, {fit_and_show("top", representation)}).find_dual("top")->representation;
  };
  EXPECT_EQ(seen(v1::REPRESENTATION_UNSPECIFIED), Representation::both);
  EXPECT_EQ(seen(v1::REPRESENTATION_POINTS), Representation::points);
  EXPECT_EQ(seen(v1::REPRESENTATION_SURFACE), Representation::surface);
  EXPECT_EQ(seen(v1::REPRESENTATION_BOTH), Representation::both);
  expect_refused(before, fit_and_show("top", static_cast<v1::Representation>(9)), ErrorCode::invalid_argument,
                 "fit.show");
  // Replaying what was recorded gives the same.
  const auto result = apply(before, fit_and_show("top", v1::REPRESENTATION_SURFACE));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(document_hash(applied(before, {result->effective})), document_hash(result->document));
}

TEST(Fit, ShowHoldsForAShapeThatIsFittedAlready) {
  const Document fitted = applied({}, {create("top"), add("top", saddle_points()), fit("top")});
  const Document shown = applied(fitted, {fit_and_show("top", v1::REPRESENTATION_SURFACE)});
  EXPECT_EQ(shown.find_dual("top")->representation, Representation::surface);
  EXPECT_EQ(shown.find_dual("top")->fit, fitted.find_dual("top")->fit) << "not fitted again";
}

TEST(Fit, A12ShowHoldsForThePartner) {
  const Document document =
      applied({}, {create("side"), symmetry("side", v1::SetSymmetry::PARTNER, 0.1),
                   add("side", saddle_points()), fit_and_show("side", v1::REPRESENTATION_SURFACE)});
  const std::string partner = document.find_dual("side")->partner;
  ASSERT_TRUE(document.find_dual(partner));
  EXPECT_EQ(document.find_dual(partner)->representation, Representation::surface);
}

TEST(Fit, A28PointsStayAsTheyAre) {
  const Document before = applied({}, {create("top"), add("top", saddle_points())});
  const Document after = applied(before, {fit("top")});
  EXPECT_TRUE(after.find_dual("top")->points.shares_all_with(before.find_dual("top")->points));
}

TEST(Fit, ThePressureIsTheWeight) {
  // A6: two heights over the same footprint, weights 1 and 3: f lies at a quarter from the heavy one.
  std::vector<v1::Point> points;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 3; ++j) {
      points.push_back(point(0.02 * i, 0.01 * j, 0.0, 0.25));
      points.push_back(point(0.02 * i, 0.01 * j, 0.004, 0.75));
    }
  }
  const Document document = applied({}, {create("top", 1), add("top", points), fit("top")});
  const FittedSurface& fitted = *document.find_dual("top")->fit;
  const geometry::Vec3 local = fitted.frame.to_local({0.02, 0.01, 0.003});
  EXPECT_NEAR(fitted.surface.value(local.x(), local.y()), local.z(), 1e-15);
}

}  // namespace
}  // namespace handloft::model
