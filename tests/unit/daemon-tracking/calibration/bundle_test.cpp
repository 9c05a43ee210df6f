// Bundle adjustment (T11): derivatives against differences, and minima that are known.

#include "daemon-tracking/calibration/bundle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "daemon-tracking/calibration/least_squares.h"
#include "daemon-tracking/vision/camera_model.h"
#include "daemon-tracking/vision/reprojection.h"

namespace handloft::tracking {
namespace {

CameraIntrinsics webcam() {
  CameraIntrinsics lens;
  lens.fx_px = 602.0;
  lens.fy_px = 601.0;
  lens.cx_px = 322.4;
  lens.cy_px = 237.1;
  lens.distortion = {-0.105, 0.031, 0.0006, -0.0004, 0.01};
  return lens;
}

TEST(Bundle, ProjectsAsTheCameraModelAndWithItsOwnDerivatives) {
  const CameraIntrinsics lens = webcam();
  const CameraModel model = CameraModel::create(lens).value();
  const Eigen::Vector3d point(0.21, -0.17, 0.8);
  const auto seen = project_through(lens, point);
  ASSERT_TRUE(seen);
  EXPECT_LT((seen->pixel - *model.project(point)).norm(), 1e-9);
  constexpr double step = 1e-6;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d more = point, less = point;
    more[axis] += step;
    less[axis] -= step;
    const Eigen::Vector2d slope =
        (project_through(lens, more)->pixel - project_through(lens, less)->pixel) / (2 * step);
    EXPECT_LT((slope - seen->by_point.col(axis)).norm(), 1e-4 * seen->by_point.col(axis).norm() + 1e-5);
  }
  for (int term = 0; term < lens_unknowns; ++term) {
    LensVector more = lens_vector(lens), less = lens_vector(lens);
    more[term] += step;
    less[term] -= step;
    const Eigen::Vector2d slope = (project_through(with_lens_vector(lens, more), point)->pixel -
                                   project_through(with_lens_vector(lens, less), point)->pixel) /
                                  (2 * step);
    EXPECT_LT((slope - seen->by_lens.col(term)).norm(), 1e-5) << term;
  }
  EXPECT_FALSE(project_through(lens, {0, 0, -1}));
  EXPECT_FALSE(project_through(lens, {0, 0, std::numeric_limits<double>::quiet_NaN()}));
}

/// A board seen from twelve places by two cameras, one behind the other in the chain.
BundleProblem two_cameras(double noise_px, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  BundleProblem problem;
  problem.lenses.push_back({webcam(), {}});
  problem.lenses.push_back({webcam(), {}});
  Eigen::Isometry3d right = Eigen::Isometry3d::Identity();
  right.translation() = Eigen::Vector3d(0.3, 0.02, 0.01);
  right.linear() = Eigen::AngleAxisd(-0.4, Eigen::Vector3d::UnitY()).toRotationMatrix();
  problem.poses.push_back({Eigen::Isometry3d::Identity(), Hold::fixed});
  problem.poses.push_back({right, Hold::free});
  for (int view = 0; view < 12; ++view) {
    Eigen::Isometry3d board = Eigen::Isometry3d::Identity();
    board.linear() = (Eigen::AngleAxisd(3.0 + 0.1 * view, Eigen::Vector3d::UnitX()) *
                      Eigen::AngleAxisd(0.5 * std::sin(view), Eigen::Vector3d::UnitY()))
                         .toRotationMatrix();
    board.translation() =
        Eigen::Vector3d(0.12 + 0.05 * std::cos(2 * view), 0.05 * std::sin(3 * view), 0.7 + 0.02 * view);
    problem.poses.push_back({board, Hold::free});
    for (int row = -3; row <= 3; ++row) {
      for (int column = -4; column <= 4; ++column) {
        for (std::uint32_t camera = 0; camera < 2; ++camera) {
          BundleCorner corner;
          corner.lens = camera;
          corner.chain[0] = {static_cast<std::uint32_t>(2 + view), BundleLink::Way::forward};
          corner.chain[1] = {camera, BundleLink::Way::inverse};
          corner.links = 2;
          corner.point_m = Eigen::Vector3d(0.025 * column, 0.025 * row, 0);
          const Eigen::Isometry3d& pose = problem.poses[camera].value;
          corner.pixel = project_through(webcam(), pose.inverse() * (board * corner.point_m))->pixel +
                         noise_px * Eigen::Vector2d(normal(random), normal(random));
          problem.corners.push_back(corner);
        }
      }
    }
  }
  return problem;
}

void disturb(BundleProblem& problem) {
  Vector6d step;
  step << 0.02, -0.01, 0.015, 0.03, -0.02, 0.04;
  for (BundlePose& pose : problem.poses)
    if (pose.hold == Hold::free) pose.value = moved(pose.value, step);
}

TEST(Bundle, T11FindsPosesAndLensesAgainFromAWrongStart) {
  BundleProblem problem = two_cameras(0.0, 1);
  const BundleProblem truth = problem;
  disturb(problem);
  for (BundleLens& lens : problem.lenses) {
    lens.hold.fill(Hold::free);
    lens.value.fx_px *= 1.08;
    lens.value.cy_px += 12;
    lens.value.distortion = {};
  }
  const auto outcome = adjust(problem);
  ASSERT_TRUE(outcome.ok()) << outcome.error().describe();
  EXPECT_LT(outcome->rms_px, 1e-6);
  EXPECT_LT((lens_vector(problem.lenses[0].value) - lens_vector(webcam())).norm(), 1e-4);
  EXPECT_TRUE(problem.poses[1].value.isApprox(truth.poses[1].value, 1e-7));
}

TEST(Bundle, T11TellsHowSureItIs) {
  // Over many draws of noise the error is as large as the stated sigma, not twice nor half of it.
  double sum = 0;
  constexpr int draws = 20;
  for (std::uint32_t seed = 0; seed < draws; ++seed) {
    BundleProblem problem = two_cameras(0.3, 100 + seed);
    const Eigen::Vector3d truth = problem.poses[1].value.translation();
    const auto outcome = adjust(problem);
    ASSERT_TRUE(outcome.ok());
    EXPECT_NEAR(outcome->rms_px, 0.3 * std::sqrt(2.0), 0.03);
    const Eigen::Vector3d error = problem.poses[1].value.translation() - truth;
    sum += error.cwiseQuotient(outcome->pose_sigmas[1].head<3>()).squaredNorm() / 3;
  }
  EXPECT_NEAR(std::sqrt(sum / draws), 1.0, 0.35);
}

TEST(Bundle, T11OneWrongCornerMovesNothing) {
  BundleProblem problem = two_cameras(0.1, 7), without = problem;
  problem.corners[40].pixel.x() += 60;
  ASSERT_TRUE(adjust(without).ok());
  BundleOptions robust;
  robust.huber_sigmas = 0.5;
  ASSERT_TRUE(adjust(problem, robust).ok());
  EXPECT_LT((problem.poses[1].value.translation() - without.poses[1].value.translation()).norm(), 0.0003);
  BundleProblem plain = two_cameras(0.1, 7);
  plain.corners[40].pixel.x() += 60;
  BundleOptions squares;
  squares.huber_sigmas = std::numeric_limits<double>::infinity();
  ASSERT_TRUE(adjust(plain, squares).ok());
  EXPECT_GT((plain.poses[1].value.translation() - without.poses[1].value.translation()).norm(),
            2 * (problem.poses[1].value.translation() - without.poses[1].value.translation()).norm());
}

TEST(Bundle, RefusesWhatItCannotSolve) {
  BundleProblem problem = two_cameras(0.0, 1);
  problem.corners[3].lens = 9;
  EXPECT_EQ(adjust(problem).error().code, ErrorCode::invalid_argument);
  problem = two_cameras(0.0, 1);
  problem.corners[3].pixel.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(adjust(problem).error().code, ErrorCode::invalid_argument);
  problem = two_cameras(0.0, 1);
  problem.corners.resize(4);
  EXPECT_EQ(adjust(problem).error().code, ErrorCode::rank_deficient);
  problem = two_cameras(0.0, 1);
  problem.poses[1].value.translation().z() = 5.0;
  EXPECT_EQ(adjust(problem).error().code, ErrorCode::failed_precondition);
  problem = two_cameras(0.0, 1);
  problem.poses[0].hold = Hold::free;  // Everything may move together: the data say not where.
  const auto loose = adjust(problem);
  ASSERT_TRUE(loose.ok());
  EXPECT_TRUE(loose->pose_sigmas.empty());
}

}  // namespace
}  // namespace handloft::tracking
