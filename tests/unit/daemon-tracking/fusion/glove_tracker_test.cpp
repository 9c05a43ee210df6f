#include "daemon-tracking/fusion/glove_tracker.h"

#include <gtest/gtest.h>

#include "daemon-tracking/source/glove_report.h"

namespace handloft::tracking {
namespace {

using std::chrono::milliseconds;

constexpr TimePoint start = from_ns(1'000'000'000);
constexpr std::uint8_t fist = contact_index | contact_middle | contact_ring | contact_little;

TimePoint at(int ms) {
  return start + milliseconds(ms);
}

GloveBytes report(int ms, std::uint16_t contacts, std::uint16_t force = 0) {
  GloveReport out;
  out.contacts = contacts;
  out.force = force;
  out.potentiometer = 512;
  const auto bytes = encode_glove_report(out);
  return {at(ms), {bytes.begin(), bytes.end()}};
}

FusedHand hand_of(const GloveTracker& glove) {
  FusedHand hand;
  glove.describe(hand);
  return hand;
}

TEST(ContactDebouncer, PressesAfter10msBackDatedT9) {
  ContactDebouncer pads;
  pads.feed(at(0), 0);
  pads.feed(at(20), 1);
  pads.feed(at(22), 0);  // Bounce
  pads.feed(at(24), 1);
  pads.advance(at(33));
  EXPECT_EQ(pads.bits(), 0);
  pads.advance(at(34));
  EXPECT_EQ(pads.bits(), 1);
  EXPECT_EQ(pads.changed(0), at(20));
  EXPECT_EQ(pads.bounces(), 1u);
}

TEST(ContactDebouncer, ReleasesLaterThanItPressesT9) {
  ContactDebouncer pads;
  pads.feed(at(0), 0);
  pads.feed(at(10), 2);
  pads.advance(at(30));
  pads.feed(at(100), 0);
  pads.feed(at(115), 2);  // A lift of 15 ms is none
  pads.advance(at(200));
  EXPECT_EQ(pads.bits(), 2);
  pads.feed(at(300), 0);
  pads.advance(at(324));
  EXPECT_EQ(pads.bits(), 2);
  pads.advance(at(325));
  EXPECT_EQ(pads.bits(), 0);
  EXPECT_EQ(pads.changed(1), at(300));
}

TEST(ContactDebouncer, AnOldSpikeDoesNotBackDateALaterPress) {
  ContactDebouncer pads;
  pads.feed(at(0), 0);
  pads.feed(at(10), 1);
  pads.feed(at(12), 0);
  pads.feed(at(500), 1);
  pads.advance(at(520));
  EXPECT_EQ(pads.changed(0), at(500));
}

TEST(ContactDebouncer, TimeThatRunsBackwardsIsHarmless) {
  ContactDebouncer pads;
  pads.feed(at(100), 1);
  pads.feed(at(50), 0);
  pads.advance(at(0));
  pads.feed(at(101), 1);
  pads.advance(at(120));
  EXPECT_EQ(pads.bits(), 1);
}

TEST(Gestures, TableOfCombinationsT10) {
  EXPECT_EQ(gesture_of(0), Gesture::open);
  EXPECT_EQ(gesture_of(contact_thumb | contact_table), Gesture::open);
  EXPECT_EQ(gesture_of(fist), Gesture::closed);
  EXPECT_EQ(gesture_of(fist & ~contact_index), Gesture::pointing);
  EXPECT_EQ(gesture_of(contact_index), Gesture::unknown);
  EXPECT_EQ(gesture_of(contact_middle | contact_ring), Gesture::unknown);
}

TEST(GloveTracker, ClosingFingersOneByOneGoesFromOpenToClosedT10) {
  GloveTracker glove;
  for (int ms = 0; ms < 100; ms += 4) ASSERT_TRUE(glove.consume(report(ms, 0)).ok());
  EXPECT_EQ(hand_of(glove).gesture, Gesture::open);
  // Fingers land 20 ms apart: no unknown in between.
  for (int ms = 100; ms < 300; ms += 4) {
    std::uint16_t contacts = 0;
    for (int finger = 0; finger < 4; ++finger)
      if (ms >= 100 + 20 * finger) contacts = static_cast<std::uint16_t>(contacts | (1u << (3 - finger)));
    ASSERT_TRUE(glove.consume(report(ms, contacts)).ok());
    EXPECT_NE(hand_of(glove).gesture, Gesture::unknown) << ms;
  }
  EXPECT_EQ(hand_of(glove).gesture, Gesture::closed);
  EXPECT_EQ(hand_of(glove).gesture_since, at(160));
}

TEST(GloveTracker, AnUndefinedCombinationBecomesUnknownAfter100msT10) {
  GloveTracker glove;
  for (int ms = 0; ms < 100; ms += 4) ASSERT_TRUE(glove.consume(report(ms, fist)).ok());
  for (int ms = 100; ms < 190; ms += 4) {
    ASSERT_TRUE(glove.consume(report(ms, contact_index)).ok());
    EXPECT_EQ(hand_of(glove).gesture, Gesture::closed);
  }
  for (int ms = 190; ms < 260; ms += 4) ASSERT_TRUE(glove.consume(report(ms, contact_index)).ok());
  EXPECT_EQ(hand_of(glove).gesture, Gesture::unknown);
  EXPECT_EQ(hand_of(glove).gesture_since, at(100));
}

TEST(GloveTracker, PressureHasHysteresisAndKeepsTheRawValue) {
  GloveTracker glove;
  const auto press = [&](int ms, std::uint16_t force) {
    ASSERT_TRUE(glove.consume(report(ms, 0, force)).ok());
    ASSERT_TRUE(glove.consume(report(ms + 1, 0, force)).ok());
    ASSERT_TRUE(glove.consume(report(ms + 2, 0, force)).ok());
  };
  press(0, 60);
  EXPECT_FALSE(hand_of(glove).pressing);  // 5.9 %
  press(10, 90);
  EXPECT_TRUE(hand_of(glove).pressing);  // 8.8 %
  press(20, 60);
  EXPECT_TRUE(hand_of(glove).pressing);
  press(30, 40);
  EXPECT_FALSE(hand_of(glove).pressing);  // 3.9 %
  press(40, 1023);
  EXPECT_DOUBLE_EQ(hand_of(glove).pressure, 1.0);
  EXPECT_EQ(hand_of(glove).raw_force, 1023);
  // A single spike is the converter's.
  ASSERT_TRUE(glove.consume(report(50, 0, 0)).ok());
  EXPECT_DOUBLE_EQ(hand_of(glove).pressure, 1.0);
}

TEST(GloveTracker, A1_PressureIsTheLevelOver1023) {
  for (const std::uint16_t level : {std::uint16_t{0}, std::uint16_t{512}, std::uint16_t{1023}}) {
    GloveTracker glove;
    for (int ms = 0; ms < 3; ++ms) ASSERT_TRUE(glove.consume(report(ms, 0, level)).ok());
    EXPECT_EQ(hand_of(glove).pressure, level / 1023.0) << level;
  }
}

TEST(GloveTracker, ALostDeviceReleasesEverythingT3) {
  GloveTracker glove;
  for (int ms = 0; ms < 100; ms += 4) ASSERT_TRUE(glove.consume(report(ms, fist | contact_table, 800)).ok());
  EXPECT_TRUE(hand_of(glove).table_by_contact);
  GloveTracker silent = glove;
  glove.device_gone(at(120));
  for (const GloveTracker* one : {&glove, &silent}) {
    if (one == &silent) silent.advance(at(700));
    const FusedHand hand = hand_of(*one);
    EXPECT_FALSE(hand.glove_present);
    EXPECT_EQ(hand.contacts, 0);
    EXPECT_EQ(hand.gesture, Gesture::unknown);
    EXPECT_FALSE(hand.pressing);
    EXPECT_EQ(hand.pressure, 0.0);
    EXPECT_FALSE(hand.table_by_contact);
  }
}

TEST(GloveTracker, ABadReportChangesNothing) {
  GloveTracker glove;
  for (int ms = 0; ms < 100; ms += 4) ASSERT_TRUE(glove.consume(report(ms, fist)).ok());
  GloveBytes bad = report(104, 0);
  bad.bytes[14] ^= 0xFF;
  EXPECT_FALSE(glove.consume(bad).ok());
  EXPECT_FALSE(glove.consume(GloveBytes{at(108), {}}).ok());
  EXPECT_EQ(hand_of(glove).gesture, Gesture::closed);
}

GloveBytes stamped(int arrival_us, std::uint32_t device_us, std::uint16_t contacts, std::uint16_t sequence) {
  GloveReport out;
  out.contacts = contacts;
  out.device_time_us = device_us;
  out.sequence = sequence;
  const auto bytes = encode_glove_report(out);
  return {start + std::chrono::microseconds(arrival_us), {bytes.begin(), bytes.end()}};
}

TEST(GloveTracker, AnEdgeIsTimedByTheGlovesClockNotByArrivalT4) {
  GloveTracker glove;
  // 250 Hz; the first two seconds arrive after 0.5 to 3.5 ms, then the report with the edge takes 12 ms.
  std::uint16_t sequence = 0;
  int ms = 0;
  for (; ms < 2000; ms += 4, ++sequence) {
    const int delay_us = 500 + (ms / 4 * 7919) % 3000;
    ASSERT_TRUE(
        glove.consume(stamped(ms * 1000 + delay_us, static_cast<std::uint32_t>(ms) * 1000u, 0, sequence))
            .ok());
  }
  for (const int edge = ms; ms < edge + 100; ms += 4, ++sequence) {
    const int delay_us = ms == edge ? 12'000 : 12'500 - std::min(12'000, (ms - edge) * 1000);
    ASSERT_TRUE(
        glove.consume(stamped(ms * 1000 + delay_us, static_cast<std::uint32_t>(ms) * 1000u, fist, sequence))
            .ok());
  }
  const TimePoint since = hand_of(glove).gesture_since;
  EXPECT_EQ(hand_of(glove).gesture, Gesture::closed);
  EXPECT_NEAR(to_seconds(since - at(2000)), 0.0005, 0.0003) << "by arrival it would be 0.012";
}

TEST(GloveTracker, CountsWhatIsMissingBySequenceOverItsWrap) {
  GloveTracker glove;
  for (const std::uint16_t sequence : std::initializer_list<std::uint16_t>{65533, 65534, 65535, 2, 3})
    ASSERT_TRUE(glove.consume(stamped(sequence, 0, 0, sequence)).ok());
  EXPECT_EQ(glove.counters().lost, 2u);
  EXPECT_EQ(glove.counters().reports, 5u);
  GloveBytes bad = report(50, 0);
  bad.bytes[20] = 1;
  EXPECT_FALSE(glove.consume(bad).ok());
  EXPECT_EQ(glove.counters().refused, 1u);
}

GloveBytes range_report(const GloveRange& range) {
  const auto bytes = encode_glove_range(range);
  return {at(0), {bytes.begin(), bytes.end()}};
}

TEST(GloveTracker, ACalibratedGlovesOwnRangeCountsBeforeTheOptionsT9) {
  GloveOptions options;
  options.force_zero = 100;
  options.force_full = 300;
  GloveTracker glove(options);
  const auto press = [&](int ms, std::uint16_t force) {
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(glove.consume(report(ms + i, 0, force)).ok());
  };
  press(0, 200);
  EXPECT_DOUBLE_EQ(hand_of(glove).pressure, 0.5);
  ASSERT_TRUE(glove.consume(range_report({0, 1023, 0, 1023, false})).ok());
  press(10, 200);
  EXPECT_DOUBLE_EQ(hand_of(glove).pressure, 0.5) << "one that was never calibrated says nothing";
  ASSERT_TRUE(glove.consume(range_report({150, 250, 412, 612, true})).ok());
  press(20, 175);
  EXPECT_DOUBLE_EQ(hand_of(glove).pressure, 0.25);
  EXPECT_DOUBLE_EQ(hand_of(glove).potentiometer, 0.5);
  EXPECT_EQ(hand_of(glove).raw_force, 175);
  // A stall is no other glove; an unplugged one may be.
  glove.advance(at(900));
  press(1000, 175);
  EXPECT_DOUBLE_EQ(hand_of(glove).pressure, 0.25);
  glove.device_gone(at(1100));
  press(1200, 200);
  EXPECT_DOUBLE_EQ(hand_of(glove).pressure, 0.5);
}

TEST(GloveTracker, TheTablesPadHasItsOwnTimeT10) {
  GloveTracker glove;
  for (int ms = 0; ms < 100; ms += 4) ASSERT_TRUE(glove.consume(report(ms, 0)).ok());
  for (int ms = 100; ms < 200; ms += 4) ASSERT_TRUE(glove.consume(report(ms, contact_table)).ok());
  EXPECT_TRUE(hand_of(glove).table_by_contact);
  EXPECT_EQ(hand_of(glove).table_since, at(100));
  for (int ms = 200; ms < 300; ms += 4) ASSERT_TRUE(glove.consume(report(ms, 0)).ok());
  EXPECT_FALSE(hand_of(glove).table_by_contact);
  EXPECT_EQ(hand_of(glove).table_since, at(200));
}

TEST(GloveTracker, ASilentDeviceStillSettlesByTimeAloneT9) {
  GloveTracker glove;
  for (int ms = 0; ms < 100; ms += 4) ASSERT_TRUE(glove.consume(report(ms, fist)).ok());
  ASSERT_TRUE(glove.consume(report(100, 0)).ok());
  glove.advance(at(124));
  EXPECT_EQ(hand_of(glove).contacts, fist);
  glove.advance(at(125));
  EXPECT_EQ(hand_of(glove).contacts, 0);
  EXPECT_EQ(hand_of(glove).gesture, Gesture::open);
  EXPECT_EQ(hand_of(glove).gesture_since, at(100));
}

DeviceBytes line(int ms, const std::string& text) {
  return {at(ms), DeviceData::serial_glove_line, {text.begin(), text.end()}};
}

TEST(SerialGlove, CurledFingersAreContactsWithHysteresis) {
  GloveTracker glove;
  int ms = 0;
  const auto hold = [&](const std::string& text) {
    for (const int end = ms + 60; ms < end; ms += 4) ASSERT_TRUE(glove.consume(line(ms, text)).ok()) << text;
  };
  hold("A0B0C0D0E0P0");
  hold("A0B4000C4000D4000E4000P2048G1024");  // Each finger's range is known now.
  EXPECT_EQ(hand_of(glove).gesture, Gesture::closed);
  EXPECT_NEAR(hand_of(glove).pressure, 0.5, 0.001);
  EXPECT_NEAR(hand_of(glove).potentiometer, 0.25, 0.001);
  hold("A0B2200C4000D4000E4000");  // 55 % of the index finger: it stays.
  EXPECT_EQ(hand_of(glove).gesture, Gesture::closed);
  hold("A0B1900C4000D4000E4000");  // 47.5 %
  EXPECT_EQ(hand_of(glove).gesture, Gesture::pointing);
  hold("A0B2200C4000D4000E4000");  // 55 % is not enough to close again.
  EXPECT_EQ(hand_of(glove).gesture, Gesture::pointing);
  hold("A0B0C0D0E0K");
  EXPECT_TRUE(hand_of(glove).table_by_contact);
  hold("A0B0C0D0E0M");
  EXPECT_DOUBLE_EQ(hand_of(glove).pressure, 1.0) << "pinch is full pressure";
  EXPECT_FALSE(glove.consume(line(ms, "A0Bx")).ok());
  EXPECT_EQ(glove.counters().refused, 1u);
}

TEST(SerialGlove, AFingerThatNeverMovedIsOpen) {
  SerialGloveMapper mapper;
  SerialGloveLine still;
  still.curl[1] = 2047;
  for (int i = 0; i < 10; ++i) {
    still.curl[1] = static_cast<std::uint16_t>(2047 + i);  // A converter's noise.
    EXPECT_EQ(mapper.map(still).contacts, 0);
  }
}

}  // namespace
}  // namespace handloft::tracking
