// Bounded memory for each receiver (architecture, idea 5).

#include "common/net/outbox.h"

#include <gtest/gtest.h>

namespace handloft::net {
namespace {

Frame frame(const std::string& text) {
  return std::make_shared<const std::string>(text);
}
std::string taken(Outbox& outbox) {
  const auto next = outbox.take();
  return next ? **next : "(nothing)";
}

TEST(Outbox, ReliableFramesKeepTheirOrderAndGoFirst) {
  Outbox outbox;
  ASSERT_TRUE(outbox.put_latest({1, "a"}, frame("state")));
  ASSERT_TRUE(outbox.push(frame("1")));
  ASSERT_TRUE(outbox.push(frame("2")));
  EXPECT_EQ(taken(outbox), "1");
  EXPECT_EQ(taken(outbox), "2");
  EXPECT_EQ(taken(outbox), "state");
  EXPECT_EQ(taken(outbox), "(nothing)");
  EXPECT_TRUE(outbox.empty());
}

TEST(Outbox, ANewerStateReplacesAnUnsentOneAndKeepsItsTurn) {
  Outbox outbox;
  outbox.put_latest({1, "a"}, frame("a1"));
  outbox.put_latest({1, "b"}, frame("b1"));
  outbox.put_latest({2, "a"}, frame("other kind"));
  outbox.put_latest({1, "a"}, frame("a2 longer"));
  EXPECT_EQ(outbox.replaced(), 1u);
  EXPECT_EQ(outbox.queued_bytes(), 9u + 2u + 10u);
  EXPECT_EQ(taken(outbox), "a2 longer");
  EXPECT_EQ(taken(outbox), "b1");
  EXPECT_EQ(taken(outbox), "other kind");
  EXPECT_EQ(outbox.queued_bytes(), 0u);
}

std::string taken_together(Outbox& outbox, std::size_t most_bytes) {
  const auto next = outbox.take_together(most_bytes);
  return next ? std::to_string(next->frames) + ": " + *next->bytes : "(nothing)";
}

TEST(Outbox, WhatIsSmallGoesTogetherAndInTurn) {
  Outbox outbox;
  outbox.push(frame("1"));
  outbox.push(frame("2"));
  for (const char* key : {"a", "b", "c", "d"}) outbox.put_latest({1, key}, frame(std::string(4, *key)));
  outbox.put_latest({1, "e"}, frame(std::string(20, 'e')));
  outbox.put_latest({1, "f"}, frame("f"));
  EXPECT_EQ(taken_together(outbox, 12), "2: 12") << "answers are not states";
  EXPECT_EQ(taken_together(outbox, 12), "3: aaaabbbbcccc");
  EXPECT_EQ(taken_together(outbox, 12), "1: dddd");
  EXPECT_EQ(taken_together(outbox, 12), "1: " + std::string(20, 'e')) << "larger than all may be: alone";
  EXPECT_EQ(taken_together(outbox, 12), "1: f");
  EXPECT_EQ(taken_together(outbox, 12), "(nothing)");
  EXPECT_EQ(outbox.queued_bytes(), 0u);
  EXPECT_EQ(outbox.queued_frames(), 0u);
}

TEST(Outbox, EveryLimitHolds) {
  Outbox outbox({.max_queued_bytes = 10, .max_queued_frames = 3, .max_slots = 2, .max_slot_bytes = 10});
  EXPECT_TRUE(outbox.push(frame("12345")));
  EXPECT_TRUE(outbox.push(frame("12345")));
  EXPECT_FALSE(outbox.push(frame("1"))) << "bytes";
  outbox.clear();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(outbox.push(frame("")));
  EXPECT_FALSE(outbox.push(frame(""))) << "frames";
  EXPECT_TRUE(outbox.put_latest({1, "a"}, frame("12345")));
  EXPECT_FALSE(outbox.put_latest({1, "b"}, frame("123456"))) << "slot bytes";
  EXPECT_TRUE(outbox.put_latest({1, "a"}, frame("1234567890"))) << "replacing gives the old bytes back";
  EXPECT_TRUE(outbox.put_latest({1, "b"}, frame("")));
  EXPECT_FALSE(outbox.put_latest({1, "c"}, frame(""))) << "slots";
}

TEST(Outbox, U4_no_lane_takes_anothers_room) {
  Outbox outbox({.max_queued_bytes = 10,
                 .max_queued_frames = 10,
                 .max_slots = 10,
                 .max_slot_bytes = 10,
                 .max_notices = 2,
                 .max_notice_bytes = 10});
  EXPECT_TRUE(outbox.put_latest({1, "hand"}, frame("1234567890")));
  EXPECT_FALSE(outbox.put_latest({1, "other"}, frame("1")));
  EXPECT_TRUE(outbox.put_latest({2, "people", Lane::notices}, frame("1234567890")));
  EXPECT_FALSE(outbox.put_latest({2, "more", Lane::notices}, frame("1")));
  EXPECT_TRUE(outbox.push(frame("1234567890")));
  EXPECT_TRUE(outbox.has_answers());
  EXPECT_EQ(outbox.queued_bytes(), 30u);
  outbox.take();
  EXPECT_FALSE(outbox.has_answers());
  outbox.take();
  EXPECT_TRUE(outbox.put_latest({1, "other"}, frame("1"))) << "what was taken gives its room back";
  EXPECT_FALSE(outbox.put_latest({2, "more", Lane::notices}, frame("1")));
  outbox.take();
  EXPECT_TRUE(outbox.put_latest({2, "a", Lane::notices}, frame("1")));
  EXPECT_TRUE(outbox.put_latest({2, "b", Lane::notices}, frame("1")));
  EXPECT_FALSE(outbox.put_latest({2, "c", Lane::notices}, frame("1"))) << "notices";
}

TEST(Outbox, ClearingEmptiesAll) {
  Outbox outbox;
  outbox.push(frame("x"));
  outbox.put_latest({1, "a"}, frame("y"));
  outbox.clear();
  EXPECT_TRUE(outbox.empty());
  EXPECT_EQ(outbox.queued_bytes(), 0u);
  EXPECT_EQ(outbox.queued_frames(), 0u);
  EXPECT_EQ(taken(outbox), "(nothing)");
}

}  // namespace
}  // namespace handloft::net
