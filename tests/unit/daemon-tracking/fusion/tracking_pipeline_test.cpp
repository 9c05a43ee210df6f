// The whole daemon without its sockets, on rendered frames: accuracy against the truth, and determinism
// (T13).

#include "daemon-tracking/fusion/tracking_pipeline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>

#include "daemon-tracking/source/simulated/mouse_shell.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"

namespace handloft::tracking {
namespace {

std::vector<Sample> samples(double seconds) {
  SimulatedRig rig(default_rig(), mouse_shell_program());
  std::vector<Sample> out;
  while (auto sample = rig.next()) {
    if (to_seconds(delivery_time(*sample) - TimePoint{}) > seconds) break;
    out.push_back(std::move(*sample));
  }
  return out;
}

/// All numbers of a snapshot, as bytes.
void append(std::vector<unsigned char>& bytes, const FusedState& state) {
  const auto put = [&](const auto& value) {
    const auto* begin = reinterpret_cast<const unsigned char*>(&value);
    bytes.insert(bytes.end(), begin, begin + sizeof(value));
  };
  put(state.time);
  put(state.sequence);
  for (const FusedTip& tip : state.hand.tips) {
    put(tip.state);
    for (double value : tip.position_m) put(value);
    for (double value : tip.velocity_m_s) put(value);
    for (double value : tip.covariance_m2.reshaped()) put(value);
  }
  for (double value : state.head.position_m) put(value);
  for (double value : state.head.orientation.coeffs()) put(value);
  for (double value : state.head.covariance.reshaped()) put(value);
  put(state.hand.gesture);
  put(state.hand.gesture_since);
  put(state.hand.pressure);
}

TEST(TrackingPipeline, AccurateOnRenderedFramesAndReplaysToTheBitT13) {
  const auto recorded = samples(1.6);
  std::map<TimePoint, Truth> truth;
  for (const Sample& sample : recorded)
    if (const auto* one = std::get_if<Truth>(&sample)) truth[one->time] = *one;
  std::vector<unsigned char> bytes[2];
  double tips_squared = 0, heads_squared = 0, turns_squared = 0;
  int tips = 0, heads = 0;
  for (auto& run : bytes) {
    auto pipeline = TrackingPipeline::create(default_rig());
    ASSERT_TRUE(pipeline.ok()) << pipeline.error().describe();
    for (const Sample& sample : recorded) {
      const auto state = pipeline->consume(sample);
      if (!state) continue;
      append(run, *state);
      const auto at = truth.find(state->time);
      if (at == truth.end() || to_seconds(state->time - TimePoint{}) < 0.2) continue;
      for (std::size_t f = 0; f < finger_count; ++f) {
        ASSERT_NE(state->hand.tips[f].state, TrackingState::lost);
        const Eigen::Vector3d expected(at->second.fingertips_m[f]);
        tips_squared += (state->hand.tips[f].position_m - expected).squaredNorm();
        ++tips;
      }
      ASSERT_TRUE(state->head.position_valid);
      const double* q = at->second.head_orientation_wxyz;
      heads_squared += (state->head.position_m - Eigen::Vector3d(at->second.head_position_m)).squaredNorm();
      turns_squared +=
          std::pow(state->head.orientation.angularDistance(Eigen::Quaterniond(q[0], q[1], q[2], q[3])), 2);
      ++heads;
    }
    EXPECT_EQ(pipeline->health().frames_refused, 0u);
  }
  ASSERT_GT(heads, 200);
  EXPECT_LE(std::sqrt(tips_squared / tips), 2e-3);
  EXPECT_LE(std::sqrt(heads_squared / heads), 2e-3);
  EXPECT_LE(std::sqrt(turns_squared / heads) * 180 / M_PI, 0.3);
  ASSERT_GT(bytes[0].size(), 1000u);
  EXPECT_EQ(bytes[0], bytes[1]);
}

TEST(TrackingPipeline, BrokenFramesAreCountedAndOutlived) {
  auto recorded = samples(0.5);
  auto pipeline = TrackingPipeline::create(default_rig());
  ASSERT_TRUE(pipeline.ok());
  int states = 0, broken = 0, frames = 0;
  for (Sample& sample : recorded) {
    if (auto* frame = std::get_if<CameraFrame>(&sample)) {
      if (++frames % 7 == 0) {
        auto cut = *frame->bytes;
        cut.resize(cut.size() / 2);
        frame->bytes = std::make_shared<const std::vector<std::uint8_t>>(std::move(cut));
        ++broken;
      }
    }
    states += pipeline->consume(sample) ? 1 : 0;
  }
  EXPECT_EQ(pipeline->health().frames_refused, static_cast<std::uint64_t>(broken));
  EXPECT_EQ(states, frames - broken);
  EXPECT_FALSE(pipeline->health().last_error.empty());
  CameraFrame foreign;
  foreign.camera = 77;
  EXPECT_FALSE(pipeline->consume(Sample(foreign)));
  pipeline->consume(DevicePresence{from_ns(600'000'000), "glove", false});
  EXPECT_FALSE(pipeline->state_at(from_ns(610'000'000)).hand.glove_present);
}

TEST(TrackingPipeline, ABadRigIsAnErrorWithItsField) {
  Rig rig = default_rig();
  rig.cameras[1].intrinsics.fx_px = -1;
  EXPECT_EQ(TrackingPipeline::create(rig).error().field, "intrinsics.fx_px");
  rig = default_rig();
  rig.head_tags[0].edge_m = 0;
  EXPECT_FALSE(TrackingPipeline::create(rig).ok());
}

}  // namespace
}  // namespace handloft::tracking
