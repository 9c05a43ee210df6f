// Sculpting by hand (D13 to D19): a simulated hand before rendered cameras makes a sheet, lays icons on it,
// drags, turns and softens them, commits, and in the end recovers, by the three programs as real processes.
// What the hand does is stated in sculpt_program.h; what came of it is asked of the server.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "daemon-tracking/source/simulated/sculpt_program.h"
#include "server-model/geometry/types.h"
#include "tests/e2e/session.h"
#include "tests/support/test_data.h"

namespace handloft {
namespace {

using e2e::run_session;
using e2e::SessionOptions;
using e2e::SessionResult;
using geometry::Vec3;
using nlohmann::json;
namespace sculpt = tracking::sculpt;

constexpr std::string_view sheet = "surface-1";

Vec3 vec3(const json& at) {
  return {at.value("x", 0.0), at.value("y", 0.0), at.value("z", 0.0)};
}

/// Of the history: the sheet, four anchors, the lifted icon and its drag, the turned one, its property and
/// its turn, the loaded one, its role, stiffness and drag, a state, the commit; one more icon, its drag, the
/// recovery.
constexpr int steps = 19, steps_to_the_turn = 10;

/// How nearly a fist turns what it holds: two and a half degrees, of fingertips tracked to 1.3 mm RMS.
constexpr double turned_to_rad = 0.044;
/// The palette's first stiffness, of that which follows the hand (InteractionOptions::soft).
constexpr double soft = 0.5;

class Script {
 public:
  /// Asks for the sheet's icons and control points; the answer's number.
  std::size_t sculpt() {
    return ask(R"({"query": {"sculpt": {"entity": ")" + std::string(sheet) + R"(", "control": true}}})");
  }
  std::size_t hash() { return ask(R"({"query": {"hash": {}}})"); }
  std::size_t history() { return ask(R"({"query": {"history": {}}})"); }
  /// Straight down through `place`.
  std::size_t pick(const Vec3& place) {
    const json query = {
        {"query",
         {{"pick",
           {{"origin", {{"x", place.x()}, {"y", place.y()}, {"z", 0.5}}}, {"direction", {{"z", -1}}}}}}}};
    return ask(query.dump());
  }
  void undo(int count = 1) { again(R"({"undo": {}})", count); }
  void redo(int count) { again(R"({"redo": {}})", count); }
  const std::string& text() const { return text_; }

 private:
  std::size_t ask(const std::string& line) {
    text_ += line + "\n";
    return asked_++;
  }
  void again(const std::string& line, int count) {
    for (int i = 0; i < count; ++i) text_ += line + "\n";
  }
  std::string text_;
  std::size_t asked_ = 0;
};

class Sculpting : public testing::Test {
 protected:
  void run(const Script& script) {
    SessionOptions options;
    options.source = {"--simulate", "sculpt", "--pace", "fast"};
    options.with_display = true;
    session_ = run_session(folder_.path(), options, script.text());
    for (const json& answer : session_.answers) {
      ASSERT_TRUE(answer.contains("result")) << answer;
      if (!answer["result"].contains("sequence")) answers_.push_back(answer["result"]);  // no undo or redo
    }
  }
  const json& icon(std::size_t answer, std::size_t index) const {
    return answers_.at(answer)["sculpt"]["icons"].at(index);
  }
  Vec3 place(std::size_t answer, std::size_t index) const { return vec3(icon(answer, index)["place"]); }
  double picked_z(std::size_t answer) const {
    const json& pick = answers_.at(answer)["pick"];
    EXPECT_EQ(pick.value("entity", ""), sheet);
    return pick["position"].value("z", 0.0);
  }
  void tell(const char* what, double value) {
    RecordProperty(what, std::to_string(value));
    std::printf("%s: %.3f\n", what, value);
  }

  test::TemporaryDirectory folder_;
  SessionResult session_;
  std::vector<json> answers_;
};

TEST_F(Sculpting, ByHandGoesWhereTheHandDragsItAndIsRecoveredToTheBit_D19) {
  const Vec3 lifted_to = sculpt::lifted_m + sculpt::lift_m;
  Script script;
  const auto history = script.history();
  const auto recovered = script.sculpt();
  const auto hash_recovered = script.hash();
  script.undo();
  const auto pressed = script.sculpt();
  script.undo(2);  // The press, and the icon that it was of.
  const auto committed = script.sculpt();
  const auto over_lifted = script.pick(lifted_to);
  const auto over_loaded = script.pick(sculpt::loaded_m);
  script.undo(1);
  const auto before_commit = script.sculpt();
  script.undo(1);
  const auto before_passive = script.sculpt();
  script.undo(1);
  const auto before_load = script.sculpt();
  const auto over_loaded_before = script.pick(sculpt::loaded_m);
  script.undo(3);  // It is soft, a load, there.
  const auto after_turn = script.sculpt();
  script.undo(1);
  const auto before_turn = script.sculpt();
  script.undo(steps_to_the_turn - 2);
  const auto at_first = script.sculpt();
  script.redo(steps - 1);
  const auto hash_again = script.hash();
  run(script);
  ASSERT_EQ(answers_.size(), hash_again + 1) << json(session_.answers).dump(1).substr(0, 4000);

  // Every operation happened, once, in order; the fist at the passive icon did nothing.
  std::vector<std::string> words = answers_[history]["history"]["applied"];
  EXPECT_EQ(words.size(), static_cast<std::size_t>(steps)) << answers_[history];
  ASSERT_EQ(answers_[at_first]["sculpt"].value("controlU", 0), 20);
  const json& accuracy = session_.tracking["accuracy"];
  tell("fingertips_mm_rms", accuracy["fingertips_mm"]["rms"].get<double>());
  EXPECT_LE(accuracy["fingertips_mm"]["rms"].get<double>(), 2.0) << accuracy;

  // Taps lay icons where the fingertip was.
  const std::array<Vec3, 4> anchors{
      Vec3(-sculpt::anchor_x_m, -sculpt::anchor_y_m, 0.1), Vec3(-sculpt::anchor_x_m, sculpt::anchor_y_m, 0.1),
      Vec3(sculpt::anchor_x_m, sculpt::anchor_y_m, 0.1), Vec3(sculpt::anchor_x_m, -sculpt::anchor_y_m, 0.1)};
  double worst_tap = 0;
  for (std::size_t i = 0; i < anchors.size(); ++i) {
    worst_tap = std::max(worst_tap, (place(committed, i) - anchors[i]).norm());
    EXPECT_NEAR(place(committed, i).z(), sculpt::sheet_z_m, 1e-9) << "held where it was laid (D6)";
  }
  tell("taps_worst_mm", worst_tap * 1e3);
  EXPECT_LT(worst_tap, 3e-3);

  // The surface passes where the hand has dragged the icon to.
  const double missed = (place(committed, 4) - lifted_to).norm();
  tell("lifted_missed_mm", missed * 1e3);
  EXPECT_LT(missed, 2e-3) << "as near as the hand is tracked";
  tell("surface_off_lifted_mm", (picked_z(over_lifted) - lifted_to.z()) * 1e3);
  EXPECT_NEAR(picked_z(over_lifted), lifted_to.z(), 2e-3);

  // The tangent turned as the fist did (D7).
  EXPECT_EQ(icon(before_turn, 5).value("label", ""), "R");
  const Vec3 was = vec3(icon(before_turn, 5)["direction"]), is = vec3(icon(after_turn, 5)["direction"]);
  const Vec3 wanted = Eigen::AngleAxisd(sculpt::turn_rad, Vec3::UnitY()) * was;
  tell("turned_off_deg", std::acos(std::min(1.0, is.dot(wanted))) * 180 / M_PI);
  EXPECT_GT(is.dot(wanted), std::cos(turned_to_rad));
  EXPECT_LT(is.dot(was), std::cos(0.25)) << "negative control: it did turn";

  // A soft load yields as its stiffness has it, half of the hand's way (D16).
  EXPECT_EQ(icon(before_load, 6).value("role", ""), "ICON_LOAD");
  EXPECT_GT(icon(before_load, 6).value("stiffness", 0.0), 0.0);
  const double yielded = picked_z(over_loaded) - picked_z(over_loaded_before);
  tell("yielded_mm", yielded * 1e3);
  const double expected = soft * sculpt::load_m.z();
  EXPECT_NEAR(yielded, expected, 0.2 * expected);

  // Passive, it holds on (D13); committed, the shape is what it was.
  EXPECT_EQ(icon(before_commit, 4).value("state", ""), "ICON_PASSIVE");
  EXPECT_EQ(icon(before_passive, 4).value("state", ""), "ICON_DRIVING");
  const auto control = [&](std::size_t answer) { return answers_[answer]["sculpt"]["surface"]; };
  EXPECT_EQ(control(committed), control(before_commit));
  EXPECT_NE(control(pressed), control(committed));

  // Recovered: to the bit as it was made, the icons asleep.
  EXPECT_EQ(control(recovered), control(at_first));
  EXPECT_NE(control(recovered), control(committed)) << "negative control";
  for (const json& each : answers_[recovered]["sculpt"]["icons"])
    EXPECT_EQ(each.value("state", ""), "ICON_SLEEPING");
  EXPECT_EQ(answers_[hash_recovered]["hash"], answers_[hash_again]["hash"]) << "undone and done again";

  EXPECT_EQ(session_.view["messages_refused"], 0);
  EXPECT_GT(session_.view["scene"]["triangles"].get<int>(), 100) << session_.view;
}

}  // namespace
}  // namespace handloft
