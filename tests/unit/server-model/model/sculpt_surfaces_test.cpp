// Sculpted surfaces as entities: where they come from, moved, copied, refined, compared, imported.

#include <fmt/format.h>

#include <cmath>

#include "server-model/geometry/bspline_projection.h"
#include "server-model/model/bspline_message.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/canonical.h"
#include "tests/unit/server-model/model/model_helpers.h"
#include "tests/unit/server-model/model/sculpt_helpers.h"

namespace handloft::model::test {
namespace {

using geometry::Vec3;

TEST_F(Sculpting, AFittedShapeIsTakenExactly) {
  ASSERT_TRUE(model.submit(create("cloud")).ok());
  ASSERT_TRUE(model.submit(add("cloud", saddle_points())).ok());
  ASSERT_TRUE(model.submit(fit("cloud", 2)).ok());
  apply(R"({"create_sculpt_surface": {"id": "exact", "fitted": "cloud", "control_u": 7, "control_v": 6}})");
  const DualPtr cloud = model.document().find_dual("cloud");
  const SculptPtr exact = as_sculpt(model.document().find("exact"));
  EXPECT_EQ(exact->rest->u.control_count(), 7);
  for (double s = 0; s <= 1; s += 0.125) {
    for (double t = 0; t <= 1; t += 0.125) {
      const Vec3 place = exact->surface->evaluate(s * exact->rest->u.upper(), t * exact->rest->v.upper());
      const Vec3 local = cloud->fit->frame.to_local(place);
      EXPECT_NEAR(local.z(), cloud->fit->surface.value(local.x(), local.y()), 1e-15);
    }
  }
  EXPECT_EQ(refused(R"({"create_sculpt_surface": {"fitted": "hood"}})").field,
            "create_sculpt_surface.fitted");
}

TEST_F(Sculpting, ThereIsSomethingToMoveWhereNobodyAskedForControlPoints) {
  apply(R"({"create_sculpt_surface": {"id": "plain", "rectangle": {"width_m": 0.4, "depth_m": 0.3}}})");
  EXPECT_EQ(as_sculpt(model.document().find("plain"))->rest->u.control_count(), 3 + 4) << "four spans";
  apply(R"({"add_icon": {"entity": "plain", "id": "p", "parameters": [{"x": 0.2, "y": 0.15}]}})");
  apply(R"({"drag_icon": {"entity": "plain", "icon": "p", "translation": {"z": 0.02}}})");
  apply(
      R"({"create_sculpt_surface": {"id": "few", "rectangle": {"width_m": 0.4, "depth_m": 0.3}, "control_u": 5}})");
  EXPECT_EQ(as_sculpt(model.document().find("few"))->rest->u.control_count(), 5) << "as asked for";
}

TEST_F(Sculpting, PointsAreApproximatedWithTheErrorSaid) {
  ASSERT_TRUE(model.submit(create("cloud")).ok());
  ASSERT_TRUE(model.submit(add("cloud", saddle_points())).ok());
  const Submitted made = apply(R"({"create_sculpt_surface": {"id": "near", "points": "cloud"}})");
  ASSERT_EQ(made.notes.size(), 1U);
  EXPECT_NE(made.notes[0].find("within"), std::string::npos) << made.notes[0];
  const SculptPtr near = as_sculpt(model.document().find("near"));
  auto projector = geometry::SurfaceProjector::create(*near->surface);
  ASSERT_TRUE(projector.ok());
  for (const DualPoint& point : model.document().find_dual("cloud")->points) {
    EXPECT_LT(projector->closest(point.position())->distance_m, 1.01e-4);
  }
}

TEST_F(Sculpting, MovedWithItsIconsAndWhatTheyHold) {
  apply(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.13, "y": 0.21}]}})");
  apply(
      R"({"add_icon": {"entity": "hood", "id": "t", "property": "ICON_TANGENT_U", "parameters": [{"x": 0.3, "y": 0.1}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.03}}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "t", "translation": {"z": 0.01}}})");
  const SculptPtr before = hood();
  apply(R"({"transform": {"entities": ["hood"], "translation": {"x": 0.2}, "scale": 2,
            "rotation": {"w": 0.7071067811865476, "z": 0.7071067811865476}, "pivot": {}}})");
  EXPECT_NEAR(hood()->rest->u.length(), 0.8, 1e-12) << "parameters stay metres";
  // A drag of nothing solves anew: the same shape.
  const auto moved_control = hood()->surface->control;
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {}}})");
  for (std::size_t i = 0; i < moved_control.size(); ++i) {
    const Vec3 original = before->surface->control[i];
    const Vec3 wanted = 2 * Vec3(-original.y(), original.x(), original.z()) + Vec3(0.2, 0, 0);
    EXPECT_LT((moved_control[i] - wanted).norm(), 1e-12);
    EXPECT_LT((hood()->surface->control[i] - wanted).norm(), 1e-9);
  }
}

TEST_F(Sculpting, MovedWithTheStiffnessOfItsSprings) {
  apply(R"({"add_icon": {"entity": "hood", "id": "l", "role": "ICON_LOAD", "stiffness": 1000,
            "parameters": [{"x": 0.13, "y": 0.21}]}})");
  apply(R"({"add_icon": {"entity": "hood", "id": "r", "shape": "ICON_REGION", "stiffness": 5000,
            "parameters": [{"x": 0.25, "y": 0.05}, {"x": 0.33, "y": 0.12}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "l", "translation": {"z": 0.03}}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": 0.02}}})");
  apply(R"({"transform": {"entities": ["hood"], "scale": 3}})");
  const auto moved_control = hood()->surface->control;
  EXPECT_GT(bulge(), 0.005) << "springs that pull";
  apply(R"({"drag_icon": {"entity": "hood", "icon": "l", "translation": {}}})");
  for (std::size_t i = 0; i < moved_control.size(); ++i)
    EXPECT_LT((hood()->surface->control[i] - moved_control[i]).norm(), 1e-10) << "solved anew, the same";
}

TEST_F(Sculpting, PointsOfClosedSurfacesAreKeptOnTheFirstTurnHoweverFarTheyAreAskedFor) {
  v1::Operation make;
  v1::CreateSculptSurface& create = *make.mutable_create_sculpt_surface();
  create.set_id("tube");
  v1::BSplineSurface& surface = *create.mutable_surface();
  surface.set_degree_u(3);
  surface.set_degree_v(1);
  surface.set_periodic_u(true);
  for (int i = -3; i <= 11; ++i) surface.add_knots_u(i);
  for (const double knot : {0, 0, 1, 1}) surface.add_knots_v(knot);
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 2; ++j) {
      for (const double c : {std::cos(i * M_PI / 4), std::sin(i * M_PI / 4), 1.0 * j}) surface.add_control(c);
    }
  }
  ASSERT_TRUE(model.submit(make).ok());
  const auto tube = [&] { return as_sculpt(model.document().find("tube")); };
  const double around = tube()->rest->u.length();
  for (const double u : {-0.25 * around, 0.75 * around, 7.75 * around, 1e308}) {
    apply(fmt::format(R"({{"add_icon": {{"entity": "tube", "parameters": [{{"x": {}, "y": 0.5}}]}}}})", u));
    const double kept = tube()->icons->back().parameters[0].x();
    EXPECT_TRUE(kept >= 0 && kept < around) << kept;
    if (u < 1e300) {
      EXPECT_NEAR(kept, 0.75 * around, 1e-12 * around);
    }
  }
  apply(R"({"transform": {"entities": ["tube"], "scale": 1000}})");
  apply(R"({"drag_icon": {"entity": "tube", "icon": "icon-4", "translation": {}}})");
}

TEST_F(Sculpting, D2_SidesAreHeldWhoseKnotsRunOnBeyondThem) {
  v1::Operation make;
  v1::CreateSculptSurface& create = *make.mutable_create_sculpt_surface();
  create.set_id("open");
  v1::BSplineSurface& surface = *create.mutable_surface();
  surface.set_degree_u(3);
  surface.set_degree_v(2);
  for (int i = 0; i < 12; ++i) surface.add_knots_u(i);                      // Eight functions over 3..8.
  for (const int k : {-1, 0, 0, 1, 2, 3, 4, 5, 6}) surface.add_knots_v(k);  // Six over 0..4.
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 6; ++j) {
      for (const double c : {0.1 * i, 0.1 * j, 0.01 * i * j}) surface.add_control(c);
    }
  }
  const auto given = read_surface(surface, "surface", Limits());
  ASSERT_TRUE(given.ok());
  ASSERT_TRUE(model.submit(make).ok());
  const auto open = [&] { return as_sculpt(model.document().find("open")); };
  const double u_m = open()->rest->u.upper(), v_m = open()->rest->v.upper();
  const auto on_given = [&](double u, double v) { return given->evaluate(3 + 5 * u / u_m, 4 * v / v_m); };
  for (double s = 0; s <= 1; s += 0.125) {
    EXPECT_LT((open()->rest->evaluate(s * u_m, 0.3 * v_m) - on_given(s * u_m, 0.3 * v_m)).norm(), 1e-14);
  }
  apply(
      fmt::format(R"({{"add_icon": {{"entity": "open", "id": "p", "parameters": [{{"x": {}, "y": {}}}]}}}})",
                  u_m / 3, v_m / 2));
  apply(R"({"drag_icon": {"entity": "open", "icon": "p", "translation": {"z": 0.1}}})");
  for (double s = 0; s <= 1; s += 0.125) {
    for (const auto& [u, v] : {std::pair{0.0, s * v_m}, {u_m, s * v_m}, {s * u_m, 0.0}, {s * u_m, v_m}}) {
      EXPECT_LT((open()->surface->evaluate(u, v) - on_given(u, v)).norm(), 1e-13) << u << ", " << v;
      EXPECT_LT((open()->surface->normal(u, v) - open()->rest->normal(u, v)).norm(), 1e-12) << u << ", " << v;
    }
  }
}

TEST_F(Sculpting, DuplicatedWithItsIcons) {
  apply(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.2, "y": 0.15}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.03}}})");
  apply(R"({"duplicate": {"entity": "hood", "translation": {"y": 0.5}}})");
  const SculptPtr copy = as_sculpt(model.document().find("surface-1"));
  ASSERT_TRUE(copy);
  EXPECT_EQ(copy->icons->size(), 1U);
  EXPECT_NEAR(copy->surface->evaluate(0.2, 0.15).z(), 0.03, 1e-10);
  EXPECT_NEAR(copy->surface->evaluate(0.2, 0.15).y(), 0.5, 1e-10);
}

TEST_F(Sculpting, RefinedToTheSameShape) {
  apply(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.2, "y": 0.15}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.03}}})");
  const auto before = hood()->surface;
  apply(R"({"refine_surface": {"entity": "hood", "control_u": 25, "control_v": 11}})");
  EXPECT_EQ(hood()->surface->u.control_count(), 25);
  EXPECT_EQ(hood()->surface->v.control_count(), 11);
  for (double u = 0; u <= 0.4; u += 0.04) {
    for (double v = 0; v <= 0.3; v += 0.03) EXPECT_LT((at(u, v) - before->evaluate(u, v)).norm(), 1e-14);
  }
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.01}}})");
  EXPECT_NEAR(at(0.2, 0.15).z(), 0.04, 1e-10);
}

TEST_F(Sculpting, D4_WithoutSupportsALoadNeedsSomethingToHoldIt) {
  apply(R"({"set_sculpting": {"entity": "hood", "u_lower": "EDGE_FREE", "u_upper": "EDGE_FREE",
            "v_lower": "EDGE_FREE", "v_upper": "EDGE_FREE"}})");
  apply(
      R"({"add_icon": {"entity": "hood", "id": "f", "parameters": [{"x": 0.2, "y": 0.15}], "role": "ICON_LOAD",
            "stiffness": 1}})");
  const Error error =
      refused(R"({"drag_icon": {"entity": "hood", "icon": "f", "translation": {"z": 0.01}}})");
  EXPECT_EQ(error.code, ErrorCode::failed_precondition);
  EXPECT_NE(error.message.find("supports"), std::string::npos) << error.message;
}

TEST_F(Sculpting, D4_AbsoluteFairingFlattensABump) {
  apply(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.2, "y": 0.15}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.03}}})");
  apply(R"({"commit_sculpting": {"entity": "hood"}})");
  apply(R"({"change_icon": {"entity": "hood", "icon": "p", "state": "ICON_SLEEPING"}})");
  EXPECT_NEAR(at(0.2, 0.15).z(), 0.03, 1e-10);
  apply(R"({"set_sculpting": {"entity": "hood", "mode": "ABSOLUTE"}})");
  EXPECT_NEAR(at(0.2, 0.15).z(), 0, 1e-9) << "the sides are flat, so is the fairest surface";
  apply(R"({"set_sculpting": {"entity": "hood", "mode": "DISPLACEMENT"}})");
  EXPECT_NEAR(at(0.2, 0.15).z(), 0.03, 1e-10);
}

TEST_F(Sculpting, QueriesTellIconsAndPlaces) {
  apply(
      R"({"add_icon": {"entity": "hood", "id": "t", "property": "ICON_TANGENT_V", "parameters": [{"x": 0.2, "y": 0.15}]}})");
  v1::Query query;
  query.mutable_sculpt()->set_entity("hood");
  query.mutable_sculpt()->set_control(true);
  auto result = model.query(query);
  ASSERT_TRUE(result.ok());
  const v1::SculptResult& sculpt = result->sculpt();
  ASSERT_EQ(sculpt.icons_size(), 1);
  EXPECT_EQ(sculpt.icons(0).label(), "V");
  EXPECT_NEAR(sculpt.icons(0).direction().y(), 1, 1e-12);
  EXPECT_EQ(sculpt.surface().control_size(), 3 * 12 * 10);
  auto again = read_surface(sculpt.surface(), "surface", {});
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->control, hood()->surface->control);
  v1::Query evaluate;
  evaluate.mutable_evaluate()->set_entity("hood");
  evaluate.mutable_evaluate()->add_at()->set_x(0.2);
  result = model.query(evaluate);
  ASSERT_TRUE(result.ok());
  EXPECT_NEAR(result->evaluate().positions(0).y(), -0.15, 1e-12);
  v1::Query pick;
  pick.mutable_pick()->mutable_origin()->set_z(1);
  pick.mutable_pick()->mutable_direction()->set_z(-1);
  result = model.query(pick);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->pick().entity(), "hood");
  EXPECT_NEAR(result->pick().distance_m(), 1, 1e-12);
}

v1::Operation model_of_two_faces() {
  v1::Operation import;
  v1::ImportModel& request = *import.mutable_import_model();
  request.set_id("car");
  v1::ResolvedModel& resolved = *request.mutable_resolved();
  resolved.set_boundary_representation("bytes that only the exchange reads");
  resolved.set_metres_per_unit(0.001);
  resolved.add_notes("face 3 stays as it is: its trim is torn");
  for (std::uint32_t number : {2U, 5U}) {
    v1::ResolvedModel::Face& face = *resolved.add_faces();
    face.set_number(number);
    v1::BSplineSurface& surface = *face.mutable_surface();
    surface.set_degree_u(1);
    surface.set_degree_v(1);
    for (const double knot : {0, 0, 1, 1}) {
      surface.add_knots_u(knot);
      surface.add_knots_v(knot);
    }
    for (const double c : {0, 0, 0, 0, 1, 0, 2, 0, 0, 2, 1, 0}) surface.add_control(c);
    v1::BSplineCurve2& curve = *face.add_loops()->add_curves();
    curve.set_degree(1);
    for (const double knot : {0, 0, 1, 2, 3, 3}) curve.add_knots(knot);
    for (const double c : {0.1, 0.1, 0.9, 0.1, 0.9, 0.9, 0.1, 0.1}) curve.add_control(c);
  }
  return import;
}

TEST_F(Sculpting, AModelBringsItsFacesWithTheirTrimsInMetres) {
  const auto submitted = model.submit(model_of_two_faces());
  ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
  const SculptPtr face = as_sculpt(model.document().find("car.face-5"));
  ASSERT_TRUE(face);
  EXPECT_EQ(face->model, "car");
  EXPECT_EQ(face->face, 5U);
  EXPECT_NEAR(face->rest->u.length(), 2, 1e-12);
  EXPECT_NEAR((*face->trim)[0][0].control[1].x(), 1.8, 1e-12) << "0.9 of 2 m";
  EXPECT_EQ(submitted->notes, (std::vector<std::string>{"face 3 stays as it is: its trim is torn"}));
  const CadModelPtr car = as_cad_model(model.document().find("car"));
  ASSERT_TRUE(car);
  EXPECT_EQ(car->faces, (std::vector<std::string>{"car.face-2", "car.face-5"}));
  apply(R"({"undo": {}})");
  EXPECT_FALSE(model.document().find("car.face-2"));
  apply(R"({"redo": {}})");

  v1::Operation bad = model_of_two_faces();
  bad.mutable_import_model()->set_id("bad");
  bad.mutable_import_model()->mutable_resolved()->mutable_faces(1)->mutable_surface()->set_control(3, NAN);
  auto refusal = model.submit(bad);
  ASSERT_FALSE(refusal.ok());
  EXPECT_EQ(refusal.error().field, "import_model.resolved.faces[1].surface.control[3]");
  bad = model_of_two_faces();
  bad.mutable_import_model()->clear_resolved();
  refusal = model.submit(bad);
  ASSERT_FALSE(refusal.ok());
  EXPECT_EQ(refusal.error().code, ErrorCode::failed_precondition);
}

}  // namespace
}  // namespace handloft::model::test
