#include "daemon-tracking/main/accuracy_meter.h"

#include <algorithm>
#include <cmath>

namespace handloft::tracking {

void ErrorSummary::add(double error) {
  ++count;
  sum_of_squares += error * error;
  largest = std::max(largest, std::abs(error));
}

double ErrorSummary::rms() const {
  return count == 0 ? 0.0 : std::sqrt(sum_of_squares / static_cast<double>(count));
}

void AccuracyMeter::add(const Truth& truth) {
  truths_.push_back(truth);
  if (truths_.size() > remembered_truths) truths_.pop_front();
}

void AccuracyMeter::add(const FusedState& state) {
  const auto found = std::find_if(truths_.rbegin(), truths_.rend(),
                                  [&](const Truth& each) { return each.time == state.time; });
  if (found == truths_.rend()) return;
  const Truth& truth = *found;
  ++accuracy_.compared;
  if (truth.hand_present) {
    for (std::size_t finger = 0; finger < finger_count; ++finger) {
      const FusedTip& tip = state.hand.tips[finger];
      if (tip.state == TrackingState::lost) {
        ++accuracy_.fingertips_lost;
        continue;
      }
      const double error = (tip.position_m - Eigen::Vector3d(truth.fingertips_m[finger])).norm();
      accuracy_.fingertips_m.add(error);
      accuracy_.by_finger_m[finger].add(error);
    }
  }
  if (!state.head.position_valid || !state.head.orientation_valid) {
    ++accuracy_.heads_lost;
    return;
  }
  accuracy_.head_position_m.add((state.head.position_m - Eigen::Vector3d(truth.head_position_m)).norm());
  const double* q = truth.head_orientation_wxyz;
  accuracy_.head_rotation_rad.add(
      state.head.orientation.angularDistance(Eigen::Quaterniond(q[0], q[1], q[2], q[3])));
}

}  // namespace handloft::tracking
