// The simulated hand's tour of all gestures (A25), and a recorded hand, as programs: what the cameras will
// see.

#include "daemon-tracking/source/simulated/tour_program.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <set>

#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/simulated/motion_program.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

using Eigen::Vector3d;

constexpr double step_s = 0.004;
constexpr auto index_finger = static_cast<std::size_t>(Finger::index);

const HandEvent& event(const HandProgram& program, const std::string& label) {
  for (const HandEvent& each : program.events()) {
    if (each.label == label) return each;
  }
  ADD_FAILURE() << "no event " << label;
  return program.events().front();
}

TEST(TourProgram, DoesEverythingAndNoFasterThanAHand) {
  const HandProgram program = tour_program();
  EXPECT_LT(program.duration_s(), 60.0);
  std::map<HandEvent::Kind, int> kinds;
  for (const HandEvent& each : program.events()) ++kinds[each.kind];
  EXPECT_EQ(kinds[HandEvent::Kind::stroke], 7);
  EXPECT_EQ(kinds[HandEvent::Kind::push], 1);
  EXPECT_EQ(kinds[HandEvent::Kind::draw], 3);
  EXPECT_EQ(kinds[HandEvent::Kind::touch], 10 + 3) << "the page is turned once to the falloff, twice back";
  std::set<std::uint16_t> contacts;
  std::optional<HandState> last;
  for (double time = 0; time < program.duration_s(); time += step_s) {
    const HandState hand = program.at(time);
    contacts.insert(hand.contacts);
    if (last) {
      // Real fingertips move at up to 546 mm/s (tracking.md 3.4); a folding finger is no faster.
      for (std::size_t i = 0; i < finger_count; ++i) {
        ASSERT_LT((hand.fingertips_m[i] - last->fingertips_m[i]).norm() / step_s, 0.75) << time;
      }
    }
    last = hand;
  }
  EXPECT_EQ(contacts.size(), 5U)
      << "open, closed, pointing, that with the thumb laid, on the table, and nothing between (T10)";
}

TEST(TourProgram, TheClosedHandFollowsItsPathAndTurnsThePotentiometer_A13_A16) {
  const HandProgram program = tour_program();
  const HandEvent& dent = event(program, "dent");
  double lowest = 1;
  for (double time = dent.begin_s; time <= dent.end_s; time += step_s) {
    const HandState hand = program.at(time);
    ASSERT_EQ(hand.contacts, contact_index | contact_middle | contact_ring | contact_little);
    ASSERT_NEAR(hand.centroid_m().x(), tour::dent_x_m, 1e-9);
    lowest = std::min(lowest, hand.centroid_m().z());
  }
  EXPECT_NEAR(lowest, tour::dent_z_m, 1e-5);
  EXPECT_NEAR(program.at(dent.begin_s - 2.0).potentiometer, 0.5, 1e-9);
  EXPECT_NEAR(program.at(dent.end_s).potentiometer, tour::dent_range, 1e-9);
  EXPECT_NEAR(program.at(program.duration_s()).potentiometer, tour::dent_range, 1e-9)
      << "it stays where it is";
}

TEST(TourProgram, FingersFoldWhileThePalmIsStill) {
  const HandProgram program = tour_program();
  const HandEvent& dent = event(program, "dent");
  const Vector3d palm = program.at(dent.begin_s).world_from_palm.translation();
  bool unfolded = false;
  for (double time = dent.begin_s - 0.4; time < dent.begin_s; time += step_s) {
    const HandState hand = program.at(time);
    ASSERT_LT((hand.world_from_palm.translation() - palm).norm(), 1e-9);
    ASSERT_EQ(hand.pressure, 0.0);
    unfolded |= hand.contacts == 0;
  }
  EXPECT_TRUE(unfolded) << "the pads close late";
}

TEST(TourProgram, ThePointingFingertipDraws_A18_A24) {
  const HandProgram program = tour_program();
  for (const auto& [label, path] :
       {std::pair<std::string, Vector3d (*)(double)>{"ridge", tour::ridge}, {"loop", tour::loop}}) {
    const HandEvent& drawn = event(program, label);
    double worst = 0;
    for (double time = drawn.begin_s; time <= drawn.end_s; time += step_s) {
      const HandState hand = program.at(time);
      ASSERT_EQ(hand.contacts, contact_middle | contact_ring | contact_little);
      double nearest = 1;
      for (double u = 0; u <= 1.0; u += 1e-3) {
        nearest = std::min(nearest, (path(u) - hand.fingertips_m[index_finger]).norm());
      }
      worst = std::max(worst, nearest);
    }
    EXPECT_LT(worst, 1.5e-3) << label << ": a hand trembles";
    // The index finger reaches farther ahead than all others.
    const HandState hand = program.at((drawn.begin_s + drawn.end_s) / 2);
    const Eigen::Isometry3d palm_from_world = hand.world_from_palm.inverse();
    for (std::size_t i = 0; i < finger_count; ++i) {
      if (i == index_finger) continue;
      EXPECT_GT((palm_from_world * hand.fingertips_m[index_finger]).y(),
                (palm_from_world * hand.fingertips_m[i]).y() + 0.02);
    }
  }
}

TEST(TourProgram, TheThumbDividesTheSecondProfileWhereItLeavesTheLid_A21) {
  const HandProgram program = tour_program();
  const HandEvent& drawn = event(program, "flank");
  std::optional<double> tapped_x;
  for (double time = drawn.begin_s; time <= drawn.end_s; time += step_s) {
    const HandState hand = program.at(time);
    const Vector3d tip = hand.fingertips_m[index_finger];
    if ((hand.contacts & contact_thumb) != 0 && !tapped_x) tapped_x = tip.x();
    if (!tapped_x) {
      ASSERT_LT(tip.z() - tour::lid_height_m(tip.x(), 0), tour::flank_m + 2e-3);
    }
  }
  ASSERT_TRUE(tapped_x);
  EXPECT_NEAR(*tapped_x, tour::flank(tour::flank_tap).x(), 2e-3);
  const double end_x = tour::flank(1.0).x();
  EXPECT_NEAR(tour::flank(1.0).z() - tour::lid_height_m(end_x, 0), tour::flank_m + tour::flank_end_m, 1e-12);
}

TEST(TourProgram, CapsStayApartInEveryPose) {
  const HandProgram program = tour_program();
  for (double time = 0; time < program.duration_s(); time += 0.02) {
    const HandState hand = program.at(time);
    for (std::size_t i = 0; i < finger_count; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        ASSERT_GT((hand.fingertips_m[i] - hand.fingertips_m[j]).norm(), 0.018)
            << time << " " << i << " " << j;
      }
    }
  }
}

std::filesystem::path write(const handloft::test::TemporaryDirectory& folder, const std::string& text) {
  const std::filesystem::path path = folder.path() / "motion.tsv";
  std::ofstream(path) << text;
  return path;
}

const std::string header =
    "FREQUENCY\t50\nFrame\tTime\tthumb_tip X\tthumb_tip Y\tthumb_tip Z\tindex_tip X\tindex_tip Y\tindex_tip "
    "Z\t"
    "middle_tip X\tmiddle_tip Y\tmiddle_tip Z\tring_tip X\tring_tip Y\tring_tip Z\tlittle_tip X\tlittle_tip "
    "Y\t"
    "little_tip Z\n";

std::string row(double shift_mm, bool hide_ring = false) {
  std::string line = "1\t0";
  for (int finger = 0; finger < 5; ++finger) {
    if (finger == 3 && hide_ring) {
      line += "\t0.0\t0.0\tNaN";
      continue;
    }
    line += "\t" + std::to_string(80 + finger + shift_mm) + "\t" + std::to_string(60 - 25 * finger) + "\t" +
            std::to_string(200 - shift_mm);
  }
  return line + "\n";
}

TEST(MotionProgram, BridgesHiddenMarkersAndTurnsHeightIntoPressure) {
  const handloft::test::TemporaryDirectory folder;
  std::string text = header;
  for (int i = 0; i <= 200; ++i) text += row(0.5 * i, i > 80 && i < 90);
  const Result<HandMotion> motion = read_hand_motion(write(folder, text));
  ASSERT_TRUE(motion.ok()) << motion.error().describe();
  EXPECT_EQ(motion->rate_hz, 50.0);
  EXPECT_FALSE(motion->frames[85][3]);
  const Result<HandProgram> program = motion_program(*motion);
  ASSERT_TRUE(program.ok()) << program.error().describe();
  const HandEvent& moved = event(*program, "recorded hand");
  EXPECT_NEAR(moved.end_s - moved.begin_s, 4.0, 1e-9);
  const double hidden_s = moved.begin_s + 85.0 / 50.0;
  const HandState hidden = program->at(hidden_s), seen = program->at(moved.begin_s + 60.0 / 50.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    EXPECT_NEAR(hidden.fingertips_m[3][a] - hidden.fingertips_m[2][a],
                seen.fingertips_m[3][a] - seen.fingertips_m[2][a], 2e-3);
  }
  EXPECT_LT(program->at(moved.begin_s + 0.6).pressure, 0.2);
  EXPECT_GT(program->at(moved.end_s - 0.01).pressure, 0.95);
  EXPECT_EQ(hidden.contacts, 0);
  double lowest = 1;
  for (const Vector3d& tip : program->at(moved.end_s).fingertips_m) lowest = std::min(lowest, tip.z());
  EXPECT_GT(lowest, 0.02);
}

TEST(MotionProgram, RefusesWhatIsNoHand) {
  const handloft::test::TemporaryDirectory folder;
  EXPECT_FALSE(read_hand_motion(folder.path() / "none.tsv").ok());
  EXPECT_FALSE(read_hand_motion(write(folder, "")).ok());
  EXPECT_FALSE(read_hand_motion(write(folder, "Frame\tTime\tthumb_tip X\n1\t2\t3\n")).ok());
  EXPECT_FALSE(read_hand_motion(write(folder, "FREQUENCY\tnan\n" + header + row(0))).ok());
  EXPECT_FALSE(read_hand_motion(write(folder, header)).ok());
  EXPECT_FALSE(read_hand_motion(write(folder, std::string(100'000, 'x'))).ok());
  const Result<HandMotion> one = read_hand_motion(write(folder, header + row(0)));
  ASSERT_TRUE(one.ok());
  EXPECT_FALSE(motion_program(*one).ok()) << "one frame is no motion";
  const Result<HandMotion> hidden = read_hand_motion(write(folder, header + row(0, true) + row(1, true)));
  ASSERT_TRUE(hidden.ok());
  EXPECT_FALSE(motion_program(*hidden).ok()) << "a finger that was never seen";
  MotionProgramOptions options;
  options.begin_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(motion_program(*one, options).ok());
}

TEST(MotionProgram, TheRealHandIsWithinReachOfTheRig) {
  HANDLOFT_REQUIRE_DATA(file, "mocap/recording.tsv");
  const Result<HandMotion> motion = read_hand_motion(file);
  ASSERT_TRUE(motion.ok()) << motion.error().describe();
  EXPECT_EQ(motion->frames.size(), 6000U);
  const Result<HandProgram> program = motion_program(*motion);
  ASSERT_TRUE(program.ok());
  EXPECT_GT(program->duration_s(), 60.0);
  for (double time = 0; time < program->duration_s(); time += 0.05) {
    for (const Vector3d& tip : program->at(time).fingertips_m) {
      ASSERT_LT(std::abs(tip.x()), 0.2);
      ASSERT_LT(std::abs(tip.y()), 0.25);
      ASSERT_GT(tip.z(), 0.005);
      ASSERT_LT(tip.z(), 0.40);
    }
  }
}

}  // namespace
}  // namespace handloft::tracking
