#include "server-model/interaction/fist_hold.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

namespace handloft::interaction {
namespace {

/// The glove's edges come to the server with the frame after them, late by their debouncing and by the frame:
/// ways are kept so much longer than unfolding takes.
constexpr Duration edges_late_by = std::chrono::milliseconds(400);

/// For a turn, what a camera sees: where a hidden fingertip is taken to be says nothing of it. Of hands that
/// show fewer than three, all.
FingertipPositions telling_fingertips(const HandSample& sample) {
  constexpr int enough = 3;
  FingertipPositions seen;
  int count = 0;
  for (std::size_t i = 0; i < finger_count; ++i) {
    if (!sample.fingertips[i] || !sample.fingertips[i]->seen) continue;
    seen[i] = sample.fingertips[i]->position;
    ++count;
  }
  return count >= enough ? seen : fingertip_positions(sample);
}

}  // namespace

Eigen::Quaterniond meant_turn(const Eigen::Quaterniond& turn, double slack_rad) {
  const Eigen::AngleAxisd about(turn);  // 0..pi
  if (!(about.angle() > slack_rad)) return Eigen::Quaterniond::Identity();
  const double meant = std::min(about.angle(), 2 * (about.angle() - slack_rad));
  return Eigen::Quaterniond(Eigen::AngleAxisd(meant, about.axis()));
}

void FistHold::begin(const HandFrame& frame, const FingertipPositions& fingertips) {
  grasp_ = Grasp();
  grasp_.since = frame.sample.capture_time;
  grasp_.first = *frame.fist_centre;
  grasp_.first_fingertips = fingertips;
  steady_up(frame, fingertips);
}

void FistHold::steady_up(const HandFrame& frame, const FingertipPositions& fingertips) {
  const Eigen::Vector3d& centre = *frame.fist_centre;
  const auto turn = hand_turn(grasp_.first_fingertips, fingertips);
  grasp_.over = grasp_.over || frame.sample.capture_time - grasp_.since > options_.steady_for ||
                (centre - grasp_.first).norm() > options_.steady_m ||
                (turn && Eigen::AngleAxisd(*turn).angle() > options_.turn_slack_rad);
  if (grasp_.over) return;
  grasp_.centre += (centre - grasp_.centre) / ++grasp_.frames;
  for (std::size_t i = 0; i < finger_count; ++i) {
    if (!fingertips[i]) continue;
    if (!grasp_.fingertips[i]) grasp_.fingertips[i].emplace(Eigen::Vector3d::Zero());
    *grasp_.fingertips[i] += (*fingertips[i] - *grasp_.fingertips[i]) / ++grasp_.seen[i];
  }
}

FistWay FistHold::on_frame(const HandFrame& frame) {
  const HandSample& sample = frame.sample;
  const FingertipPositions fingertips = telling_fingertips(sample);
  FistWay way;
  way.time = sample.capture_time;
  way.potentiometer = sample.potentiometer;
  if (!folded_) {
    begin(frame, fingertips);
    folded_ = !sample.gesture_since || sample.capture_time - *sample.gesture_since >= options_.folds_for;
    if (!folded_) return way;
  } else {
    steady_up(frame, fingertips);
    if (const auto turn = hand_turn(grasp_.fingertips, fingertips)) turn_ = *turn;
    way.translation = *frame.fist_centre - grasp_.centre;
    way.turn = turn_;
  }
  ways_.push_back(way);
  const Duration kept = options_.unfolds_for + options_.steady_for + edges_late_by;
  while (ways_.size() > 1 && way.time - ways_[1].time > kept) ways_.pop_front();
  way.turn = meant_turn(way.turn, options_.turn_slack_rad);
  return way;
}

std::optional<FistWay> FistHold::at_release(std::optional<TimePoint> opened) const {
  if (ways_.empty()) return std::nullopt;
  FistWay last = ways_.back();
  if (opened) {
    const auto unfolding = std::find_if(ways_.begin(), ways_.end(), [&](const FistWay& way) {
      return *opened - way.time < options_.unfolds_for;
    });
    if (unfolding == ways_.begin()) return std::nullopt;
    last = *std::prev(unfolding);
    const FistWay from = last;
    Eigen::Vector4d turns = Eigen::Vector4d::Zero();
    int frames = 0;
    for (auto way = unfolding; way != ways_.begin();) {
      --way;
      const bool steady = from.time - way->time <= options_.steady_for &&
                          (way->translation - from.translation).norm() <= options_.steady_m &&
                          way->turn.angularDistance(from.turn) <= options_.turn_slack_rad;
      if (!steady) break;
      last.translation += (way->translation - last.translation) / ++frames;
      turns += std::copysign(1.0, from.turn.dot(way->turn)) * way->turn.coeffs();
    }
    last.turn = Eigen::Quaterniond(turns).normalized();
  }
  last.turn = meant_turn(last.turn, options_.turn_slack_rad);
  return last;
}

}  // namespace handloft::interaction
