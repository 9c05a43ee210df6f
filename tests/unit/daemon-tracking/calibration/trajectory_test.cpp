// Tags, clocks and rolling shutters from what moves (T4, T11), against a truth made by other code.

#include "daemon-tracking/calibration/trajectory.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "daemon-tracking/calibration/spline.h"
#include "daemon-tracking/source/simulated/lens.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"
#include "daemon-tracking/vision/body_pose.h"

namespace handloft::tracking {
namespace {

constexpr double degrees = 57.29577951308232;

HeadMotion lively_head(double sway_hz = 0.45) {
  HeadMotion head;
  head.sway_m = 0.03;
  head.sway_hz = sway_hz;
  return head;
}

struct Truths {
  double offset_s = 0.0, row_s = 0.0;
};

/// What the rig's cameras see of a swaying head, through the simulation's own lens; stamps are early by the
/// camera's offset.
std::vector<TagSight> sights_of(const Rig& rig, const HeadMotion& motion, const std::vector<Truths>& truths,
                                double seconds, double noise_px, unsigned seed = 5) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<TagSight> sights;
  for (std::uint32_t c = 0; c < rig.cameras.size(); ++c) {
    const CameraCalibration& camera = rig.cameras[c];
    const Lens lens(camera.intrinsics);
    const bool table = camera.role == CameraRole::table;
    for (double time_s = 0.01 * (c + 1); time_s < seconds; time_s += 1.0 / 30.0) {
      TagSight sight;
      sight.camera = c;
      sight.time = from_ns(1'000'000'000) + from_seconds(time_s - truths[c].offset_s);
      for (const TagPlacement& placed : table ? rig.head_tags : rig.table_tags) {
        TagDetection tag;
        tag.id = placed.id;
        bool all = true;
        const auto corners = tag_corners(placed);
        for (std::size_t i = 0; i < 4; ++i) {
          double at_s = time_s;
          for (int pass = 0; pass < 4 && all; ++pass) {  // The row decides the time, and the time the row.
            const Eigen::Isometry3d head = motion.at(at_s);
            const Eigen::Isometry3d camera_from_tags = table ? camera.world_from_camera.inverse() * head
                                                             : (head * camera.head_from_camera).inverse();
            const auto pixel = lens.project(camera_from_tags * corners[i]);
            all = pixel && pixel->x() > 5 && pixel->y() > 5 && pixel->x() < 634 && pixel->y() < 474;
            if (!all) break;
            tag.corners_px[i] = *pixel;
            at_s = time_s + (pixel->y() - 239.5) * truths[c].row_s;
          }
          // The order in which arguments are worked out is the compiler's: one draw a line.
          const double across = normal(random);
          const double down = normal(random);
          tag.corners_px[i] += noise_px * Eigen::Vector2d(across, down);
        }
        const Eigen::Isometry3d head = motion.at(time_s);
        const Eigen::Isometry3d camera_from_tag =
            (table ? camera.world_from_camera.inverse() * head : (head * camera.head_from_camera).inverse()) *
            placed.body_from_tag;
        const double facing =
            -camera_from_tag.linear().col(2).dot(camera_from_tag.translation().normalized());
        if (all && facing > 0.3) sight.tags.push_back(tag);
      }
      if (!sight.tags.empty()) sights.push_back(std::move(sight));
    }
  }
  return sights;
}

TEST(Spline, FollowsAMotionAndItsVelocity) {
  const HeadMotion motion = lively_head();
  std::vector<TimedPose> poses;
  for (double t = 0; t < 4.0; t += 0.02) poses.push_back({t, motion.at(t)});
  const PoseSpline spline(0.0, 4.0, 0.1, poses);
  for (double t = 0.3; t < 3.7; t += 0.171) {
    const SplinePoint point = spline.at(t);
    EXPECT_LT((point.pose.translation() - motion.at(t).translation()).norm(), 5e-5);
    EXPECT_LT(Eigen::AngleAxisd(point.pose.linear().transpose() * motion.at(t).linear()).angle(), 2e-4);
    constexpr double step = 1e-4;
    const Eigen::Isometry3d before = spline.at(t - step).pose, after = spline.at(t + step).pose;
    EXPECT_LT((point.velocity_m_s - (after.translation() - before.translation()) / (2 * step)).norm(), 1e-5);
    const Eigen::AngleAxisd turn(after.linear() * before.linear().transpose());
    EXPECT_LT((point.angular_rad_s - turn.axis() * turn.angle() / (2 * step)).norm(), 1e-5);
  }
}

TEST(Trajectory, T11FindsClocksAndRowTimesFromMotion) {
  const Rig rig = default_rig();
  const std::vector<Truths> truths = {{0.0, 25e-6}, {0.0123, 30e-6}, {-0.0081, 0.0}};
  TrajectoryInput input{rig.cameras, rig.head_tags, rig.table_tags,
                        sights_of(rig, lively_head(0.9), truths, 8.0, 0.3)};
  TrajectoryOptions options;
  options.row_times = Estimate::find;
  const auto made = calibrate_on_the_move(input, options);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  EXPECT_LT(made->rms_px, 0.5);
  for (std::size_t i = 0; i < truths.size(); ++i) {
    SCOPED_TRACE(rig.cameras[i].name);
    EXPECT_NEAR(made->cameras[i].offset_s, truths[i].offset_s - truths[0].offset_s, 0.0005)
        << "1 ms is asked for";
    EXPECT_NEAR(made->cameras[i].offset_s, truths[i].offset_s, 5 * made->cameras[i].offset_sigma_s + 5e-5);
    EXPECT_NEAR(made->cameras[i].row_s, truths[i].row_s, 4e-6);
    EXPECT_EQ(made->cameras[i].result.verdict, Verdict::good) << made->cameras[i].result.words;
  }
}

TEST(Trajectory, T11MeasuresTheHeadRigAndItsCamera) {
  const Rig rig = default_rig();
  const std::vector<Truths> truths(3);
  TrajectoryInput input{rig.cameras, rig.head_tags, rig.table_tags,
                        sights_of(rig, lively_head(), truths, 8.0, 0.3)};
  // The paper was folded by hand: tags are off by millimetres and degrees, the camera's place is not known.
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  for (TagPlacement& tag : input.body_tags) {
    for (double& coordinate : tag.body_from_tag.translation()) coordinate += 0.003 * normal(random);
    const Eigen::AngleAxisd tilt(0.05 * normal(random), Eigen::Vector3d::UnitX());
    const Eigen::AngleAxisd turn(0.05 * normal(random), Eigen::Vector3d::UnitY());
    tag.body_from_tag.rotate(tilt * turn);
  }
  input.cameras[2].head_from_camera = Eigen::Isometry3d::Identity();
  const auto made = calibrate_on_the_move(input);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  // Frames differ by a rigid motion: tags are compared among each other.
  std::size_t carrying = 0;
  for (std::size_t i = 0; i < rig.head_tags.size(); ++i) {
    ASSERT_TRUE(made->tag_sigma_m[i].has_value()) << "tag " << rig.head_tags[i].id;
    carrying += *made->tag_sigma_m[i] == 0.0 ? 1 : 0;
  }
  EXPECT_EQ(carrying, 1U);
  std::vector<Eigen::Vector3d> found, truth;
  for (std::size_t i = 0; i < rig.head_tags.size(); ++i) {
    for (const auto& point : tag_corners(made->body_tags[i])) found.push_back(point);
    for (const auto& point : tag_corners(rig.head_tags[i])) truth.push_back(point);
  }
  const Eigen::Isometry3d motion = best_motion(found, truth);
  double worst = 0, before = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    worst = std::max(worst, (motion * found[i] - truth[i]).norm());
    before = std::max(before, (tag_corners(input.body_tags[i / 4])[i % 4] - truth[i]).norm());
  }
  EXPECT_GT(before, 0.004);
  EXPECT_LT(worst, 0.0005);
  const Eigen::Isometry3d eye = motion * made->head_from_camera[2];
  EXPECT_LT((eye.translation() - rig.cameras[2].head_from_camera.translation()).norm(), 0.002);
  EXPECT_LT(
      degrees *
          Eigen::AngleAxisd(eye.linear().transpose() * rig.cameras[2].head_from_camera.linear()).angle(),
      0.5)
      << "two frames laid over each other by tags that are known to 0.5 mm over 15 cm";
  RecordProperty("worst_corner_mm", std::to_string(1e3 * worst));
}

TEST(Trajectory, T11ARigGluedCentimetresFromItsDrawingIsMeasured) {
  const Rig rig = default_rig();
  for (const unsigned seed : {1U, 2U, 3U}) {
    TrajectoryInput input{rig.cameras, rig.head_tags, rig.table_tags,
                          sights_of(rig, lively_head(), std::vector<Truths>(3), 8.0, 0.3)};
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> off(-1, 1);
    for (TagPlacement& tag : input.body_tags) {
      tag.body_from_tag.translation() +=
          0.02 * Eigen::Vector3d(off(random), off(random), off(random)).normalized();
      tag.body_from_tag.rotate(Eigen::AngleAxisd(0.2 * off(random), Eigen::Vector3d::UnitX()) *
                               Eigen::AngleAxisd(0.2 * off(random), Eigen::Vector3d::UnitY()));
    }
    const auto made = calibrate_on_the_move(input);
    ASSERT_TRUE(made.ok()) << made.error().describe();
    std::vector<Eigen::Vector3d> found, truth;
    for (std::size_t i = 0; i < rig.head_tags.size(); ++i) {
      for (const auto& point : tag_corners(made->body_tags[i])) found.push_back(point);
      for (const auto& point : tag_corners(rig.head_tags[i])) truth.push_back(point);
    }
    const Eigen::Isometry3d motion = best_motion(found, truth);
    double worst = 0;
    for (std::size_t i = 0; i < found.size(); ++i)
      worst = std::max(worst, (motion * found[i] - truth[i]).norm());
    fmt::print("20 mm off: worst corner {:.2f} mm, {:.2f} px, {}\n", 1e3 * worst, made->rms_px,
               made->result.words);
    EXPECT_LT(worst, 0.001) << "seed " << seed;
  }
}

TEST(Trajectory, T11ATagThatNoFrameShowsIsSaidToBeUnseen) {
  const Rig rig = default_rig();
  TrajectoryInput input{rig.cameras, rig.head_tags, rig.table_tags,
                        sights_of(rig, lively_head(), std::vector<Truths>(3), 4.0, 0.3)};
  const TagPlacement hidden = rig.head_tags.back();
  for (TagSight& sight : input.sights)
    std::erase_if(sight.tags, [&](const TagDetection& tag) { return tag.id == hidden.id; });
  const auto made = calibrate_on_the_move(input);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  EXPECT_FALSE(made->tag_sigma_m.back().has_value()) << "a sigma of 0 would say that it is known exactly";
  EXPECT_TRUE(made->tag_sigma_m.front().has_value());
  EXPECT_NE(made->result.words.find(fmt::format("tag {}", hidden.id)), std::string::npos)
      << made->result.words;
}

TEST(Trajectory, T11AClockFarOffIsFoundOverSeveralKnots) {
  const Rig rig = default_rig();
  const std::vector<Truths> truths = {{0.0, 0.0}, {0.14, 0.0}, {-0.11, 0.0}};
  TrajectoryInput input{rig.cameras, rig.head_tags, rig.table_tags,
                        sights_of(rig, lively_head(0.9), truths, 8.0, 0.3)};
  TrajectoryOptions options;
  options.body_tags = Estimate::keep;
  options.head_camera = Estimate::keep;
  const auto made = calibrate_on_the_move(input, options);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  for (std::size_t i = 0; i < truths.size(); ++i)
    EXPECT_NEAR(made->cameras[i].offset_s, truths[i].offset_s, 0.001) << rig.cameras[i].name;
}

TEST(Trajectory, T11TellsHowSureItIs) {
  // Over many draws of noise the clocks' and tags' errors are as large as the stated sigmas.
  const Rig rig = default_rig();
  double clocks = 0, tags = 0;
  int clock_count = 0, tag_count = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    TrajectoryInput input{rig.cameras, rig.head_tags, rig.table_tags,
                          sights_of(rig, lively_head(0.9), std::vector<Truths>(3), 4.0, 0.3, seed)};
    const auto made = calibrate_on_the_move(input);
    ASSERT_TRUE(made.ok()) << made.error().describe();
    for (std::size_t i = 1; i < 3; ++i, ++clock_count)
      clocks += std::pow(made->cameras[i].offset_s / made->cameras[i].offset_sigma_s, 2);
    // Among each other: all of them are carried by the one that is held.
    const auto carrier = static_cast<std::size_t>(
        std::find(made->tag_sigma_m.begin(), made->tag_sigma_m.end(), std::optional(0.0)) -
        made->tag_sigma_m.begin());
    ASSERT_LT(carrier, rig.head_tags.size());
    const Eigen::Isometry3d back =
        rig.head_tags[carrier].body_from_tag * made->body_tags[carrier].body_from_tag.inverse();
    for (std::size_t i = 0; i < rig.head_tags.size(); ++i) {
      if (i == carrier) continue;
      const Eigen::Vector3d error = (back * made->body_tags[i].body_from_tag).translation() -
                                    rig.head_tags[i].body_from_tag.translation();
      tags += error.squaredNorm() / std::pow(*made->tag_sigma_m[i], 2);
      ++tag_count;
    }
  }
  fmt::print("error over stated sigma: clocks {:.2f}, tags {:.2f}\n", std::sqrt(clocks / clock_count),
             std::sqrt(tags / tag_count));
  EXPECT_NEAR(std::sqrt(clocks / clock_count), 1.0, 0.5);
  EXPECT_NEAR(std::sqrt(tags / tag_count), 1.0, 0.5);
}

TEST(Trajectory, T11RefusesWhatTellsNothing) {
  const Rig rig = default_rig();
  TrajectoryInput input{rig.cameras, rig.head_tags, rig.table_tags, {}};
  EXPECT_FALSE(calibrate_on_the_move(input).ok());
  input.sights = sights_of(rig, lively_head(), std::vector<Truths>(3), 0.3, 0.3);
  const auto short_one = calibrate_on_the_move(input);
  ASSERT_FALSE(short_one.ok());
  EXPECT_NE(short_one.error().message.find("at least 30"), std::string::npos);
  // A head that stands still tells no clocks: said in the verdict, not guessed.
  HeadMotion still;
  still.sway_m = 0.0;
  input.sights = sights_of(rig, still, std::vector<Truths>(3), 2.0, 0.3);
  const auto quiet = calibrate_on_the_move(input);
  ASSERT_TRUE(quiet.ok()) << quiet.error().describe();
  EXPECT_EQ(quiet->cameras[1].result.verdict, Verdict::bad) << quiet->cameras[1].result.words;
}

}  // namespace
}  // namespace handloft::tracking
