// Moving, turning, scaling and copying whole shapes: everything goes along, so nothing needs a fit (A12,
// A28).

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "model_helpers.h"
#include "server-model/geometry/symmetry.h"

namespace handloft::model {
namespace {

using namespace test;

void write(const geometry::Vec3& from, v1::Vec3& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

struct Motion {
  geometry::Vec3 translation = geometry::Vec3::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  double scale = 1;
  geometry::Vec3 pivot = geometry::Vec3::Zero();

  geometry::Vec3 operator()(const geometry::Vec3& p) const {
    return pivot + scale * (rotation * (p - pivot)) + translation;
  }
  v1::Operation of(const std::vector<std::string>& ids) const {
    v1::Operation operation;
    auto& request = *operation.mutable_transform();
    for (const std::string& id : ids) request.add_entities(id);
    write(translation, *request.mutable_translation());
    request.mutable_rotation()->set_w(3 * rotation.w());  // Any length.
    request.mutable_rotation()->set_x(3 * rotation.x());
    request.mutable_rotation()->set_y(3 * rotation.y());
    request.mutable_rotation()->set_z(3 * rotation.z());
    request.set_scale(scale);
    write(pivot, *request.mutable_pivot());
    return operation;
  }
};

Motion any_motion(double scale) {
  return {{0.1, -0.2, 0.05},
          Eigen::Quaterniond(Eigen::AngleAxisd(1.1, geometry::Vec3(1, 2, -0.5).normalized())),
          scale,
          {0.02, 0.01, 0.3}};
}

Document fitted_saddle(v1::SetSymmetry::Mode mode = v1::SetSymmetry::OFF) {
  return applied({}, {create("a", 3), symmetry("a", mode, 0.005), add("a", saddle_points(0.01)), fit("a")});
}

geometry::Vec3 surface_point(const DualShape& shape, const geometry::Vec3& world) {
  const geometry::Vec3 local = shape.fit->frame.to_local(world);
  return shape.fit->surface.world_point(shape.fit->frame, local.x(), local.y());
}

TEST(Transform, PointsAndSurfaceGoAlongExactly) {
  const DualPtr before = fitted_saddle().find_dual("a");
  for (const double scale : {1.0, 0.01, 2.5, 100.0}) {
    const Motion motion = any_motion(scale);
    const DualPtr after = applied(fitted_saddle(), {motion.of({"a"})}).find_dual("a");
    ASSERT_EQ(after->points.size(), before->points.size());
    EXPECT_FALSE(after->stale);
    const double tolerance = 1e-15 * (1 + scale);
    for (std::size_t i = 0; i < before->points.size(); ++i) {
      const geometry::Vec3 place = before->points[i].position();
      EXPECT_LE((after->points[i].position() - motion(place)).norm(), tolerance);
      EXPECT_LE((surface_point(*after, motion(place)) - motion(surface_point(*before, place))).norm(),
                tolerance);
      EXPECT_NEAR(after->residual_m(i), scale * before->residual_m(i), 1e-18 * scale);
    }
    const geometry::Mat3& r = after->fit->frame.rotation;
    EXPECT_LE((r.transpose() * r - geometry::Mat3::Identity()).norm(), 1e-15);
    EXPECT_GT(r.determinant(), 0);
    if (scale == 1) {
      EXPECT_EQ(after->fit->surface, before->fit->surface);
    }
    // A fit of the points where they are now gives the same surface.
    Document again = applied(fitted_saddle(), {motion.of({"a"})});
    DualShape shape = *again.find_dual("a");
    shape.stale = true;
    again.entities["a"] = std::make_shared<const DualShape>(shape);
    const DualPtr refitted = applied(again, {fit("a")}).find_dual("a");
    for (const DualPoint& p : shape.points) {
      EXPECT_LE((surface_point(*refitted, p.position()) - surface_point(shape, p.position())).norm(),
                1e-14 * (1 + scale));
    }
  }
}

TEST(Transform, ThereAndBackIsWhereItWas) {
  const Document start = fitted_saddle();
  Document document = start;
  const Motion there = any_motion(1);
  Motion back = there;
  back.rotation = there.rotation.conjugate();
  back.translation = -there.translation;
  back.pivot = there.pivot + there.translation;
  for (int i = 0; i < 50; ++i) document = applied(document, {there.of({"a"}), back.of({"a"})});
  const DualPtr before = start.find_dual("a");
  const DualPtr after = document.find_dual("a");
  for (std::size_t i = 0; i < before->points.size(); ++i) {
    EXPECT_LE((after->points[i].position() - before->points[i].position()).norm(), 1e-14);
  }
  EXPECT_LE((after->fit->frame.rotation - before->fit->frame.rotation).norm(), 1e-14);
}

TEST(Transform, WithoutAPivotItTurnsAboutTheCentre) {
  v1::Operation turn;
  turn.mutable_transform()->add_entities("a");
  turn.mutable_transform()->mutable_rotation()->set_z(1);  // 180 degrees about z.
  const auto result =
      apply(applied({}, {create("a"), add("a", {point(0.1, 0, 0), point(0.3, 0.2, 0.4)})}), turn);
  ASSERT_TRUE(result.ok());
  const DualPtr shape = result->document.find_dual("a");
  EXPECT_NEAR(shape->points[0].x, 0.3, 1e-15);
  EXPECT_NEAR(shape->points[0].y, 0.2, 1e-15);
  EXPECT_NEAR(shape->points[1].z, 0.4, 1e-15);
  EXPECT_NEAR(result->effective.transform().pivot().y(), 0.1, 1e-15);
  EXPECT_EQ(result->effective.transform().scale(), 1);
}

TEST(Transform, TheBoundaryCurveGoesAlong) {
  v1::Operation trim;
  trim.mutable_set_boundary()->set_entity("a");
  for (int i = 0; i < 24; ++i) {
    const double angle = 2 * M_PI * i / 24;
    write({0.035 + 0.02 * std::cos(angle), 0.015 * std::sin(angle), 0.01},
          *trim.mutable_set_boundary()->add_curve());
  }
  const Document before = applied(fitted_saddle(), {trim});
  const Motion motion = any_motion(2);
  const DualPtr after = applied(before, {motion.of({"a"})}).find_dual("a");
  ASSERT_TRUE(after->boundary != nullptr);
  const auto& curve = before.find_dual("a")->boundary->points();
  for (std::size_t i = 0; i < curve.size(); ++i) {
    EXPECT_LE((after->boundary->points()[i] - motion(curve[i])).norm(), 1e-15);
  }
  EXPECT_TRUE(after->trim().ok());
}

TEST(Transform, A12ASymmetricShapeTakesItsPlaneAlong) {
  const Document before = fitted_saddle(v1::SetSymmetry::SAME_SHAPE);
  const DualPtr after = applied(before, {any_motion(2).of({"a"})}).find_dual("a");
  EXPECT_NE(after->plane.normal, before.find_dual("a")->plane.normal);
  for (std::size_t i = 0; i < after->points.size(); ++i) {
    const geometry::Vec3 image = after->points[after->mirror_partner(i)].position();
    EXPECT_LE((geometry::reflect_point(after->points[i].position(), after->plane) - image).norm(), 1e-15);
  }
}

void expect_mirror_images(const Document& document, double tolerance) {
  const DualPtr shape = document.find_dual("a");
  const DualPtr partner = document.find_dual("a-mirror");
  ASSERT_TRUE(shape && partner);
  EXPECT_EQ(shape->plane.origin, partner->plane.origin);
  EXPECT_EQ(shape->plane.normal, partner->plane.normal);
  for (std::size_t i = 0; i < shape->points.size(); ++i) {
    const geometry::Vec3 place = shape->points[i].position();
    const geometry::Vec3 image = partner->points[shape->mirror_partner(i)].position();
    EXPECT_LE((geometry::reflect_point(place, shape->plane) - image).norm(), tolerance);
    EXPECT_LE(
        (geometry::reflect_point(surface_point(*shape, place), shape->plane) - surface_point(*partner, image))
            .norm(),
        tolerance);
  }
}

TEST(Transform, A12AnUnnamedPartnerMovesAsTheMirrorImage) {
  const Document before = fitted_saddle(v1::SetSymmetry::PARTNER);
  const Document after = applied(before, {any_motion(1.5).of({"a"})});
  EXPECT_EQ(after.find_dual("a")->plane.origin, before.find_dual("a")->plane.origin);
  expect_mirror_images(after, 1e-14);
  // From the other side it is the same.
  expect_mirror_images(applied(before, {any_motion(0.5).of({"a-mirror"})}), 1e-14);
  // And fits of both sides stay mirror images, now that they lie elsewhere.
  v1::Operation more = add("a", saddle_points(0.02));
  more.mutable_add_points()->set_refit(true);
  expect_mirror_images(applied(after, {more}), 1e-12);
}

TEST(Transform, A12NamedTogetherThePairMovesWithItsPlane) {
  const Document before = fitted_saddle(v1::SetSymmetry::PARTNER);
  const Motion motion = any_motion(1.5);
  const Document after = applied(before, {motion.of({"a", "a-mirror"})});
  expect_mirror_images(after, 1e-14);
  EXPECT_LE((after.find_dual("a")->plane.origin - motion(before.find_dual("a")->plane.origin)).norm(), 1e-15);
  // The image of the mirrored point is where the motion takes it: the pair is rigid.
  const DualPtr partner = before.find_dual("a-mirror");
  for (std::size_t i = 0; i < partner->points.size(); ++i) {
    EXPECT_LE(
        (after.find_dual("a-mirror")->points[i].position() - motion(partner->points[i].position())).norm(),
        1e-14);
  }
}

TEST(Transform, A12AReleasedPartnerStaysWhereItIs) {
  const Document released =
      applied(fitted_saddle(v1::SetSymmetry::PARTNER), {symmetry("a", v1::SetSymmetry::OFF)});
  const auto result = apply(released, any_motion(1).of({"a"}));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->changes.changed, std::vector<std::string>{"a"});
}

TEST(Transform, BadRequestsAreRefusedWithTheirField) {
  const Document document = fitted_saddle();
  const auto refused = [&](const auto& change, const std::string& field,
                           ErrorCode code = ErrorCode::invalid_argument) {
    v1::Operation operation = any_motion(1).of({"a"});
    change(*operation.mutable_transform());
    expect_refused(document, operation, code, field);
  };
  refused([](auto& t) { t.clear_entities(); }, "transform.entities");
  refused([](auto& t) { t.add_entities("a"); }, "transform.entities[1]");
  refused([](auto& t) { t.add_entities("b"); }, "transform.entities[1]", ErrorCode::not_found);
  refused([](auto& t) { t.mutable_translation()->set_y(NAN); }, "transform.translation.y");
  refused([](auto& t) { t.mutable_pivot()->set_z(INFINITY); }, "transform.pivot.z");
  refused([](auto& t) { t.mutable_rotation()->set_w(NAN); }, "transform.rotation");
  refused([](auto& t) { t.mutable_rotation()->Clear(); }, "transform.rotation");
  refused([](auto& t) { t.set_scale(-1); }, "transform.scale");
  refused([](auto& t) { t.set_scale(NAN); }, "transform.scale");
  refused([](auto& t) { t.set_scale(1e-4); }, "transform.scale");
  refused(
      [](auto& t) {
        t.clear_rotation();
        t.mutable_translation()->set_x(9999.999);
      },
      "transform");
}

TEST(Transform, X5ShrinkingForeverIsRefusedBeforeNumbersBreak) {
  Document document = fitted_saddle();
  Motion shrink;
  shrink.scale = 0.001;
  int done = 0;
  for (; done < 120; ++done) {
    auto result = apply(document, shrink.of({"a"}));
    if (!result) {
      EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
      break;
    }
    document = std::move(result->document);
    for (const double c : document.find_dual("a")->fit->surface.coefficients()) ASSERT_TRUE(std::isfinite(c));
  }
  EXPECT_GT(done, 10);
  EXPECT_LT(done, 120);
}

v1::Operation duplicate(const std::string& id, const std::string& copy, double dx = 0) {
  v1::Operation operation;
  operation.mutable_duplicate()->set_entity(id);
  operation.mutable_duplicate()->set_id(copy);
  operation.mutable_duplicate()->mutable_translation()->set_x(dx);
  return operation;
}

TEST(Duplicate, CopiesEverythingBeside) {
  const Document document = applied(fitted_saddle(), {superellipse("a", 5), duplicate("a", "b", 0.5)});
  const DualPtr a = document.find_dual("a");
  const DualPtr b = document.find_dual("b");
  ASSERT_TRUE(b != nullptr);
  EXPECT_EQ(b->name, "a (copy)");
  EXPECT_EQ(b->superellipse_exponent, 5);
  EXPECT_EQ(b->fit->surface, a->fit->surface);
  EXPECT_EQ(b->fit->frame.origin.x(), a->fit->frame.origin.x() + 0.5);
  for (std::size_t i = 0; i < a->points.size(); ++i) EXPECT_EQ(b->points[i].x, a->points[i].x + 0.5);
  // Two things from now on.
  const Document changed = applied(document, {add("b", {point(0, 0, 0)})});
  EXPECT_EQ(changed.find_dual("a"), a);
  // In place, it shares all memory.
  EXPECT_TRUE(applied(document, {duplicate("a", "c")}).find_dual("c")->points.shares_all_with(a->points));
}

TEST(Duplicate, TakesTheNextFreeIdAndTheLogHoldsIt) {
  const Document document = fitted_saddle();
  const auto result = apply(document, duplicate("a", ""));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->changes.created, std::vector<std::string>{"shape-1"});
  EXPECT_EQ(result->effective.duplicate().id(), "shape-1");
  EXPECT_EQ(document_hash(apply(document, result->effective)->document), document_hash(result->document));
}

TEST(Duplicate, A12TheCopyOfALinkedShapeIsReleasedAndThatOfASymmetricOneIsSymmetric) {
  const Document linked = applied(fitted_saddle(v1::SetSymmetry::PARTNER), {duplicate("a", "b", 0.1)});
  const DualPtr copy = linked.find_dual("b");
  EXPECT_EQ(copy->symmetry, SymmetryMode::off);
  EXPECT_TRUE(copy->partner.empty());
  EXPECT_EQ(copy->mirror_partner(0), DualPoint::no_partner);
  EXPECT_EQ(linked.find_dual("a-mirror")->partner, "a");
  const Document symmetric = applied(fitted_saddle(v1::SetSymmetry::SAME_SHAPE), {duplicate("a", "b", 0.1)});
  const DualPtr twin = symmetric.find_dual("b");
  EXPECT_EQ(twin->plane.origin.x(), symmetric.find_dual("a")->plane.origin.x() + 0.1);
  EXPECT_LE(
      (geometry::reflect_point(twin->points[0].position(), twin->plane) - twin->points[1].position()).norm(),
      1e-15);
}

TEST(Duplicate, BadRequestsAreRefusedWithTheirField) {
  const Document document = fitted_saddle();
  expect_refused(document, duplicate("b", "c"), ErrorCode::not_found, "duplicate.entity");
  expect_refused(document, duplicate("a", "a"), ErrorCode::already_exists, "duplicate.id");
  expect_refused(document, duplicate("a", "no spaces"), ErrorCode::invalid_argument, "duplicate.id");
  expect_refused(document, duplicate("a", "b", NAN), ErrorCode::invalid_argument, "duplicate.translation.x");
  expect_refused(document, duplicate("a", "b", 1e4), ErrorCode::invalid_argument, "duplicate.translation");
  v1::Operation named = duplicate("a", "b");
  named.mutable_duplicate()->set_name("\x01");
  expect_refused(document, named, ErrorCode::invalid_argument, "duplicate.name");
}

}  // namespace
}  // namespace handloft::model
