// PushPoints (A9, A12-A17): the operation, its gesture and its limits.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "model_helpers.h"
#include "server-model/geometry/symmetry.h"

namespace handloft::model {
namespace {

using namespace test;

// A disk that looks down.
v1::DiskPose disk(double x, double y, double z, double radius = 0.012) {
  v1::DiskPose pose;
  pose.mutable_centre()->set_x(x);
  pose.mutable_centre()->set_y(y);
  pose.mutable_centre()->set_z(z);
  pose.mutable_normal()->set_z(-2);
  pose.set_radius_m(radius);
  return pose;
}

v1::Operation push(const std::string& id, const std::vector<v1::DiskPose>& path, double range = 0) {
  v1::Operation operation;
  operation.mutable_push_points()->add_entities(id);
  for (const auto& pose : path) *operation.mutable_push_points()->add_path() = pose;
  operation.mutable_push_points()->set_range(range);
  return operation;
}

// Ten poses that dive and slide.
std::vector<v1::DiskPose> gesture() {
  std::vector<v1::DiskPose> poses;
  for (int i = 0; i < 10; ++i) {
    poses.push_back(disk(0.002 * i, 0.001 * i, 0.03 - 0.0035 * i));
    poses.back().mutable_normal()->set_x(0.05 * i);
  }
  return poses;
}

Document saddle() {
  Model model;
  for (const auto& operation : {create("top"), add("top", saddle_points())}) {
    EXPECT_TRUE(model.submit(operation));
  }
  return model.document();
}

Error refusal(const v1::Operation& operation) {
  const auto result = apply(saddle(), operation);
  EXPECT_FALSE(result);
  return result ? Error{} : result.error();
}

TEST(PushPoints, A14_MovesWhatTheDiskMeetsAndNothingElseWithoutRange) {
  const Document before = saddle();
  const auto result = apply(before, push("top", {disk(0, 0, 0.05), disk(0, 0, 0.0)}));
  ASSERT_TRUE(result);
  const auto a = before.find_dual("top"), b = result->document.find_dual("top");
  int moved = 0;
  for (std::size_t i = 0; i < a->points.size(); ++i) {
    const bool under = std::hypot(a->points[i].x, a->points[i].y) <= 0.012;
    EXPECT_NEAR(b->points[i].z, under ? 0.0 : a->points[i].z, 1e-15);
    EXPECT_EQ(b->points[i].x, a->points[i].x);
    EXPECT_EQ(b->points[i].pressure, a->points[i].pressure);
    moved += under;
  }
  EXPECT_GT(moved, 2);
  EXPECT_EQ(result->words, "Push " + std::to_string(moved) + " points of \"top\"");
}

TEST(PushPoints, A16_RangePropagates) {
  const Document before = saddle();
  const auto result = apply(before, push("top", {disk(0, 0, 0.05), disk(0, 0, 0.0)}, 0.6));
  ASSERT_TRUE(result);
  int moved = 0;
  for (std::size_t i = 0; i < 30; ++i) {
    moved += before.find_dual("top")->points[i].z != result->document.find_dual("top")->points[i].z;
  }
  EXPECT_GT(moved, 15);
}

TEST(PushPoints, APushThatMeetsNothingChangesNothing) {
  Model model(saddle());
  const std::string hash = document_hash(model.document());
  const auto submitted = model.submit(push("top", {disk(0, 0, 0.05), disk(0, 0, 0.04)}, 1));
  ASSERT_TRUE(submitted);
  EXPECT_EQ(submitted->sequence, 0U);
  EXPECT_EQ(document_hash(model.document()), hash);
}

TEST(PushPoints, A9_MarksTheFitStaleOrFitsAgainInTheFrozenFrame) {
  Model model(saddle());
  ASSERT_TRUE(model.submit(fit("top")));
  const auto frame = model.document().find_dual("top")->fit->frame;
  v1::Operation operation = push("top", {disk(0, 0, 0.05), disk(0, 0, 0.0)}, 0.5);
  ASSERT_TRUE(model.submit(operation));
  EXPECT_TRUE(model.document().find_dual("top")->stale);
  ASSERT_TRUE(model.submit(v1::Operation(operation)).ok());
  operation.mutable_push_points()->set_refit(true);
  operation.mutable_push_points()->mutable_path(1)->mutable_centre()->set_z(-0.01);
  ASSERT_TRUE(model.submit(operation));
  const auto shape = model.document().find_dual("top");
  EXPECT_FALSE(shape->stale);
  EXPECT_EQ(shape->fit->frame.rotation, frame.rotation);
  EXPECT_EQ(shape->fit->frame.origin, frame.origin);
}

TEST(PushPoints, A12_LinkedPointsOfTheSameShapeFollowMirrored) {
  Model model;
  ASSERT_TRUE(model.submit(create("top")));
  ASSERT_TRUE(model.submit(symmetry("top", v1::SetSymmetry::SAME_SHAPE, -0.03)));
  ASSERT_TRUE(model.submit(add("top", saddle_points())));
  const Document before = model.document();
  auto path = gesture();
  ASSERT_TRUE(model.submit(push("top", path, 0.4)));
  const auto a = before.find_dual("top"), b = model.document().find_dual("top");
  int moved = 0;
  for (std::uint32_t i = 0; i < b->points.size(); ++i) {
    const auto image = b->mirror_partner(i);
    ASSERT_NE(image, DualPoint::no_partner);
    EXPECT_LT(
        (geometry::reflect_point(b->points[i].position(), b->plane) - b->points[image].position()).norm(),
        1e-15);
    moved += a->points[i].z != b->points[i].z;
  }
  EXPECT_GT(moved, 20);
}

TEST(PushPoints, A12_LinkedPartnerShapeFollowsAndUndoRestoresBoth) {
  for (const bool both_named : {false, true}) {
    Model model;
    ASSERT_TRUE(model.submit(create("top")));
    ASSERT_TRUE(model.submit(symmetry("top", v1::SetSymmetry::PARTNER, -0.03)));
    ASSERT_TRUE(model.submit(add("top", saddle_points())));
    const std::string hash = document_hash(model.document());
    v1::Operation operation = push("top", gesture(), 0.4);
    if (both_named) operation.mutable_push_points()->add_entities("top-mirror");
    const auto submitted = model.submit(operation);
    ASSERT_TRUE(submitted);
    EXPECT_EQ(submitted->changes.changed, (std::vector<std::string>{"top", "top-mirror"}));
    const auto top = model.document().find_dual("top"), mirror = model.document().find_dual("top-mirror");
    for (std::uint32_t i = 0; i < top->points.size(); ++i) {
      const auto image = top->mirror_partner(i);
      EXPECT_LT(
          (geometry::reflect_point(top->points[i].position(), top->plane) - mirror->points[image].position())
              .norm(),
          1e-15);
    }
    v1::Operation undo;
    undo.mutable_undo();
    ASSERT_TRUE(model.submit(undo));
    EXPECT_EQ(document_hash(model.document()), hash);
  }
}

TEST(PushPoints, A12_DiskAcrossTheMirrorPlanePushesOnce) {
  Model model;
  ASSERT_TRUE(model.submit(create("top")));
  ASSERT_TRUE(model.submit(symmetry("top", v1::SetSymmetry::SAME_SHAPE, 0)));
  ASSERT_TRUE(model.submit(add("top", {point(0.004, 0, 0.01), point(0.1, 0, 0.01)})));
  ASSERT_TRUE(model.submit(push("top", {disk(0, 0, 0.02), disk(0, 0, 0.005)})));
  const auto shape = model.document().find_dual("top");
  EXPECT_NEAR(shape->points[0].z, 0.005, 1e-15);
  EXPECT_NEAR(shape->points[1].z, 0.005, 1e-15);
  EXPECT_EQ(shape->points[2].z, 0.01);
}

TEST(PushPoints, A17_GestureInPiecesEqualsTheWholeToTheBit) {
  for (const bool refit : {false, true}) {
    const auto path = gesture();
    Model model(saddle());
    ASSERT_TRUE(model.submit(fit("top")));
    const Document base = model.document();
    v1::Operation first = push("top", {path[0], path[1]}, 0.1);
    first.mutable_push_points()->set_refit(refit);
    const auto id = model.begin_provisional(first);
    ASSERT_TRUE(id);
    for (std::size_t i = 2; i < path.size(); ++i) {
      ASSERT_TRUE(model.append_disk(*id, std::span(&path[i], 1), 0.1 * static_cast<double>(i)));
    }
    ASSERT_TRUE(model.append_disk(*id, {}, 0.55));  // The potentiometer alone.
    const auto preview = document_hash(model.preview());
    v1::Operation whole = push("top", path, 0.55);
    whole.mutable_push_points()->set_refit(refit);
    const auto at_once = apply(base, whole);
    ASSERT_TRUE(at_once);
    EXPECT_EQ(document_hash(at_once->document), preview);
    ASSERT_TRUE(model.commit_provisional(*id));
    EXPECT_EQ(document_hash(model.document()), preview);
    EXPECT_NE(preview, document_hash(base));
  }
}

TEST(PushPoints, CancelledGestureLeavesNoTrace) {
  Model model(saddle());
  const std::string hash = document_hash(model.document());
  const auto path = gesture();
  const auto id = model.begin_provisional(push("top", {path[0], path[0]}));
  ASSERT_TRUE(id);
  ASSERT_TRUE(model.append_disk(*id, path, 1));
  EXPECT_NE(document_hash(model.preview()), hash);
  EXPECT_TRUE(model.cancel_provisional(*id));
  EXPECT_EQ(document_hash(model.preview()), hash);
}

TEST(PushPoints, RefusedPosesLeaveTheGestureAsItWas) {
  Model model(saddle());
  const auto path = gesture();
  const auto id = model.begin_provisional(push("top", {path[0], path[4]}, 0.3));
  ASSERT_TRUE(id);
  ASSERT_TRUE(model.append_disk(*id, std::span(&path[5], 1), 0.3));
  const std::string hash = document_hash(model.preview());
  auto bad = path[6];
  bad.mutable_centre()->set_x(std::nan(""));
  EXPECT_EQ(model.append_disk(*id, std::span(&bad, 1), 0.3).error().field, "path[3].centre.x");
  EXPECT_EQ(model.append_disk(*id, std::span(&path[6], 1), 1.5).error().field, "range");
  EXPECT_EQ(document_hash(model.preview()), hash);
  ASSERT_TRUE(model.append_disk(*id, std::span(&path[6], 1), 0.4));
  ASSERT_TRUE(model.commit_provisional(*id));
  const auto whole = apply(saddle(), push("top", {path[0], path[4], path[5], path[6]}, 0.4));
  EXPECT_EQ(document_hash(whole->document), document_hash(model.document()));
  EXPECT_FALSE(model.append_disk(77, {}, 0.5));
}

TEST(PushPoints, EveryFieldIsChecked) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const auto good = std::vector{disk(0, 0, 0.05), disk(0, 0, 0.0)};
  EXPECT_EQ(refusal(push("nobody", good)).field, "push_points.entities[0]");
  EXPECT_EQ(refusal(push("top", {good[0]})).field, "push_points.path");
  for (const double range : {nan, -0.1, 1.1, inf}) {
    EXPECT_EQ(refusal(push("top", good, range)).field, "push_points.range");
  }
  auto bad = push("top", good);
  bad.mutable_push_points()->clear_entities();
  EXPECT_EQ(refusal(bad).field, "push_points.entities");
  bad = push("top", good);
  bad.mutable_push_points()->add_entities("top");
  EXPECT_EQ(refusal(bad).field, "push_points.entities[1]");
  bad = push("top", good);
  bad.mutable_push_points()->set_falloff(static_cast<v1::Falloff>(9));
  EXPECT_EQ(refusal(bad).field, "push_points.falloff");
  for (const double radius : {nan, -0.01, 1e6}) {
    bad = push("top", good);
    bad.mutable_push_points()->mutable_path(1)->set_radius_m(radius);
    EXPECT_EQ(refusal(bad).field, "push_points.path[1].radius_m");
  }
  bad = push("top", good);
  bad.mutable_push_points()->mutable_path(0)->clear_normal();
  EXPECT_EQ(refusal(bad).field, "push_points.path[0].normal");
  bad = push("top", good);
  bad.mutable_push_points()->mutable_path(0)->mutable_centre()->set_y(1e9);
  EXPECT_EQ(refusal(bad).field, "push_points.path[0].centre.y");
  ApplyContext context;
  context.limits.max_disk_poses = 1;
  const auto many = apply(saddle(), push("top", good), context);
  ASSERT_FALSE(many);
  EXPECT_EQ(many.error().code, ErrorCode::resource_exhausted);
}

}  // namespace
}  // namespace handloft::model
