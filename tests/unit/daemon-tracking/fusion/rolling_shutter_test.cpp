// Rows of a rolling shutter at their own times (T4, T5, T7): on frames that are drawn row by row, knowing the
// shutter beats taking it for a global one, by hand and by head.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "daemon-tracking/fusion/tracking_pipeline.h"
#include "daemon-tracking/source/simulated/mouse_shell.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"
#include "daemon-tracking/vision/moving_body.h"
#include "daemon-tracking/vision/reprojection.h"

namespace handloft::tracking {
namespace {

constexpr double row_s = 60e-6;  // 29 ms from the first row to the last: a slow webcam.

struct Errors {
  double tips_m = 0, head_m = 0;  // RMS
};

Errors follow(const std::vector<Sample>& samples, const std::map<TimePoint, Truth>& truths,
              double known_row_s) {
  Rig rig = default_rig();
  for (CameraCalibration& camera : rig.cameras) camera.row_time = from_seconds(known_row_s);
  auto pipeline = TrackingPipeline::create(rig);
  EXPECT_TRUE(pipeline.ok());
  double tips = 0, tip_count = 0, heads = 0, head_count = 0;
  for (const Sample& sample : samples) {
    const auto state = pipeline->consume(sample);
    if (!state || to_seconds(state->time - TimePoint{}) < 0.3) continue;
    const auto truth = truths.find(state->time);
    if (truth == truths.end()) continue;
    for (std::size_t f = 0; f < finger_count; ++f) {
      if (state->hand.tips[f].state != TrackingState::tracked) continue;
      tips += (state->hand.tips[f].position_m - Eigen::Vector3d(truth->second.fingertips_m[f])).squaredNorm();
      ++tip_count;
    }
    heads += (state->head.position_m - Eigen::Vector3d(truth->second.head_position_m)).squaredNorm();
    ++head_count;
  }
  EXPECT_GT(tip_count, 300);
  return {std::sqrt(tips / tip_count), std::sqrt(heads / head_count)};
}

TEST(RollingShutter, RowsAtTheirOwnTimesBeatAGlobalShutter) {
  SimulatedRigOptions options;
  options.image.row_time_s = row_s;
  options.head.sway_hz = 0.5;  // A head that looks around.
  SimulatedRig rig(default_rig(), mouse_shell_program(), options);
  std::vector<Sample> samples;
  std::map<TimePoint, Truth> truths;
  while (auto sample = rig.next()) {
    if (to_seconds(delivery_time(*sample) - TimePoint{}) > 1.8) break;
    if (const auto* truth = std::get_if<Truth>(&*sample)) truths[truth->time] = *truth;
    samples.push_back(std::move(*sample));
  }
  const Errors known = follow(samples, truths, row_s), global = follow(samples, truths, 0.0);
  std::printf("rows known: tips %.2f mm, head %.2f mm; taken for global: %.2f mm, %.2f mm\n",
              known.tips_m * 1e3, known.head_m * 1e3, global.tips_m * 1e3, global.head_m * 1e3);
  EXPECT_LE(known.tips_m, 2e-3);
  EXPECT_LE(known.head_m, 0.5e-3);
  EXPECT_LT(known.tips_m, global.tips_m);
  EXPECT_LT(known.head_m, global.head_m);
}

TEST(RollingShutter, OneViewTellsPoseAndVelocities) {
  // A body 0.5 m before the camera that moves and turns, its corners each drawn at its own row's time.
  CameraCalibration calibration;
  calibration.row_time = from_seconds(row_s);
  const CameraModel model = CameraModel::create(calibration.intrinsics).value();
  Vector6d rate;
  rate << 0.4, 0.1, 0.05, 0.2, -0.3, 0.5;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(0.02, 0.03, 0.5);
  BodyView view;
  view.camera = &model;
  std::vector<double> delays_s;
  for (double y : {-0.12, -0.04, 0.04, 0.12}) {
    for (const auto& [x, z] : {std::pair{-0.1, 0.0}, {0.0, 0.03}, {0.05, -0.02}, {0.1, 0.01}}) {
      const Eigen::Vector3d corner(x, y, z);
      // The row decides the time, and the time the row: a few rounds are enough.
      Eigen::Vector2d pixel = *model.project(pose * corner);
      for (int round = 0; round < 6; ++round)
        pixel = *model.project(moved(pose, calibration.row_delay_s(pixel.y()) * rate) * corner);
      view.corners.push_back({corner, pixel});
      delays_s.push_back(calibration.row_delay_s(pixel.y()));
    }
  }
  MovingBody prior;  // It stands still as far as is known, not sure of anything.
  prior.base_from_body = pose;
  prior.base_from_body.translation() += Eigen::Vector3d(0.004, -0.003, 0.005);
  prior.covariance = Vector12d::Constant(0.25).asDiagonal();
  BodyPoseOptions options;
  options.corner_sigma_px = 1e-3;  // Exact corners: no outlier is to be weighed down.
  options.huber_sigmas = 1e9;
  const auto fit = correct_moving_body(view, delays_s, prior, options);
  ASSERT_TRUE(fit.ok()) << fit.error().describe();
  EXPECT_LT((fit->body.base_from_body.translation() - pose.translation()).norm(), 1e-4);
  EXPECT_LT((fit->body.rate - rate).norm(), 2e-2);
  EXPECT_LT(fit->reprojection_rms_px, 1e-2);

  // Taken as one moment, the same corners make no such pose.
  const std::vector<double> none(delays_s.size(), 0.0);
  const auto wrong = correct_moving_body(view, none, prior, options);
  ASSERT_TRUE(wrong.ok()) << wrong.error().describe();
  EXPECT_GT(wrong->reprojection_rms_px, 20 * fit->reprojection_rms_px);
}

TEST(RollingShutter, BadCornersAndDelaysAreErrors) {
  const CameraModel model = CameraModel::create(CameraIntrinsics{}).value();
  BodyView view;
  view.camera = &model;
  MovingBody prior;
  prior.base_from_body.translation().z() = 0.5;
  EXPECT_EQ(correct_moving_body(view, {}, prior).error().code, ErrorCode::failed_precondition);
  view.corners.assign(4, {{0, 0, 0}, {320, 240}});
  EXPECT_EQ(correct_moving_body(view, std::vector<double>(3, 0.0), prior).error().field, "delays_s");
  EXPECT_EQ(correct_moving_body(view, std::vector<double>(4, std::nan("")), prior).error().field, "delays_s");
  prior.rate[2] = std::nan("");
  EXPECT_EQ(correct_moving_body(view, std::vector<double>(4, 0.0), prior).error().field, "prior");
  prior.rate[2] = 0;
  prior.base_from_body.translation().z() = -0.5;  // Behind the camera.
  EXPECT_EQ(correct_moving_body(view, std::vector<double>(4, 0.0), prior).error().code,
            ErrorCode::failed_precondition);
}

}  // namespace
}  // namespace handloft::tracking
