// Time of exposure (T4): the driver's stamp when it deserves it, else arrival minus the latency learned.

#include "daemon-tracking/source/camera/v4l2_timestamps.h"

#include <gtest/gtest.h>

namespace handloft::tracking {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr TimePoint start = from_ns(1'000'000'000'000);
constexpr Duration exposure = milliseconds(6);

DriverStamp at(TimePoint time, StampPoint point = StampPoint::start_of_exposure, bool monotonic = true) {
  return {to_ns(time), monotonic, point};
}

TEST(FrameStamperT4, StartOfExposureIsMovedToItsMiddle) {
  FrameStamper stamper({});
  const FrameStamp stamp = stamper.stamp(at(start), start + milliseconds(20), exposure);
  EXPECT_FALSE(stamp.estimated);
  EXPECT_EQ(stamp.capture, start + milliseconds(3));
  EXPECT_EQ(stamper.learned_latency(), milliseconds(17));
}

TEST(FrameStamperT4, EndOfFrameIsMovedBackByReadoutAndHalfTheExposure) {
  StampOptions options;
  options.readout = milliseconds(10);
  FrameStamper stamper(options);
  const FrameStamp stamp =
      stamper.stamp(at(start, StampPoint::end_of_frame), start + milliseconds(5), exposure);
  EXPECT_EQ(stamp.capture, start - milliseconds(13));
}

TEST(FrameStamperT4, TheCalibratedOffsetIsAddedAndNotLearned) {
  StampOptions options;
  options.offset = milliseconds(-4);
  FrameStamper stamper(options);
  EXPECT_EQ(stamper.stamp(at(start), start + milliseconds(20), Duration{}).capture, start - milliseconds(4));
  EXPECT_EQ(stamper.learned_latency(), milliseconds(20));
}

TEST(FrameStamperT4, ABadStampIsReplacedByArrivalMinusTheLatencyLearned) {
  struct Bad {
    const char* what;
    DriverStamp stamp;
  };
  const TimePoint next = start + milliseconds(33);
  const Bad bad[] = {{"not monotonic", at(next, StampPoint::start_of_exposure, false)},
                     {"none", {0, true, StampPoint::end_of_frame}},
                     {"the same again", at(start)},
                     {"before the last", at(start - milliseconds(1))},
                     {"wall clock", {1'700'000'000'000'000'000, true, StampPoint::end_of_frame}},
                     {"too far ahead", at(next + milliseconds(61))},
                     {"negative", {-5, true, StampPoint::end_of_frame}}};
  for (const Bad& each : bad) {
    FrameStamper stamper({});
    stamper.stamp(at(start), start + milliseconds(20), exposure);
    const FrameStamp stamp = stamper.stamp(each.stamp, next + milliseconds(20), exposure);
    EXPECT_TRUE(stamp.estimated) << each.what;
    EXPECT_EQ(stamp.capture, next + milliseconds(3)) << each.what;
    // And the next good one is trusted again.
    EXPECT_FALSE(stamper.stamp(at(next + milliseconds(33)), next + milliseconds(53), exposure).estimated)
        << each.what;
  }
}

TEST(FrameStamperT4, AStampOlderThanPlausibleIsNotOfThisFrame) {
  FrameStamper stamper({});
  EXPECT_TRUE(stamper.stamp(at(start), start + milliseconds(201), exposure).estimated);
  EXPECT_FALSE(stamper.stamp(at(start + milliseconds(201)), start + milliseconds(400), exposure).estimated);
}

TEST(FrameStamperT4, WithoutAnyGoodStampAFrameIntervalIsAssumed) {
  StampOptions options;
  options.frame_interval = milliseconds(16);
  FrameStamper stamper(options);
  const FrameStamp stamp = stamper.stamp(at(start, StampPoint::end_of_frame, false), start, exposure);
  EXPECT_TRUE(stamp.estimated);
  EXPECT_EQ(stamp.capture, start - milliseconds(19));
  EXPECT_FALSE(stamper.learned_latency().has_value());
}

// vivid stamps up to 33 ms ahead: the spacing of the stamps is right, only all are late by as much.
TEST(FrameStamperT4, StampsFromTheFutureKeepTheirSpacing) {
  FrameStamper stamper({});
  TimePoint last = stamper.stamp(at(start + milliseconds(33)), start, Duration{}).capture;
  EXPECT_LE(last, start);
  for (int i = 1; i < 50; ++i) {
    // Arrival wavers by some ms, exposure doesn't.
    const TimePoint exposed = start + i * milliseconds(33);
    const TimePoint arrival = exposed + milliseconds(i % 5);
    const FrameStamp stamp = stamper.stamp(at(exposed + milliseconds(33)), arrival, Duration{});
    EXPECT_FALSE(stamp.estimated);
    EXPECT_EQ(stamp.capture - last, milliseconds(33));
    EXPECT_LE(stamp.capture, arrival);
    last = stamp.capture;
  }
}

TEST(FrameStamperT4, CaptureTimesAlwaysIncrease) {
  FrameStamper stamper({});
  TimePoint last = from_ns(0);
  for (int i = 0; i < 200; ++i) {
    // Good, missing and duplicated stamps in turns, frames arriving in pairs.
    const TimePoint exposed = start + i * milliseconds(16);
    const TimePoint arrival = start + (i / 2) * milliseconds(33) + milliseconds(40);
    const DriverStamp stamp = i % 3 == 0   ? at(exposed)
                              : i % 3 == 1 ? DriverStamp{}
                                           : at(exposed - milliseconds(32));
    const FrameStamp got = stamper.stamp(stamp, arrival, exposure);
    EXPECT_GT(got.capture, last) << i;
    last = got.capture;
  }
}

TEST(FrameStamperT4, TheLearnedLatencyFollowsSlowly) {
  FrameStamper stamper({});
  for (int i = 0; i < 100; ++i)
    stamper.stamp(at(start + i * milliseconds(33)), start + i * milliseconds(33) + milliseconds(20),
                  Duration{});
  // One frame that waited for us moves it by a twentieth only.
  stamper.stamp(at(start + milliseconds(3300)), start + milliseconds(3400), Duration{});
  EXPECT_EQ(stamper.learned_latency(), milliseconds(24));
}

}  // namespace
}  // namespace handloft::tracking
