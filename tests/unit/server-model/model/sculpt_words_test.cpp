// What is said of icons, and what is refused: in words that tell what to do, and once (D9, D20).

#include <fmt/format.h>

#include <memory>

#include "server-model/model/cad_model.h"
#include "tests/unit/server-model/model/sculpt_helpers.h"

namespace handloft::model::test {
namespace {

std::string point(const std::string& id, double x, double y) {
  return fmt::format(R"({{"add_icon": {{"entity": "hood", "id": "{}", "shape": "ICON_POINT",
                     "parameters": [{{"x": {}, "y": {}}}]}}}})",
                     id, x, y);
}
std::string drag(const std::string& id, double by) {
  return fmt::format(R"({{"drag_icon": {{"entity": "hood", "icon": "{}", "translation": {{"z": {}}}}}}})", id,
                     by);
}

TEST_F(Sculpting, D20_WhatWasSaidIsSaidAgainOnlyOfTheIconWorkedOn) {
  apply(point("one", 0.2, 0.15));
  EXPECT_EQ(apply(point("two", 0.2, 0.15)).notes.size(), 1U);
  EXPECT_TRUE(apply(point("three", 0.1, 0.1)).notes.empty()) << "nothing of \"two\" has changed";
  EXPECT_TRUE(apply(drag("three", 0.01)).notes.empty());
  EXPECT_EQ(
      apply(R"({"change_icon": {"entity": "hood", "icon": "two", "state": "ICON_PASSIVE"}})").notes.size(),
      1U)
      << "it is worked on";
  apply(R"({"delete_icon": {"entity": "hood", "icon": "two"}})");
  EXPECT_EQ(apply(point("two", 0.2, 0.15)).notes.size(), 1U) << "another one of that name";
}

TEST_F(Sculpting, D9_HowNearlyACurveIsFollowedIsSaidAgainWhenItGetsWorse) {
  apply(R"({"add_icon": {"entity": "hood", "id": "c", "shape": "ICON_CURVE",
            "parameters": [{"x": 0.25, "y": 0.05}, {"x": 0.3, "y": 0.25}]}})");
  EXPECT_EQ(apply(drag("c", 0.005)).notes.size(), 1U);
  apply(point("p", 0.05, 0.15));
  EXPECT_TRUE(apply(drag("p", 0.001)).notes.empty());
  EXPECT_EQ(apply(drag("c", 0.02)).notes.size(), 1U);
}

// Two places so close that what one is moved by tilts all the surface.
TEST_F(Sculpting, D20_PointsTooCloseForOneToBeMovedAreNamed) {
  apply(point("a", 0.2, 0.15));
  EXPECT_TRUE(apply(point("b", 0.201, 0.15)).notes.empty()) << "at rest they do no harm";
  const Submitted moved = apply(drag("b", 0.01));
  EXPECT_GT(bulge(), 0.05);
  ASSERT_EQ(moved.notes.size(), 1U);
  EXPECT_NE(moved.notes[0].find("icons \"a\" and \"b\" lie 1 mm apart"), std::string::npos) << moved.notes[0];
  EXPECT_NE(moved.notes[0].find("move them apart or delete one"), std::string::npos) << moved.notes[0];
  apply(drag("b", -0.01));
  EXPECT_TRUE(apply(drag("a", 0)).notes.empty());
  apply(point("far", 0.1, 0.1));
  EXPECT_TRUE(apply(drag("far", 0.03)).notes.empty()) << "apart enough";
}

class Sheet : public Sculpting {
 protected:
  void SetUp() override {}
  void make(int u, int v, int degree = 3) {
    apply(fmt::format(R"({{"create_sculpt_surface": {{"id": "hood", "control_u": {}, "control_v": {},
                      "rectangle": {{"width_m": 1, "depth_m": 1, "degree": {}}}}}}})",
                      u, v, degree));
  }
};

TEST_F(Sheet, D20_ACurveThatSidesHoldBackIsToldOfThem) {
  make(16, 16);
  apply(R"({"add_icon": {"entity": "hood", "id": "c", "shape": "ICON_CURVE",
            "parameters": [{"x": 0, "y": 0.5}, {"x": 1, "y": 0.5}]}})");
  const Error error = refused(drag("c", 0.05));
  EXPECT_EQ(error.code, ErrorCode::failed_precondition);
  for (const char* word : {"\"c\"", "16 x 16", "uLower EDGE_CLAMPED", "vUpper", "refineSurface", "EDGE_FREE"})
    EXPECT_NE(error.message.find(word), std::string::npos) << word << " in: " << error.message;
  EXPECT_EQ(error.message.find("\"c\""), error.message.rfind("\"c\"")) << "named once: " << error.message;
}

TEST_F(Sheet, D3_AFaceWithNoPointBetweenItsSidesSaysWhatToDo) {
  make(4, 4);
  const Error error = refused(point("p", 0.5, 0.5));
  EXPECT_EQ(error.code, ErrorCode::failed_precondition);
  for (const char* word : {"4 x 4", "refineSurface", "EDGE_FREE"})
    EXPECT_NE(error.message.find(word), std::string::npos) << word << " in: " << error.message;
}

// A normal makes three equations of every place.
TEST(SculptLimits, X4_EquationsAreCountedNotRows) {
  ApplyContext context;
  context.limits.max_constraint_rows = 20;
  for (const bool coupled : {false, true}) {
    Model model({}, context);
    const auto submit = [&](const std::string& json) { return model.submit(operation(json)); };
    ASSERT_TRUE(
        submit(R"({"create_sculpt_surface": {"id": "hood", "rectangle": {"width_m": 0.4, "depth_m": 0.3},
                           "control_u": 12, "control_v": 10}})"));
    if (coupled) {
      ASSERT_TRUE(submit(R"({"add_icon": {"entity": "hood", "id": "n", "shape": "ICON_POINT",
                             "property": "ICON_NORMAL", "parameters": [{"x": 0.2, "y": 0.15}]}})"));
    }
    for (int i = 0; i < 7; ++i) {
      const auto added = submit(point(fmt::format("p{}", i), 0.08 + 0.04 * i, 0.1));
      if (!coupled || i < 6) {
        EXPECT_TRUE(added.ok()) << i;
        continue;
      }
      ASSERT_FALSE(added.ok()) << "2 and 3 x 7 are above 20";
      EXPECT_EQ(added.error().code, ErrorCode::resource_exhausted);
      EXPECT_NE(added.error().message.find("ask for 23 equations"), std::string::npos)
          << added.error().message;
      EXPECT_NE(added.error().message.find("delete icons"), std::string::npos) << added.error().message;
    }
  }
}

TEST_F(Sculpting, D15_AStiffnessBeyondAnySurfaceIsNamed) {
  apply(R"({"add_icon": {"entity": "hood", "id": "l", "shape": "ICON_POINT", "role": "ICON_LOAD",
            "parameters": [{"x": 0.2, "y": 0.15}], "stiffness": 1e308}})");
  for (const char* id : {"", "with"}) {
    if (*id != 0) apply(point(id, 0.1, 0.1));
    const Error error = refused(drag("l", 0.01));
    EXPECT_NE(error.message.find("stiffness of 1e+308 N/m"), std::string::npos) << error.message;
  }
}

TEST(DuplicateModel, SaysWhatMayBeDuplicated) {
  auto cad = std::make_shared<CadModel>();
  cad->id = "car";
  cad->boundary_representation = std::make_shared<const std::string>();
  Document document;
  document.entities["car"] = cad;
  Model model(document);
  const auto refused = model.submit(operation(R"({"duplicate": {"entity": "car"}})"));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().field, "duplicate.entity");
  EXPECT_NE(refused.error().message.find("expected a dual_shape or sculpt_surface"), std::string::npos)
      << refused.error().message;
}

TEST_F(Sculpting, D9_WhereACurveIsHeldIsNothingWithoutAReach) {
  apply(R"({"add_icon": {"entity": "hood", "id": "c", "shape": "ICON_CURVE",
            "parameters": [{"x": 0.1, "y": 0.15}, {"x": 0.3, "y": 0.15}]}})");
  const Error error = refused(
      R"({"drag_icon": {"entity": "hood", "icon": "c", "translation": {"z": 0.01}, "held_at": 0.5}})");
  EXPECT_EQ(error.field, "drag_icon.held_at");
}

}  // namespace
}  // namespace handloft::model::test
