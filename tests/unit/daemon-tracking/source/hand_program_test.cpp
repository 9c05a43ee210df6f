// The simulated hand's timeline.

#include "daemon-tracking/source/simulated/hand_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/simulated/mouse_shell.h"
#include "daemon-tracking/source/simulated/stroke_program.h"

namespace handloft::tracking {
namespace {

using Eigen::Vector3d;

constexpr double step_s = 0.004;

template <typename Visit>
void along(const HandProgram& program, Visit visit) {
  for (double time = 0; time < program.duration_s(); time += step_s) visit(time, program.at(time));
}

TEST(MouseShellProgram, LastsAsLongAsADemo) {
  const HandProgram program = mouse_shell_program();
  EXPECT_GT(program.duration_s(), 25.0);
  EXPECT_LT(program.duration_s(), 50.0);
}

TEST(MouseShellProgram, MovesAsFastAsAHand) {
  // Real fingertips: median 200, at most 546 mm/s (tracking.md 3.4).
  const HandProgram program = mouse_shell_program();
  double fastest = 0;
  std::vector<double> pressed;
  std::optional<Vector3d> last;
  along(program, [&](double, const HandState& hand) {
    if (last) {
      const double speed = (hand.centroid_m() - *last).norm() / step_s;
      fastest = std::max(fastest, speed);
      if (hand.pressure > 0.0) pressed.push_back(speed);
    }
    last = hand.centroid_m();
  });
  EXPECT_LT(fastest, 0.55);
  const auto middle = pressed.begin() + static_cast<std::ptrdiff_t>(pressed.size() / 2);
  std::nth_element(pressed.begin(), middle, pressed.end());
  EXPECT_GT(*middle, 0.15);
  EXPECT_LT(*middle, 0.25);
}

TEST(MouseShellProgram, CentroidIsOnTheSurfaceWhilePressed) {
  const HandProgram program = mouse_shell_program();
  int top = 0, side = 0;
  for (const HandEvent& event : program.events()) {
    if (event.kind != HandEvent::Kind::stroke) continue;
    const bool is_top = event.label.starts_with("top");
    for (double time = event.begin_s; time <= event.end_s; time += step_s) {
      const HandState hand = program.at(time);
      const Vector3d at = hand.centroid_m();
      const double distance = is_top ? mouse_shell::top_distance_m(at) : mouse_shell::side_distance_m(at);
      ASSERT_NEAR(distance, 0.0, 1e-9) << event.label << " at " << time;
      ASSERT_EQ(hand.contacts, 0);
      (is_top ? top : side) += hand.pressure > 0.3;
    }
  }
  EXPECT_GT(top, 500);
  EXPECT_GT(side, 400);
}

TEST(MouseShellProgram, PressesOnlyInStrokes) {
  const HandProgram program = mouse_shell_program();
  along(program, [&](double time, const HandState& hand) {
    const bool in_stroke =
        std::any_of(program.events().begin(), program.events().end(), [&](const HandEvent& event) {
          return event.kind == HandEvent::Kind::stroke && time >= event.begin_s && time <= event.end_s;
        });
    if (!in_stroke) {
      ASSERT_EQ(hand.pressure, 0.0) << time;
    }
  });
}

TEST(MouseShellProgram, TouchesThePaletteInOrder) {
  const HandProgram program = mouse_shell_program();
  std::vector<PaletteCommand> touched;
  bool down = false;
  along(program, [&](double time, const HandState& hand) {
    const bool contact = (hand.contacts & contact_table) != 0;
    if (contact) {
      const Vector3d at = hand.centroid_m();
      const auto command = palette_command_at(at.x(), at.y(), first_palette_page);
      ASSERT_TRUE(command.has_value()) << time;
      ASSERT_LT(at.z(), 0.012) << time;
      if (!down) touched.push_back(*command);
    }
    down = contact;
  });
  EXPECT_EQ(touched,
            (std::vector<PaletteCommand>{PaletteCommand::symmetry, PaletteCommand::fit,
                                         PaletteCommand::new_shape, PaletteCommand::fit,
                                         PaletteCommand::representation, PaletteCommand::representation}));
}

TEST(HandProgram, TurnsThePageToTheCellThatItTouches) {
  HandProgram program;
  program.touch(PaletteCommand::falloff);
  program.touch(PaletteCommand::undo);  // On every page.
  program.touch(PaletteCommand::degree);
  program.touch(PaletteCommand::export_file);
  std::vector<std::string> labels;
  int page = first_palette_page;
  for (const HandEvent& event : program.events()) {
    const Vector3d at = program.at((event.begin_s + event.end_s) / 2).centroid_m();
    const PaletteCell* cell = palette_cell_at(at.x(), at.y(), page);
    ASSERT_NE(cell, nullptr) << event.label;
    EXPECT_EQ(cell->label, event.label);
    if (cell->command == PaletteCommand::next_page) page = palette_page_after(page);
    labels.push_back(event.label);
  }
  std::vector<std::string> expected{"More", "Falloff", "Undo"};
  for (int turned = 2; turned <= palette_pages; ++turned) expected.emplace_back("More");
  expected.insert(expected.end(), {"Degree", "Export"});
  EXPECT_EQ(labels, expected);
}

TEST(HandProgram, TheThumbTapsWhereItsTold_A21) {
  HandProgram program;
  const Vector3d from(-0.04, 0, 0.1), to(0.04, 0, 0.1);
  program.draw(
      "line", [&](double u) -> Vector3d { return from + u * (to - from); }, 2.0, [](double) { return 0.5; },
      Eigen::Quaterniond::Identity(), {0.25, 0.75});
  std::vector<double> tapped_x;
  bool laid = false;
  along(program, [&](double, const HandState& hand) {
    const bool now = (hand.contacts & contact_thumb) != 0;
    if (now) {
      EXPECT_EQ(hand.contacts, contact_thumb | contact_middle | contact_ring | contact_little);
    }
    if (now && !laid) tapped_x.push_back(hand.fingertips_m[static_cast<std::size_t>(Finger::index)].x());
    laid = now;
  });
  ASSERT_EQ(tapped_x.size(), 2U);
  EXPECT_NEAR(tapped_x[0], -0.02, 2e-3);
  EXPECT_NEAR(tapped_x[1], 0.02, 2e-3);
}

TEST(MouseShellProgram, WithdrawsFromTheShapeAtTheEnd) {
  const HandProgram program = mouse_shell_program();
  const HandState hand = program.at(program.duration_s());
  EXPECT_EQ(hand.pressure, 0.0);
  EXPECT_EQ(hand.contacts, 0);
  for (const Vector3d& tip : hand.fingertips_m) {
    EXPECT_LT(tip.x(), -mouse_shell::top_half_width_m - 0.03) << "beside it";
    EXPECT_GT(tip.z(), 0.02) << "and not on the table";
  }
}

TEST(MouseShellProgram, CapsStayApartAndOverTheTable) {
  const HandProgram program = mouse_shell_program();
  along(program, [&](double time, const HandState& hand) {
    for (std::size_t i = 0; i < finger_count; ++i) {
      ASSERT_GT(hand.fingertips_m[i].z(), 0.005) << time;
      for (std::size_t j = i + 1; j < finger_count; ++j) {
        ASSERT_GE((hand.fingertips_m[i] - hand.fingertips_m[j]).norm(), 0.02) << time;
      }
    }
  });
}

TEST(MouseShellProgram, TopIsSymmetricInX) {
  EXPECT_EQ(mouse_shell::top_height_m(0.02, 0.01), mouse_shell::top_height_m(-0.02, 0.01));
  // Negative control: a millimetre above it is a millimetre away where the surface is level.
  EXPECT_NEAR(
      mouse_shell::top_distance_m({0, -0.06 / 6.6, mouse_shell::top_height_m(0, -0.06 / 6.6) + 0.001}), 0.001,
      1e-12);
}

TEST(HandProgram, TremorHasItsAmplitudeAndLeavesTheCentroid) {
  HandOptions still, shaking;
  still.tremor_m = 0.0;
  HandProgram calm(still), tremulous(shaking);
  calm.idle(10);
  tremulous.idle(10);
  double sum = 0;
  int count = 0;
  along(calm, [&](double time, const HandState& hand) {
    const HandState other = tremulous.at(time);
    EXPECT_LT((hand.centroid_m() - other.centroid_m()).norm(), 1e-12);
    for (std::size_t i = 0; i < finger_count; ++i) {
      sum += (hand.fingertips_m[i] - other.fingertips_m[i]).squaredNorm();
      ++count;
    }
  });
  EXPECT_NEAR(std::sqrt(sum / count), shaking.tremor_m, 0.2 * shaking.tremor_m);
}

TEST(HandProgram, AnyTimeHasAState) {
  const HandProgram program = mouse_shell_program();
  for (const double time : {-1.0, 0.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(program.at(time).fingertips_m[0].allFinite() || std::isnan(time));
    EXPECT_TRUE(program.at(time).world_from_palm.translation().allFinite());
  }
  EXPECT_TRUE(HandProgram().at(0.0).centroid_m().allFinite());
}

Stroke line(double length_m, double duration_s, int points) {
  Stroke stroke;
  for (int i = 0; i < points; ++i) {
    const double u = static_cast<double>(i) / (points - 1);
    stroke.push_back({Vector3d(length_m * u, 1.0, 2.0), 0.2 + 0.6 * u, 100.0 + duration_s * u});
  }
  return stroke;
}

TEST(StrokeProgram, FollowsTheStrokeWithItsPressureAndTiming) {
  const Stroke stroke = line(2.0, 1.0, 50);
  const auto result = stroke_program({stroke});
  ASSERT_TRUE(result.ok()) << result.error().describe();
  EXPECT_NEAR(result->placement.scale, 0.08, 1e-12);
  EXPECT_EQ(result->placement.time_stretch, 1.0);
  const auto event = std::find_if(result->program.events().begin(), result->program.events().end(),
                                  [](const HandEvent& e) { return e.kind == HandEvent::Kind::stroke; });
  ASSERT_NE(event, result->program.events().end());
  EXPECT_NEAR(event->end_s - event->begin_s, 1.0, 1e-9);
  for (const StrokePoint& point : stroke) {
    const double time = event->begin_s + (point.time_s - 100.0);
    if (time >= event->end_s) continue;
    const HandState hand = result->program.at(time);
    EXPECT_LT((hand.centroid_m() - result->placement.place(point.position_m)).norm(), 1e-6);
    EXPECT_NEAR(hand.pressure, point.pressure, 1e-6);
  }
}

TEST(StrokeProgram, SlowsDownWhatIsTooFast) {
  const auto result = stroke_program({line(2.0, 0.1, 50)});  // 1.6 m/s after scaling.
  ASSERT_TRUE(result.ok());
  EXPECT_NEAR(result->placement.speed_p99_m_s, 1.6, 1e-6);
  EXPECT_NEAR(result->placement.time_stretch, 3.2, 1e-6);
  double fastest = 0;
  std::optional<Vector3d> last;
  along(result->program, [&](double, const HandState& hand) {
    if (last) fastest = std::max(fastest, (hand.centroid_m() - *last).norm() / step_s);
    last = hand.centroid_m();
  });
  EXPECT_LT(fastest, 0.65);
}

TEST(StrokeProgram, EndsOnFit) {
  const auto result = stroke_program({line(1, 1, 10), line(1, 1, 10)});
  ASSERT_TRUE(result.ok());
  const auto& events = result->program.events();
  const auto touch = std::find_if(events.rbegin(), events.rend(),
                                  [](const HandEvent& e) { return e.kind == HandEvent::Kind::touch; });
  ASSERT_NE(touch, events.rend());
  EXPECT_EQ(touch->label, "Fit");
}

TEST(StrokeProgram, RefusesBadStrokes) {
  EXPECT_FALSE(stroke_program({}).ok());
  EXPECT_FALSE(stroke_program({Stroke{}}).ok());
  Stroke bad = line(1, 1, 5);
  bad[2].position_m.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(stroke_program({bad}).ok());
  bad = line(1, 1, 5);
  bad[2].pressure = 1.1;
  const auto refused = stroke_program({bad});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().field, "strokes[0][2].pressure");
  bad = line(1, 1, 5);
  bad[3].time_s = 0;
  EXPECT_FALSE(stroke_program({bad}).ok());
  StrokeProgramOptions few;
  few.max_points = 4;
  EXPECT_FALSE(stroke_program({line(1, 1, 5)}, few).ok());
}

TEST(StrokeProgram, TakesASingleDab) {
  const auto result = stroke_program({Stroke{StrokePoint{Vector3d(5, 5, 5), 0.5, 1.0}}});
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(result->program.at(2.0).centroid_m().allFinite());
}

}  // namespace
}  // namespace handloft::tracking
