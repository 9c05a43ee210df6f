// Other users' hands between two messages (U1): smooth, behind by a little, fading when nothing is heard.

#include "client-hmd/main/ghost_tracker.h"

#include <gtest/gtest.h>

namespace handloft::client {
namespace {

using std::chrono::milliseconds;

constexpr TimePoint start = from_ns(1'000'000'000'000);

Activity hand_at(float x, TimePoint when) {
  Activity activity;
  activity.client_id = 7;
  activity.name = "Anna";
  activity.tool = "laying points";
  activity.received_at = when;
  activity.hand.emplace();
  for (TipMark& tip : activity.hand->tips) tip = {TipState::seen, {x, 0, 0.1F}, {1.0F, 0, 0}};
  activity.hand->tips[4].state = TipState::lost;
  activity.hand->tips[3].state = TipState::predicted;
  return activity;
}

ModelState state_of(const Activity& activity) {
  ModelState state;
  state.connected = true;
  state.own_client_id = 3;
  state.activities[{activity.client_id, activity.name}] = activity;
  return state;
}

glm::vec3 colour_of(std::uint64_t client) {
  return glm::vec3(static_cast<float>(client));
}

TEST(GhostTracker, MovesEvenlyBetweenMessages_U1) {
  GhostTracker tracker;
  // A hand at 1 m/s, told 60 times a second but received with a jitter of up to 6 ms.
  float last = -1.0F;
  for (int i = 0; i < 60; ++i) {
    const TimePoint sent = start + milliseconds(1000 * i / 60);
    tracker.take(state_of(hand_at(static_cast<float>(i) / 60.0F, sent + milliseconds((i * 7) % 6))),
                 TrackedHand::somebodys);
    if (i < 10) continue;
    for (int sub = 0; sub < 2; ++sub) {  // Frames at 120 Hz.
      const TimePoint now = sent + milliseconds(6 + 8 * sub);
      const std::vector<GhostHint> ghosts = tracker.at(now, colour_of);
      ASSERT_EQ(ghosts.size(), 1U);
      const float x = ghosts[0].tips[1]->place.x;
      const auto truth = static_cast<float>(to_seconds(now - start) - 0.050);
      EXPECT_NEAR(x, truth, 0.008F) << "behind by the delay, give or take the jitter";
      EXPECT_GT(x, last - 1e-4F) << "never backwards";
      last = x;
    }
  }
  EXPECT_EQ(tracker.at(start + milliseconds(1000), colour_of)[0].colour, glm::vec3(7.0F));
}

TEST(GhostTracker, TellsWhatIsSureAndWhatIsNot_T6) {
  GhostTracker tracker;
  tracker.take(state_of(hand_at(0.1F, start)), TrackedHand::somebodys);
  tracker.take(state_of(hand_at(0.1F, start + milliseconds(60))), TrackedHand::somebodys);
  const GhostHint ghost = tracker.at(start + milliseconds(60), colour_of).at(0);
  EXPECT_FLOAT_EQ(ghost.tips[0]->certainty, 1.0F);
  EXPECT_LT(ghost.tips[3]->certainty, 1.0F);
  EXPECT_FALSE(ghost.tips[4]);
  EXPECT_EQ(ghost.name, "Anna");
  EXPECT_EQ(ghost.doing, "laying points");
}

TEST(GhostTracker, FadesWhenNothingIsHeardAndEndsWithItsOwner_U1) {
  GhostTracker tracker;
  const ModelState state = state_of(hand_at(0.1F, start));
  tracker.take(state, TrackedHand::somebodys);
  const auto opacity = [&](int ms) {
    const std::vector<GhostHint> ghosts = tracker.at(start + milliseconds(ms), colour_of);
    return ghosts.empty() ? 0.0F : ghosts[0].opacity;
  };
  EXPECT_FLOAT_EQ(opacity(100), 1.0F);
  EXPECT_FLOAT_EQ(opacity(1000), 1.0F);
  EXPECT_NEAR(opacity(1200), 0.5F, 0.01F);
  EXPECT_FLOAT_EQ(opacity(1500), 0.0F);
  EXPECT_TRUE(tracker.at(start + milliseconds(900), colour_of).at(0).tips[0]) << "it waits where it was";

  tracker.take(ModelState{}, TrackedHand::somebodys);
  EXPECT_TRUE(tracker.at(start + milliseconds(1), colour_of).empty()) << "gone at once";
}

TEST(GhostTracker, OurOwnHandIsNoGhost_U1) {
  Activity ours = hand_at(0.1F, start);
  ours.client_id = 3;
  GhostTracker tracker;
  tracker.take(state_of(ours), TrackedHand::somebodys);
  EXPECT_TRUE(tracker.at(start, colour_of).empty());

  Activity tracked = hand_at(0.1F, start);
  tracked.client_id = 0;
  tracker.take(state_of(tracked), TrackedHand::ours);
  EXPECT_TRUE(tracker.at(start, colour_of).empty());
  tracker.take(state_of(tracked), TrackedHand::somebodys);
  EXPECT_EQ(tracker.at(start, colour_of).size(), 1U) << "who only looks sees the tracked hand as a ghost";
  tracker.take(state_of(tracked), TrackedHand::ours);
  EXPECT_TRUE(tracker.at(start, colour_of).empty()) << "until tracking is joined";
}

TEST(GhostTracker, AbsurdSpeedsThrowNobodyAcrossTheRoom) {
  Activity wild = hand_at(0.1F, start);
  for (TipMark& tip : wild.hand->tips) tip.velocity = {900.0F, 0, 0};
  GhostTracker tracker;
  tracker.take(state_of(wild), TrackedHand::somebodys);
  const GhostHint ghost = tracker.at(start + milliseconds(500), colour_of).at(0);
  EXPECT_LT(ghost.tips[0]->place.x, 0.1F + 0.5F);
}

TEST(GhostTracker, AHeadTurnsTheShortWay) {
  GhostTracker tracker;
  Activity activity = hand_at(0.0F, start);
  activity.head = HeadMark{{0, 0, 0.4F}, {1, 0, 0, 0}, {}, {}};
  tracker.take(state_of(activity), TrackedHand::somebodys);
  activity.received_at = start + milliseconds(20);
  // A half turn less a little about z, the quaternion's sign reversed.
  activity.head->orientation = {-0.70710678F, 0, 0, -0.70710678F};
  tracker.take(state_of(activity), TrackedHand::somebodys);
  const GhostHint ghost = tracker.at(start + milliseconds(60), colour_of).at(0);
  ASSERT_TRUE(ghost.head);
  const glm::dvec3 ahead = ghost.head->orientation * glm::dvec3(1, 0, 0);
  EXPECT_NEAR(ahead.x, std::cos(0.785398), 1e-6);
  EXPECT_NEAR(ahead.y, std::sin(0.785398), 1e-6);
}

}  // namespace
}  // namespace handloft::client
