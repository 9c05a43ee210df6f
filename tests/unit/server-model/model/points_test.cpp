// Deleting and moving points of a region (A9, A12), and points that a fitted surface follows (A10).

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "model_helpers.h"
#include "server-model/geometry/symmetry.h"
#include "server-model/model/live_fit.h"

namespace handloft::model {
namespace {

using namespace test;

v1::Vec3 vec(double x, double y, double z) {
  v1::Vec3 v;
  v.set_x(x);
  v.set_y(y);
  v.set_z(z);
  return v;
}

v1::PointRegion sphere(double x, double y, double z, double radius) {
  v1::PointRegion region;
  *region.mutable_sphere()->mutable_centre() = vec(x, y, z);
  region.mutable_sphere()->set_radius_m(radius);
  return region;
}

v1::PointRegion box(const v1::Vec3& minimum, const v1::Vec3& maximum) {
  v1::PointRegion region;
  *region.mutable_box()->mutable_minimum() = minimum;
  *region.mutable_box()->mutable_maximum() = maximum;
  return region;
}

v1::PointRegion indices(const std::vector<std::uint32_t>& numbers) {
  v1::PointRegion region;
  region.mutable_indices();
  for (const std::uint32_t i : numbers) region.mutable_indices()->add_indices(i);
  return region;
}

v1::PointRegion strokes(const std::vector<std::uint32_t>& numbers) {
  v1::PointRegion region;
  region.mutable_strokes();
  for (const std::uint32_t i : numbers) region.mutable_strokes()->add_numbers(i);
  return region;
}

v1::Operation delete_points(const std::string& id, const v1::PointRegion& region) {
  v1::Operation operation;
  operation.mutable_delete_points()->set_entity(id);
  *operation.mutable_delete_points()->mutable_region() = region;
  return operation;
}

v1::Operation move_points(const std::string& id, const v1::PointRegion& region, const v1::Vec3& by) {
  v1::Operation operation;
  operation.mutable_move_points()->set_entity(id);
  *operation.mutable_move_points()->mutable_region() = region;
  *operation.mutable_move_points()->mutable_by() = by;
  return operation;
}

/// Points 0, 1, 2, 3 cm along x in stroke 1 and 4, 5 cm in stroke 2.
Document row() {
  return applied(
      {}, {create("a"), add("a", {point(0, 0, 0), point(0.01, 0, 0), point(0.02, 0, 0), point(0.03, 0, 0)}),
           add("a", {point(0.04, 0, 0), point(0.05, 0, 0)})});
}

std::vector<double> xs(const DualShape& shape) {
  std::vector<double> result;
  for (const DualPoint& p : shape.points) result.push_back(p.x);
  return result;
}

TEST(DeletePoints, RegionsByHand) {
  const Document document = row();
  const auto left = [&](const v1::PointRegion& region) {
    return xs(*applied(document, {delete_points("a", region)}).find_dual("a"));
  };
  EXPECT_EQ(left(sphere(0.02, 0, 0, 0.01)), (std::vector<double>{0, 0.04, 0.05}));  // The rim belongs to it.
  EXPECT_EQ(left(box(vec(0.015, -1, -1), vec(0.04, 1, 1))), (std::vector<double>{0, 0.01, 0.05}));
  EXPECT_EQ(left(strokes({2, 2})), (std::vector<double>{0, 0.01, 0.02, 0.03}));
  EXPECT_EQ(left(indices({5, 0, 5})), (std::vector<double>{0.01, 0.02, 0.03, 0.04}));
  EXPECT_EQ(left(strokes({1, 2})), std::vector<double>{});
  // Strokes keep their numbers: the next one is the third.
  const Document third = applied(document, {delete_points("a", strokes({2})), add("a", {point(0.1, 0, 0)})});
  EXPECT_EQ(third.find_dual("a")->points.back().stroke, 3U);
}

TEST(DeletePoints, AnEmptyRegionChangesNothingAndSaysSo) {
  const auto result = apply(row(), delete_points("a", sphere(1, 1, 1, 0.1)));
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(result->changes.empty());
  EXPECT_EQ(result->notes.size(), 1U);
}

TEST(DeletePoints, A9TheFitIsStaleAndResidualsStayWithTheirPoints) {
  const Document fitted = applied({}, {create("a", 1), add("a", saddle_points()), fit("a")});
  const DualPtr before = fitted.find_dual("a");
  const DualPtr after = applied(fitted, {delete_points("a", indices({0, 7}))}).find_dual("a");
  ASSERT_EQ(after->points.size(), before->points.size() - 2);
  EXPECT_TRUE(after->stale);
  EXPECT_FALSE(before->stale);
  EXPECT_EQ(after->residual_m(0), before->residual_m(1));
  EXPECT_EQ(after->residual_m(6), before->residual_m(8));
  EXPECT_NE(before->residual_m(7), before->residual_m(8));
  EXPECT_EQ(after->fit->surface, before->fit->surface);
}

TEST(DeletePoints, A12ImagesGoWithTheirOriginals) {
  for (const auto mode : {v1::SetSymmetry::SAME_SHAPE, v1::SetSymmetry::PARTNER}) {
    // Two points without an image, then five with.
    Document document =
        applied({}, {create("a"), add("a", {point(0.5, 0, 0), point(0.6, 0, 0)}), symmetry("a", mode)});
    std::vector<v1::Point> points;
    for (int i = 0; i < 5; ++i) points.push_back(point(0.1 + 0.01 * i, 0.02 * i, 0.03));
    document = applied(document, {add("a", points)});
    document = applied(document, {delete_points("a", box(vec(0.115, -1, -1), vec(0.125, 1, 1))),
                                  delete_points("a", sphere(0.5, 0, 0, 0.01))});
    const DualPtr shape = document.find_dual("a");
    const bool same = mode == v1::SetSymmetry::SAME_SHAPE;
    EXPECT_EQ(shape->points.size(), same ? 9U : 5U);
    EXPECT_EQ(shape->linked_from, 1U);
    const DualPtr other = same ? shape : document.find_dual("a-mirror");
    int linked = 0;
    for (std::size_t i = 0; i < shape->points.size(); ++i) {
      const std::uint32_t image = shape->mirror_partner(i);
      if (image == DualPoint::no_partner) continue;
      ++linked;
      ASSERT_LT(image, other->points.size());
      EXPECT_EQ(other->mirror_partner(image), i);
      EXPECT_EQ(other->points[image].x, -shape->points[i].x);
      EXPECT_EQ(other->points[image].y, shape->points[i].y);
    }
    EXPECT_EQ(linked, same ? 8 : 4);
  }
}

TEST(DeletePoints, A12APartnerKeepsItsOwnFrameWhereItIsNoMirrorImage) {
  // Both are fitted while the shape has points of its own besides; then those go, and the points are images.
  Document document = applied({}, {create("a"), add("a", {point(0.05, 0, 0.2), point(0.06, 0.01, 0.1)}),
                                   symmetry("a", v1::SetSymmetry::PARTNER), add("a", saddle_points(0.01)),
                                   fit("a"), delete_points("a", indices({0, 1})), fit("a")});
  const DualPtr partner = document.find_dual("a-mirror");
  for (std::size_t i = 0; i < partner->points.size(); ++i) {
    const geometry::Vec3 p = partner->fit->frame.to_local(partner->points[i].position());
    EXPECT_NEAR(partner->residual_m(i), p.z() - partner->fit->surface.value(p.x(), p.y()), 1e-14);
  }
}

TEST(MovePoints, MovesThoseInTheRegionOnlyAndMarksTheFitStale) {
  const Document fitted = applied({}, {create("a"), add("a", saddle_points()), fit("a")});
  const Document moved = applied(fitted, {move_points("a", indices({3, 5}), vec(0, 0, 0.25))});
  const DualPtr before = fitted.find_dual("a");
  const DualPtr after = moved.find_dual("a");
  EXPECT_TRUE(after->stale);
  EXPECT_EQ(after->fit, before->fit);
  for (std::size_t i = 0; i < before->points.size(); ++i) {
    const double lifted = i == 3 || i == 5 ? 0.25 : 0.0;
    EXPECT_EQ(after->points[i].z, before->points[i].z + lifted);
    EXPECT_EQ(after->points[i].x, before->points[i].x);
    EXPECT_EQ(after->points[i].pressure, before->points[i].pressure);
  }
  const auto nothing = apply(fitted, move_points("a", indices({3}), vec(0, 0, 0)));
  EXPECT_TRUE(nothing.ok() && nothing->changes.empty());
}

TEST(MovePoints, A12ImagesMoveAsImages) {
  for (const auto mode : {v1::SetSymmetry::SAME_SHAPE, v1::SetSymmetry::PARTNER}) {
    const Document laid = applied({}, {create("a"), symmetry("a", mode), add("a", saddle_points(0.01))});
    const bool same = mode == v1::SetSymmetry::SAME_SHAPE;
    // Everything: under SAME_SHAPE both of each pair are in the region, and the one that was laid leads.
    const Document moved = applied(laid, {move_points("a", sphere(0, 0, 0, 1), vec(0.005, 0.001, -0.002))});
    const DualPtr shape = moved.find_dual("a");
    const DualPtr other = same ? shape : moved.find_dual("a-mirror");
    for (std::size_t i = 0; i < shape->points.size(); ++i) {
      const DualPoint& image = other->points[shape->mirror_partner(i)];
      EXPECT_EQ(image.x, -shape->points[i].x);
      EXPECT_EQ(image.y, shape->points[i].y);
      EXPECT_EQ(image.z, shape->points[i].z);
    }
    EXPECT_EQ(shape->points[0].x, laid.find_dual("a")->points[0].x + 0.005);
    // And from the image's side.
    const std::string side = same ? "a" : "a-mirror";
    const std::uint32_t image = shape->mirror_partner(0);
    const Document back = applied(moved, {move_points(side, indices({image}), vec(0.125, 0, 0))});
    EXPECT_EQ(back.find_dual("a")->points[0].x, -back.find_dual(side)->points[image].x);
  }
}

TEST(PointRegions, BadOnesAreRefusedWithTheirField) {
  const Document document = row();
  const auto refused = [&](const v1::PointRegion& region, const std::string& field) {
    expect_refused(document, delete_points("a", region), ErrorCode::invalid_argument,
                   "delete_points.region" + field);
    expect_refused(document, move_points("a", region, vec(0, 0, 1)), ErrorCode::invalid_argument,
                   "move_points.region" + field);
  };
  refused({}, "");
  refused(sphere(NAN, 0, 0, 1), ".sphere.centre.x");
  refused(sphere(0, 0, 0, -1), ".sphere.radius_m");
  refused(sphere(0, 0, 0, NAN), ".sphere.radius_m");
  refused(box(vec(0, 2, 0), vec(1, 1, 1)), ".box.minimum.y");
  refused(box(vec(0, 0, 0), vec(0, 0, INFINITY)), ".box.maximum.z");
  refused(strokes({0}), ".strokes.numbers");
  refused(strokes({3}), ".strokes.numbers");
  refused(indices({6}), ".indices.indices");
  expect_refused(document, delete_points("b", indices({0})), ErrorCode::not_found, "delete_points.entity");
  expect_refused(document, move_points("a", indices({0}), vec(0, NAN, 0)), ErrorCode::invalid_argument,
                 "move_points.by.y");
  expect_refused(document, move_points("a", indices({5}), vec(1e4, 0, 0)), ErrorCode::invalid_argument,
                 "move_points.by");
}

// --- points that join a fitted shape with a refit

v1::Operation add_and_refit(const std::string& id, const std::vector<v1::Point>& points) {
  v1::Operation operation = add(id, points);
  operation.mutable_add_points()->set_refit(true);
  return operation;
}

std::vector<v1::Point> bump(int from, int count) {
  std::vector<v1::Point> points;
  for (int i = from; i < from + count; ++i) {
    points.push_back(
        point(0.02 * std::cos(0.5 * i), 0.02 * std::sin(0.5 * i), 0.012 + 0.001 * std::sin(i), 0.5));
  }
  return points;
}

TEST(AddPointsRefit, A10FitsAgainInTheFrozenFrameAsFitDoes) {
  const Document fitted = applied({}, {create("a"), add("a", saddle_points()), fit("a")});
  const Document at_once = applied(fitted, {add_and_refit("a", bump(0, 20))});
  const Document in_two = applied(fitted, {add("a", bump(0, 20)), fit("a")});
  EXPECT_EQ(document_hash(at_once), document_hash(in_two));
  EXPECT_EQ(at_once.find_dual("a")->fit->frame.rotation, fitted.find_dual("a")->fit->frame.rotation);
  EXPECT_FALSE(at_once.find_dual("a")->stale);
  // A shape without a surface gets none.
  const Document points = applied({}, {create("a"), add_and_refit("a", saddle_points())});
  EXPECT_FALSE(points.find_dual("a")->fitted());
}

TEST(AddPointsRefit, A12ANewPartnerOfAShapeShownAsASurfaceIsSeen) {
  const Document document = applied(
      {}, {create("a"), add("a", saddle_points()), fit("a"), represent("a", v1::REPRESENTATION_SURFACE),
           symmetry("a", v1::SetSymmetry::PARTNER), add("a", saddle_points(0.01))});
  EXPECT_EQ(document.find_dual("a")->representation, Representation::surface);
  EXPECT_EQ(document.find_dual("a-mirror")->representation, Representation::points);
}

TEST(AddPointsRefit, PointsThatCarryNoSurfaceAreKeptAndSaidSo) {
  const Document emptied =
      applied({}, {create("a"), add("a", saddle_points()), fit("a"), delete_points("a", sphere(0, 0, 0, 1))});
  const auto result = apply(emptied, add_and_refit("a", {point(0, 0, 0)}));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->document.find_dual("a")->points.size(), 1U);
  EXPECT_TRUE(result->document.find_dual("a")->stale);
  ASSERT_EQ(result->notes.size(), 1U);
}

TEST(AddPointsRefit, A27ThePreviewIsTheCommittedSurfaceButForRounding) {
  for (const std::uint32_t degree : {1U, 2U, 3U, 4U}) {
    for (const auto mode : {v1::SetSymmetry::OFF, v1::SetSymmetry::SAME_SHAPE, v1::SetSymmetry::PARTNER}) {
      Model model(
          applied({}, {create("a", degree), symmetry("a", mode), add("a", saddle_points(0.01)), fit("a")}));
      auto gesture = model.begin_provisional(add_and_refit("a", {}));
      ASSERT_TRUE(gesture.ok());
      for (int i = 0; i < 60; i += 3) ASSERT_TRUE(model.append_provisional(*gesture, bump(i, 3)).ok());
      const Document preview = model.preview();
      ASSERT_TRUE(model.commit_provisional(*gesture).ok());
      for (const std::string id : {"a", "a-mirror"}) {
        const DualPtr live = preview.find_dual(id);
        const DualPtr committed = model.document().find_dual(id);
        if (!committed) continue;
        EXPECT_FALSE(live->stale);
        EXPECT_FALSE(committed->stale);
        EXPECT_EQ(live->points.size(), committed->points.size());
        EXPECT_EQ(live->fit->surface.degree(), committed->fit->surface.degree());
        EXPECT_EQ(live->fit->frame.rotation, committed->fit->frame.rotation);
        EXPECT_LE((live->fit->box.centre - committed->fit->box.centre).norm(), 1e-15);
        EXPECT_NEAR(live->fit->statistics.weighted_rms, committed->fit->statistics.weighted_rms, 1e-12);
        for (const DualPoint& p : committed->points) {
          const geometry::Vec3 local = live->fit->frame.to_local(p.position());
          EXPECT_NEAR(live->fit->surface.value(local.x(), local.y()),
                      committed->fit->surface.value(local.x(), local.y()), 1e-13);
        }
      }
    }
  }
}

TEST(AddPointsRefit, AFollowedGestureLeavesNoTraceWhenCancelled) {
  Model model(applied({}, {create("a"), add("a", saddle_points()), fit("a")}));
  const std::string before = document_hash(model.document());
  auto gesture = model.begin_provisional(add_and_refit("a", {}));
  ASSERT_TRUE(gesture.ok());
  ASSERT_TRUE(model.append_provisional(*gesture, bump(0, 10)).ok());
  EXPECT_NE(model.preview().find_dual("a")->fit, model.document().find_dual("a")->fit);
  EXPECT_TRUE(model.cancel_provisional(*gesture));
  EXPECT_EQ(document_hash(model.preview()), before);
}

// --- the automatic degree

v1::Operation automatic(const std::string& id, std::uint32_t highest = 0) {
  v1::Operation operation = fit(id, highest);
  operation.mutable_fit()->set_automatic_degree(true);
  return operation;
}

TEST(FitAutomaticDegree, A4ChoosesReportsAndReplays) {
  std::vector<v1::Point> points;
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 12; ++j) {
      const double x = -0.055 + 0.01 * i;
      const double y = -0.055 + 0.01 * j;
      points.push_back(point(x, y, 0.02 + 20 * x * x * x - 2 * y * y + 1e-5 * ((7 * i + 11 * j) % 13 - 6)));
    }
  }
  const Document laid = applied({}, {create("a", 1), add("a", points)});
  const auto result = apply(laid, automatic("a"));
  ASSERT_TRUE(result.ok());
  const DualPtr shape = result->document.find_dual("a");
  EXPECT_EQ(shape->fit->surface.degree(), 3);
  EXPECT_EQ(shape->requested_degree, 3U);
  ASSERT_EQ(shape->fit->cross_validated_rms_m.size(), 6U);
  EXPECT_GT(shape->fit->cross_validated_rms_m[1], 2 * shape->fit->cross_validated_rms_m[2]);
  EXPECT_EQ(result->effective.fit().chosen_degree(), 3U);
  EXPECT_EQ(result->effective.fit().degree(), 6U);
  ASSERT_EQ(result->notes.size(), 1U);
  const auto replayed = apply(laid, result->effective);
  ASSERT_TRUE(replayed.ok());
  EXPECT_EQ(document_hash(replayed->document), document_hash(result->document));
  // What the log says holds, though this machine should find otherwise.
  v1::Operation other = result->effective;
  other.mutable_fit()->set_chosen_degree(2);
  EXPECT_EQ(apply(laid, other)->document.find_dual("a")->fit->surface.degree(), 2);
  // Again: nothing changes. A fit by hand forgets the scores.
  EXPECT_TRUE(apply(result->document, automatic("a"))->changes.empty());
  EXPECT_TRUE(applied(result->document, {fit("a", 2)}).find_dual("a")->fit->cross_validated_rms_m.empty());
  EXPECT_EQ(apply(laid, automatic("a", 2))->document.find_dual("a")->fit->surface.degree(), 2);
}

TEST(FitAutomaticDegree, A7TakesWhatThePointsCarryAndA12GivesThePartnerTheSame) {
  const Document laid = applied({}, {create("a"), symmetry("a", v1::SetSymmetry::PARTNER),
                                     add("a", {point(0.1, 0, 0), point(0.2, 0, 0.01), point(0.1, 0.1, 0),
                                               point(0.2, 0.1, 0.02), point(0.15, 0.05, 0)})});
  const auto result = apply(laid, automatic("a"));
  ASSERT_TRUE(result.ok());
  const DualPtr shape = result->document.find_dual("a");
  EXPECT_EQ(shape->fit->surface.degree(), 1);
  EXPECT_EQ(shape->fit->cross_validated_rms_m[1], -1.0);
  const DualPtr partner = result->document.find_dual("a-mirror");
  EXPECT_EQ(partner->requested_degree, 1U);
  EXPECT_EQ(partner->fit->surface.degree(), 1);
}

TEST(FitAutomaticDegree, BadRequestsAreRefused) {
  const Document document = applied({}, {create("a"), add("a", saddle_points())});
  v1::Operation request = fit("a", 2);
  request.mutable_fit()->set_chosen_degree(2);
  expect_refused(document, request, ErrorCode::invalid_argument, "fit.chosen_degree");
  request.mutable_fit()->set_automatic_degree(true);
  request.mutable_fit()->set_chosen_degree(3);
  expect_refused(document, request, ErrorCode::invalid_argument, "fit.chosen_degree");
  expect_refused(document, automatic("a", 7), ErrorCode::invalid_argument, "fit.degree");
  expect_refused(applied({}, {create("b")}), automatic("b"), ErrorCode::rank_deficient, "fit.entity");
}

}  // namespace
}  // namespace handloft::model
