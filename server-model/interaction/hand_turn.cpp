#include "server-model/interaction/hand_turn.h"

#include <Eigen/SVD>

namespace handloft::interaction {
namespace {

/// The second extent of three fingertips or more, beside the first: below 5 mm a millimetre of noise turns
/// them by more than ten degrees.
constexpr double min_extent_m = 0.005;
constexpr int min_fingers = 3;

}  // namespace

FingertipPositions fingertip_positions(const HandSample& sample) {
  FingertipPositions positions;
  for (std::size_t i = 0; i < finger_count; ++i) {
    if (sample.fingertips[i]) positions[i] = sample.fingertips[i]->position;
  }
  return positions;
}

std::optional<Eigen::Quaterniond> hand_turn(const FingertipPositions& then, const FingertipPositions& now) {
  Eigen::Vector3d then_sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d now_sum = Eigen::Vector3d::Zero();
  int common = 0;
  for (std::size_t i = 0; i < finger_count; ++i) {
    if (!then[i] || !now[i]) continue;
    then_sum += *then[i];
    now_sum += *now[i];
    ++common;
  }
  if (common < min_fingers) return std::nullopt;
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < finger_count; ++i) {
    if (!then[i] || !now[i]) continue;
    correlation += (*now[i] - now_sum / common) * (*then[i] - then_sum / common).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()[1] > min_extent_m * min_extent_m)) return std::nullopt;
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs[2] = -1;
  const Eigen::Matrix3d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  return Eigen::Quaterniond(rotation).normalized();
}

}  // namespace handloft::interaction
