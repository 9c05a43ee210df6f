// Region icons that end where they were picked, and icons across the seam of a closed surface (D9 - D14).

#include <fmt/format.h>

#include <cmath>

#include "server-model/geometry/region_border.h"
#include "server-model/model/canonical.h"
#include "server-model/model/sculpt_border.h"
#include "tests/unit/server-model/model/sculpt_helpers.h"

namespace handloft::model::test {
namespace {

using geometry::BSplineSurface;
using geometry::Vec2;
using geometry::Vec3;

constexpr const char* picked =
    R"({"add_icon": {"entity": "hood", "id": "r", "shape": "ICON_REGION",
        "parameters": [{"x": 0.15, "y": 0.12}, {"x": 0.22, "y": 0.2}]}})";

double largest_between(const BSplineSurface& a, const BSplineSurface& b) {
  double largest = 0;
  for (int i = 0; i <= 60; ++i) {
    for (int j = 0; j <= 60; ++j) {
      const double u = a.u.lower() + a.u.length() * i / 60, v = a.v.lower() + a.v.length() * j / 60;
      largest = std::max(largest, (a.evaluate(u, v) - b.evaluate(u, v)).norm());
    }
  }
  return largest;
}

/// How far the rectangle is from its place at rest, moved by a translation.
double off_body(const SculptShape& shape, const Vec2& lower, const Vec2& upper, const Vec3& by) {
  double most = 0;
  for (int i = 0; i <= 60; ++i) {
    for (int j = 0; j <= 60; ++j) {
      const double u = lower.x() + (upper.x() - lower.x()) * i / 60;
      const double v = lower.y() + (upper.y() - lower.y()) * j / 60;
      most = std::max(most, (shape.surface->evaluate(u, v) - shape.rest->evaluate(u, v) - by).norm());
    }
  }
  return most;
}

class Regions : public Sculpting {
 protected:
  /// Bends the hood by a point icon first, so that it is not at rest.
  void bend() {
    apply(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.1, "y": 0.1}]}})");
    apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.02}}})");
  }
};

TEST_F(Regions, D11KnotsAtTheBorderMoveNothingAndHoldThePickedRectangleAlone) {
  const SculptPtr before = hood();
  const Submitted added = apply(picked);
  ASSERT_EQ(added.notes.size(), 1U);
  EXPECT_NE(added.notes[0].find("4 knots at the border of region \"r\": 14 x 12"), std::string::npos)
      << added.notes[0];
  EXPECT_EQ(hood()->rest->u.control_count(), 14);
  EXPECT_EQ(hood()->rest->v.control_count(), 12);
  EXPECT_EQ(hood()->surface, hood()->rest);
  EXPECT_LE(largest_between(*before->surface, *hood()->surface), 1e-12);
  EXPECT_EQ(hood()->initial, before->initial) << "as made, for recovery";
  EXPECT_EQ(region_hold(icon("r"), *hood()->rest), RegionHold::points);
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": 0.02}}})");
  EXPECT_LE(off_body(*hood(), {0.15, 0.12}, {0.22, 0.2}, {0, 0, 0.02}), 1e-9);
  for (const Vec2& uv : {Vec2(0.14, 0.16), Vec2(0.23, 0.16), Vec2(0.18, 0.11), Vec2(0.18, 0.21)})
    EXPECT_LT(at(uv.x(), uv.y()).z(), 0.02 - 1e-6) << "outside is free";
}

TEST_F(Regions, D11InsideDeformsWithinSmallRectanglesToo) {
  apply(R"({"add_icon": {"entity": "hood", "id": "frame", "shape": "ICON_REGION", "outside": true,
            "parameters": [{"x": 0.16, "y": 0.12}, {"x": 0.22, "y": 0.18}], "state": "ICON_PASSIVE"}})");
  apply(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.19, "y": 0.15}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.01}}})");
  EXPECT_NEAR(at(0.19, 0.15).z(), 0.01, 1e-10);
  for (int i = 0; i <= 40; ++i) {
    for (int j = 0; j <= 30; ++j) {
      const double u = 0.01 * i, v = 0.01 * j;
      if (u > 0.16 && u < 0.22 && v > 0.12 && v < 0.18) continue;
      EXPECT_EQ(at(u, v), hood()->rest->evaluate(u, v)) << u << " " << v;
    }
  }
}

TEST_F(Regions, D19X2UndoRedoReplayCommitAndRecoverToTheBit) {
  std::vector<v1::Operation> log;
  const auto act = [&](const std::string& json) {
    const Submitted submitted = apply(json);
    log.push_back(submitted.effective);
  };
  log.push_back(operation(R"({"create_sculpt_surface": {"id": "hood",
      "rectangle": {"width_m": 0.4, "depth_m": 0.3}, "control_u": 12, "control_v": 10}})"));
  const std::string initial = document_hash(model.document());
  const auto first = hood()->initial;
  act(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.1, "y": 0.1}]}})");
  act(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.02}}})");
  act(picked);
  act(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"y": 0.003, "z": 0.01}}})");
  act(R"({"commit_sculpting": {"entity": "hood"}})");
  act(R"({"transform": {"entities": ["hood"], "scale": 1.3, "rotation": {"w": 1}}})");
  act(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": 0.01}}})");
  EXPECT_EQ(region_hold(icon("r"), *hood()->rest), RegionHold::points) << "scaled with its knots";
  const std::string last = document_hash(model.document());
  Model replayed;
  for (const v1::Operation& each : log) ASSERT_TRUE(replayed.submit(each).ok());
  EXPECT_EQ(document_hash(replayed.document()), last);
  while (model.history().undo_steps() > 1) apply(R"({"undo": {}})");
  EXPECT_EQ(document_hash(model.document()), initial);
  for (std::size_t i = 1; i < log.size(); ++i) apply(R"({"redo": {}})");
  EXPECT_EQ(document_hash(model.document()), last);
  apply(R"({"undo": {}})");
  apply(R"({"undo": {}})");
  apply(R"({"recover_sculpting": {"entity": "hood"}})");
  EXPECT_EQ(hood()->surface, first) << "with the control points it was made with";
  apply(R"({"change_icon": {"entity": "hood", "icon": "r", "state": "ICON_DRIVING"}})");
  EXPECT_EQ(hood()->rest->u.control_count(), 14) << "awake again it gets its knots";
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": 0.02}}})");
  EXPECT_LE(off_body(*hood(), {0.15, 0.12}, {0.22, 0.2}, {0, 0, 0.02}), 1e-9);
}

TEST_F(Regions, SliversAndLimitsAreHeldAtPlacesAndSaidSo) {
  const Submitted thin = apply(R"({"add_icon": {"entity": "hood", "id": "thin", "shape": "ICON_REGION",
      "parameters": [{"x": 0.15, "y": 0.12}, {"x": 0.1502, "y": 0.2}]}})");
  ASSERT_GE(thin.notes.size(), 1U);
  EXPECT_NE(thin.notes[0].find("narrower than a span"), std::string::npos) << thin.notes[0];
  EXPECT_EQ(hood()->rest->u.control_count(), 12);
  apply(R"({"drag_icon": {"entity": "hood", "icon": "thin", "translation": {"z": 0.02}}})");
  EXPECT_LE(off_body(*hood(), {0.15, 0.12}, {0.1502, 0.2}, {0, 0, 0.02}), 1e-4 * 0.5);

  Limits few;
  few.max_control_points = 130;
  ApplyContext context;
  context.limits = few;
  Model small({}, context);
  ASSERT_TRUE(small
                  .submit(operation(R"({"create_sculpt_surface": {"id": "hood",
      "rectangle": {"width_m": 0.4, "depth_m": 0.3}, "control_u": 12, "control_v": 10}})"))
                  .ok());
  const auto added = small.submit(operation(picked));
  ASSERT_TRUE(added.ok()) << added.error().describe();
  ASSERT_GE(added->notes.size(), 1U);
  EXPECT_NE(added->notes[0].find("14 x 12 control points, more than 130"), std::string::npos)
      << added->notes[0];
  const auto dragged = small.submit(
      operation(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": 0.02}}})"));
  ASSERT_TRUE(dragged.ok()) << dragged.error().describe();
  EXPECT_LE(off_body(*as_sculpt(small.document().find("hood")), {0.15, 0.12}, {0.22, 0.2}, {0, 0, 0.02}),
            1e-4 * 0.5);
}

TEST_F(Regions, D11AStiffnessMakesThePenaltyOfAConstraint) {
  apply(R"({"add_icon": {"entity": "hood", "id": "r", "shape": "ICON_REGION", "stiffness": 50,
            "parameters": [{"x": 0.15, "y": 0.12}, {"x": 0.22, "y": 0.2}]}})");
  EXPECT_EQ(hood()->rest->u.control_count(), 12) << "springs need no knots";
  EXPECT_EQ(bulge(), 0);
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": 0.02}}})");
  const double soft = at(0.185, 0.16).z();
  EXPECT_GT(soft, 1e-4);
  EXPECT_LT(soft, 0.02 - 1e-4) << "it gives way";
  apply(R"({"change_icon": {"entity": "hood", "icon": "r", "stiffness": 5000}})");
  const double stiff = at(0.185, 0.16).z();
  EXPECT_GT(stiff, soft + 1e-4);
  apply(R"({"change_icon": {"entity": "hood", "icon": "r", "state": "ICON_PASSIVE"}})");
  EXPECT_EQ(at(0.185, 0.16).z(), stiff) << "D13: a passive constraint acts";
  apply(R"({"change_icon": {"entity": "hood", "icon": "r", "state": "ICON_SLEEPING"}})");
  EXPECT_EQ(bulge(), 0);
  apply(R"({"change_icon": {"entity": "hood", "icon": "r", "state": "ICON_DRIVING", "stiffness": 0}})");
  EXPECT_EQ(region_hold(icon("r"), *hood()->rest), RegionHold::points) << "held exactly from now on";
}

// D14 on everything that does not move by itself, while another icon bends the surface.
TEST_F(Regions, D14SleepingIconsAndPassiveLoadsStayOnTheSurface) {
  for (
      const char* shape :
      {R"("shape": "ICON_POINT", "parameters": [{"x": 0.2, "y": 0.15}])",
       R"("shape": "ICON_CURVE", "parameters": [{"x": 0.1, "y": 0.1}, {"x": 0.2, "y": 0.18}, {"x": 0.3, "y": 0.15}])",
       R"("shape": "ICON_REGION", "parameters": [{"x": 0.15, "y": 0.12}, {"x": 0.22, "y": 0.2}])"}) {
    for (const char* kind : {R"("role": "ICON_LOAD", "state": "ICON_PASSIVE")",
                             R"("role": "ICON_LOAD", "state": "ICON_SLEEPING")",
                             R"("role": "ICON_CONSTRAINT", "state": "ICON_SLEEPING")"})
      apply(fmt::format(R"({{"add_icon": {{"entity": "hood", {}, {}}}}})", shape, kind));
  }
  bend();
  EXPECT_GT(bulge(), 0.01);
  int looked = 0;
  for (const SculptIcon& each : *hood()->icons) {
    if (each.id == "p") continue;
    ++looked;
    Vec2 uv = each.parameters.front();
    if (each.shape == IconShape::region) uv = Vec2(0.185, 0.16);
    if (each.shape == IconShape::curve) {  // Half way: of 0.1281 + 0.1044.
      const double left = (std::hypot(0.1, 0.08) + std::hypot(0.1, 0.03)) / 2;
      uv = Vec2(0.1, 0.1) + left / std::hypot(0.1, 0.08) * Vec2(0.1, 0.08);
    }
    EXPECT_LE((each.place - at(uv.x(), uv.y())).norm(), 1e-12) << each.id;
    EXPECT_GT(std::abs(each.place.z()), 1e-4) << "it went along: " << each.id;
  }
  EXPECT_EQ(looked, 9);
}

TEST_F(Regions, D10AndD12ALoadPushesWithItsStiffnessTimesItsWay) {
  for (const char* shape :
       {R"("shape": "ICON_CURVE", "parameters": [{"x": 0.1, "y": 0.1}, {"x": 0.3, "y": 0.15}])",
        R"("shape": "ICON_REGION", "parameters": [{"x": 0.15, "y": 0.12}, {"x": 0.22, "y": 0.2}])"}) {
    const auto lifted = [&](double stiffness, double way) {
      apply(fmt::format(
          R"({{"add_icon": {{"entity": "hood", "id": "f", {}, "role": "ICON_LOAD", "stiffness": {}}}}})",
          shape, stiffness));
      apply(fmt::format(R"({{"drag_icon": {{"entity": "hood", "icon": "f", "translation": {{"z": {}}}}}}})",
                        way));
      const double z = icon("f").place.z();
      apply(R"({"delete_icon": {"entity": "hood", "icon": "f"}})");
      return z;
    };
    const double one = lifted(10, 0.01);
    EXPECT_GT(one, 0);
    EXPECT_NEAR(lifted(20, 0.01) / one, 2, 1e-9) << shape;
    EXPECT_NEAR(lifted(10, -0.03) / one, -3, 1e-9) << shape;
    EXPECT_EQ(hood()->rest->u.control_count(), 12) << "loads need no knots";
  }
}

/// A tube along x, 0.3 m long and 0.2 m wide, closed in v with the seam at +y; parameters (m) once around:
/// what its control polygon measures.
class Tube : public Sculpting {
 protected:
  void SetUp() override {
    v1::Operation create;
    auto& request = *create.mutable_create_sculpt_surface();
    request.set_id("hood");
    auto& surface = *request.mutable_surface();
    surface.set_degree_u(3);
    surface.set_degree_v(3);
    for (const double knot : {0, 0, 0, 0, 1, 2, 3, 3, 3, 3}) surface.add_knots_u(knot);
    for (int j = -3; j <= 13; ++j) surface.add_knots_v(j);
    surface.set_periodic_v(true);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 10; ++j) {
        const double angle = 2 * M_PI * (j - 1) / 10;
        surface.add_control(0.06 * i);
        surface.add_control(0.1 * std::cos(angle));
        surface.add_control(0.1 * std::sin(angle));
      }
    }
    ASSERT_TRUE(model.submit(create).ok());
  }
  double around() const { return hood()->rest->v.length(); }
};

TEST_F(Tube, D11ARegionAcrossTheSeamEndsWhereItWasPicked) {
  const SculptPtr before = hood();
  const double end = around() + 0.07;
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "r", "shape": "ICON_REGION",
            "parameters": [{{"x": 0.1, "y": -0.05}}, {{"x": 0.17, "y": 0.07}}]}}}})"));
  EXPECT_NEAR(icon("r").parameters[0].y(), around() - 0.05, 1e-12);
  EXPECT_NEAR(icon("r").parameters[1].y(), end, 1e-12);
  EXPECT_LE(largest_between(*before->surface, *hood()->surface), 1e-12);
  EXPECT_EQ(region_hold(icon("r"), *hood()->rest), RegionHold::points);
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"y": 0.02}}})");
  EXPECT_LE(off_body(*hood(), {0.1, around() - 0.05}, {0.17, end}, {0, 0.02, 0}), 1e-9);
  for (const double v : {-0.06, 0.08})
    EXPECT_GT((at(0.135, v) - hood()->rest->evaluate(0.135, v) - Vec3(0, 0.02, 0)).norm(), 1e-6)
        << "outside is free";
  const std::string now = document_hash(model.document());
  apply(R"({"undo": {}})");
  apply(R"({"redo": {}})");
  EXPECT_EQ(document_hash(model.document()), now);
}

TEST_F(Tube, PickedPlacesGoTheShorterWayAcross) {
  // Above and below the seam (+y): corners of a region, and a line.
  apply(R"({"add_icon": {"entity": "hood", "id": "r", "shape": "ICON_REGION",
            "places": [{"x": 0.1, "y": 0.09, "z": 0.03}, {"x": 0.15, "y": 0.09, "z": -0.03}]}})");
  const Vec2 size = icon("r").parameters[1] - icon("r").parameters[0];
  EXPECT_LT(size.y(), around() / 4);
  EXPECT_GT(icon("r").parameters[1].y(), hood()->rest->v.upper());
  apply(R"({"delete_icon": {"entity": "hood", "icon": "r"}})");
  apply(R"({"add_icon": {"entity": "hood", "id": "c", "shape": "ICON_CURVE",
            "places": [{"x": 0.1, "y": 0.09, "z": 0.03}, {"x": 0.12, "y": 0.1, "z": 0}, {"x": 0.15, "y": 0.09, "z": -0.03}]}})");
  double length = 0;
  for (std::size_t i = 1; i < 3; ++i)
    length += (icon("c").parameters[i] - icon("c").parameters[i - 1]).norm();
  EXPECT_LT(length, around() / 4);
  const std::vector<Vec3> outline = icon_outline(icon("c"), *hood()->surface);
  for (const Vec3& place : outline) EXPECT_GT(place.y(), 0.05) << "drawn across the seam, not around";
  apply(R"({"drag_icon": {"entity": "hood", "icon": "c", "translation": {"y": 0.01}}})");
  for (std::size_t i = 0; i < outline.size(); ++i)
    EXPECT_LE((icon_outline(icon("c"), *hood()->surface)[i] - outline[i] - Vec3(0, 0.01, 0)).norm(), 3e-5)
        << "D9: a ten-thousandth of the diagonal";
}

// Table 1 across the seam, and of springs.
TEST_F(Tube, D13OnlyDrivingOnesAndPassiveConstraintsChangeTheSurface) {
  for (
      const char* shape :
      {R"("shape": "ICON_POINT", "parameters": [{"x": 0.15, "y": -0.01}])",
       R"("shape": "ICON_CURVE", "parameters": [{"x": 0.1, "y": -0.06}, {"x": 0.2, "y": 0.06}])",
       R"("shape": "ICON_REGION", "parameters": [{"x": 0.1, "y": -0.05}, {"x": 0.17, "y": 0.07}])",
       R"("shape": "ICON_REGION", "stiffness": 300, "parameters": [{"x": 0.1, "y": -0.05}, {"x": 0.17, "y": 0.07}])"}) {
    for (const char* role : {"ICON_CONSTRAINT", "ICON_LOAD"}) {
      for (const char* state : {"ICON_DRIVING", "ICON_PASSIVE", "ICON_SLEEPING"}) {
        SCOPED_TRACE(fmt::format("{} {} {}", shape, role, state));
        const std::string before = document_hash(model.document());
        apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "i{0}", {1}, "role": "{2}"}}}})",
                          model.history().undo_steps(), shape, role));
        const std::string id = hood()->icons->front().id;
        EXPECT_LE(bulge(), 1e-15);
        apply(fmt::format(
            R"({{"drag_icon": {{"entity": "hood", "icon": "{}", "translation": {{"y": 0.01}}}}}})", id));
        EXPECT_GT(bulge(), 1e-3);
        apply(fmt::format(R"({{"change_icon": {{"entity": "hood", "icon": "{}", "state": "{}"}}}})", id,
                          state));
        const bool acts = state == std::string("ICON_DRIVING") ||
                          (state == std::string("ICON_PASSIVE") && role == std::string("ICON_CONSTRAINT"));
        EXPECT_EQ(bulge() > 1e-3, acts);
        if (!acts) {
          EXPECT_EQ(hood()->surface, hood()->rest);
        }
        for (int i = 0; i < 3; ++i) apply(R"({"undo": {}})");
        EXPECT_EQ(document_hash(model.document()), before);
      }
    }
  }
}

TEST_F(Regions, D11ABentSurfaceGetsFinerWithWhatItsIconsHold) {
  bend();
  apply(R"({"add_icon": {"entity": "hood", "id": "c", "shape": "ICON_CURVE",
            "parameters": [{"x": 0.26, "y": 0.11}, {"x": 0.29, "y": 0.19}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "c", "translation": {"z": 0.005}}})");
  const SculptPtr before = hood();
  apply(picked);
  EXPECT_GT(hood()->rest->u.control_count(), before->rest->u.control_count());
  EXPECT_LE(largest_between(*before->rest, *hood()->rest), 1e-12);
  EXPECT_LE(off_body(*hood(), {0.15, 0.12}, {0.22, 0.2}, Vec3::Zero()) -
                off_body(*before, {0.15, 0.12}, {0.22, 0.2}, Vec3::Zero()),
            1e-9);
  for (double s = 0; s <= 1; s += 0.02) {
    const Vec2 on(0.26 + 0.03 * s, 0.11 + 0.08 * s), in(0.15 + 0.07 * s, 0.12 + 0.08 * s);
    EXPECT_LE((at(in.x(), in.y()) - before->surface->evaluate(in.x(), in.y())).norm(), 1e-10) << "held";
    EXPECT_LE((at(on.x(), on.y()) - before->surface->evaluate(on.x(), on.y())).norm(), 5e-6) << "the curve";
  }
  EXPECT_NEAR(at(0.1, 0.1).z(), 0.02, 1e-10) << "the point";
  // Elsewhere it yields with more freedom than before, and so a little more.
  EXPECT_LE(largest_between(*before->surface, *hood()->surface), 0.06 * 0.02);
  apply(R"({"delete_icon": {"entity": "hood", "icon": "p"}})");
  apply(R"({"delete_icon": {"entity": "hood", "icon": "c"}})");
  apply(R"({"delete_icon": {"entity": "hood", "icon": "r"}})");
  EXPECT_EQ(hood()->surface, hood()->rest) << "nothing was committed by the way";
}

}  // namespace
}  // namespace handloft::model::test
