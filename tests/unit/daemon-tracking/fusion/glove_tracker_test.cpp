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
  EXPECT_FALSE(glove.consume({at(108), {}}).ok());
  EXPECT_EQ(hand_of(glove).gesture, Gesture::closed);
}

}  // namespace
}  // namespace handloft::tracking
