// Icons of sculpted surfaces (D5 - D20): what each kind does in each state, and what is kept.

#include <fmt/format.h>

#include <cmath>

#include "server-model/model/canonical.h"
#include "tests/unit/server-model/model/sculpt_helpers.h"

namespace handloft::model::test {
namespace {

using geometry::Vec3;

constexpr const char* point_icon = R"("shape": "ICON_POINT", "parameters": [{"x": 0.2, "y": 0.15}])";
constexpr const char* curve_icon =
    R"("shape": "ICON_CURVE", "parameters": [{"x": 0.1, "y": 0.1}, {"x": 0.2, "y": 0.18}, {"x": 0.3, "y": 0.15}])";
constexpr const char* region_icon =
    R"("shape": "ICON_REGION", "parameters": [{"x": 0.15, "y": 0.12}, {"x": 0.22, "y": 0.2}])";

TEST_F(Sculpting, D2_ParametersAreMetres) {
  EXPECT_NEAR(hood()->rest->u.length(), 0.4, 1e-12);
  EXPECT_NEAR(hood()->rest->v.length(), 0.3, 1e-12);
  EXPECT_EQ(hood()->rest->u.control_count(), 12);
  EXPECT_EQ(hood()->rest->v.control_count(), 10);
}

struct TruthCase {
  const char* name;
  const char* icon;
};
class TruthTable : public Sculpting, public testing::WithParamInterface<TruthCase> {};

// Table 1 of the paper: dragged by 2 cm, then put into each state.
TEST_P(TruthTable, D13_OnlyDrivingOnesAndPassiveConstraintsChangeTheSurface) {
  for (const char* role : {"ICON_CONSTRAINT", "ICON_LOAD"}) {
    SCOPED_TRACE(role);
    apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "{0}", {1}, "role": "{0}"}}}})", role,
                      GetParam().icon));
    EXPECT_EQ(bulge(), 0) << "an icon begins at the surface as it is (D4)";
    apply(fmt::format(R"({{"drag_icon": {{"entity": "hood", "icon": "{}", "translation": {{"z": 0.02}}}}}})",
                      role));
    EXPECT_GT(bulge(), 0.01) << "driving";
    const Vec3 place = icon(role).place;
    const bool constraint = std::string(role) == "ICON_CONSTRAINT";
    apply(fmt::format(R"({{"change_icon": {{"entity": "hood", "icon": "{}", "state": "ICON_PASSIVE"}}}})",
                      role));
    if (constraint) {
      EXPECT_GT(bulge(), 0.01) << "a passive constraint holds";
      EXPECT_EQ(icon(role).place, place);
    } else {
      EXPECT_EQ(bulge(), 0) << "a passive load does nothing";
      EXPECT_NEAR(icon(role).place.z(), 0, 1e-15) << "D14: its place is the surface's";
    }
    apply(fmt::format(R"({{"change_icon": {{"entity": "hood", "icon": "{}", "state": "ICON_SLEEPING"}}}})",
                      role));
    EXPECT_EQ(bulge(), 0) << "sleeping";
    EXPECT_EQ(hood()->surface, hood()->rest);
    apply(fmt::format(R"({{"change_icon": {{"entity": "hood", "icon": "{}", "state": "ICON_DRIVING"}}}})",
                      role));
    EXPECT_EQ(bulge(), 0) << "awake again it begins at the surface as it is";
    apply(fmt::format(R"({{"delete_icon": {{"entity": "hood", "icon": "{}"}}}})", role));
  }
}
INSTANTIATE_TEST_SUITE_P(Shapes, TruthTable,
                         testing::Values(TruthCase{"Point", point_icon}, TruthCase{"Curve", curve_icon},
                                         TruthCase{"Region", region_icon}),
                         [](const auto& each) { return each.param.name; });

TEST_F(Sculpting, D6_APositionIsMetAndTheSidesStay) {
  apply(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.13, "y": 0.21}]}})");
  apply(
      R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"x": 0.01, "y": -0.005, "z": 0.03}}})");
  const Vec3 target = hood()->rest->evaluate(0.13, 0.21) + Vec3(0.01, -0.005, 0.03);
  EXPECT_LT((at(0.13, 0.21) - target).norm(), 1e-10);
  for (const double t : {0.0, 0.3, 0.7, 1.0}) {
    EXPECT_EQ(at(0.4 * t, 0), hood()->rest->evaluate(0.4 * t, 0));
    EXPECT_EQ(at(0, 0.3 * t), hood()->rest->evaluate(0, 0.3 * t));
  }
}

TEST_F(Sculpting, D7_DerivativesTurnAndStretchWithTheArrow) {
  struct Case {
    const char* property;
    int a, b;
  };
  for (const Case& each :
       {Case{"ICON_TANGENT_U", 1, 0}, Case{"ICON_TANGENT_V", 0, 1}, Case{"ICON_SECOND_U", 2, 0},
        Case{"ICON_SECOND_V", 0, 2}, Case{"ICON_TWIST", 1, 1}}) {
    SCOPED_TRACE(each.property);
    const auto value = [&](const geometry::BSplineSurface& surface) {
      auto functional = geometry::surface_functional(surface, 0.2, 0.15, each.a, each.b);
      Vec3 sum = Vec3::Zero();
      for (std::size_t k = 0; k < functional->point.size(); ++k)
        sum += functional->value[k] * surface.control[functional->point[k]];
      return sum;
    };
    const Vec3 before = value(*hood()->surface);
    apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "d", {}, "property": "{}"}}}})", point_icon,
                      each.property));
    // A quarter of a turn about y by w, y: cos 15 deg, sin 15 deg is 30 degrees.
    apply(R"({"drag_icon": {"entity": "hood", "icon": "d", "translation": {"z": 0.01},
              "rotation": {"w": 0.9659258262890683, "y": -0.25881904510252074}}})");
    const Vec3 turned = Eigen::AngleAxisd(-M_PI / 6, Vec3::UnitY()) * before;
    const Vec3 target = turned + Vec3(0, 0, 0.01 / std::pow(icon_arrow_m, each.a + each.b));
    EXPECT_LT((value(*hood()->surface) - target).norm(), 1e-9 * (1 + target.norm()));
    apply(R"({"delete_icon": {"entity": "hood", "icon": "d"}})");
  }
}

TEST_F(Sculpting, D8_ANormalIsHeldAsItTurns) {
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "n", {}, "property": "ICON_NORMAL"}}}})",
                    point_icon));
  apply(R"({"drag_icon": {"entity": "hood", "icon": "n",
            "rotation": {"w": 0.9659258262890683, "x": 0.25881904510252074}}})");
  const Vec3 wanted = Eigen::AngleAxisd(M_PI / 6, Vec3::UnitX()) * Vec3::UnitZ();
  EXPECT_LT((hood()->surface->normal(0.2, 0.15) - wanted).norm(), 1e-9);
}

TEST_F(Sculpting, D8_ANormalTurnedBeyondARightAngleIsSaidToBeMetFromBehind) {
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "n", {}, "property": "ICON_NORMAL"}}}})",
                    point_icon));
  const auto turn = [&](double degrees) {
    const double half = degrees * M_PI / 360;
    return apply(
        fmt::format(R"({{"drag_icon": {{"entity": "hood", "icon": "n", "rotation": {{"w": {}, "x": {}}}}}}})",
                    std::cos(half), std::sin(half)));
  };
  EXPECT_TRUE(turn(80).notes.empty());
  const Submitted over = turn(20);
  ASSERT_EQ(over.notes.size(), 1U);
  EXPECT_NE(over.notes[0].find("\"n\" is met from behind"), std::string::npos) << over.notes[0];
  EXPECT_TRUE(turn(-20).notes.empty());
}

TEST_F(Sculpting, D9_ACurveIsFollowedBetweenItsPlacesToo) {
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "c", {}}}}})", curve_icon));
  apply(R"({"drag_icon": {"entity": "hood", "icon": "c", "translation": {"z": 0.02}}})");
  for (int i = 0; i <= 100; ++i) {
    const double t = i / 100.0;
    const double u = t < 0.5 ? 0.1 + 0.2 * t : 0.2 + 0.2 * (t - 0.5),
                 v = t < 0.5 ? 0.1 + 0.16 * t : 0.18 - 0.06 * (t - 0.5);
    EXPECT_NEAR(at(u, v).z(), 0.02, 5e-6) << "D9 asks 1e-4 of the diagonal, 5e-5";
  }
  for (const Vec3& point : hood()->surface->control) {
    EXPECT_LT(point.z(), 1.5 * 0.02) << "no waves elsewhere";
    EXPECT_GT(point.z(), -0.5 * 0.02);
  }
}

// The first span's control points are held with the clamped side, so that the surface cannot follow there
// exactly: it follows as nearly as it can without waves, and says so.
TEST_F(Sculpting, D9_ACurveThatASideHoldsBackMakesNoWaves) {
  for (const char* curve :
       {R"([{"x": 0.25, "y": 0.05}, {"x": 0.3, "y": 0.25}])",      // Oblique
        R"([{"x": 0.27, "y": 0.05}, {"x": 0.27, "y": 0.25}])"}) {  // Along a parameter line
    apply(fmt::format(
        R"({{"add_icon": {{"entity": "hood", "id": "c", "shape": "ICON_CURVE", "parameters": {}}}}})",
        curve));
    const Submitted moved =
        apply(R"({"drag_icon": {"entity": "hood", "icon": "c", "translation": {"z": 0.005}}})");
    ASSERT_EQ(moved.notes.size(), 1U);
    EXPECT_NE(moved.notes[0].find("\"c\" is followed to within"), std::string::npos) << moved.notes[0];
    double largest = 0;
    for (const Vec3& point : hood()->surface->control) largest = std::max(largest, std::abs(point.z()));
    EXPECT_LT(largest, 8 * 0.005) << "it was 197 times the motion, when what cannot be met was forced";
    EXPECT_NEAR(at(0.275, 0.15).z(), 0.005, 2e-5) << "in the middle it is met";
    // It is linear, so a drag never jumps.
    const double before = at(0.35, 0.2).z();
    apply(R"({"drag_icon": {"entity": "hood", "icon": "c", "translation": {"z": 0.015}}})");
    EXPECT_NEAR(at(0.35, 0.2).z(), 4 * before, 1e-9);
    apply(R"({"delete_icon": {"entity": "hood", "icon": "c"}})");
  }
}

TEST_F(Sculpting, D9_ABentCurveKeepsItsEnds) {
  apply(R"({"add_icon": {"entity": "hood", "id": "c", "shape": "ICON_CURVE",
            "parameters": [{"x": 0.1, "y": 0.15}, {"x": 0.3, "y": 0.15}]}})");
  apply(
      R"({"drag_icon": {"entity": "hood", "icon": "c", "translation": {"z": 0.02}, "held_at": 0.5, "reach_m": 0.08}})");
  const double diagonal = 0.5;
  EXPECT_NEAR(at(0.2, 0.15).z(), 0.02, 1e-3 * diagonal) << "eta(0) = 1";
  EXPECT_NEAR(at(0.1, 0.15).z(), 0, 1e-3 * diagonal) << "beyond its reach";
  EXPECT_NEAR(at(0.24, 0.15).z(), 0.02 * 0.5449, 1e-3 * diagonal) << "eta(0.5), A15";
}

TEST_F(Sculpting, D11_ARegionMovesAsABody) {
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "r", {}}}}})", region_icon));
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": 0.02},
            "rotation": {"w": 0.9961946980917455, "x": 0.08715574274765817}}})");
  const Vec3 pivot = hood()->rest->evaluate(0.185, 0.16);
  const Eigen::AngleAxisd turn(M_PI / 18, Vec3::UnitX());
  for (int i = 0; i <= 10; ++i) {
    for (int j = 0; j <= 10; ++j) {
      const double u = 0.15 + 0.007 * i, v = 0.12 + 0.008 * j;
      const Vec3 wanted = pivot + turn * (hood()->rest->evaluate(u, v) - pivot) + Vec3(0, 0, 0.02);
      EXPECT_LT((at(u, v) - wanted).norm(), 1e-9);
    }
  }
}

TEST_F(Sculpting, D11_InsideARegionWhileAllElseIsHeld) {
  apply(R"({"add_icon": {"entity": "hood", "id": "frame", "shape": "ICON_REGION", "outside": true,
            "parameters": [{"x": 0.08, "y": 0.03}, {"x": 0.35, "y": 0.27}], "state": "ICON_PASSIVE"}})");
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "p", {}}}}})", point_icon));
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.02}}})");
  EXPECT_NEAR(at(0.2, 0.15).z(), 0.02, 1e-10);
  for (int i = 0; i <= 40; ++i) {
    for (int j = 0; j <= 30; ++j) {
      const double u = 0.01 * i, v = 0.01 * j;
      if (u > 0.08 && u < 0.35 && v > 0.03 && v < 0.27) continue;
      EXPECT_EQ(at(u, v), hood()->rest->evaluate(u, v)) << u << " " << v;
    }
  }
}

TEST_F(Sculpting, D11_TheOutsideOfARegionIsHeldAsItIsNotAsItWas) {
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "p", {}}}}})", point_icon));
  apply(
      R"({"add_icon": {"entity": "hood", "id": "l", "role": "ICON_LOAD", "parameters": [{"x": 0.1, "y": 0.1}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.02}}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "l", "translation": {"z": -0.02}}})");
  const SculptPtr before = hood();
  const std::string frame = R"({"add_icon": {"entity": "hood", "id": "frame", "shape": "ICON_REGION",
      "outside": true, "parameters": [{"x": 0.25, "y": 0.12}, {"x": 0.35, "y": 0.27}]}})";
  const Submitted added = apply(frame);
  ASSERT_FALSE(added.notes.empty());
  EXPECT_NE(added.notes[0].find("committed"), std::string::npos);
  for (int i = 0; i <= 40; ++i) {
    for (int j = 0; j <= 30; ++j) {
      EXPECT_LT((at(0.01 * i, 0.01 * j) - before->surface->evaluate(0.01 * i, 0.01 * j)).norm(), 1e-13);
    }
  }
  const SculptPtr framed = hood();
  apply(R"({"add_icon": {"entity": "hood", "id": "in", "parameters": [{"x": 0.3, "y": 0.2}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "in", "translation": {"z": 0.01}}})");
  EXPECT_EQ(at(0.2, 0.15), framed->surface->evaluate(0.2, 0.15)) << "outside, to the bit";
  EXPECT_NEAR(at(0.3, 0.2).z(), framed->surface->evaluate(0.3, 0.2).z() + 0.01, 1e-10);

  for (int i = 0; i < 3; ++i) apply(R"({"undo": {}})");
  EXPECT_EQ(hood()->surface->control, before->surface->control);
  apply(R"({"change_icon": {"entity": "hood", "icon": "l", "state": "ICON_SLEEPING"}})");
  apply(R"({"delete_icon": {"entity": "hood", "icon": "p"}})");
  EXPECT_EQ(hood()->surface, hood()->rest);
  for (const std::string& note : apply(frame).notes)
    EXPECT_EQ(note.find("committed"), std::string::npos) << note;
}

TEST_F(Sculpting, D16_ALoadFollowsTheHandExactly) {
  apply(
      R"({"add_icon": {"entity": "hood", "id": "held", "parameters": [{"x": 0.1, "y": 0.1}], "state": "ICON_PASSIVE"}})");
  for (const char* shape : {point_icon, curve_icon, region_icon}) {
    SCOPED_TRACE(shape);
    apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "f", {}, "role": "ICON_LOAD"}}}})", shape));
    for (const double dx : {1e-4, 0.01, 0.05}) {
      const Document before = model.document();
      apply(fmt::format(R"({{"drag_icon": {{"entity": "hood", "icon": "f", "translation": {{"z": {}}}}}}})",
                        dx));
      if (shape == point_icon) {
        EXPECT_NEAR(at(0.2, 0.15).z() / dx, 1, 1e-9);
      } else {
        EXPECT_NEAR(icon("f").place.z() / dx, 1, 0.35) << "the mean along it follows, the middle nearly";
      }
      apply(R"({"undo": {}})");
    }
    apply(R"({"delete_icon": {"entity": "hood", "icon": "f"}})");
  }
}

TEST_F(Sculpting, D15_ALoadTurnsTheTangents) {
  apply(
      fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "f", {}, "role": "ICON_LOAD"}}}})", point_icon));
  apply(
      R"({"drag_icon": {"entity": "hood", "icon": "f", "rotation": {"w": 0.9990482215818578, "x": 0.043619387365336}}})");
  const Vec3 normal = hood()->surface->normal(0.2, 0.15);
  EXPECT_LT(normal.y(), -0.01) << "about +x, the normal leans towards -y";
  EXPECT_NEAR(normal.x(), 0, 1e-6);
}

TEST_F(Sculpting, D18_TypesSwitchAndBeginAtTheSurfaceAsItIs) {
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "p", {}}}}})", point_icon));
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.02}}})");
  apply(R"({"add_icon": {"entity": "hood", "id": "q", "parameters": [{"x": 0.1, "y": 0.1}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "q", "translation": {"z": 0.01}}})");
  for (const char* property : {"ICON_TANGENT_U", "ICON_NORMAL", "ICON_POSITION"}) {
    const Vec3 other = at(0.1, 0.1);
    apply(fmt::format(R"({{"change_icon": {{"entity": "hood", "icon": "p", "property": "{}"}}}})", property));
    EXPECT_LT((at(0.1, 0.1) - other).norm(), 1e-10) << property;
  }
  apply(R"({"change_icon": {"entity": "hood", "icon": "p", "role": "ICON_LOAD"}})");
  EXPECT_EQ(icon("p").role, IconRole::load);
  EXPECT_EQ(icon("p").translation, Vec3(0, 0, 0));
}

TEST_F(Sculpting, D19_CommitKeepsTheShapeAndRecoverBringsTheFirstOneBackToTheBit) {
  const std::string initial = document_hash(model.document());
  const auto first = hood()->initial;
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "p", {}}}}})", point_icon));
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.02}}})");
  const auto sculpted = hood()->surface->control;
  apply(R"({"commit_sculpting": {"entity": "hood"}})");
  EXPECT_EQ(hood()->surface->control, sculpted);
  EXPECT_EQ(hood()->rest->control, sculpted);
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0}}})");
  EXPECT_LT(bulge(), 1e-12) << "at rest in the new shape (D4)";
  apply(R"({"recover_sculpting": {"entity": "hood"}})");
  EXPECT_EQ(hood()->surface, first);
  EXPECT_EQ(icon("p").state, IconState::sleeping);
  while (model.history().undo_steps() > 1) apply(R"({"undo": {}})");
  EXPECT_EQ(document_hash(model.document()), initial);
}

TEST_F(Sculpting, D20_DuplicatesAreHarmlessConflictsAreNamedOrMetInTheMean) {
  apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "one", {}}}}})", point_icon));
  const Submitted twice =
      apply(fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "two", {}}}}})", point_icon));
  ASSERT_EQ(twice.notes.size(), 1U);
  EXPECT_NE(twice.notes[0].find("\"two\" adds nothing"), std::string::npos) << twice.notes[0];
  const Error error =
      refused(R"({"drag_icon": {"entity": "hood", "icon": "two", "translation": {"z": 0.02}}})");
  EXPECT_EQ(error.code, ErrorCode::failed_precondition);
  EXPECT_EQ(error.field, "drag_icon");
  EXPECT_NE(error.message.find("\"one\""), std::string::npos) << error.message;
  EXPECT_NE(error.message.find("\"two\""), std::string::npos) << error.message;
  apply(R"({"set_sculpting": {"entity": "hood", "least_squares": true}})");
  const Submitted meant =
      apply(R"({"drag_icon": {"entity": "hood", "icon": "two", "translation": {"z": 0.02}}})");
  EXPECT_NEAR(at(0.2, 0.15).z(), 0.01, 1e-9) << "half way between the two";
  EXPECT_FALSE(meant.notes.empty());
}

TEST_F(Sculpting, X2_TheSameOperationsGiveTheSameBitsWhateverWasKept) {
  const auto run = [&](Model& other) {
    for (
        const v1::Operation& each :
        {operation(R"({"create_sculpt_surface": {"id": "hood", "rectangle":
             {"width_m": 0.4, "depth_m": 0.3}, "control_u": 12, "control_v": 10}})"),
         operation(R"({"add_icon": {"entity": "hood", "id": "a", "parameters": [{"x": 0.1, "y": 0.1}]}})"),
         operation(
             R"({"add_icon": {"entity": "hood", "id": "b", "parameters": [{"x": 0.3, "y": 0.2}], "role": "ICON_LOAD"}})"),
         operation(R"({"drag_icon": {"entity": "hood", "icon": "a", "translation": {"z": 0.02}}})"),
         operation(R"({"drag_icon": {"entity": "hood", "icon": "b", "translation": {"z": 0.01}}})")}) {
      ASSERT_TRUE(other.submit(each).ok());
    }
  };
  Model plain;
  run(plain);
  Model busy;
  for (int i = 0; i < 2; ++i) {
    // What was asked before leaves no trace.
    ASSERT_TRUE(busy.submit(operation(R"({"create_sculpt_surface": {"id": "other", "rectangle":
             {"width_m": 0.4, "depth_m": 0.3}, "control_u": 12, "control_v": 10}})"))
                    .ok() ||
                i > 0);
  }
  ASSERT_TRUE(
      busy.submit(operation(R"({"add_icon": {"entity": "other", "parameters": [{"x": 0.3, "y": 0.2}]}})"))
          .ok());
  run(busy);
  EXPECT_EQ(as_sculpt(plain.document().find("hood"))->surface->control,
            as_sculpt(busy.document().find("hood"))->surface->control);
}

TEST_F(Sculpting, BadIconsAreRefusedByName) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {R"({"add_icon": {"entity": "none"}})", "add_icon.entity"},
      {R"({"add_icon": {"entity": "hood", "shape": 7, "parameters": [{"x": 0.1, "y": 0.1}]}})",
       "add_icon.shape"},
      {R"({"add_icon": {"entity": "hood"}})", "add_icon.parameters"},
      {R"({"add_icon": {"entity": "hood", "parameters": [{"x": "NaN", "y": 0.1}]}})",
       "add_icon.parameters[0]"},
      {R"({"add_icon": {"entity": "hood", "places": [{"x": "Infinity"}]}})", "add_icon.places[0].x"},
      {R"({"add_icon": {"entity": "hood", "shape": "ICON_REGION", "parameters": [{"x": 0.1}, {"x": 0.1, "y": 1}]}})",
       "add_icon.parameters"},
      {R"({"add_icon": {"entity": "hood", "parameters": [{"x": 0.1}], "stiffness": -1}})",
       "add_icon.stiffness"},
      {R"({"add_icon": {"entity": "hood", "parameters": [{"x": 0.1}], "role": 9}})", "add_icon.role"},
      {R"({"add_icon": {"entity": "hood", "parameters": [{"x": 0.1}], "outside": true}})",
       "add_icon.outside"},
      {R"({"drag_icon": {"entity": "hood", "icon": "x"}})", "drag_icon.icon"},
      {R"({"change_icon": {"entity": "hood", "icon": "x"}})", "change_icon.icon"},
      {R"({"delete_icon": {"entity": "hood", "icon": "x"}})", "delete_icon.icon"},
      {R"({"set_sculpting": {"entity": "hood", "energy": {"a11": -1}}})", "set_sculpting.energy.a11"},
      {R"({"set_sculpting": {"entity": "hood", "mode": 7}})", "set_sculpting.mode"},
      {R"({"refine_surface": {"entity": "hood", "control_u": 4000000000, "control_v": 4000000000}})",
       "refine_surface.control_u"},
      {R"({"create_sculpt_surface": {"id": "x"}})", "create_sculpt_surface"},
      {R"({"create_sculpt_surface": {"rectangle": {"width_m": "NaN"}}})",
       "create_sculpt_surface.rectangle.width_m"},
  };
  for (const auto& [json, field] : cases) EXPECT_EQ(refused(json).field, field) << json;
  apply(
      R"({"add_icon": {"entity": "hood", "id": "s", "parameters": [{"x": 0.1, "y": 0.1}], "state": "ICON_SLEEPING"}})");
  EXPECT_EQ(refused(R"({"drag_icon": {"entity": "hood", "icon": "s", "translation": {"z": 0.1}}})").field,
            "drag_icon.icon");
}

}  // namespace
}  // namespace handloft::model::test
