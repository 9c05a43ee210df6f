#include "daemon-tracking/fusion/head_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace handloft::tracking {
namespace {

using std::chrono::milliseconds;

constexpr TimePoint start = from_ns(1'000'000'000);

class Head : public ::testing::Test {
 protected:
  Head() {
    for (const auto& camera : rig_.cameras) models_.push_back(CameraModel::create(camera.intrinsics).value());
  }
  CameraObservation see(std::uint32_t camera, double time_s, const Eigen::Isometry3d& world_from_head,
                        double noise_px = 0.1, std::size_t most_tags = 99) {
    CameraObservation out;
    out.camera = camera;
    out.capture_time = start + from_seconds(time_s);
    const CameraCalibration& calibration = rig_.cameras[camera];
    const bool on_table = calibration.role == CameraRole::table;
    const Eigen::Isometry3d camera_from_seen =
        on_table ? calibration.world_from_camera.inverse() * world_from_head
                 : (world_from_head * calibration.head_from_camera).inverse();
    std::normal_distribution<double> normal(0.0, noise_px);
    for (const TagPlacement& tag : on_table ? rig_.head_tags : rig_.table_tags) {
      if (out.tags.size() >= most_tags) break;
      const Eigen::Isometry3d camera_from_tag = camera_from_seen * tag.body_from_tag;
      if (camera_from_tag.linear().col(2).dot(camera_from_tag.translation().normalized()) > -0.3) continue;
      TagDetection detection;
      detection.id = tag.id;
      bool inside = true;
      const auto corners = tag_corners(tag);
      for (std::size_t i = 0; i < 4; ++i) {
        const auto pixel = models_[camera].project(camera_from_seen * corners[i]);
        inside = inside && pixel && models_[camera].contains(*pixel);
        if (inside) detection.corners_px[i] = *pixel + Eigen::Vector2d(normal(random_), normal(random_));
      }
      if (inside) out.tags.push_back(detection);
    }
    return out;
  }
  /// Looks at the table from above its front edge, turning at `rad_s` about the vertical.
  static Eigen::Isometry3d head_at(double time_s, double rad_s) {
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    out.linear() = (Eigen::AngleAxisd(rad_s * time_s, Eigen::Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(0.62, Eigen::Vector3d::UnitX()))
                       .toRotationMatrix();
    out.translation() = Eigen::Vector3d(0.05 * time_s, -0.36, 0.48);
    return out;
  }
  static double angle_deg(const Eigen::Quaterniond& a, const Eigen::Isometry3d& b) {
    return a.angularDistance(Eigen::Quaterniond(b.linear())) * 180.0 / M_PI;
  }

  Rig rig_ = default_rig();
  std::vector<CameraModel> models_;
  std::mt19937 random_{11};
};

TEST_F(Head, EitherKindOfCameraAloneFindsIt) {
  for (std::uint32_t camera = 0; camera < rig_.cameras.size(); ++camera) {
    auto filter = HeadFilter::create(rig_).value();
    double time_s = 0;
    for (; time_s < 0.7; time_s += 0.033)
      ASSERT_TRUE(filter.update(see(camera, time_s, head_at(time_s, 0.1))).ok());
    const FusedHead head = filter.head();
    ASSERT_EQ(head.state, TrackingState::tracked) << camera;
    EXPECT_EQ(head.camera_mask, 1u << camera);
    const Eigen::Isometry3d truth = head_at(to_seconds(filter.newest() - start), 0.1);
    EXPECT_LT((head.position_m - truth.translation()).norm(), 2e-3) << camera;
    EXPECT_LT(angle_deg(head.orientation, truth), 0.3) << camera;
  }
}

TEST_F(Head, AQuickTurnIsFollowed) {
  auto filter = HeadFilter::create(rig_).value();
  double worst = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const double time_s = 0.011 * frame;
    // At rest, then 50 degrees a second at once.
    const Eigen::Isometry3d truth = head_at(std::max(0.0, time_s - 0.3), 0.87);
    ASSERT_TRUE(filter.update(see(static_cast<std::uint32_t>(frame % 3), time_s, truth)).ok());
    if (frame > 6) worst = std::max(worst, angle_deg(filter.head().orientation, truth));
  }
  EXPECT_LT(worst, 0.6);
  EXPECT_EQ(filter.counters().resets, 0u);
  EXPECT_NEAR(filter.head().angular_velocity_rad_s.z(), 0.87, 0.15);
}

// T5: with only one head tag in view the pose must not flip once it is known.
TEST_F(Head, OneTagNeverFlipsIn10000NoisyFrames) {
  HeadFilterOptions options;
  options.history = milliseconds(100);
  auto filter = HeadFilter::create(rig_, options).value();
  const Eigen::Isometry3d truth = head_at(0, 0);
  for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(filter.update(see(0, 0.011 * frame, truth)).ok());
  ASSERT_EQ(filter.head().state, TrackingState::tracked);
  double worst = 0;
  for (int frame = 3; frame < 10003; ++frame) {
    ASSERT_TRUE(filter.update(see(0, 0.033 * frame, truth, 0.3, 1)).ok());
    worst = std::max(worst, angle_deg(filter.head().orientation, truth));
  }
  EXPECT_LT(worst, 6.0);
}

TEST_F(Head, AnAmbiguousViewStartsNothing) {
  auto filter = HeadFilter::create(rig_).value();
  auto flat = see(0, 0, head_at(0, 0), 0.3, 1);
  ASSERT_EQ(flat.tags.size(), 1u);
  // The tag's image shrunk to a speck that any tilt explains.
  const Eigen::Vector2d middle = 0.25 * (flat.tags[0].corners_px[0] + flat.tags[0].corners_px[1] +
                                         flat.tags[0].corners_px[2] + flat.tags[0].corners_px[3]);
  for (auto& corner : flat.tags[0].corners_px) corner = middle + 0.05 * (corner - middle);
  ASSERT_TRUE(filter.update(flat).ok());
  EXPECT_EQ(filter.head().state, TrackingState::lost);
}

TEST_F(Head, LostAfterSilenceAndLateObservationsAreReplayed) {
  auto filter = HeadFilter::create(rig_).value();
  for (int frame = 0; frame < 10; ++frame)
    ASSERT_TRUE(filter.update(see(0, 0.033 * frame, head_at(0, 0))).ok());
  ASSERT_TRUE(filter.update(see(1, 0.280, head_at(0, 0))).ok());
  EXPECT_EQ(filter.counters().replayed, 1u);
  EXPECT_FALSE(filter.update(see(1, 0.1, head_at(0, 0))).ok());
  EXPECT_EQ(filter.head_at_time(filter.newest() + milliseconds(200), {}).state, TrackingState::predicted);
  EXPECT_EQ(filter.head_at_time(filter.newest() + milliseconds(900), {}).state, TrackingState::lost);
  EXPECT_EQ(filter.at(filter.newest() - milliseconds(50), {}).kind, ResultKind::interpolated);
}

}  // namespace
}  // namespace handloft::tracking
