#include "daemon-tracking/source/simulated/hand_model.h"

#include "daemon-tracking/source/glove_report.h"

namespace handloft::tracking {
namespace {

using Eigen::Vector3d;

const FingerPoints knuckles = {Vector3d{-0.036, 0.002, -0.006}, Vector3d{-0.027, 0.036, 0.000},
                               Vector3d{-0.006, 0.040, 0.003}, Vector3d{0.015, 0.036, 0.002},
                               Vector3d{0.034, 0.028, -0.002}};

const FingerPoints open_tips = {Vector3d{-0.060, 0.040, 0.000}, Vector3d{-0.034, 0.088, 0.008},
                                Vector3d{-0.005, 0.097, 0.010}, Vector3d{0.024, 0.089, 0.008},
                                Vector3d{0.050, 0.070, 0.002}};

/// Gathered before the palm rather than clenched in it: the cameras in front of the hand must see three caps
/// and more, as must a designer who wants to push with them. Nearly in one plane, whose normal is the disk's
/// (A13).
const FingerPoints curled_tips = {Vector3d{-0.050, 0.060, -0.046}, Vector3d{-0.037, 0.034, -0.040},
                                  Vector3d{-0.012, 0.036, -0.040}, Vector3d{0.013, 0.034, -0.040},
                                  Vector3d{0.038, 0.029, -0.038}};

/// Height of the palm over the fingertips when the hand lies flat.
constexpr double flat_drop_m = -0.008;
/// How far along the finger its middle joint is.
constexpr double middle_joint_fraction = 0.52;

Vector3d straight_joint(int finger, const Vector3d& tip) {
  const auto i = static_cast<std::size_t>(finger);
  return knuckles[i] + middle_joint_fraction * (tip - knuckles[i]);
}

Vector3d curled_joint(int finger) {
  const auto i = static_cast<std::size_t>(finger);
  return finger == 0 ? Vector3d(-0.050, 0.032, -0.026) : Vector3d(knuckles[i] + Vector3d(0.0, 0.018, -0.004));
}

}  // namespace

HandShape hand_shape(HandPose pose) {
  HandShape shape;
  shape.knuckles_m = knuckles;
  for (int finger = 0; finger < finger_count; ++finger) {
    const auto i = static_cast<std::size_t>(finger);
    const bool index = finger == static_cast<int>(Finger::index);
    const bool curled = pose == HandPose::closed || (pose == HandPose::pointing && !index);
    shape.fingertips_m[i] = curled ? curled_tips[i] : open_tips[i];
    if (pose == HandPose::on_table) shape.fingertips_m[i].z() = flat_drop_m;
    shape.middle_joints_m[i] = curled ? curled_joint(finger) : straight_joint(finger, shape.fingertips_m[i]);
  }
  return shape;
}

HandShape blend(const HandShape& a, const HandShape& b, double weight) {
  HandShape shape;
  for (std::size_t i = 0; i < finger_count; ++i) {
    shape.fingertips_m[i] = (1 - weight) * a.fingertips_m[i] + weight * b.fingertips_m[i];
    shape.middle_joints_m[i] = (1 - weight) * a.middle_joints_m[i] + weight * b.middle_joints_m[i];
    shape.knuckles_m[i] = (1 - weight) * a.knuckles_m[i] + weight * b.knuckles_m[i];
  }
  return shape;
}

Vector3d centroid(const FingerPoints& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& point : points) sum += point;
  return sum / finger_count;
}

std::uint16_t contacts_of(HandPose pose) {
  switch (pose) {
    case HandPose::open:
      return 0;
    case HandPose::closed:
      return contact_index | contact_middle | contact_ring | contact_little;
    case HandPose::pointing:
      return contact_middle | contact_ring | contact_little;
    case HandPose::on_table:
      return contact_table;
  }
  return 0;
}

}  // namespace handloft::tracking
