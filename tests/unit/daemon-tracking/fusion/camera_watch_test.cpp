// T12: the alarm when a table camera was moved.

#include "daemon-tracking/fusion/camera_watch.h"

#include <gtest/gtest.h>

#include <limits>

#include "daemon-tracking/vision/body_pose.h"
#include "daemon-tracking/vision/camera_model.h"

namespace handloft::tracking {
namespace {

/// What camera 0 of the rig sees of the table, shifted.
CameraObservation table_seen(const Rig& rig, double time_s, const Eigen::Vector2d& shift_px) {
  CameraObservation out;
  out.capture_time = from_ns(static_cast<std::int64_t>(time_s * 1e9));
  const auto model = CameraModel::create(rig.cameras[0].intrinsics).value();
  for (const TagPlacement& tag : rig.table_tags) {
    TagDetection detection;
    detection.id = tag.id;
    const auto corners = tag_corners(tag);
    for (std::size_t i = 0; i < corners.size(); ++i)
      detection.corners_px[i] =
          *model.project(rig.cameras[0].world_from_camera.inverse() * corners[i]) + shift_px;
    out.tags.push_back(detection);
  }
  return out;
}

TEST(CameraWatch, AlarmsAfterASecondBeyondOnePixelT12) {
  const Rig rig = default_rig();
  ASSERT_EQ(rig.cameras[0].role, CameraRole::table);
  auto watch = CameraWatch::create(rig).value();
  const Eigen::Vector2d moved(0.9, -0.9), shaken(0.3, 0.4);
  watch.update(table_seen(rig, 1.0, shaken));
  EXPECT_NEAR(watch.placements()[0].residual_px, 0.5, 1e-9);
  for (double time_s : {2.0, 2.3, 2.6, 2.9}) {
    watch.update(table_seen(rig, time_s, moved));
    EXPECT_FALSE(watch.placements()[0].moved);
    EXPECT_EQ(placement_problem(watch.placements()[0]), "");
  }
  watch.update(table_seen(rig, 3.0, moved));
  EXPECT_TRUE(watch.placements()[0].moved);
  EXPECT_NE(placement_problem(watch.placements()[0]).find("1.3 px"), std::string::npos);
  CameraObservation nothing;
  nothing.capture_time = from_ns(3'100'000'000);
  watch.update(nothing);  // Says nothing about the camera
  EXPECT_TRUE(watch.placements()[0].moved);
  watch.update(table_seen(rig, 3.3, shaken));
  EXPECT_FALSE(watch.placements()[0].moved);
}

TEST(CameraWatch, OneCoveredTagOrBadNumbersAlarmNobody) {
  const Rig rig = default_rig();
  auto watch = CameraWatch::create(rig).value();
  for (double time_s : {1.0, 2.0, 3.0}) {
    auto seen = table_seen(rig, time_s, {0, 0});
    for (auto& corner : seen.tags[0].corners_px) corner += Eigen::Vector2d(8, 8);
    seen.tags[1].corners_px[0].x() = std::numeric_limits<double>::quiet_NaN();
    watch.update(seen);
    EXPECT_FALSE(watch.placements()[0].moved);
  }
  CameraObservation foreign;
  foreign.camera = 99;
  watch.update(foreign);
  EXPECT_EQ(watch.placements().size(), rig.cameras.size());
}

}  // namespace
}  // namespace handloft::tracking
