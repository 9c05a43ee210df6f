// What becomes of a client's frames while the model is behind (U4), and on which clock they are.

#include "server-model/session/hand_inbox.h"

#include <gmock/gmock.h>

#include <limits>
#include <string>
#include <vector>

#include "server-model/session/client_frame.h"
#include "tests/support/hand_script.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;
using Taken = HandInbox::Taken;

class InboxTest : public ::testing::Test {
 protected:
  Taken push(HandInbox& inbox, const v1::TrackingFrame& frame) { return inbox.push(frame, now_ += 10ms); }
  static std::vector<v1::TrackingFrame> drain(HandInbox& inbox) {
    std::vector<v1::TrackingFrame> frames;
    while (auto frame = inbox.pop()) frames.push_back(*std::move(frame));
    return frames;
  }
  test::HandScript script_;
  TimePoint now_ = from_ns(1'000'000'000);
};

TEST_F(InboxTest, U4_of_a_hand_that_only_moves_the_newest_wins) {
  HandInbox inbox;
  for (int i = 0; i < 4; ++i) EXPECT_EQ(push(inbox, script_.resting({0.01 * i, 0, 0.1})), Taken::waits);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(push(inbox, script_.resting({0.01 * i, 0, 0.1})), Taken::replaced);
  const auto frames = drain(inbox);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames.back().sequence(), 54U);
  EXPECT_EQ(inbox.statistics().frames, 54U);
  EXPECT_EQ(inbox.statistics().replaced, 50U);
  EXPECT_EQ(push(inbox, script_.resting()), Taken::waits) << "the model keeps up again";
}

TEST_F(InboxTest, U4_changes_of_gesture_pressing_contacts_and_sight_are_never_replaced) {
  HandInbox inbox;
  for (int i = 0; i < 5; ++i) push(inbox, script_.resting());
  std::vector<v1::TrackingFrame> changes;
  changes.push_back(script_.laying({0, 0, 0.1}));
  changes.push_back(script_.resting());
  changes.push_back(script_.hand({0, 0, 0.1}, v1::GESTURE_POINTING));
  v1::TrackingFrame thumb = script_.hand({0, 0, 0.1}, v1::GESTURE_POINTING);
  thumb.mutable_hands(0)->set_contacts(1U << v1::CONTACT_PAD_THUMB);
  changes.push_back(thumb);
  changes.push_back(script_.empty());
  for (const auto& change : changes) EXPECT_EQ(push(inbox, change), Taken::waits);
  const auto frames = drain(inbox);
  ASSERT_EQ(frames.size(), 4 + changes.size());
  for (std::size_t i = 0; i < changes.size(); ++i) EXPECT_EQ(frames[4 + i].sequence(), changes[i].sequence());
}

TEST_F(InboxTest, A1_a_stroke_keeps_its_frames_for_half_a_second_and_more) {
  HandInbox inbox;
  for (int i = 0; i < 64; ++i) EXPECT_EQ(push(inbox, script_.laying({0.001 * i, 0, 0.1})), Taken::waits);
  EXPECT_EQ(push(inbox, script_.laying({0.1, 0, 0.1})), Taken::replaced);
  EXPECT_EQ(push(inbox, script_.resting()), Taken::waits) << "its end is a change";
  EXPECT_EQ(drain(inbox).size(), 65U);
}

TEST_F(InboxTest, U4_nothing_waits_without_bound) {
  HandInbox inbox;
  for (int i = 0; i < 5000; ++i) push(inbox, i % 2 == 0 ? script_.laying({0, 0, 0.1}) : script_.resting());
  EXPECT_EQ(drain(inbox).size(), HandInboxOptions{}.most);
}

TEST_F(InboxTest, U4_more_frames_than_a_hand_makes_are_left_out) {
  HandInbox inbox;
  std::size_t taken = 0;
  for (int i = 0; i < 10'000; ++i) {  // Ten thousand a second, for a second.
    if (inbox.push(script_.resting(), now_ += 100us) != Taken::left_out) ++taken;
    (void)inbox.pop();
  }
  const HandInboxOptions options;
  EXPECT_NEAR(static_cast<double>(taken), options.burst_frames + options.max_frames_per_s, 2.0);
  EXPECT_EQ(inbox.statistics().left_out, 10'000 - taken);
  // At 120 a second none ever is.
  HandInbox calm;
  for (int i = 0; i < 2000; ++i) {
    EXPECT_EQ(calm.push(script_.resting(), now_ += 8333us), Taken::waits);
    (void)calm.pop();
  }
}

TEST_F(InboxTest, A25_what_a_command_follows_is_not_replaced_by_what_comes_after_it) {
  HandInbox inbox;
  for (int i = 0; i < 4; ++i) push(inbox, script_.resting());
  inbox.seal();
  EXPECT_EQ(push(inbox, script_.resting()), Taken::waits);
  EXPECT_EQ(push(inbox, script_.resting()), Taken::replaced);
  EXPECT_EQ(drain(inbox).size(), 5U);
}

TEST(ClientFrame, T4_times_come_onto_the_servers_clock) {
  net::PeerInfo peer;
  peer.hello_sent_ns = 5'000'000'000;
  peer.hello_received = from_ns(100'000'000'000);
  const ClientClock clock = ClientClock::of(peer);
  EXPECT_EQ(clock.server_minus_client, 95s);
  const TimePoint received = from_ns(110'000'000'000);
  EXPECT_EQ(clock.to_server(14'000'000'000, received, 10s), from_ns(109'000'000'000));
  EXPECT_EQ(clock.to_server(16'000'000'000, received, 10s), received) << "the future";
  EXPECT_EQ(clock.to_server(4'000'000'000, received, 10s), received) << "eleven seconds ago";
  for (const std::int64_t none : {std::int64_t{0}, std::int64_t{-5}, std::numeric_limits<std::int64_t>::min(),
                                  std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_EQ(clock.to_server(none, received, 10s), received) << none;
    peer.hello_sent_ns = none;
    EXPECT_EQ(ClientClock::of(peer).server_minus_client, 0s) << none;
  }
}

TEST(ClientFrame, X5_keeps_what_the_model_looks_at_and_nothing_else) {
  test::HandScript script;
  v1::TrackingFrame frame = test::since(script.closed({0, 0, 0.1}, 0.5, 0.7), 3);
  for (int i = 0; i < 50; ++i) frame = test::with_second_hand(frame, script.closed({0, 0, 0.1}));
  frame.mutable_hands(0)->mutable_fingertip_covariances()->Resize(30, 1.0F);
  frame.add_devices()->set_device(std::string(10'000, 'x'));
  frame.add_cameras();
  frame.add_fingertip_colours(1);
  frame.set_end_of_recording(true);
  frame.mutable_head()->set_reprojection_rms_px(std::numeric_limits<double>::infinity());
  frame.mutable_space_mouse()->mutable_translation()->set_x(0.5);
  const ClientClock clock{100s};
  const TimePoint received = from_ns(frame.capture_time_ns()) + 101s;
  const auto read = read_client_frame(frame, clock, received);
  ASSERT_TRUE(read.ok()) << read.error().describe();
  EXPECT_EQ(read->capture_time_ns(), frame.capture_time_ns() + 100'000'000'000);
  ASSERT_EQ(read->hands_size(), 2);
  EXPECT_EQ(read->capture_time_ns() - read->hands(0).gesture_since_ns(),
            frame.capture_time_ns() - frame.hands(0).gesture_since_ns());
  EXPECT_EQ(read->hands(0).potentiometer(), 0.7);
  EXPECT_EQ(read->hands(0).fingertip_positions_size(), 15);
  EXPECT_TRUE(read->hands(0).fingertip_covariances().empty());
  EXPECT_TRUE(read->devices().empty() && read->cameras().empty() && read->fingertip_colours().empty());
  EXPECT_FALSE(read->end_of_recording());
  EXPECT_EQ(read->head().state(), v1::TRACKING_LOST);
  EXPECT_EQ(read->space_mouse().translation().x(), 0.5);
  EXPECT_LT(read->ByteSizeLong(), 2000U);
}

TEST(ClientFrame, X5_names_the_field_that_cannot_be_used) {
  test::HandScript script;
  const auto field_of = [&](const v1::TrackingFrame& frame) {
    const auto read = read_client_frame(frame, {}, from_ns(frame.capture_time_ns()));
    return read ? std::string() : read.error().field;
  };
  v1::TrackingFrame frame = test::with_second_hand(script.resting(), script.resting());
  EXPECT_EQ(field_of(frame), "") << "negative control";
  frame.mutable_hands(1)->set_potentiometer(2.0);
  EXPECT_EQ(field_of(frame), "tracking.hands[1].potentiometer");
  frame = script.resting();
  frame.mutable_hands(0)->set_fingertip_positions(4, std::numeric_limits<double>::infinity());
  EXPECT_EQ(field_of(frame), "tracking.hands[0].fingertip_positions[4]");
  frame = script.resting();
  frame.mutable_hands(0)->add_fingertip_velocities(1.0F);
  EXPECT_EQ(field_of(frame), "tracking.hands[0].fingertip_velocities");
}

}  // namespace
}  // namespace handloft::session
