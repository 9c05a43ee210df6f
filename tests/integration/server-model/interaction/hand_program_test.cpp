// What the simulated hand does (sculpt_program.h, tour_program.h), told to the server as a daemon without any
// error of its own would: the same hand before rendered cameras is in tests/e2e. Here a drag must be as exact
// as the hand is steady, though its fingers fold and unfold about it (D19).

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon-tracking/source/simulated/hand_program.h"
#include "daemon-tracking/source/simulated/sculpt_program.h"
#include "server-model/interaction/interaction.h"

namespace handloft::interaction {
namespace {

namespace sculpt = tracking::sculpt;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double frames_per_s = 60;
/// As the daemon's contact debouncer has it.
constexpr double debounced_s = 0.012;
constexpr double pressing_from = 0.1;

v1::Gesture gesture_of(tracking::HandPose pose) {
  switch (pose) {
    case tracking::HandPose::open:
      return v1::GESTURE_OPEN;
    case tracking::HandPose::closed:
      return v1::GESTURE_CLOSED;
    case tracking::HandPose::pointing:
      return v1::GESTURE_POINTING;
    case tracking::HandPose::on_table:
      return v1::GESTURE_ON_TABLE;
  }
  return v1::GESTURE_UNKNOWN;
}

/// Frames of what `program` does: the fingertips at once, gestures when their contacts are debounced, with
/// the time of their first edges.
class Daemon {
 public:
  explicit Daemon(const tracking::HandProgram& program) : program_(program) {}

  bool done() const { return time_s() > program_.duration_s(); }
  v1::TrackingFrame next() {
    const double now_s = time_s();
    const tracking::HandPose pose = program_.at(now_s - debounced_s).pose;
    if (pose != pose_) {
      pose_ = pose;
      since_s_ = now_s - debounced_s;
      // To the millisecond, as the glove reports.
      while (program_.at(since_s_ - 1e-3).pose == pose) since_s_ -= 1e-3;
    }
    const tracking::HandState state = program_.at(now_s);
    v1::TrackingFrame frame;
    frame.set_sequence(++sequence_);
    frame.set_capture_time_ns(ns(now_s));
    v1::HandState& hand = *frame.add_hands();
    hand.set_gesture(gesture_of(pose_));
    hand.set_gesture_since_ns(ns(since_s_));
    hand.set_pressure(state.pressure);
    hand.set_pressing(state.pressure > pressing_from);
    hand.set_potentiometer(state.potentiometer);
    for (const Vector3d& tip : state.fingertips_m) {
      hand.add_fingertip_states(v1::TRACKING_TRACKED);
      for (const double coordinate : tip) hand.add_fingertip_positions(coordinate);
    }
    return frame;
  }

 private:
  double time_s() const { return static_cast<double>(sequence_) / frames_per_s; }
  static std::int64_t ns(double s) { return std::int64_t{1'000'000'000} + std::llround(s * 1e9); }

  const tracking::HandProgram& program_;
  tracking::HandPose pose_ = tracking::HandPose::open;
  double since_s_ = 0;
  std::uint64_t sequence_ = 0;
};

/// All that the hand committed, in order.
std::vector<v1::Operation> operations_of(const tracking::HandProgram& program, model::Model& model) {
  Interaction interaction(model);
  Daemon daemon(program);
  std::vector<v1::Operation> operations;
  while (!daemon.done()) {
    const FrameOutcome outcome = interaction.on_frame(daemon.next());
    for (const model::Submitted& submitted : outcome.submitted) operations.push_back(submitted.effective);
    for (const std::string& problem : outcome.problems) ADD_FAILURE() << problem;
  }
  return operations;
}

Vector3d vec3(const v1::Vec3& at) {
  return {at.x(), at.y(), at.z()};
}

TEST(HandProgramTest, D19_a_fist_drags_as_far_and_turns_as_much_as_it_goes) {
  model::Model model;
  std::vector<v1::DragIcon> drags;
  for (const v1::Operation& operation : operations_of(tracking::sculpt_program(), model)) {
    if (operation.has_drag_icon()) drags.push_back(operation.drag_icon());
  }
  const std::vector<Vector3d> ways{sculpt::lift_m, Vector3d::Zero(), sculpt::load_m, sculpt::press_m};
  ASSERT_EQ(drags.size(), ways.size());
  for (std::size_t i = 0; i < ways.size(); ++i) {
    EXPECT_LT((vec3(drags[i].translation()) - ways[i]).norm(), 0.5e-3)
        << i << ": " << vec3(drags[i].translation()).transpose() << " instead of " << ways[i].transpose();
    const v1::Quaternion& to = drags[i].rotation();
    const Quaterniond turn =
        drags[i].has_rotation() ? Quaterniond(to.w(), to.x(), to.y(), to.z()) : Quaterniond::Identity();
    const Quaterniond wanted(Eigen::AngleAxisd(i == 1 ? sculpt::turn_rad : 0, Vector3d::UnitY()));
    EXPECT_LT(turn.angularDistance(wanted), 0.02) << i;
  }
}

}  // namespace
}  // namespace handloft::interaction
