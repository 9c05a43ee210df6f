#pragma once
// Bundle adjustment of everything that stands still (T11): lenses, camera poses, boards, tags, from corners
// that were seen (Triggs et al. 1999; Zhang 2000 for the planar board). A corner is a point that goes through
// a chain of poses into a camera and through its lens to a pixel; any lens and pose may be fixed or free.
// Robust: Huber's loss on each corner's distance. Pure; deterministic.

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/camera_calibration.h"

namespace handloft::tracking {

/// fx, fy, cx, cy, k1, k2, p1, p2, k3: the order of CameraIntrinsics' unknowns everywhere here.
inline constexpr int lens_unknowns = 9;
using LensVector = Eigen::Matrix<double, lens_unknowns, 1>;
LensVector lens_vector(const CameraIntrinsics& lens);
CameraIntrinsics with_lens_vector(CameraIntrinsics lens, const LensVector& values);

enum class Hold : std::uint8_t { fixed, free };

struct BundleLens {
  CameraIntrinsics value;
  std::array<Hold, lens_unknowns> hold{};  ///< All fixed unless said.
};

struct BundlePose {
  Eigen::Isometry3d value = Eigen::Isometry3d::Identity();
  Hold hold = Hold::fixed;
  /// What is believed of a free pose beforehand: its start, to so many metres and radians. 0: nothing.
  double prior_sigma_m = 0.0;
  double prior_sigma_rad = 0.0;
};

/// One pose on a point's way: p -> pose * p, or its inverse.
struct BundleLink {
  enum class Way : std::uint8_t { forward, inverse };
  std::uint32_t pose = 0;
  Way way = Way::forward;
};

struct BundleCorner {
  static constexpr std::size_t max_links = 4;
  std::uint32_t lens = 0;
  std::array<BundleLink, max_links> chain{};  ///< Applied to the point from the first on.
  std::uint8_t links = 0;
  Eigen::Vector3d point_m{0, 0, 0};
  Eigen::Vector2d pixel{0, 0};
  double sigma_px = 1.0;
};

struct BundleProblem {
  std::vector<BundleLens> lenses;
  std::vector<BundlePose> poses;
  std::vector<BundleCorner> corners;
};

struct BundleOptions {
  /// Corners farther off than this many sigmas are weighted down; infinity: plain least squares.
  double huber_sigmas = 3.0;
  int max_iterations = 100;
};

struct BundleOutcome {
  double rms_px = 0.0;                     ///< Root mean square distance over all corners.
  std::vector<Eigen::Vector2d> residuals;  ///< Seen minus expected, per corner.
  int iterations = 0;
  /// Standard deviations of each lens's unknowns (0 where fixed), from the residuals' own spread; empty when
  /// something is not determined by the data.
  std::vector<LensVector> lens_sigmas;
  /// Of each pose: (translation m, rotation rad), 0 where fixed; empty likewise.
  std::vector<Eigen::Matrix<double, 6, 1>> pose_sigmas;
};

/// Improves `problem` in place. Errors: invalid_argument for indices out of range or values that are not
/// finite, rank_deficient for fewer residuals than unknowns, failed_precondition when a corner is not in
/// front of its camera at the start.
Result<BundleOutcome> adjust(BundleProblem& problem, const BundleOptions& options = {});

/// Robust standard deviation of a corner's coordinate: 1.4826 median |residual|. 0 for none.
double robust_sigma(const std::vector<Eigen::Vector2d>& residuals);
double rms(const std::vector<Eigen::Vector2d>& residuals);

/// The image of a point and its derivatives by point and by lens; as CameraModel, without its guard of the
/// field of view (a start may be far off). nullopt behind the camera.
struct LensProjection {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, lens_unknowns> by_lens;
};
std::optional<LensProjection> project_through(const CameraIntrinsics& lens, const Eigen::Vector3d& point_m);

}  // namespace handloft::tracking
