// All that a designer does, done by the simulated hand through cameras, glove, tracking and interaction, by
// the three programs as real processes (A25): the hand's truth is stated in tour_program.h, and what came of
// it is asked of the server.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "daemon-tracking/source/simulated/tour_program.h"
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
namespace tour = tracking::tour;

std::vector<Vec3> positions(const json& points) {
  std::vector<Vec3> out;
  for (const json& point : points) {
    const json& p = point["position"];
    out.emplace_back(p.value("x", 0.0), p.value("y", 0.0), p.value("z", 0.0));
  }
  return out;
}

double above_lid(const Vec3& p) {
  return p.z() - tour::lid_height_m(p.x(), p.y());
}

double ring_distance(const Vec3& p) {
  return std::hypot(p.x() - tour::dent_x_m, p.y() - tour::dent_y_m);
}

// The tour ends in the first alternative, where the history stands as the hand made it: so what each step did
// is seen by taking the steps back one by one.
TEST(Tour, TheHandDoesAllThatADesignerDoes_A25) {
  const test::TemporaryDirectory folder;
  SessionOptions options;
  options.source = {"--simulate", "tour", "--pace", "fast"};
  const std::string script =
      "{\"query\": {\"history\": {}}}\n"
      "{\"query\": {\"alternatives\": {}}}\n"
      "{\"query\": {\"surface\": {\"entity\": \"shape-1\"}}}\n"
      "{\"query\": {\"pick\": {\"origin\": {\"x\": 0.0, \"y\": 0.0, \"z\": 0.4}, \"direction\": {\"z\": "
      "-1}}}}\n"
      "{\"query\": {\"pick\": {\"origin\": {\"x\": 0.034, \"y\": 0.0, \"z\": 0.4}, \"direction\": {\"z\": "
      "-1}}}}\n"
      "{\"undo\": {}}\n{\"undo\": {}}\n{\"undo\": {}}\n"  // switch, degree, new alternative
      "{\"undo\": {}}\n"                                  // the boundary
      "{\"query\": {\"pick\": {\"origin\": {\"x\": 0.034, \"y\": 0.0, \"z\": 0.4}, \"direction\": {\"z\": "
      "-1}}}}\n"
      "{\"query\": {\"pick\": {\"origin\": {\"x\": 0.02, \"y\": 0.0, \"z\": 0.4}, \"direction\": {\"z\": "
      "-1}}}}\n"
      "{\"undo\": {}}\n"  // the profile that the thumb divided
      "{\"query\": {\"pick\": {\"origin\": {\"x\": 0.02, \"y\": 0.0, \"z\": 0.4}, \"direction\": {\"z\": "
      "-1}}}}\n"
      "{\"query\": {\"pick\": {\"origin\": {\"x\": 0.0, \"y\": 0.0, \"z\": 0.4}, \"direction\": {\"z\": "
      "-1}}}}\n"
      "{\"undo\": {}}\n"  // the profile
      "{\"query\": {\"pick\": {\"origin\": {\"x\": 0.0, \"y\": 0.0, \"z\": 0.4}, \"direction\": {\"z\": "
      "-1}}}}\n"
      "{\"query\": {\"points\": {\"entity\": \"shape-1\"}}}\n"
      "{\"undo\": {}}\n"  // the push
      "{\"query\": {\"points\": {\"entity\": \"shape-1\"}}}\n";
  const SessionResult session = run_session(folder.path(), options, script);
  std::vector<json> answers;
  for (const json& answer : session.answers) {
    const bool asked = answer.contains("result") && !answer["result"].contains("sequence");
    if (asked) answers.push_back(answer["result"]);  // the others are of the undos
  }
  ASSERT_EQ(answers.size(), 12U) << json(session.answers).dump(1).substr(0, 4000);

  // Tracking, in every pose of the hand.
  const json& accuracy = session.tracking["accuracy"];
  EXPECT_LE(accuracy["fingertips_mm"]["rms"].get<double>(), 2.0) << accuracy;

  // Every operation happened, in order.
  std::string words;
  for (const json& step : answers[0]["history"]["applied"]) words += step.get<std::string>() + " | ";
  RecordProperty("history", words);
  for (const char* word :
       {"points", "Fit", "points and a surface", "Push", "profile", "Trim", "New alternative", "Switch to"}) {
    EXPECT_THAT(words, testing::HasSubstr(word));
  }
  EXPECT_GE(answers[0]["history"]["applied"].size(), 12U) << words;
  EXPECT_EQ(answers[1]["alternatives"]["names"].size(), 2U) << answers[1];
  EXPECT_EQ(answers[2]["surface"].value("trim", ""), "boundary");
  EXPECT_EQ(answers[2]["surface"].value("degree", 0), 2) << "the other alternative has the higher one";

  // The boundary: seen inside the loop, not outside; without it outside as well.
  EXPECT_EQ(answers[3]["pick"].value("entity", ""), "shape-1");
  EXPECT_EQ(answers[4]["pick"].value("entity", ""), "");
  EXPECT_EQ(answers[5]["pick"].value("entity", ""), "shape-1");

  // The profile raised the middle, by most of what the stroke was above it.
  const double raised =
      answers[8]["pick"]["position"].value("z", 0.0) - answers[9]["pick"]["position"].value("z", 0.0);
  EXPECT_GT(raised, 0.3 * tour::ridge_m);
  EXPECT_LT(raised, 1.5 * tour::ridge_m);

  // The second profile went far above the right half of the lid, but the thumb had tapped before (A21).
  const double beside =
      answers[6]["pick"]["position"].value("z", 0.0) - answers[7]["pick"]["position"].value("z", 0.0);
  RecordProperty("raised_beside_the_split_mm", std::to_string(beside * 1e3));
  EXPECT_LT(std::abs(beside), 0.3 * (tour::flank(0.75).z() - tour::lid_height_m(0.02, 0.0)))
      << "the rest of the stroke was nobody's";

  // The push: points under the disk lie on its lowest place now, those beyond its range where they were.
  const std::vector<Vec3> pushed = positions(answers[10]["points"]["points"]);
  const std::vector<Vec3> laid = positions(answers[11]["points"]["points"]);
  ASSERT_EQ(pushed.size(), laid.size());
  ASSERT_GT(laid.size(), 80U);
  const double radius = 0.005 + 0.055 * tour::dent_pressure;
  int beneath = 0;
  double worst = 0, off_lid = 0, moved_far = 0, upwards = 0;
  for (std::size_t i = 0; i < laid.size(); ++i) {
    off_lid += above_lid(laid[i]) * above_lid(laid[i]);
    const double moved = (pushed[i] - laid[i]).norm();
    upwards = std::max(upwards, pushed[i].z() - laid[i].z());
    // d_max is at most the lid's diagonal.
    const double reach = radius + tour::dent_range * 2 * std::hypot(tour::half_width_m, tour::half_length_m);
    if (ring_distance(laid[i]) > reach + 0.004) moved_far = std::max(moved_far, moved);
    if (ring_distance(laid[i]) < radius - 0.008) {
      ++beneath;
      worst = std::max(worst, std::abs(pushed[i].z() - tour::dent_z_m));
      EXPECT_GT(moved, 0.004);
    }
  }
  off_lid = std::sqrt(off_lid / static_cast<double>(laid.size()));
  RecordProperty("laid_off_lid_mm_rms", std::to_string(off_lid * 1e3));
  RecordProperty("pushed_worst_mm", std::to_string(worst * 1e3));
  EXPECT_LT(off_lid, 1e-3);
  EXPECT_GE(beneath, 3);
  EXPECT_LT(worst, 5e-3) << "tracking, and the disk's tilt over its radius";
  EXPECT_LT(moved_far, 1e-6);
  EXPECT_LT(upwards, 1.5e-3) << "only pushed";
}

/// Of the environment, or the other: the whole recording takes minutes.
double seconds_of_motion() {
  const char* wanted = std::getenv("HANDLOFT_MOTION_S");
  return wanted != nullptr ? std::strtod(wanted, nullptr) : 8.0;
}

TEST(Tour, ARealHandsMotionLaysPoints_A1_T7) {
  HANDLOFT_REQUIRE_DATA(file, "mocap/recording.tsv");
  const test::TemporaryDirectory folder;
  SessionOptions options;
  options.source = {"--simulate",  "motion",     "--motion",
                    file.string(), "--motion-s", std::to_string(seconds_of_motion()),
                    "--pace",      "fast"};
  options.with_display = true;
  const SessionResult session = run_session(folder.path(), options,
                                            "{\"query\": {\"points\": {\"entity\": \"shape-1\"}}}\n"
                                            "{\"fit\": {\"entity\": \"shape-1\"}}\n"
                                            "{\"query\": {\"surface\": {\"entity\": \"shape-1\"}}}\n");
  ASSERT_FALSE(session.answers.empty());
  const json& accuracy = session.tracking["accuracy"];
  const std::size_t laid = session.answers[0]["result"]["points"]["points"].size();
  std::printf("%.0f s of a real hand: %zu points laid, fingertips %s, lost %d\n%s\n", seconds_of_motion(),
              laid, accuracy["fingertips_mm"].dump().c_str(), accuracy.value("fingertips_lost", -1),
              session.answers.back().dump().substr(0, 900).c_str());
  EXPECT_GT(laid, 50U);
  // This hand holds its thumb under the palm, where the table cameras see it now and then only.
  const json& fingers = accuracy["by_finger_mm"];
  ASSERT_EQ(fingers.size(), 5U);
  EXPECT_LE(fingers[0]["rms"].get<double>(), 20.0);
  for (std::size_t i = 1; i < fingers.size(); ++i) EXPECT_LE(fingers[i]["rms"].get<double>(), 2.0) << i;
  EXPECT_GT(session.view["scene"]["points"].get<int>(), 50) << session.view;
  EXPECT_EQ(session.view["messages_refused"], 0);
}

class StrokesOfAFile : public testing::TestWithParam<const char*> {};

// Drawn by people in the air, followed by the simulated hand, which touches "Fit" at the end (A1, A6).
TEST_P(StrokesOfAFile, FitToASurface_A6) {
  HANDLOFT_REQUIRE_DATA(file, GetParam());
  const test::TemporaryDirectory folder;
  SessionOptions options;
  options.source = {"--simulate", "strokes", "--strokes", file.string(), "--pace", "fast"};
  const SessionResult session =
      run_session(folder.path(), options, "{\"query\": {\"surface\": {\"entity\": \"shape-1\"}}}\n");
  ASSERT_EQ(session.answers.size(), 1U);
  ASSERT_TRUE(session.answers[0].contains("result")) << session.answers[0];
  const json& surface = session.answers[0]["result"]["surface"];
  const json& residuals = surface["residuals"];
  const double rms = residuals.value("rmsM", -1.0);
  std::printf("%s: %d points, degree %d, residuals %.1f mm RMS, fingertips %.2f mm RMS\n", GetParam(),
              surface.value("pointCount", 0), surface.value("degree", 0), rms * 1e3,
              session.tracking["accuracy"]["fingertips_mm"]["rms"].get<double>());
  EXPECT_GE(surface.value("degree", 0), 1);
  EXPECT_EQ(surface["coefficients"].size(), static_cast<std::size_t>((surface.value("degree", 0) + 1) *
                                                                     (surface.value("degree", 0) + 2) / 2));
  EXPECT_GT(rms, 0.0);
  EXPECT_LT(rms, 0.04) << "the drawing is 160 mm wide and no surface: the fit is its best plane or quadric";
  EXPECT_LE(session.tracking["accuracy"]["fingertips_mm"]["rms"].get<double>(), 2.0);
}

INSTANTIATE_TEST_SUITE_P(Tilt, StrokesOfAFile, testing::Values("tilt/sketch1.tilt", "tilt/torch.tilt"));

}  // namespace
}  // namespace handloft
