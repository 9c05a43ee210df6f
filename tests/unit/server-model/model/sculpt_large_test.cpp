// Surfaces too large for a factor: every operation of sculpting by iteration, with curves and regions as pins
// of the solver, does what the factor does. "Large" is made small here: above ten control points that may
// move.

#include "server-model/model/sculpt_solvers.h"
#include "tests/unit/server-model/model/sculpt_helpers.h"

namespace handloft::model::test {
namespace {

constexpr double agreement_m = 1e-6;

std::shared_ptr<SculptSolvers> by_iteration() {
  geometry::IterativeOptions options;
  options.direct_unknowns = 10;
  options.relative_residual = 1e-8;
  return std::make_shared<SculptSolvers>(8, 1'500'000, options);
}

Model with(std::shared_ptr<SculptSolvers> solvers) {
  ApplyContext context;
  context.sculpt_solvers = std::move(solvers);
  return Model(Document{}, std::move(context));
}

class LargeSculpting : public testing::Test {
 protected:
  LargeSculpting() : large(with(by_iteration())), small(with(std::make_shared<SculptSolvers>())) {
    apply(R"({"create_sculpt_surface": {"id": "hood", "rectangle": {"width_m": 0.4, "depth_m": 0.3},
              "control_u": 22, "control_v": 19}})");
  }

  static SculptPtr hood(const Model& model) { return as_sculpt(model.document().find("hood")); }

  /// The same of both, and how far the surfaces are apart. Notes are those of the large one.
  void apply(const std::string& json) {
    SCOPED_TRACE(json);
    auto one = large.submit(operation(json));
    auto two = small.submit(operation(json));
    ASSERT_TRUE(one.ok()) << one.error().describe();
    ASSERT_TRUE(two.ok()) << two.error().describe();
    const SculptPtr a = hood(large), b = hood(small);
    ASSERT_TRUE(a && b);
    ASSERT_EQ(a->surface->control.size(), b->surface->control.size());
    double apart = 0;
    for (std::size_t i = 0; i < a->surface->control.size(); ++i)
      apart = std::max(apart, (a->surface->control[i] - b->surface->control[i]).norm());
    EXPECT_LE(apart, agreement_m);
    for (std::size_t i = 0; i < a->icons->size(); ++i)
      EXPECT_LE(((*a->icons)[i].place - (*b->icons)[i].place).norm(), agreement_m);
  }
  double bulge() const {
    double most = 0;
    const SculptPtr shape = hood(large);
    for (std::size_t i = 0; i < shape->surface->control.size(); ++i)
      most = std::max(most, (shape->surface->control[i] - shape->rest->control[i]).norm());
    return most;
  }

  Model large, small;
};

TEST_F(LargeSculpting, D9_D11_CurvesAndRegionsAreDraggedTurnedAndBent) {
  apply(R"({"add_icon": {"entity": "hood", "id": "r", "shape": "ICON_REGION", "parameters":
           [{"x": 0.06, "y": 0.06}, {"x": 0.16, "y": 0.14}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": 0.02}}})");
  EXPECT_GT(bulge(), 0.019);
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "rotation": {"x": 0.1, "w": 0.995}}})");
  apply(R"({"add_icon": {"entity": "hood", "id": "c", "shape": "ICON_CURVE", "parameters":
           [{"x": 0.24, "y": 0.08}, {"x": 0.24, "y": 0.2}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "c", "translation": {"x": 0.002, "z": 0.01}}})");
  apply(R"({"commit_sculpting": {"entity": "hood"}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": -0.004}}})");
  apply(R"({"recover_sculpting": {"entity": "hood"}})");
  EXPECT_TRUE(hood(large)->surface->control == hood(large)->initial->control);  // D19: to the bit.
}

TEST_F(LargeSculpting, D11_InsideARegion) {
  apply(R"({"add_icon": {"entity": "hood", "id": "out", "shape": "ICON_REGION", "outside": true, "parameters":
           [{"x": 0.06, "y": 0.03}, {"x": 0.32, "y": 0.24}]}})");
  apply(R"({"add_icon": {"entity": "hood", "id": "p", "shape": "ICON_POINT", "parameters":
           [{"x": 0.2, "y": 0.15}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.02}}})");
  EXPECT_GT(bulge(), 0.019);
  apply(R"({"add_icon": {"entity": "hood", "id": "r", "shape": "ICON_REGION", "parameters":
           [{"x": 0.12, "y": 0.06}, {"x": 0.17, "y": 0.12}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": -0.01}}})");
  apply(R"({"delete_icon": {"entity": "hood", "icon": "out"}})");
}

// Table 1's kinds beside a region and a curve: points, normals, loads, their stiffness, states and switches.
TEST_F(LargeSculpting, D13_EveryOtherIconBesideThem) {
  apply(R"({"set_sculpting": {"entity": "hood", "u_lower": "EDGE_FREE", "v_upper": "EDGE_SUPPORTED"}})");
  apply(R"({"add_icon": {"entity": "hood", "id": "r", "shape": "ICON_REGION", "parameters":
           [{"x": 0.05, "y": 0.05}, {"x": 0.13, "y": 0.13}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"z": 0.01}}})");
  for (const char* property : {"POSITION", "TANGENT_U", "SECOND_V", "TWIST"}) {
    const std::string id = std::string("p-") + property;
    apply(R"({"add_icon": {"entity": "hood", "id": ")" + id + R"(", "parameters": [{"x": 0.23, "y": 0.17}],
           "property": "ICON_)" +
          property + "\"}}");
    apply(R"({"drag_icon": {"entity": "hood", "icon": ")" + id + R"(", "translation": {"z": 0.002}}})");
    apply(R"({"delete_icon": {"entity": "hood", "icon": ")" + id + "\"}}");
  }
  apply(R"({"add_icon": {"entity": "hood", "id": "n", "property": "ICON_NORMAL",
           "parameters": [{"x": 0.23, "y": 0.07}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "n", "rotation": {"y": 0.05, "w": 0.99875}}})");
  apply(
      R"({"add_icon": {"entity": "hood", "id": "l", "role": "ICON_LOAD", "parameters": [{"x": 0.3, "y": 0.2}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "l", "translation": {"z": 0.006}}})");
  apply(R"({"change_icon": {"entity": "hood", "icon": "l", "stiffness": 30}})");
  apply(
      R"({"add_icon": {"entity": "hood", "id": "cl", "shape": "ICON_CURVE", "role": "ICON_LOAD", "parameters":
           [{"x": 0.2, "y": 0.05}, {"x": 0.3, "y": 0.1}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "cl", "translation": {"z": -0.004}}})");
  apply(R"({"change_icon": {"entity": "hood", "icon": "r", "state": "ICON_PASSIVE"}})");
  apply(R"({"change_icon": {"entity": "hood", "icon": "n", "state": "ICON_SLEEPING"}})");
  apply(R"({"set_sculpting": {"entity": "hood", "mode": "ABSOLUTE"}})");
  apply(R"({"change_icon": {"entity": "hood", "icon": "r", "role": "ICON_LOAD", "state": "ICON_DRIVING"}})");
}

// A surface that nothing but its icons holds, without stretching: what pins leave of its motions others bear.
TEST_F(LargeSculpting, D4_PinsHoldAFreeSurface) {
  apply(R"({"set_sculpting": {"entity": "hood", "u_lower": "EDGE_FREE", "u_upper": "EDGE_FREE",
           "v_lower": "EDGE_FREE", "v_upper": "EDGE_FREE", "energy": {"b11": 1, "b12": 1, "b22": 1}}})");
  apply(R"({"add_icon": {"entity": "hood", "id": "c", "shape": "ICON_CURVE", "parameters":
           [{"x": 0.1, "y": 0.1}, {"x": 0.3, "y": 0.1}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "c", "translation": {"z": 0.01}}})");
  apply(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.2, "y": 0.25}]}})");
  apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.02}}})");
}

// D20: what is held twice says so, what contradicts is named.
TEST_F(LargeSculpting, D20_FollowersAndContradictionsAreNamed) {
  apply(R"({"add_icon": {"entity": "hood", "id": "r", "shape": "ICON_REGION", "parameters":
           [{"x": 0.06, "y": 0.06}, {"x": 0.2, "y": 0.18}]}})");
  auto again = large.submit(operation(R"({"add_icon": {"entity": "hood", "id": "p",
                                          "parameters": [{"x": 0.13, "y": 0.12}]}})"));
  ASSERT_TRUE(again.ok()) << again.error().describe();
  ASSERT_EQ(again->notes.size(), 1U);
  EXPECT_NE(again->notes[0].find("icon \"p\" adds nothing"), std::string::npos) << again->notes[0];
  auto off = large.submit(
      operation(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.01}}})"));
  ASSERT_FALSE(off.ok());
  EXPECT_EQ(off.error().code, ErrorCode::failed_precondition);
  EXPECT_NE(off.error().message.find("icon \"p\" (off by 0.01)"), std::string::npos) << off.error().message;
  auto overlapping = large.submit(
      operation(R"({"add_icon": {"entity": "hood", "id": "q", "shape": "ICON_REGION", "parameters":
                   [{"x": 0.06, "y": 0.06}, {"x": 0.2, "y": 0.18}]}})"));
  ASSERT_TRUE(overlapping.ok()) << overlapping.error().describe();
  auto apart = large.submit(
      operation(R"({"drag_icon": {"entity": "hood", "icon": "q", "translation": {"z": 0.01}}})"));
  ASSERT_FALSE(apart.ok());
  EXPECT_NE(apart.error().message.find("icon \"q\" (off by 0.01)"), std::string::npos)
      << apart.error().message;
}

// X2: no bit depends on what was solved before.
TEST(LargeSculptingBits, X2_AreThoseOfTheDocumentAlone) {
  const auto run = [](Model& model, bool wander) {
    const auto apply = [&](const std::string& json) {
      auto done = model.submit(operation(json));
      EXPECT_TRUE(done.ok()) << json << (done ? "" : done.error().describe());
    };
    apply(R"({"create_sculpt_surface": {"id": "hood", "rectangle": {"width_m": 0.4, "depth_m": 0.3},
              "control_u": 22, "control_v": 19}})");
    apply(R"({"add_icon": {"entity": "hood", "id": "r", "shape": "ICON_REGION", "parameters":
             [{"x": 0.06, "y": 0.06}, {"x": 0.16, "y": 0.14}]}})");
    if (wander) {
      apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "rotation": {"x": 0.1, "w": 0.995}}})");
      apply(R"({"undo": {}})");
    }
    apply(R"({"drag_icon": {"entity": "hood", "icon": "r", "translation": {"x": 0.01, "z": 0.02}}})");
    apply(R"({"add_icon": {"entity": "hood", "id": "p", "parameters": [{"x": 0.3, "y": 0.2}]}})");
    apply(R"({"drag_icon": {"entity": "hood", "icon": "p", "translation": {"z": 0.02}}})");
    if (wander) {
      apply(R"({"undo": {}})");
      apply(R"({"redo": {}})");
    }
    return as_sculpt(model.document().find("hood"))->surface->control;
  };
  Model one = with(by_iteration()), two = with(by_iteration());
  EXPECT_TRUE(run(one, false) == run(two, true));
}

// More places than a dense system is made of are pins at any size.
TEST_F(Sculpting, D11_ARegionOfThousandsOfControlPoints) {
  apply(R"({"create_sculpt_surface": {"id": "big", "rectangle": {"width_m": 1, "depth_m": 1},
            "control_u": 80, "control_v": 80}})");
  apply(R"({"add_icon": {"entity": "big", "id": "r", "shape": "ICON_REGION", "parameters":
           [{"x": 0.1, "y": 0.1}, {"x": 0.85, "y": 0.85}]}})");
  apply(R"({"drag_icon": {"entity": "big", "icon": "r", "translation": {"z": 0.05}}})");
  const SculptPtr big = as_sculpt(model.document().find("big"));
  EXPECT_NEAR(big->surface->evaluate(0.5, 0.5).z(), 0.05, 1e-12);
  EXPECT_NEAR(big->surface->evaluate(0.11, 0.84).z(), 0.05, 1e-9);
}

// D13, D16: who pushes at what is held is told.
TEST_F(Sculpting, ALoadOnWhatIsHeldSaysThatItMovesNothing) {
  const auto said = [](const Submitted& done) {
    return std::any_of(done.notes.begin(), done.notes.end(), [](const std::string& note) {
      return note.find("load \"l\" moves nothing") != std::string::npos;
    });
  };
  for (const char* stiffness : {"0", "50"}) {
    apply(std::string(R"({"add_icon": {"entity": "hood", "id": "l", "role": "ICON_LOAD", "stiffness": )") +
          stiffness + R"(, "parameters": [{"x": 0, "y": 0.15}]}})");
    EXPECT_TRUE(said(apply(R"({"drag_icon": {"entity": "hood", "icon": "l", "translation": {"z": 0.01}}})")));
    apply(R"({"delete_icon": {"entity": "hood", "icon": "l"}})");
  }
  apply(
      R"({"add_icon": {"entity": "hood", "id": "l", "role": "ICON_LOAD", "parameters": [{"x": 0.2, "y": 0.15}]}})");
  EXPECT_FALSE(said(apply(R"({"drag_icon": {"entity": "hood", "icon": "l", "translation": {"z": 0.01}}})")));
}

// D16: the first drag of a load finds its stiffness ready.
TEST_F(Sculpting, D16_ALoadIsMadeReadyWhenItComes) {
  auto solvers = std::make_shared<SculptSolvers>();
  Model fresh = with(solvers);
  const auto submit = [&](const char* json) { return fresh.submit(operation(json)).ok(); };
  ASSERT_TRUE(submit(R"({"create_sculpt_surface": {"id": "s", "rectangle": {"width_m": 0.4, "depth_m": 0.3},
                         "control_u": 12, "control_v": 10}})"));
  EXPECT_EQ(solvers->made(), 0U);
  ASSERT_TRUE(submit(R"({"add_icon": {"entity": "s", "id": "l", "role": "ICON_LOAD",
                         "parameters": [{"x": 0.2, "y": 0.15}]}})"));
  EXPECT_EQ(solvers->made(), 1U);
  ASSERT_TRUE(submit(R"({"drag_icon": {"entity": "s", "icon": "l", "translation": {"z": 0.01}}})"));
  EXPECT_EQ(solvers->made(), 1U);
}

// What a message leaves unsaid stays as it was.
TEST_F(Sculpting, D20_LeastSquaresUnsaidStays) {
  apply(R"({"set_sculpting": {"entity": "hood", "least_squares": true}})");
  apply(R"({"set_sculpting": {"entity": "hood", "u_lower": "EDGE_FREE"}})");
  EXPECT_TRUE(hood()->least_squares);
  apply(R"({"set_sculpting": {"entity": "hood", "least_squares": false}})");
  EXPECT_FALSE(hood()->least_squares);
}

}  // namespace
}  // namespace handloft::model::test
