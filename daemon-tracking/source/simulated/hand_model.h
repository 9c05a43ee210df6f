#pragma once
// The simulated hand's shape: where knuckles, middle joints and fingertips are, relative to the palm, in each
// pose. A right hand of ordinary size, palm down, the fingers fanned out so that caps are at least 20 mm
// apart.

#include <Eigen/Core>
#include <array>

#include "daemon-tracking/source/simulated/hand_program.h"

namespace handloft::tracking {

using FingerPoints = std::array<Eigen::Vector3d, finger_count>;

/// Palm frame: x right, y towards the fingertips, z up (out of the back of the hand); metres.
struct HandShape {
  FingerPoints fingertips_m;
  FingerPoints middle_joints_m;
  FingerPoints knuckles_m;
};

HandShape hand_shape(HandPose pose);
/// Linear between two shapes, `weight` of `b` in 0..1.
HandShape blend(const HandShape& a, const HandShape& b, double weight);
Eigen::Vector3d centroid(const FingerPoints& points);

/// The contacts that a pose closes (bits of `Contact`).
std::uint16_t contacts_of(HandPose pose);

}  // namespace handloft::tracking
