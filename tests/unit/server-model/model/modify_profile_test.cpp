// ModifyProfile on documents: A8, A9, A10, A12, A18 - A21.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "model_helpers.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/resample.h"
#include "server-model/geometry/symmetry.h"

namespace handloft::model::test {
namespace {

using geometry::Vec3;

std::vector<v1::Point> stroke(const std::function<Vec3(double)>& at, std::size_t n = 60) {
  std::vector<v1::Point> points;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 p = at(static_cast<double>(i) / static_cast<double>(n - 1));
    points.push_back(point(p.x(), p.y(), p.z(), 0.7));
    points.back().set_time_ns(static_cast<std::int64_t>(i) * 1000);
  }
  return points;
}

std::vector<v1::Point> line(const Vec3& from, const Vec3& to) {
  return stroke([&](double t) { return Vec3(from + t * (to - from)); });
}

/// An arch over x = x0 - 0.03 .. x0 + 0.03 at y.
std::vector<v1::Point> arch(double height, double y = 0, double x0 = 0) {
  return stroke([=](double t) { return Vec3(x0 - 0.03 + 0.06 * t, y, 0.01 + height * 4 * t * (1 - t)); });
}

v1::ProfileCurve curve(const std::vector<v1::Point>& points, const std::string& entity = "") {
  v1::ProfileCurve result;
  for (const auto& p : points) *result.add_points() = p;
  result.set_entity(entity);
  return result;
}

v1::Operation profile(const std::vector<v1::ProfileCurve>& curves, bool keep = false) {
  v1::Operation operation;
  for (const auto& one : curves) *operation.mutable_modify_profile()->add_curves() = one;
  operation.mutable_modify_profile()->set_keep_as_points(keep);
  return operation;
}

std::vector<v1::Point> random_points(std::size_t n, std::uint64_t seed, double x0 = 0) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<v1::Point> points;
  for (std::size_t i = 0; i < n; ++i) {
    points.push_back(point(x0 + 0.04 * unit(random), 0.03 * unit(random), 0.01 + 0.003 * unit(random),
                           0.55 + 0.45 * unit(random)));
  }
  return points;
}

Document fitted(const std::string& id, const std::vector<v1::Point>& points, std::uint32_t degree = 2,
                Document base = {}) {
  return applied(std::move(base), {create(id, degree), add(id, points), fit(id)});
}

std::vector<geometry::WeightedPoint> local_points(const DualShape& shape) {
  std::vector<geometry::WeightedPoint> points;
  for (const DualPoint& p : shape.points) {
    points.push_back({shape.fit->frame.to_local(p.position()), p.pressure});
  }
  return points;
}

/// Largest distance between the shape's surface and a fit of its points, over the points, relative to height.
double refit_error(const DualShape& shape) {
  const auto points = local_points(shape);
  const auto refit = geometry::fit_polynomial_surface(points, {.degree = shape.fit->surface.degree()});
  EXPECT_TRUE(refit.ok());
  double apart = 0;
  double height = 0;
  for (const auto& p : points) {
    const double f = shape.fit->surface.value(p.position.x(), p.position.y());
    apart = std::max(apart, std::abs(refit->surface.value(p.position.x(), p.position.y()) - f));
    height = std::max(height, std::abs(f));
  }
  return apart / height;
}

ApplyResult must(const Document& document, const v1::Operation& operation) {
  auto result = apply(document, operation);
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().describe());
  return result ? std::move(*result) : ApplyResult{};
}

double height_over(const DualShape& shape, const Vec3& world) {
  const Vec3 local = shape.fit->frame.to_local(world);
  return local.z() - shape.fit->surface.value(local.x(), local.y());
}

TEST(ModifyProfile, A8_A19_SurfaceFollowsAndRefitKeepsIt) {
  for (std::uint32_t degree = 1; degree <= 4; ++degree) {
    for (const std::size_t n : {7U, 40U, 1000U}) {
      const Document before = fitted("a", random_points(n, degree), degree);
      const ApplyResult result =
          must(before, profile({curve(arch(0.03), "a"), curve(arch(0.02, 0.02), "a")}));
      const DualPtr a = before.find_dual("a");
      const DualPtr b = result.document.find_dual("a");
      ASSERT_EQ(b->points.size(), n);  // Temporaries are gone.
      EXPECT_EQ(b->fit->surface.degree(), a->fit->surface.degree());
      EXPECT_FALSE(b->stale);
      EXPECT_FALSE(a->fit->surface == b->fit->surface);
      EXPECT_LE(refit_error(*b), 1e-9) << degree << ", " << n;
      EXPECT_EQ(b->fit->frame.rotation, a->fit->frame.rotation);  // The frame is frozen.
      const auto x = local_points(*a);
      const auto y = local_points(*b);
      for (std::size_t i = 0; i < n; ++i) {
        EXPECT_LE((x[i].position - y[i].position).head<2>().norm(), 1e-15);
        EXPECT_NEAR(height_over(*b, b->points[i].position()), b->residual_m(i), 1e-15);
        EXPECT_EQ(b->points[i].pressure, a->points[i].pressure);
      }
      // A fit afterwards has nothing to do, and after a change of degree and back it finds f1 again.
      EXPECT_TRUE(must(result.document, fit("a")).changes.empty());
    }
  }
}

TEST(ModifyProfile, A19_TheSurfaceComesNearerToTheCurve) {
  const Document before = fitted("a", random_points(300, 1));
  const auto points = arch(0.03);
  const Document after = must(before, profile({curve(points, "a")})).document;
  double old_distance = 0;
  double new_distance = 0;
  for (const auto& p : points) {
    const Vec3 at(p.position().x(), p.position().y(), p.position().z());
    old_distance += std::abs(height_over(*before.find_dual("a"), at));
    new_distance += std::abs(height_over(*after.find_dual("a"), at));
  }
  EXPECT_LT(new_distance, 0.5 * old_distance);
}

TEST(ModifyProfile, A19_OrderAndDirectionOfCurvesChangeNothing) {
  const Document before = fitted("a", random_points(101, 2), 3);
  std::vector<v1::ProfileCurve> curves = {curve(arch(0.03), "a"), curve(arch(0.03, 0.02), "a")};
  const std::string hash = document_hash(must(before, profile(curves)).document);
  std::swap(curves[0], curves[1]);
  auto reversed = arch(0.03);
  std::reverse(reversed.begin(), reversed.end());
  curves[1] = curve(reversed, "a");
  EXPECT_EQ(document_hash(must(before, profile(curves)).document), hash);  // To the bit.
}

TEST(ModifyProfile, A19_ACurveOnTheSurfaceChangesNothing) {
  const Document before = fitted("a", random_points(200, 3), 1);
  const DualPtr a = before.find_dual("a");
  const auto on_it = stroke(
      [&](double t) { return a->fit->surface.world_point(a->fit->frame, -0.03 + 0.06 * t, 0.01 * t); });
  const Document after = must(before, profile({curve(on_it, "a")})).document;
  for (std::size_t i = 0; i < a->points.size(); ++i) {
    EXPECT_LE((after.find_dual("a")->points[i].position() - a->points[i].position()).norm(), 1e-12);
  }
}

TEST(ModifyProfile, A9_AStaleFitIsRefittedFirstInTheFrozenFrame) {
  const Document base = fitted("a", random_points(200, 4));
  // New points off the surface: the fit is stale, its frame is not taken anew.
  std::vector<v1::Point> off;
  for (int i = 0; i < 40; ++i) off.push_back(point(-0.03 + 0.001 * i, 0.02, 0.03, 0.9));
  const Document stale = applied(base, {add("a", off)});
  ASSERT_TRUE(stale.find_dual("a")->stale);
  const Document after = must(stale, profile({curve(arch(0.03), "a")})).document;
  const DualPtr b = after.find_dual("a");
  EXPECT_FALSE(b->stale);
  EXPECT_EQ(b->fit->frame.rotation, base.find_dual("a")->fit->frame.rotation);
  EXPECT_EQ(b->fit->residuals_m.size(), 240U);
  EXPECT_LE(refit_error(*b), 1e-9);
  // Just the same as fitting by hand before.
  EXPECT_EQ(document_hash(must(applied(stale, {fit("a")}), profile({curve(arch(0.03), "a")})).document),
            document_hash(after));
}

TEST(ModifyProfile, A7_ALoweredDegreeStaysTheSpace) {
  // Seven points carry degree 2 at most, though 4 was asked for.
  const Document before = fitted("a", random_points(7, 5), 4);
  ASSERT_EQ(before.find_dual("a")->fit->surface.degree(), 2);
  const ApplyResult result = must(before, profile({curve(arch(0.02), "a")}));
  const DualPtr b = result.document.find_dual("a");
  EXPECT_EQ(b->fit->surface.degree(), 2);
  EXPECT_EQ(b->fit->requested_degree, 4U);
  EXPECT_LE(refit_error(*b), 1e-9);
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_NE(result.notes[0].find("degree 2"), std::string::npos) << result.notes[0];
}

TEST(ModifyProfile, A10_ADriftedNormalIsNoted) {
  const Document before = fitted("a", random_points(200, 6), 1);
  const auto steep = stroke([](double t) { return Vec3(-0.04 + 0.08 * t, 0, 0.01 + 0.06 * t); });
  Document after = before;
  ApplyResult result = must(after, profile({curve(steep, "a")}));
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_NE(result.notes[0].find("refit_plane"), std::string::npos);
  EXPECT_GT(result.document.find_dual("a")->fit->frame_drift_rad, 0.35);
  EXPECT_TRUE(must(before, profile({curve(arch(0.001), "a")})).notes.empty());
}

TEST(ModifyProfile, A20_KeepsTheCurveAsATenthOfThePoints) {
  for (std::uint32_t degree = 1; degree <= 4; ++degree) {
    const Document before = fitted("a", random_points(100, 7 + degree), degree);
    const auto operation = profile({curve(arch(0.03), "a"), curve(arch(0.02, 0.02), "a")}, true);
    const DualPtr b = must(before, operation).document.find_dual("a");
    ASSERT_EQ(b->points.size(), 110U);
    double mean = 0;
    for (const DualPoint& p : before.find_dual("a")->points) mean += p.pressure / 100;
    EXPECT_EQ(b->stroke_count, 3U);
    for (std::size_t i = 100; i < 110; ++i) {
      EXPECT_NEAR(b->points[i].pressure, mean, 1e-15);
      EXPECT_NEAR(height_over(*b, b->points[i].position()), 0, 1e-15);
      EXPECT_EQ(b->points[i].time_ns, 59000);
      EXPECT_GE(b->points[i].stroke, 2U);
    }
    EXPECT_FALSE(b->stale);
    EXPECT_EQ(b->fit->residuals_m.size(), 110U);
    EXPECT_EQ(b->fit->statistics.count, 110U);
    EXPECT_LE(refit_error(*b), 1e-9);
    // The surface is that of the edit without keeping.
    const auto temporary = profile({curve(arch(0.03), "a"), curve(arch(0.02, 0.02), "a")});
    EXPECT_EQ(must(before, temporary).document.find_dual("a")->fit->surface, b->fit->surface);
  }
}

/// Two tiles beside each other, "left" about x = -0.05 and "right" about x = 0.05.
Document two_tiles() {
  return fitted("right", random_points(120, 22, 0.05), 2, fitted("left", random_points(80, 21, -0.05)));
}

TEST(ModifyProfile, A21_AStrokeDividesItselfAndTheEffectiveOperationSaysWhere) {
  const Document before = two_tiles();
  const auto across = line({-0.08, 0, 0.03}, {0.08, 0.005, 0.03});
  const ApplyResult result = must(before, profile({curve(across)}));
  EXPECT_EQ(result.changes.changed, (std::vector<std::string>{"left", "right"}));
  EXPECT_EQ(result.words, "Draw the profile of \"left\", \"right\"");
  EXPECT_TRUE(result.notes.empty());
  const auto& effective = result.effective.modify_profile().curves(0);
  ASSERT_EQ(effective.split_at_size(), 1);
  EXPECT_NEAR(effective.split_at(0), 0.5, 0.03);
  EXPECT_EQ(effective.split_entities(0), "left");
  EXPECT_EQ(effective.split_entities(1), "right");
  EXPECT_TRUE(effective.entity().empty());
  // The replay decides nothing anew: the same, to the bit, and the same effective operation again.
  const ApplyResult replay = must(before, result.effective);
  EXPECT_EQ(document_hash(replay.document), document_hash(result.document));
  EXPECT_EQ(replay.effective.SerializeAsString(), result.effective.SerializeAsString());
}

TEST(ModifyProfile, A21_ATwoSurfaceStrokeIsTwoSeparateEditsBitwise) {
  const Document before = two_tiles();
  const auto across = line({-0.08, 0, 0.03}, {0.08, 0.005, 0.02});
  for (const bool keep : {false, true}) {
    const ApplyResult at_once = must(before, profile({curve(across)}, keep));
    const double at = at_once.effective.modify_profile().curves(0).split_at(0);

    std::vector<Vec3> drawn;
    for (const auto& p : across) drawn.push_back({p.position().x(), p.position().y(), p.position().z()});
    const auto parts = geometry::split_curve(drawn, std::array{at});
    Document one_by_one = before;
    for (const auto& [k, id] : {std::pair{0U, "left"}, std::pair{1U, "right"}}) {
      std::vector<v1::Point> part;
      for (const Vec3& p : (*parts)[k]) {
        part.push_back(point(p.x(), p.y(), p.z(), 0.7));
        part.back().set_time_ns(59000);
      }
      one_by_one = must(one_by_one, profile({curve(part, id)}, keep)).document;
    }
    EXPECT_EQ(document_hash(one_by_one), document_hash(at_once.document));

    // The other way to say it: each part for itself, the other one nobody's.
    Document by_division = before;
    for (int k = 0; k < 2; ++k) {
      v1::Operation part = at_once.effective;
      part.mutable_modify_profile()->mutable_curves(0)->set_split_entities(1 - k, "");
      by_division = must(by_division, part).document;
    }
    EXPECT_EQ(document_hash(by_division), document_hash(at_once.document));
  }
}

TEST(ModifyProfile, A21_OnlyAmongTheNamedEntities) {
  auto operation = profile({curve(line({-0.08, 0, 0.03}, {0.08, 0, 0.03}))});
  operation.mutable_modify_profile()->add_entities("right");
  const ApplyResult result = must(two_tiles(), operation);
  EXPECT_EQ(result.changes.changed, (std::vector<std::string>{"right"}));
}

TEST(ModifyProfile, A21_WhatIsNearNobodyChangesNothingAndIsNoted) {
  const Document before = two_tiles();
  const ApplyResult far = must(before, profile({curve(line({-0.05, 0, 0.5}, {0.05, 0, 0.5}))}));
  EXPECT_TRUE(far.changes.empty());
  ASSERT_EQ(far.notes.size(), 1U);
  EXPECT_NE(far.notes[0].find("changes nothing"), std::string::npos) << far.notes[0];
  EXPECT_TRUE(must(before, far.effective).changes.empty());

  const ApplyResult half = must(before, profile({curve(line({0.05, 0, 0.02}, {1, 0, 0.02}))}));
  EXPECT_EQ(half.changes.changed, (std::vector<std::string>{"right"}));
  ASSERT_EQ(half.notes.size(), 1U);
  EXPECT_NE(half.notes[0].find("% of curve 1"), std::string::npos) << half.notes[0];
}

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

TEST(ModifyProfile, ADegreeChosenForThePointsBeforeIsNotTakenAsChosen) {
  auto automatic = fit("a");
  automatic.mutable_fit()->set_automatic_degree(true);
  const Document before = applied({}, {create("a"), add("a", random_points(80, 44)), automatic});
  ASSERT_EQ(before.find_dual("a")->fit->cross_validated_rms_m.size(), 6U);
  const Document after = must(before, profile({curve(arch(0.02), "a")})).document;
  EXPECT_TRUE(after.find_dual("a")->fit->cross_validated_rms_m.empty());
  EXPECT_EQ(must(after, automatic).document.find_dual("a")->fit->cross_validated_rms_m.size(), 6U);
}

TEST(ModifyProfile, EveryFieldIsChecked) {
  const Document document = applied(two_tiles(), {create("bare"), add("bare", saddle_points())});
  const auto good = line({-0.08, 0, 0.03}, {0.08, 0, 0.03});
  const auto refused = [&](const v1::Operation& operation, ErrorCode code, const std::string& field) {
    expect_refused(document, operation, code, "modify_profile." + field);
  };
  refused(profile({}), ErrorCode::invalid_argument, "curves");
  refused(profile(std::vector<v1::ProfileCurve>(65, curve(good))), ErrorCode::resource_exhausted, "curves");
  refused(profile({curve({})}), ErrorCode::invalid_argument, "curves[0].points");
  refused(profile({curve(good), curve({point(0, 0, 0)})}), ErrorCode::invalid_argument, "curves[1].points");
  refused(profile({curve({point(0, 0, 0), point(0, 0, 0)})}), ErrorCode::invalid_argument,
          "curves[0].points");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused(profile({curve({point(0, 0, 0), point(0, nan, 0)})}), ErrorCode::invalid_argument,
          "curves[0].points[1].position.y");
  refused(profile({curve({point(0, 0, 0), point(0, 1, 0, 2)})}), ErrorCode::invalid_argument,
          "curves[0].points[1].pressure");
  refused(profile({curve(good, "nobody")}), ErrorCode::not_found, "curves[0].entity");
  refused(profile({curve(good, "bare")}), ErrorCode::failed_precondition, "curves[0].entity");

  auto both = curve(good, "left");
  both.add_split_entities("left");
  refused(profile({both}), ErrorCode::invalid_argument, "curves[0].entity");
  const auto divided = [&](const std::vector<double>& at, const std::vector<std::string>& entities) {
    auto one = curve(good);
    for (const double f : at) one.add_split_at(f);
    for (const auto& id : entities) one.add_split_entities(id);
    return profile({one});
  };
  refused(divided({0.5}, {}), ErrorCode::invalid_argument, "curves[0].split_entities");
  refused(divided({0.5}, {"left"}), ErrorCode::invalid_argument, "curves[0].split_entities");
  refused(divided({0.5, 0.4}, {"left", "", "right"}), ErrorCode::invalid_argument, "curves[0].split_at[1]");
  refused(divided({1.1}, {"left", "right"}), ErrorCode::invalid_argument, "curves[0].split_at[0]");
  refused(divided({nan}, {"left", "right"}), ErrorCode::invalid_argument, "curves[0].split_at[0]");
  refused(divided({0.5}, {"left", "no"}), ErrorCode::not_found, "curves[0].split_entities[1]");
  refused(divided({0.5}, {"bare", "left"}), ErrorCode::failed_precondition, "curves[0].split_entities[0]");
  EXPECT_EQ(must(document, divided({0.0, 1.0}, {"left", "right", "left"})).changes.changed,
            (std::vector<std::string>{"right"}));  // What is left over at the ends is no curve.

  auto among = profile({curve(good)});
  among.mutable_modify_profile()->add_entities("left");
  among.mutable_modify_profile()->add_entities("bare");
  refused(among, ErrorCode::failed_precondition, "entities[1]");
  among.mutable_modify_profile()->set_entities(1, "no");
  refused(among, ErrorCode::not_found, "entities[1]");

  expect_refused(applied({}, {create("bare")}), profile({curve(good)}), ErrorCode::failed_precondition,
                 "modify_profile.entities");

  // Curves at the rim of the workspace, named for a shape explicitly, never leave a number that is not one.
  const auto far = apply(document, profile({curve(line({-9999, 0, 9999}, {9999, 9999, -9999}), "left")}));
  if (!far.ok()) {
    EXPECT_EQ(far.error().field, "modify_profile.curves");
  } else {
    for (const DualPoint& p : far->document.find_dual("left")->points) {
      EXPECT_TRUE(p.position().allFinite());
    }
  }
  ApplyContext tight;
  tight.limits.max_points_per_operation = 100;
  expect_refused(document, profile({curve(good), curve(good)}), ErrorCode::resource_exhausted,
                 "modify_profile.curves[1].points", tight);
  tight.limits.max_points_per_operation = 1000;
  tight.limits.max_points_per_shape = 80;
  expect_refused(document, profile({curve(good, "left")}, true), ErrorCode::resource_exhausted,
                 "modify_profile.curves", tight);
}

TEST(ModifyProfile, A28_UndoIsBitIdentical_AndAGestureInTheAirLeavesTheBaseAlone) {
  Model model(two_tiles());
  const std::string start = document_hash(model.document());
  const auto across = line({-0.08, 0, 0.03}, {0.08, 0.005, 0.03});
  const auto id = model.begin_provisional(profile({curve({across[0], across[1]})}));
  ASSERT_TRUE(id.ok());
  for (std::size_t n = 3; n <= across.size(); ++n) {
    const std::vector<v1::Point> so_far(across.begin(), across.begin() + static_cast<std::ptrdiff_t>(n));
    ASSERT_TRUE(model.update_provisional(*id, profile({curve(so_far)})).ok());
    EXPECT_EQ(document_hash(model.document()), start);
  }
  EXPECT_TRUE(model.is_provisional("right"));
  const std::string shown = document_hash(model.preview());
  ASSERT_TRUE(model.commit_provisional(*id).ok());
  EXPECT_EQ(document_hash(model.document()), shown);
  ASSERT_TRUE(model.submit(undo()).ok());
  EXPECT_EQ(document_hash(model.document()), start);
  ASSERT_TRUE(model.submit(redo()).ok());
  EXPECT_EQ(document_hash(model.document()), shown);
}

}  // namespace
}  // namespace handloft::model::test
