// T1, T4: a pen's state from the kernel's events.

#include "daemon-tracking/fusion/pen_tracker.h"

#include <gtest/gtest.h>
#include <linux/input-event-codes.h>

#include <cmath>

#include "daemon-tracking/source/pen/pen_streams.h"

namespace handloft::tracking {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr TimePoint start = from_ns(5'000'000'000);

DeviceBytes facts_sample(const PenFacts& facts) {
  return {start, DeviceData::pen_facts, encode_pen_facts(facts)};
}

struct Event {
  unsigned type, code;
  std::int32_t value;
};

DeviceBytes events_sample(TimePoint time, const std::vector<Event>& events,
                          Duration delay = microseconds(300)) {
  std::vector<PenEvent> out;
  for (const Event& event : events)
    out.push_back(
        {time, static_cast<std::uint16_t>(event.type), static_cast<std::uint16_t>(event.code), event.value});
  return {time + delay, DeviceData::pen_events, encode_pen_events(out)};
}

constexpr Event report{EV_SYN, SYN_REPORT, 0};

FusedPen pen_of(const PenTracker& tracker) {
  FusedPen pen;
  tracker.describe(pen);
  return pen;
}

TEST(PenTracker, UnitsComeFromTheTabletsResolution) {
  PenTracker tracker;
  ASSERT_TRUE(tracker.consume(facts_sample(simulated_pen_facts())).ok());
  ASSERT_TRUE(tracker
                  .consume(events_sample(start + milliseconds(1), {{EV_KEY, BTN_TOOL_PEN, 1},
                                                                   {EV_ABS, ABS_X, 10800},
                                                                   {EV_ABS, ABS_Y, 3500},
                                                                   {EV_ABS, ABS_PRESSURE, 8191},
                                                                   {EV_ABS, ABS_TILT_X, 57},
                                                                   {EV_ABS, ABS_TILT_Y, 30},
                                                                   {EV_KEY, BTN_STYLUS2, 1},
                                                                   report}))
                  .ok());
  const FusedPen pen = pen_of(tracker);
  EXPECT_TRUE(pen.present);
  EXPECT_TRUE(pen.in_proximity);
  EXPECT_FALSE(pen.eraser);
  EXPECT_NEAR(pen.position_m.x(), 0.108, 1e-12);  // 10800 units at 100 per mm
  EXPECT_NEAR(pen.position_m.y(), 0.100, 1e-12);  // (13500 - 3500) units, away from the designer
  EXPECT_EQ(pen.pressure, 1.0);
  EXPECT_NEAR(pen.tilt_rad.x(), 1.0, 1e-12);
  EXPECT_NEAR(pen.tilt_rad.y(), -30.0 / 57.0, 1e-12);
  EXPECT_EQ(pen.buttons, 2u);
  EXPECT_EQ(pen.time, start + milliseconds(1)) << "the kernel's time, not the arrival (T4)";
}

TEST(PenTracker, NothingIsToldBeforeItsReport) {
  PenTracker tracker;
  ASSERT_TRUE(tracker.consume(facts_sample(simulated_pen_facts())).ok());
  ASSERT_TRUE(tracker.consume(events_sample(start, {{EV_KEY, BTN_TOOL_PEN, 1}, {EV_ABS, ABS_X, 500}})).ok());
  EXPECT_FALSE(pen_of(tracker).in_proximity);
  ASSERT_TRUE(tracker.consume(events_sample(start + milliseconds(1), {report})).ok());
  EXPECT_TRUE(pen_of(tracker).in_proximity);
  EXPECT_NEAR(pen_of(tracker).position_m.x(), 0.005, 1e-12);
}

TEST(PenTracker, DroppedEventsArePutRightByTheDifferencesThatFollow) {
  PenTracker tracker;
  ASSERT_TRUE(tracker.consume(facts_sample(simulated_pen_facts())).ok());
  ASSERT_TRUE(
      tracker
          .consume(events_sample(
              start,
              {{EV_KEY, BTN_TOOL_PEN, 1}, {EV_KEY, BTN_STYLUS, 1}, {EV_ABS, ABS_PRESSURE, 4000}, report}))
          .ok());
  // The button's and the pen's leaving were lost.
  ASSERT_TRUE(tracker
                  .consume(events_sample(start + milliseconds(5), {{EV_ABS, ABS_X, 7},
                                                                   {EV_SYN, SYN_DROPPED, 0},
                                                                   {EV_KEY, BTN_TOOL_PEN, 0},
                                                                   {EV_KEY, BTN_STYLUS, 0},
                                                                   {EV_ABS, ABS_PRESSURE, 0},
                                                                   report}))
                  .ok());
  EXPECT_EQ(tracker.overruns(), 1u);
  EXPECT_FALSE(pen_of(tracker).in_proximity);
  EXPECT_EQ(pen_of(tracker).buttons, 0u);
  EXPECT_EQ(pen_of(tracker).pressure, 0.0);
}

TEST(PenTracker, TheEraserIsTheOtherEnd) {
  PenTracker tracker;
  ASSERT_TRUE(tracker.consume(facts_sample(simulated_pen_facts())).ok());
  ASSERT_TRUE(tracker.consume(events_sample(start, {{EV_KEY, BTN_TOOL_RUBBER, 1}, report})).ok());
  EXPECT_TRUE(pen_of(tracker).in_proximity);
  EXPECT_TRUE(pen_of(tracker).eraser);
  tracker.device_gone(start + milliseconds(9));
  EXPECT_FALSE(pen_of(tracker).present);
  EXPECT_FALSE(pen_of(tracker).in_proximity);
}

TEST(PenTracker, ATabletWithoutResolutionIsTakenAsAMediumOneWithSquareUnits) {
  PenFacts facts = simulated_pen_facts();
  facts.x = {true, 0, 1000, 0};
  facts.y = {true, 0, 500, 0};
  facts.tilt_x = {true, -90, 90, 0};
  PenTracker tracker;
  ASSERT_TRUE(tracker.consume(facts_sample(facts)).ok());
  ASSERT_TRUE(tracker
                  .consume(events_sample(start, {{EV_KEY, BTN_TOOL_PEN, 1},
                                                 {EV_ABS, ABS_X, 1000},
                                                 {EV_ABS, ABS_Y, 0},
                                                 {EV_ABS, ABS_TILT_X, 45},
                                                 report}))
                  .ok());
  EXPECT_NEAR(pen_of(tracker).position_m.x(), 0.216, 1e-12);
  EXPECT_NEAR(pen_of(tracker).position_m.y(), 0.108, 1e-12);
  EXPECT_NEAR(pen_of(tracker).tilt_rad.x(), 0.7853981633974483, 1e-12);
}

TEST(PenTracker, AForeignClockIsNotBelievedT4) {
  PenTracker tracker;
  ASSERT_TRUE(tracker.consume(facts_sample(simulated_pen_facts())).ok());
  const DeviceBytes wall =
      events_sample(from_ns(1'700'000'000'000'000'000), {{EV_KEY, BTN_TOOL_PEN, 1}, report},
                    -(from_ns(1'700'000'000'000'000'000) - (start + milliseconds(50))));
  ASSERT_TRUE(tracker.consume(wall).ok());
  EXPECT_EQ(pen_of(tracker).time, start + milliseconds(50));
}

TEST(PenTracker, HostileValuesStayFiniteAndBounded) {
  PenTracker tracker;
  EXPECT_FALSE(tracker.consume(events_sample(start, {report})).ok()) << "before any facts";
  ASSERT_TRUE(tracker.consume(facts_sample(simulated_pen_facts())).ok());
  for (const std::int32_t value :
       {std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()}) {
    ASSERT_TRUE(tracker
                    .consume(events_sample(start, {{EV_KEY, BTN_TOOL_PEN, 1},
                                                   {EV_ABS, ABS_X, value},
                                                   {EV_ABS, ABS_Y, value},
                                                   {EV_ABS, ABS_PRESSURE, value},
                                                   {EV_ABS, ABS_TILT_X, value},
                                                   report}))
                    .ok());
    const FusedPen pen = pen_of(tracker);
    EXPECT_GE(pen.position_m.minCoeff(), 0.0);
    EXPECT_LE(pen.position_m.x(), 0.216 + 1e-9);
    EXPECT_GE(pen.pressure, 0.0);
    EXPECT_LE(pen.pressure, 1.0);
    EXPECT_LE(std::abs(pen.tilt_rad.x()), 1.58);
  }
}

TEST(SimulatedPen, ComesOutOfTheTrackerAsItWentIn) {
  SimulatedPenOptions options;
  options.start = start;
  options.seconds = 6.0;
  const auto stream = simulated_pen_stream(options);
  PenTracker tracker;
  int near = 0, erasing = 0;
  while (const auto sample = stream->next()) {
    const auto* bytes = std::get_if<DeviceBytes>(&*sample);
    if (bytes == nullptr) continue;
    ASSERT_TRUE(tracker.consume(*bytes).ok());
    if (bytes->kind == DeviceData::pen_facts) continue;
    const FusedPen pen = pen_of(tracker);
    const SimulatedPenTruth truth = simulated_pen_at(options, to_seconds(pen.time - start));
    ASSERT_EQ(pen.in_proximity, truth.in_proximity);
    if (!truth.in_proximity) continue;
    ++near;
    erasing += pen.eraser ? 1 : 0;
    ASSERT_NEAR(pen.position_m.x(), truth.x_m, 5.1e-6);  // Half a unit.
    ASSERT_NEAR(pen.position_m.y(), truth.y_m, 5.1e-6);
    ASSERT_NEAR(pen.pressure, truth.pressure, 1.0 / 8191);
    ASSERT_NEAR(pen.tilt_rad.x(), truth.tilt_x_rad, 0.012);  // Half a degree, and 57 for 57.3.
  }
  EXPECT_GT(near, 1000);
  EXPECT_GT(erasing, 100);
}

}  // namespace
}  // namespace handloft::tracking
