// T1, T3, T13, T14: gloves, pens and 3D mice through the whole pipeline, without any camera.

#include <gtest/gtest.h>

#include "daemon-tracking/fusion/tracking_pipeline.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/pen/pen_streams.h"
#include "daemon-tracking/source/space_mouse/space_mouse_streams.h"

namespace handloft::tracking {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr TimePoint start = from_ns(3'000'000'000);

TrackingPipeline pipeline() {
  auto made = TrackingPipeline::create(default_rig());
  EXPECT_TRUE(made.ok());
  return std::move(*made);
}

std::vector<Sample> session() {
  SimulatedPenOptions pen;
  pen.start = start;
  pen.seconds = 2.0;
  std::vector<std::unique_ptr<SampleStream>> parts;
  parts.push_back(simulated_pen_stream(pen));
  parts.push_back(simulated_space_mouse_stream({start, 2.0, SpaceMouseForm::split}));
  MergedStream merged(std::move(parts));
  std::vector<Sample> out;
  while (auto sample = merged.next()) out.push_back(std::move(*sample));
  return out;
}

TEST(InputPipeline, PenAnd3dMouseAreInEverySnapshotT14) {
  TrackingPipeline tracking = pipeline();
  EXPECT_FALSE(tracking.tick(start).pen.present);
  double pressed = 0.0, pushed = 0.0;
  for (const Sample& sample : session()) {
    EXPECT_FALSE(tracking.consume(sample).has_value());
    const FusedState state = tracking.tick(delivery_time(sample));
    pressed = std::max(pressed, state.pen.pressure);
    pushed = std::max(pushed, state.space_mouse.translation.x());
  }
  EXPECT_GT(pressed, 0.99);
  EXPECT_GT(pushed, 0.99);
  const PipelineHealth health = tracking.health();
  EXPECT_GT(health.pen_samples, 300u);
  EXPECT_EQ(health.pen_refused, 0u);
  EXPECT_GT(health.space_mouse_reports, 200u);
  EXPECT_EQ(health.space_mouse_refused, 0u);

  tracking.consume(DevicePresence{start + seconds(2), "space_mouse", false});
  tracking.consume(DevicePresence{start + seconds(2), "pen", false});
  const FusedState gone = tracking.tick(start + seconds(2));
  EXPECT_FALSE(gone.pen.present);
  EXPECT_FALSE(gone.space_mouse.present);
  EXPECT_EQ(gone.space_mouse.translation.norm(), 0.0);
}

TEST(InputPipeline, BadBytesOfEveryDeviceAreCountedAndChangeNothing) {
  TrackingPipeline tracking = pipeline();
  for (const Sample& sample : session()) (void)tracking.consume(sample);
  const FusedState before = tracking.tick(start + seconds(2));
  for (const DeviceData kind : {DeviceData::space_mouse_report, DeviceData::pen_facts, DeviceData::pen_events,
                                DeviceData::serial_glove_line}) {
    tracking.consume(DeviceBytes{start + seconds(2), kind, {1, 2, 3}});
    tracking.consume(DeviceBytes{start + seconds(2), kind, {}});
  }
  const PipelineHealth health = tracking.health();
  EXPECT_EQ(health.space_mouse_refused, 2u);
  EXPECT_EQ(health.pen_refused, 4u);
  EXPECT_EQ(health.glove_refused, 2u);
  const FusedState after = tracking.tick(start + seconds(2));
  EXPECT_EQ(after.pen.position_m, before.pen.position_m);
  EXPECT_EQ(after.space_mouse.translation, before.space_mouse.translation);
  EXPECT_FALSE(after.hand.glove_present);
}

TEST(InputPipeline, ASilentGloveSettlesAndIsLetGoByTicksAloneT9T3) {
  TrackingPipeline tracking = pipeline();
  GloveReport report;
  report.contacts = contact_index | contact_middle | contact_ring | contact_little;
  for (int ms = 0; ms < 40; ms += 4, ++report.sequence) {
    report.device_time_us = static_cast<std::uint32_t>(1000 * ms);
    const auto bytes = encode_glove_report(report);
    tracking.consume(GloveBytes{start + milliseconds(ms), {bytes.begin(), bytes.end()}});
  }
  EXPECT_EQ(tracking.tick(start + milliseconds(40)).hand.gesture, Gesture::closed);
  report.contacts = 0;
  report.device_time_us = 40'000;
  const auto bytes = encode_glove_report(report);
  tracking.consume(GloveBytes{start + milliseconds(40), {bytes.begin(), bytes.end()}});
  EXPECT_EQ(tracking.tick(start + milliseconds(64)).hand.gesture, Gesture::closed);
  EXPECT_EQ(tracking.tick(start + milliseconds(66)).hand.gesture, Gesture::open);
  EXPECT_TRUE(tracking.tick(start + milliseconds(500)).hand.glove_present);
  EXPECT_FALSE(tracking.tick(start + milliseconds(600)).hand.glove_present);
}

}  // namespace
}  // namespace handloft::tracking
