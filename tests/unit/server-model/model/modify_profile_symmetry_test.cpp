// ModifyProfile on symmetric shapes and on linked partners (A12, A20).

#include <gtest/gtest.h>

#include "profile_helpers.h"
#include "server-model/geometry/symmetry.h"

namespace handloft::model::test {
namespace {

TEST(ModifyProfile, A12_SameShapeSymmetryMirrorsTheCurve) {
  auto half = random_points(60, 30, 0.05);
  const Document before =
      applied({}, {create("a"), symmetry("a", v1::SetSymmetry::SAME_SHAPE), add("a", half), fit("a")});
  for (const bool keep : {false, true}) {
    const Document after = must(before, profile({curve(arch(0.02, 0.01, 0.05), "a")}, keep)).document;
    const DualPtr b = after.find_dual("a");
    ASSERT_EQ(b->points.size(), keep ? 132U : 120U);  // 12 kept points: 6 and their images.
    for (std::size_t i = 0; i < b->points.size(); ++i) {
      const Vec3 image = geometry::reflect_point(b->points[i].position(), b->plane);
      EXPECT_LE((b->points[b->mirror_partner(i)].position() - image).norm(), 1e-12);
    }
    EXPECT_LE(refit_error(*b), 1e-9);
    EXPECT_FALSE(b->stale);
    // The mirrored stroke draws the same.
    const auto mirrored = must(before, profile({curve(arch(0.02, 0.01, -0.05), "a")}, keep)).document;
    for (std::size_t i = 0; i < 120; ++i) {
      EXPECT_LE((mirrored.find_dual("a")->points[i].position() - b->points[i].position()).norm(), 1e-12);
    }
  }
}

TEST(ModifyProfile, A12_PartnersFollowAsMirrorImages) {
  const Document before = applied({}, {create("a"), symmetry("a", v1::SetSymmetry::PARTNER),
                                       add("a", random_points(60, 31, 0.05)), fit("a")});
  for (const bool keep : {false, true}) {
    const ApplyResult result = must(before, profile({curve(arch(0.02, 0.01, 0.05), "a")}, keep));
    EXPECT_EQ(result.changes.changed, (std::vector<std::string>{"a", "a-mirror"}));
    const DualPtr a = result.document.find_dual("a");
    const DualPtr b = result.document.find_dual("a-mirror");
    ASSERT_EQ(a->points.size(), keep ? 66U : 60U);
    ASSERT_EQ(b->points.size(), a->points.size());
    for (std::size_t i = 0; i < a->points.size(); ++i) {
      const Vec3 image = geometry::reflect_point(a->points[i].position(), a->plane);
      EXPECT_LE((b->points[i].position() - image).norm(), 1e-15);
    }
    EXPECT_FALSE(a->stale);
    EXPECT_FALSE(b->stale);
    EXPECT_LE(refit_error(*a), 1e-9);
    EXPECT_LE(refit_error(*b), 1e-9);
    EXPECT_EQ(b->fit->frame.rotation, before.find_dual("a-mirror")->fit->frame.rotation);
    // The stroke over the partner, mirrored, does the same to both.
    const auto over = must(before, profile({curve(arch(0.02, 0.01, -0.05), "a-mirror")}, keep)).document;
    for (std::size_t i = 0; i < 60; ++i) {
      EXPECT_LE((over.find_dual("a")->points[i].position() - a->points[i].position()).norm(), 1e-12);
    }
  }
  // One stroke across both is one edit of the pair, and symmetric.
  const Document both = must(before, profile({curve(line({-0.08, 0, 0.03}, {0.08, 0, 0.03}))})).document;
  for (std::size_t i = 0; i < 60; ++i) {
    const DualPtr a = both.find_dual("a");
    const Vec3 image = geometry::reflect_point(a->points[i].position(), a->plane);
    EXPECT_LE((both.find_dual("a-mirror")->points[i].position() - image).norm(), 1e-15);
  }
}

TEST(ModifyProfile, A12_APartnerWithPointsOfItsOwnIsEditedByTheMirroredCurve) {
  // The first points came before the symmetry, so the partner is no mirror image.
  const Document before =
      applied({}, {create("a"), add("a", random_points(60, 32, 0.05)),
                   symmetry("a", v1::SetSymmetry::PARTNER), add("a", random_points(50, 33, 0.05)), fit("a")});
  ASSERT_EQ(before.find_dual("a-mirror")->points.size(), 50U);
  for (const bool keep : {false, true}) {
    const Document after = must(before, profile({curve(arch(0.02, 0.01, 0.05), "a")}, keep)).document;
    for (const char* id : {"a", "a-mirror"}) {
      const DualPtr b = after.find_dual(id);
      EXPECT_FALSE(b->stale);
      EXPECT_EQ(b->fit->residuals_m.size(), b->points.size());
      EXPECT_LE(refit_error(*b), 1e-9);
      EXPECT_FALSE(b->fit->surface == before.find_dual(id)->fit->surface);
    }
    // Linked pairs stay mirror images.
    const DualPtr a = after.find_dual("a");
    const DualPtr b = after.find_dual("a-mirror");
    for (std::size_t i = 60; i < a->points.size(); ++i) {
      const Vec3 image = geometry::reflect_point(a->points[i].position(), a->plane);
      EXPECT_LE((b->points[a->mirror_partner(i)].position() - image).norm(), 1e-15);
    }
  }
  // Released, it stays.
  const Document alone = applied(before, {symmetry("a", v1::SetSymmetry::OFF)});
  EXPECT_EQ(must(alone, profile({curve(arch(0.02, 0.01, 0.05), "a")})).changes.changed,
            (std::vector<std::string>{"a"}));
}

/// The residuals are those of the points, and every linked pair is one of mirror images.
void expect_consistent(const Document& document, const DualShape& shape) {
  EXPECT_FALSE(shape.stale);
  ASSERT_EQ(shape.fit->residuals_m.size(), shape.points.size());
  const DualShape& other = shape.partner.empty() ? shape : *document.find_dual(shape.partner);
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    EXPECT_NEAR(shape.residual_m(i), height_over(shape, shape.points[i].position()), 1e-13) << i;
    if (shape.mirror_partner(i) == DualPoint::no_partner) continue;
    const Vec3 image = geometry::reflect_point(shape.points[i].position(), shape.plane);
    EXPECT_LE((other.points[shape.mirror_partner(i)].position() - image).norm(), 1e-15) << i;
  }
}

TEST(ModifyProfile, A12_A20_ImagesStayExactWhereNoSurfaceIsItsOwnImage) {
  // Points without images, fitted before there was a symmetry: neither they nor the base plane are symmetric.
  const auto tilted = [](const Vec3& p) { return point(p.x(), p.y(), 0.01 + 0.4 * p.x() + 0.1 * p.y()); };
  std::vector<v1::Point> own;
  for (const auto& p : random_points(40, 40, 0.01)) {
    own.push_back(tilted({p.position().x(), p.position().y(), 0}));
  }
  const Document before =
      applied({}, {create("a"), add("a", own), fit("a"), symmetry("a", v1::SetSymmetry::SAME_SHAPE),
                   add("a", random_points(30, 41, 0.02)), fit("a")});
  expect_consistent(before, *before.find_dual("a"));
  for (const bool keep : {false, true}) {
    const Document after = must(before, profile({curve(arch(0.02, 0.01, 0.02), "a")}, keep)).document;
    const DualPtr b = after.find_dual("a");
    ASSERT_EQ(b->points.size(), keep ? 110U : 100U);
    expect_consistent(after, *b);
    EXPECT_LE(refit_error(*b), 1e-9);
    EXPECT_EQ(b->fit->frame.rotation, before.find_dual("a")->fit->frame.rotation);
    if (!keep) continue;
    // The images of kept points do not lie on the surface: that is what this test is about.
    double off = 0;
    for (std::size_t i = 100; i < 110; ++i) off = std::max(off, std::abs(b->residual_m(i)));
    EXPECT_GT(off, 1e-4);
  }
}

TEST(ModifyProfile, A12_TheLinkedPointsOfAPartnerWithoutASurfaceFollow) {
  // Fitted before it had a partner, which thus has none.
  const Document before =
      applied({}, {create("a"), add("a", random_points(60, 42, 0.05)), fit("a"),
                   symmetry("a", v1::SetSymmetry::PARTNER), add("a", random_points(20, 43, 0.05))});
  ASSERT_FALSE(before.find_dual("a-mirror")->fitted());
  for (const bool keep : {false, true}) {
    const ApplyResult result = must(before, profile({curve(arch(0.02, 0.01, 0.05), "a")}, keep));
    expect_consistent(result.document, *result.document.find_dual("a"));
    EXPECT_EQ(result.changes.changed, (std::vector<std::string>{"a", "a-mirror"}));
    const DualPtr b = result.document.find_dual("a-mirror");
    EXPECT_FALSE(b->fitted());
    EXPECT_FALSE(b->stale);
    EXPECT_EQ(b->points.size(), keep ? 28U : 20U);
    EXPECT_GT((b->points[0].position() - before.find_dual("a-mirror")->points[0].position()).norm(), 1e-5);
  }
}

TEST(ModifyProfile, A12_AShapeMirroredInItsOwnBasePlaneStaysThere) {
  // Images above and below each other: the surface lies between them, and all of its heights are rounding.
  auto mirror = symmetry("a", v1::SetSymmetry::SAME_SHAPE);
  mirror.mutable_set_symmetry()->mutable_plane()->mutable_normal()->set_x(0.3);
  mirror.mutable_set_symmetry()->mutable_plane()->mutable_normal()->set_z(1);
  std::vector<v1::Point> points = random_points(50, 45);
  for (auto& p : points) p.mutable_position()->set_z(p.position().z() - 0.3 * p.position().x());
  const Document before = applied({}, {create("a"), mirror, add("a", points), fit("a")});
  for (const bool keep : {false, true}) {
    const Document after = must(before, profile({curve(arch(0.02), "a")}, keep)).document;
    expect_consistent(after, *after.find_dual("a"));
    for (const DualPoint& p : after.find_dual("a")->points) {
      const Vec3 local = after.find_dual("a")->fit->frame.to_local(p.position());
      EXPECT_NEAR(after.find_dual("a")->fit->surface.value(local.x(), local.y()), 0, 1e-15);
    }
  }
}

}  // namespace
}  // namespace handloft::model::test
