#include "server-model/interaction/hand_centre.h"

namespace handloft::interaction {
namespace {

struct Count {
  int usable = 0;
  int seen = 0;
};

Count count(const HandSample& sample) {
  Count result;
  for (const auto& tip : sample.fingertips) {
    if (!tip) continue;
    ++result.usable;
    if (tip->seen) ++result.seen;
  }
  return result;
}

}  // namespace

std::optional<Eigen::Vector3d> HandCentre::update(const HandSample& sample) {
  const Count tips = count(sample);
  if (tips.usable < options_.min_fingertips || tips.seen < options_.min_seen) return std::nullopt;
  const bool complete = tips.usable == static_cast<int>(finger_count);
  if (!complete && (!complete_at_ || sample.capture_time - *complete_at_ > options_.offsets_valid_for)) {
    return std::nullopt;
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < finger_count; ++i) {
    if (!sample.fingertips[i]) continue;
    sum += sample.fingertips[i]->position;
    if (!complete) sum -= offsets_[i];
  }
  const Eigen::Vector3d centre = sum / tips.usable;
  if (complete) {
    for (std::size_t i = 0; i < finger_count; ++i) offsets_[i] = sample.fingertips[i]->position - centre;
    complete_at_ = sample.capture_time;
  }
  return centre;
}

std::optional<Eigen::Vector3d> HandCentre::rough(const HandSample& sample) const {
  const Count tips = count(sample);
  if (tips.usable < options_.min_fingertips || tips.seen < options_.min_seen) return std::nullopt;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& tip : sample.fingertips) {
    if (tip) sum += tip->position;
  }
  return Eigen::Vector3d(sum / tips.usable);
}

}  // namespace handloft::interaction
