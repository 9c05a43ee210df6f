#pragma once
// A rigid body's way through space: a uniform cubic B-spline of translation and rotation vector about a
// reference orientation. Good for motions within 90 degrees of it. Pure.

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <span>
#include <vector>

namespace handloft::tracking {

/// The body at a time, and how it depends on the four control points around it.
struct SplinePoint {
  Eigen::Isometry3d pose;
  Eigen::Matrix3d left_jacobian;  ///< d (small left rotation) / d (rotation vector)
  Eigen::Vector3d velocity_m_s;
  Eigen::Vector3d angular_rad_s;  ///< World frame
  std::size_t first = 0;          ///< The first of the four control points
  std::array<double, 4> weights{};
};

struct TimedPose {
  double time_s = 0.0;
  Eigen::Isometry3d pose;
};

class PoseSpline {
 public:
  using Control = Eigen::Matrix<double, 6, 1>;  ///< (translation m, rotation vector rad)

  /// Covers begin_s..end_s. Controls are fitted to the poses with the least squares, smooth where there are
  /// none. Preconditions: at least one pose, begin_s < end_s, knot_s > 0.
  PoseSpline(double begin_s, double end_s, double knot_s, std::span<const TimedPose> poses);

  /// Times outside are as at the ends.
  SplinePoint at(double time_s) const;

  /// The same with other values for the controls from `window` on: `values[i]` are the six numbers of control
  /// `window + i`. nullopt when the time depends on a control outside.
  std::optional<SplinePoint> at(double time_s, std::size_t window,
                                std::span<const double* const> values) const;
  /// The first of the four controls that the time depends on.
  std::size_t first_at(double time_s) const { return place(time_s).first; }

  std::vector<Control>& controls() { return controls_; }
  const std::vector<Control>& controls() const { return controls_; }
  double knot_s() const { return knot_s_; }

 private:
  std::pair<std::size_t, double> place(double time_s) const;
  SplinePoint blend(std::size_t first, double u, const std::array<Control, 4>& controls) const;
  double begin_s_, knot_s_;
  Eigen::Matrix3d reference_;
  std::vector<Control> controls_;
};

/// d (left rotation) / d (rotation vector): exp(r + d) ~ exp(J d) exp(r).
Eigen::Matrix3d left_jacobian_of(const Eigen::Vector3d& rotation_rad);

}  // namespace handloft::tracking
