// Trimming by a drawn curve (A24), what queries say of it, and picking what is seen (A22-A24).

#include <gtest/gtest.h>

#include <numbers>

#include "model_helpers.h"
#include "server-model/model/query.h"

namespace handloft::model {
namespace {

using namespace test;
namespace v1 = handloft::v1;

/// A circle about (x, 0) in the plane of the saddle, 1 cm above it; `turn` of it is drawn.
v1::Operation circle(const std::string& id, double radius, double x = 0, double turn = 1) {
  v1::Operation operation;
  auto& request = *operation.mutable_set_boundary();
  request.set_entity(id);
  constexpr int count = 400;
  for (int i = 0; i <= count; ++i) {
    const double angle = turn * 2 * std::numbers::pi * i / count;
    v1::Vec3& p = *request.add_curve();
    p.set_x(x + radius * std::cos(angle));
    p.set_y(radius * std::sin(angle));
    p.set_z(0.02);
  }
  return operation;
}

v1::Operation no_curve(const std::string& id) {
  v1::Operation operation;
  operation.mutable_set_boundary()->set_entity(id);
  return operation;
}

/// Flat and level, so that its frame's plane is the world's.
Document flat() {
  std::vector<v1::Point> points;
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 5; ++j) points.push_back(point(-0.04 + 0.01 * i, -0.02 + 0.01 * j, 0.0));
  }
  return applied({}, {create("top"), add("top", points), fit("top", 1)});
}

v1::QueryResult ask(const Document& document, const v1::Query& query) {
  auto result = answer(query, document, History{}, {}, {});
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().describe());
  return result ? *result : v1::QueryResult();
}

std::string trim_of(const Document& document, const std::string& id) {
  v1::Query query;
  query.mutable_surface()->set_entity(id);
  return ask(document, query).surface().trim();
}

/// The opacity over a place of the world's plane.
double opacity_at(const Document& document, const std::string& id, double x, double y) {
  const DualPtr shape = document.find_dual(id);
  const geometry::Vec3 local = shape->fit->frame.to_local({x, y, 0});
  v1::Query query;
  query.mutable_evaluate()->set_entity(id);
  query.mutable_evaluate()->add_at()->set_x(local.x());
  query.mutable_evaluate()->mutable_at(0)->set_y(local.y());
  return ask(document, query).evaluate().opacity(0);
}

v1::PickResult pick(const Document& document, double x, double y, double z = 0.5) {
  v1::Query query;
  query.mutable_pick()->mutable_origin()->set_x(x);
  query.mutable_pick()->mutable_origin()->set_y(y);
  query.mutable_pick()->mutable_origin()->set_z(z);
  query.mutable_pick()->mutable_direction()->set_z(-2);
  return ask(document, query).pick();
}

TEST(SetBoundary, A24_OpacityOfEquation8InsideTheCurve) {
  const Document before = flat();
  EXPECT_EQ(trim_of(before, "top"), "superellipse");
  const Document after = applied(before, {circle("top", 0.02)});
  EXPECT_EQ(trim_of(after, "top"), "boundary");
  EXPECT_NEAR(opacity_at(after, "top", 0, 0), 0.99995, 1e-5);
  EXPECT_NEAR(opacity_at(after, "top", 0.02, 0), 0.5, 1e-3);
  EXPECT_NEAR(opacity_at(after, "top", 0, 0.03), 1 / (1 + std::exp(5)), 1e-4);
  EXPECT_NE(document_hash(before), document_hash(after));
}

TEST(SetBoundary, A24_DoublingTheExtentLeavesTheOpacity) {
  // Points twice as far out: footprint and mesh grow, the distances from the curve and the largest of them,
  // which eq. 8 divides by, do not.
  const Document before = applied(flat(), {circle("top", 0.02)});
  std::vector<v1::Point> wide;
  for (const double x : {-0.08, 0.08}) {
    for (const double y : {-0.04, 0.04}) wide.push_back(point(x, y, 0.0));
  }
  const Document after = applied(before, {add("top", wide), fit("top", 1)});
  ASSERT_NEAR(after.find_dual("top")->fit->box.half_extent.x(),
              2 * before.find_dual("top")->fit->box.half_extent.x(), 1e-12);
  for (int i = -6; i <= 6; ++i) {
    for (int j = -6; j <= 6; ++j) {
      const double x = 0.005 * i;
      const double y = 0.005 * j;
      EXPECT_NEAR(opacity_at(after, "top", x, y), opacity_at(before, "top", x, y), 1e-6);
    }
  }
}

TEST(SetBoundary, NoCurveOrAnExponentBringsTheSuperellipseBack) {
  const Document before = applied(flat(), {superellipse("top", 3)});
  const Document drawn = applied(before, {circle("top", 0.02)});
  const Document none = applied(drawn, {no_curve("top")});
  EXPECT_EQ(document_hash(none), document_hash(before)) << "with the exponent it had";
  EXPECT_EQ(trim_of(applied(drawn, {superellipse("top", 3)}), "top"), "superellipse");
  EXPECT_EQ(document_hash(applied(drawn, {superellipse("top", 3)})), document_hash(before));
}

TEST(SetBoundary, A24_RefusesAGapAboveATenthWithBothFigures) {
  const Document document = flat();
  EXPECT_EQ(trim_of(applied(document, {circle("top", 0.02, 0, 0.95)}), "top"), "boundary");
  const auto open = circle("top", 0.02, 0, 0.8);
  expect_refused(document, open, ErrorCode::invalid_argument, "set_boundary.curve");
  const std::string message = apply(document, open).error().message;
  EXPECT_NE(message.find("gap of 0.0235"), std::string::npos) << message;
  EXPECT_NE(message.find("curve of 0.1005"), std::string::npos) << message;
}

TEST(SetBoundary, RefusesWhatCanNotTrim) {
  const Document document = flat();
  expect_refused(document, circle("side", 0.02), ErrorCode::not_found, "set_boundary.entity");
  expect_refused(applied({}, {create("top")}), circle("top", 0.02), ErrorCode::failed_precondition,
                 "set_boundary.entity");
  expect_refused(document, circle("top", 0), ErrorCode::invalid_argument, "set_boundary.curve");
  auto bad = circle("top", 0.02);
  bad.mutable_set_boundary()->mutable_curve(7)->set_y(std::nan(""));
  expect_refused(document, bad, ErrorCode::invalid_argument, "set_boundary.curve[7]");
  bad.mutable_set_boundary()->mutable_curve(7)->set_y(1e9);
  expect_refused(document, bad, ErrorCode::invalid_argument, "set_boundary.curve[7]");
  ApplyContext small;
  small.limits.max_boundary_points = 400;
  expect_refused(document, circle("top", 0.02), ErrorCode::resource_exhausted, "set_boundary.curve", small);
}

TEST(SetBoundary, A12_ALinkedPartnerGetsTheMirrorImage) {
  Document document = applied({}, {create("side"), symmetry("side", v1::SetSymmetry::PARTNER, 0.1),
                                   add("side", saddle_points()), fit("side")});
  const auto partner = document.find_dual("side")->partner;
  ASSERT_FALSE(partner.empty());
  document = applied(document, {circle("side", 0.015)});
  EXPECT_EQ(trim_of(document, partner), "boundary");
  for (const double x : {0.0, 0.01, 0.015, 0.02}) {
    EXPECT_NEAR(opacity_at(document, "side", x, 0.003), opacity_at(document, partner, 0.2 - x, 0.003), 1e-9);
  }
  document = applied(document, {no_curve("side")});
  EXPECT_EQ(trim_of(document, partner), "superellipse");
}

TEST(SetBoundary, StaysThroughFitsAndIsProjectedAnewOnARefittedPlane) {
  Document document =
      applied({}, {create("top"), add("top", saddle_points()), fit("top"), circle("top", 0.015)});
  document = applied(document, {add("top", {point(0.03, 0.01, 0.03)}), fit("top", 3)});
  EXPECT_EQ(trim_of(document, "top"), "boundary");
  document = applied(document, {refit_plane("top")});
  EXPECT_EQ(trim_of(document, "top"), "boundary");
  const auto trim = document.find_dual("top")->trim();
  ASSERT_TRUE(trim.ok());
  EXPECT_NEAR(trim->boundary()->reach(), 0.015, 0.002);
}

TEST(SetBoundary, A28_UndoIsBitIdentical) {
  Model model(flat());
  const std::string before = document_hash(model.document());
  ASSERT_TRUE(model.submit(circle("top", 0.02)).ok());
  const std::string after = document_hash(model.document());
  ASSERT_TRUE(model.submit(undo()).ok());
  EXPECT_EQ(document_hash(model.document()), before);
  ASSERT_TRUE(model.submit(redo()).ok());
  EXPECT_EQ(document_hash(model.document()), after);
}

TEST(Pick, A22_A24_MeetsOnlyWhatIsSeen) {
  const Document document = applied(flat(), {circle("top", 0.02, 0.01)});
  EXPECT_EQ(pick(document, 0.01, 0).entity(), "top");
  EXPECT_NEAR(pick(document, 0.01, 0).distance_m(), 0.5, 1e-9);
  EXPECT_NEAR(pick(document, 0.01, 0).position().z(), 0, 1e-12);
  EXPECT_EQ(pick(document, 0.0299, 0).entity(), "top");
  EXPECT_EQ(pick(document, 0.0301, 0).entity(), "");
  EXPECT_EQ(pick(document, -0.02, 0).entity(), "") << "seen before the curve was drawn";
  EXPECT_EQ(pick(flat(), -0.02, 0).entity(), "top");
  EXPECT_EQ(pick(document, 0.01, 0, -0.5).entity(), "") << "behind the ray";
  EXPECT_EQ(pick(applied(document, {represent("top", v1::REPRESENTATION_POINTS)}), 0.01, 0).entity(), "");
}

TEST(Pick, TheNearestOfSeveral) {
  std::vector<v1::Point> above;
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 5; ++j) above.push_back(point(-0.04 + 0.01 * i, -0.02 + 0.01 * j, 0.1));
  }
  const Document document = applied(flat(), {create("roof"), add("roof", above), fit("roof", 1)});
  EXPECT_EQ(pick(document, 0, 0).entity(), "roof");
  EXPECT_NEAR(pick(document, 0, 0).distance_m(), 0.4, 1e-9);
  EXPECT_EQ(pick(document, 0, 0, 0.05).entity(), "top");
}

TEST(Pick, BadRaysAreRefused) {
  v1::Query query;
  query.mutable_pick();
  EXPECT_EQ(answer(query, flat(), History{}, {}, {}).error().field, "pick.direction");
  query.mutable_pick()->mutable_direction()->set_z(std::nan(""));
  EXPECT_EQ(answer(query, flat(), History{}, {}, {}).error().field, "pick.direction");
  query.mutable_pick()->mutable_direction()->set_z(1);
  query.mutable_pick()->mutable_origin()->set_x(std::nan(""));
  EXPECT_EQ(answer(query, flat(), History{}, {}, {}).error().field, "pick.origin");
}

}  // namespace
}  // namespace handloft::model
