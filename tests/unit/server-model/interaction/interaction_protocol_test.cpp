// A25: the four states of the glove are the four modes of operation, as they stand on the wire.

#include "tests/unit/server-model/interaction/interaction_fixture.h"

namespace handloft::interaction {
namespace {

/// What the history says was done, by the kind of its operation.
class ProtocolTest : public GestureTest {
 protected:
  void SetUp() override { make_plate("plate", {0, 0, 0.1}); }
  /// Through the bytes that handloft-trackd publishes.
  FrameOutcome publish(const v1::TrackingFrame& frame) {
    v1::TrackingFrame received;
    EXPECT_TRUE(received.ParseFromString(frame.SerializeAsString()));
    return send(received);
  }
  /// The operations that a gesture of this state gives: it comes down over the plate, pressing.
  std::vector<v1::Operation> operations_of(v1::Gesture gesture) {
    std::vector<v1::Operation> operations;
    const auto keep = [&](const FrameOutcome& outcome) {
      for (const model::Submitted& submitted : outcome.submitted) operations.push_back(submitted.effective);
    };
    for (int i = 0; i <= 20; ++i) {
      const double s = i / 20.0;
      keep(publish(HandScript::with_potentiometer(
          script_.hand({0.17 * s, 0.06 * s, 0.13 * (1 - s)}, gesture, true, 0.5), 0.25)));
    }
    keep(publish(script_.resting({0.17, 0.06, 0.5})));
    return operations;
  }
};

TEST_F(ProtocolTest, A25_open_creates_closed_modifies_pointing_draws_on_table_switches) {
  const auto created = operations_of(v1::GESTURE_OPEN);
  ASSERT_EQ(created.size(), 1U);
  EXPECT_EQ(created[0].body_case(), v1::Operation::kAddPoints);
  EXPECT_EQ(created[0].add_points().points_size(), 21);
  interaction_.select("plate");

  const auto pushed = operations_of(v1::GESTURE_CLOSED);
  ASSERT_EQ(pushed.size(), 1U);
  EXPECT_EQ(pushed[0].body_case(), v1::Operation::kPushPoints);
  EXPECT_EQ(pushed[0].push_points().range(), 0.25);

  const auto drawn = operations_of(v1::GESTURE_POINTING);
  ASSERT_EQ(drawn.size(), 1U);
  EXPECT_EQ(drawn[0].body_case(), v1::Operation::kModifyProfile);

  const auto switched = operations_of(v1::GESTURE_ON_TABLE);  // ends over "Fit"
  ASSERT_EQ(switched.size(), 1U);
  EXPECT_EQ(switched[0].body_case(), v1::Operation::kFit);
}

TEST_F(ProtocolTest, A25_a_state_that_this_build_does_not_know_does_nothing) {
  const std::string before = hash();
  for (const int state : {0, 5, 77, -1}) {
    EXPECT_TRUE(operations_of(static_cast<v1::Gesture>(state)).empty()) << state;
  }
  EXPECT_EQ(hash(), before);
}

TEST_F(ProtocolTest, A25_changing_the_state_ends_one_operation_and_begins_the_next) {
  interaction_.select("plate");
  const std::size_t steps = model_.history().undo_steps();
  for (int i = 0; i <= 10; ++i) send(script_.closed({0, 0, 0.14 - 0.006 * i}, 0.3));
  EXPECT_EQ(model_.history().undo_steps(), steps);
  for (int i = 0; i <= 10; ++i) send(script_.pointing({-0.05 + 0.01 * i, 0, 0.1}));
  EXPECT_EQ(model_.history().undo_steps(), steps + 1);
  for (int i = 0; i <= 10; ++i) send(script_.laying({0.01 * i, 0, 0.1}));
  EXPECT_EQ(model_.history().undo_steps(), steps + 2);
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps + 3);
  EXPECT_EQ(interaction_.statistics().gestures_committed, 3U);
  EXPECT_EQ(interaction_.statistics().strokes_committed, 1U);
  EXPECT_TRUE(problems_.empty());
}

TEST_F(ProtocolTest, X2_the_operations_of_all_gestures_replay_to_the_same_bits) {
  std::vector<v1::Operation> operations;
  for (const v1::Gesture gesture : {v1::GESTURE_OPEN, v1::GESTURE_CLOSED, v1::GESTURE_POINTING}) {
    const auto more = operations_of(gesture);
    operations.insert(operations.end(), more.begin(), more.end());
    interaction_.select("plate");
  }
  ASSERT_EQ(operations.size(), 3U);
  model::Model replayed;
  const model::Model made = std::exchange(model_, model::Model());
  make_plate("plate", {0, 0, 0.1});
  for (const v1::Operation& operation : operations) ASSERT_TRUE(model_.submit(operation).ok());
  EXPECT_EQ(hash(), model::document_hash(made.document()));
}

TEST_F(ProtocolTest, frames_with_a_bad_number_or_out_of_order_change_no_gesture) {
  interaction_.select("plate");
  for (int i = 0; i <= 5; ++i) send(script_.closed({0, 0, 0.13 - 0.006 * i}, 0.3));
  const model::DualPtr before = preview("plate");
  v1::TrackingFrame bad = script_.closed({0, 0, 0.05});
  bad.mutable_hands(0)->set_potentiometer(std::numeric_limits<double>::quiet_NaN());
  send(bad);
  bad = script_.closed({0, 0, 0.05});
  bad.mutable_hands(0)->set_fingertip_positions(4, std::numeric_limits<double>::infinity());
  send(bad);
  v1::TrackingFrame late = script_.closed({0, 0, 0.05});
  late.set_capture_time_ns(1);
  send(late);
  EXPECT_EQ(preview("plate"), before);
  EXPECT_EQ(interaction_.statistics().frames_ignored, 2U);
  EXPECT_EQ(interaction_.statistics().frames_out_of_order, 1U);
  EXPECT_TRUE(model_.has_provisional());
}

TEST_F(ProtocolTest, both_hands_have_gestures_of_their_own) {
  make_plate("other", {0.3, 0, 0.1});
  const std::size_t steps = model_.history().undo_steps();
  for (int i = 0; i <= 10; ++i) {
    send(test::with_second_hand(script_.closed({0, 0, 0.14 - 0.006 * i}, 0.3),
                                script_.pointing({0.25 + 0.01 * i, 0, 0.11})));
  }
  EXPECT_EQ(interaction_.activity(0).entity, "plate");
  EXPECT_EQ(interaction_.activity(1).entity, "other");
  EXPECT_EQ(interaction_.targets(), (std::vector<std::string>{"other", "plate"}));
  // The second hand is lost, the first one ends its gesture.
  for (int i = 0; i < 10; ++i) send(script_.closed({0, 0, 0.08}, 0.3));
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps + 1);
  EXPECT_EQ(interaction_.statistics().gestures_cancelled, 1U);
  EXPECT_FALSE(model_.has_provisional());
}

}  // namespace
}  // namespace handloft::interaction
