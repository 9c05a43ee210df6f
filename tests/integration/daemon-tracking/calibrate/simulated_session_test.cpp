// A whole calibration on the simulated rig, from lenses, places and clocks that are wrong, against the truth
// (T11): every step sees pictures only.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "daemon-tracking/calibrate/options.h"
#include "daemon-tracking/calibrate/steps.h"
#include "daemon-tracking/calibration/extrinsics.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

constexpr double degrees = 57.29577951308232;

TEST(SimulatedSession, T11FromWrongValuesToTheTruth) {
  const test::TemporaryDirectory folder;
  CalibrateOptions options;
  options.file = (folder.path() / "lab.toml").string();
  options.out = (folder.path() / "pictures").string();
  options.simulate = true;

  Calibration wrong = calibration_of(default_rig());
  for (CameraCalibration& camera : wrong.rig.cameras) {
    camera.intrinsics.fx_px = camera.intrinsics.fy_px = 520;
    camera.intrinsics.cx_px = 319.5;
    camera.intrinsics.cy_px = 239.5;
    camera.intrinsics.distortion = {};
    camera.world_from_camera = camera.head_from_camera = Eigen::Isometry3d::Identity();
  }
  for (TagPlacement& tag : wrong.rig.head_tags) tag.body_from_tag.translation() *= 1.04;
  ASSERT_TRUE(save_calibration(wrong, options.file).ok());

  for (const char* step : {"intrinsics", "extrinsics", "head-rig", "colours", "glove", "check"}) {
    options.step = step;
    const auto verdict = run_step(options, "2026-11-22T12:00:00Z", stdout);
    ASSERT_TRUE(verdict.ok()) << step << ": " << verdict.error().describe();
    EXPECT_NE(*verdict, Verdict::bad) << step;
  }

  const auto made = load_calibration(options.file);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  const Rig truth = default_rig();
  for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
    SCOPED_TRACE(truth.cameras[i].name);
    const CameraCalibration &found = made->rig.cameras[i], &real = truth.cameras[i];
    EXPECT_NEAR(found.intrinsics.fx_px, real.intrinsics.fx_px, 1.5);
    EXPECT_NEAR(found.intrinsics.cx_px, real.intrinsics.cx_px, 1.5);
    EXPECT_NEAR(found.intrinsics.cy_px, real.intrinsics.cy_px, 1.5);
    EXPECT_LT(std::abs(to_seconds(found.time_offset)), 0.001);
    if (real.role == CameraRole::table) {
      const double off_m =
          (found.world_from_camera.translation() - real.world_from_camera.translation()).norm();
      const double off_deg = degrees * Eigen::AngleAxisd(found.world_from_camera.linear().transpose() *
                                                         real.world_from_camera.linear())
                                           .angle();
      fmt::print("{}: {:.2f} mm, {:.3f} degrees from the truth\n", real.name, 1e3 * off_m, off_deg);
      EXPECT_LT(off_m, 0.003);
      EXPECT_LT(off_deg, 0.2);
    }
    EXPECT_EQ(made->cameras[i].results.at("intrinsics").verdict, Verdict::good);
  }
  std::vector<Eigen::Vector3d> found, real;
  for (std::size_t i = 0; i < 4; ++i) {  // The last one is hardly seen.
    for (const auto& point : tag_corners(made->rig.head_tags[i])) found.push_back(point);
    for (const auto& point : tag_corners(truth.head_tags[i])) real.push_back(point);
  }
  const Eigen::Isometry3d motion = best_motion(found, real);
  double worst = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    worst = std::max(worst, (motion * found[i] - real[i]).norm());
  fmt::print("head tags: worst corner {:.2f} mm\n", 1e3 * worst);
  EXPECT_LT(worst, 0.002);
  EXPECT_TRUE(made->cameras[0].colours && made->cameras[1].colours && made->glove);
}

}  // namespace
}  // namespace handloft::tracking
