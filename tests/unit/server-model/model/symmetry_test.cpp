// A12: symmetry in one shape and with a linked partner.

#include "server-model/geometry/symmetry.h"

#include <Eigen/Dense>

#include <limits>

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

const geometry::Plane oblique{{0.01, -0.02, 0.03}, geometry::Vec3(1, 2, -2) / 3.0};

v1::Operation oblique_symmetry(const std::string& id, v1::SetSymmetry::Mode mode) {
  v1::Operation operation = symmetry(id, mode);
  auto& plane = *operation.mutable_set_symmetry()->mutable_plane();
  plane.mutable_origin()->set_x(0.01);
  plane.mutable_origin()->set_y(-0.02);
  plane.mutable_origin()->set_z(0.03);
  plane.mutable_normal()->set_x(1);
  plane.mutable_normal()->set_y(2);
  plane.mutable_normal()->set_z(-2);
  return operation;
}

TEST(Symmetry, A12SameShapeLaysEachPointsImageBesideIt) {
  const Document document = applied({}, {create("top"), symmetry("top", v1::SetSymmetry::SAME_SHAPE, 1.0),
                                         add("top", {point(0.25, 2, 3, 0.5), point(0.5, 4, 5)})});
  const DualPtr shape = document.find_dual("top");
  ASSERT_EQ(shape->points.size(), 4U);
  // The plane x = 1: (0.25, 2, 3) -> (1.75, 2, 3).
  EXPECT_EQ(shape->points[1].position(), geometry::Vec3(1.75, 2, 3));
  EXPECT_EQ(shape->points[3].position(), geometry::Vec3(1.5, 4, 5));
  EXPECT_EQ(shape->points[1].pressure, 0.5);
  for (const std::size_t i : {0U, 1U, 2U, 3U}) EXPECT_EQ(shape->mirror_partner(i), i ^ 1U);
  // A stroke and its image are two strokes, each a line of its own.
  EXPECT_EQ(shape->points[0].stroke, 1U);
  EXPECT_EQ(shape->points[1].stroke, 2U);
  EXPECT_EQ(shape->points[2].stroke, 1U);
  EXPECT_EQ(shape->points[3].stroke, 2U);
  EXPECT_EQ(shape->stroke_count, 2U);
}

TEST(Symmetry, AContinuedStrokeContinuesItsImage) {
  const Document document =
      applied({}, {create("top"), symmetry("top", v1::SetSymmetry::SAME_SHAPE), add("top", {point(1, 0, 0)}),
                   add("top", {point(2, 0, 0)}), add("top", {point(1, 1, 0)}, 1)});
  const DualPtr shape = document.find_dual("top");
  ASSERT_EQ(shape->points.size(), 6U);
  EXPECT_EQ(shape->points[4].stroke, 1U);
  EXPECT_EQ(shape->points[5].stroke, 2U);
  EXPECT_EQ(shape->stroke_count, 4U);
}

TEST(Symmetry, A12TheSurfaceIsItsOwnMirrorImage) {
  // One half of a saddle off the plane, mirrored: f at a place and at its image agree.
  const Document document =
      applied({}, {create("top", 3), oblique_symmetry("top", v1::SetSymmetry::SAME_SHAPE),
                   add("top", saddle_points(0.01)), fit("top")});
  const FittedSurface& fitted = *document.find_dual("top")->fit;
  for (double x = -0.05; x <= 0.05; x += 0.01) {
    for (double y = -0.05; y <= 0.05; y += 0.01) {
      const geometry::Vec3 image =
          geometry::reflect_point(fitted.surface.world_point(fitted.frame, x, y), oblique);
      const geometry::Vec3 local = fitted.frame.to_local(image);
      EXPECT_NEAR(fitted.surface.value(local.x(), local.y()), local.z(), 1e-12);
    }
  }
}

TEST(Symmetry, A12ThePartnerAppearsWithTheFirstPoints) {
  const Document before = applied({}, {create("side"), symmetry("side", v1::SetSymmetry::PARTNER)});
  EXPECT_EQ(before.entities.size(), 1U);
  const auto result = apply(before, add("side", saddle_points(0.01)));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->changes.created, std::vector<std::string>{"side-mirror"});
  EXPECT_EQ(result->changes.changed, std::vector<std::string>{"side"});
  const DualPtr side = result->document.find_dual("side");
  const DualPtr mirror = result->document.find_dual("side-mirror");
  EXPECT_EQ(side->partner, "side-mirror");
  EXPECT_EQ(mirror->partner, "side");
  EXPECT_EQ(mirror->symmetry, SymmetryMode::partner);
  ASSERT_EQ(mirror->points.size(), side->points.size());
  for (std::size_t i = 0; i < side->points.size(); ++i) {
    EXPECT_EQ(mirror->points[i].x, -side->points[i].x);
    EXPECT_EQ(mirror->points[i].y, side->points[i].y);
    EXPECT_EQ(mirror->points[i].pressure, side->points[i].pressure);
    EXPECT_EQ(side->mirror_partner(i), i);
    EXPECT_EQ(mirror->mirror_partner(i), i);
  }
}

TEST(Symmetry, A12FitsOfBothSidesAreMirrorImages) {
  for (const char* fitted_one : {"side", "side-mirror"}) {
    const Document document =
        applied({}, {create("side", 3), oblique_symmetry("side", v1::SetSymmetry::PARTNER),
                     add("side", saddle_points(0.01)), fit(fitted_one)});
    const FittedSurface& a = *document.find_dual("side")->fit;
    const FittedSurface& b = *document.find_dual("side-mirror")->fit;
    EXPECT_NEAR(b.frame.rotation.determinant(), 1.0, 1e-14);  // Right-handed, though mirrored.
    EXPECT_EQ(a.statistics.rms, b.statistics.rms);
    EXPECT_EQ(a.residuals_m, b.residuals_m);
    for (double x = -0.05; x <= 0.05; x += 0.01) {
      const geometry::Vec3 image =
          geometry::reflect_point(a.surface.world_point(a.frame, x, 0.5 * x), oblique);
      const geometry::Vec3 local = b.frame.to_local(image);
      EXPECT_NEAR(b.surface.value(local.x(), local.y()), local.z(), 1e-12);
    }
    // Its own points' fit gives the same surface: the image is no shortcut with another result.
    const Document released = applied(document, {symmetry("side", v1::SetSymmetry::OFF),
                                                 add("side-mirror", {}), refit_plane("side-mirror")});
    const FittedSurface& own = *released.find_dual("side-mirror")->fit;
    for (double x = -0.02; x <= 0.02; x += 0.01) {
      const geometry::Vec3 local = own.frame.to_local(b.surface.world_point(b.frame, x, -x));
      EXPECT_NEAR(own.surface.value(local.x(), local.y()), local.z(), 1e-12);
    }
  }
}

TEST(Symmetry, A12EditsOfEitherSideReachTheOther) {
  Document document = applied(
      {}, {create("side"), symmetry("side", v1::SetSymmetry::PARTNER), add("side", saddle_points(0.01)),
           fit("side"), superellipse("side-mirror", 3), represent("side", v1::REPRESENTATION_SURFACE)});
  for (const char* id : {"side", "side-mirror"}) {
    EXPECT_EQ(document.find_dual(id)->superellipse_exponent, 3.0);
    EXPECT_EQ(document.find_dual(id)->representation, Representation::surface);
  }
  document = applied(document, {add("side-mirror", {point(-0.1, 0, 0.02)})});
  EXPECT_EQ(document.find_dual("side")->points.back().position(), geometry::Vec3(0.1, 0, 0.02));
  EXPECT_TRUE(document.find_dual("side")->stale);
  EXPECT_TRUE(document.find_dual("side-mirror")->stale);
  EXPECT_EQ(document.find_dual("side")->mirror_partner(30), 30U);
}

TEST(Symmetry, TheFrozenPlaneOfThePartnerStaysToTheBit) {
  Document document = applied({}, {create("side"), oblique_symmetry("side", v1::SetSymmetry::PARTNER),
                                   add("side", saddle_points(0.01)), fit("side")});
  const geometry::Frame a = document.find_dual("side")->fit->frame;
  const geometry::Frame b = document.find_dual("side-mirror")->fit->frame;
  for (const char* id : {"side-mirror", "side", "side-mirror"}) {
    document = applied(document, {add(id, {point(0.02, 0.01, 0.011)}), fit(id)});
  }
  EXPECT_EQ(document.find_dual("side")->fit->frame.rotation, a.rotation);
  EXPECT_EQ(document.find_dual("side-mirror")->fit->frame.rotation, b.rotation);
}

TEST(Symmetry, A12OffReleasesThePartnerAsItIs) {
  const Document linked = applied({}, {create("side"), symmetry("side", v1::SetSymmetry::PARTNER),
                                       add("side", saddle_points(0.01)), fit("side")});
  for (const char* id : {"side", "side-mirror"}) {
    Document document = applied(linked, {symmetry(id, v1::SetSymmetry::OFF)});
    for (const char* one : {"side", "side-mirror"}) {
      const DualPtr shape = document.find_dual(one);
      EXPECT_EQ(shape->symmetry, SymmetryMode::off);
      EXPECT_EQ(shape->partner, "");
      EXPECT_EQ(shape->mirror_partner(0), DualPoint::no_partner);
      EXPECT_EQ(shape->fit, linked.find_dual(one)->fit);
      EXPECT_EQ(shape->points.size(), 30U);
    }
    document = applied(document, {add("side", {point(1, 1, 1)}), superellipse("side", 5)});
    EXPECT_EQ(document.find_dual("side-mirror")->points.size(), 30U);
    EXPECT_EQ(document.find_dual("side-mirror")->superellipse_exponent, 2.0);
  }
}

TEST(Symmetry, DeletingOneReleasesTheOther) {
  const Document document = applied({}, {create("side"), symmetry("side", v1::SetSymmetry::PARTNER),
                                         add("side", saddle_points(0.01)), remove("side")});
  const DualPtr mirror = document.find_dual("side-mirror");
  ASSERT_TRUE(mirror);
  EXPECT_EQ(mirror->symmetry, SymmetryMode::off);
  EXPECT_EQ(mirror->partner, "");
}

TEST(Symmetry, AnotherPlaneMakesAnotherPartner) {
  const Document document = applied(
      {}, {create("side"), symmetry("side", v1::SetSymmetry::PARTNER, 0.0), add("side", saddle_points(0.01)),
           symmetry("side", v1::SetSymmetry::PARTNER, 0.1), add("side", saddle_points(0.01)), fit("side")});
  const DualPtr side = document.find_dual("side");
  EXPECT_EQ(side->partner, "side-mirror-2");
  EXPECT_EQ(side->linked_from, 30U);
  EXPECT_EQ(side->mirror_partner(29), DualPoint::no_partner);
  EXPECT_EQ(side->mirror_partner(30), 0U);
  EXPECT_EQ(document.find_dual("side-mirror")->symmetry, SymmetryMode::off);
  // The new partner has only half of the points, so it is fitted by itself.
  EXPECT_EQ(document.find_dual("side-mirror-2")->points.size(), 30U);
  EXPECT_TRUE(document.find_dual("side-mirror-2")->fitted());
}

TEST(Symmetry, APartnerThatCannotBeFittedIsNoted) {
  const Document document =
      applied({}, {create("side"), add("side", saddle_points(0.01)),
                   symmetry("side", v1::SetSymmetry::PARTNER), add("side", {point(0.1, 0, 0)})});
  const auto result = apply(document, fit("side"));
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(result->document.find_dual("side")->fitted());
  EXPECT_FALSE(result->document.find_dual("side-mirror")->fitted());
  ASSERT_EQ(result->notes.size(), 1U);
}

TEST(Symmetry, TheSameAgainChangesNothing) {
  const Document document = applied({}, {create("top"), symmetry("top", v1::SetSymmetry::SAME_SHAPE)});
  EXPECT_TRUE(apply(document, symmetry("top", v1::SetSymmetry::SAME_SHAPE))->changes.empty());
  EXPECT_FALSE(apply(document, symmetry("top", v1::SetSymmetry::SAME_SHAPE, 1.0))->changes.empty());
}

TEST(Symmetry, RefusesPlanesThatAreNone) {
  const Document document = applied({}, {create("top")});
  v1::Operation operation = symmetry("top", v1::SetSymmetry::PARTNER);
  operation.mutable_set_symmetry()->mutable_plane()->mutable_normal()->set_x(0);
  expect_refused(document, operation, ErrorCode::invalid_argument, "set_symmetry.plane.normal");
  operation.mutable_set_symmetry()->mutable_plane()->mutable_normal()->set_y(
      std::numeric_limits<double>::quiet_NaN());
  expect_refused(document, operation, ErrorCode::invalid_argument, "set_symmetry.plane.normal.y");
  operation = symmetry("top", v1::SetSymmetry::PARTNER, 2e4);
  expect_refused(document, operation, ErrorCode::invalid_argument, "set_symmetry.plane.origin.x");
  operation = symmetry("top", v1::SetSymmetry::OFF);
  operation.mutable_set_symmetry()->set_mode(static_cast<v1::SetSymmetry::Mode>(9));
  expect_refused(document, operation, ErrorCode::invalid_argument, "set_symmetry.mode");
}

}  // namespace
}  // namespace handloft::model
