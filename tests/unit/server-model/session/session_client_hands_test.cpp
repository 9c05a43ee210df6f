// Hands that come with a client (V6), several at once on one model (U1), and who may bring them (U2).

#include "tests/unit/server-model/session/peers_fixture.h"

namespace handloft::session {
namespace {

TEST_F(PeersTest, V6_two_clients_lay_points_into_two_shapes_at_once) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  const auto two = joined(v1::ROLE_EDITOR, "Bo");
  const auto viewer = joined(v1::ROLE_VIEWER, "Cy");
  for (int i = 0; i < 12; ++i) {
    show(one, script_.laying({0.004 * i, 0.0, 0.1}));
    show(two, script_.laying({0.004 * i, 0.3, 0.1}));
  }
  // Both are streamed while they are in the air, each by whom.
  EXPECT_TRUE(seen(viewer, "shape-1").provisional());
  EXPECT_EQ(seen(viewer, "shape-1").provisional_by(), one->id());
  EXPECT_EQ(seen(viewer, "shape-2").provisional_by(), two->id());
  EXPECT_EQ(seen(viewer, "shape-2").points().total(), 12U);
  show(one, script_.resting({0, 0, 0.5}));
  show(two, script_.resting({0, 0, 0.5}));
  const ActorState state = settled();
  EXPECT_EQ(points_of(state, "shape-1"), 12U);
  EXPECT_EQ(points_of(state, "shape-2"), 12U);
  EXPECT_EQ(state.interaction.strokes_committed, 2U);
  EXPECT_EQ(state.client_frames.frames, 26U);
  EXPECT_FALSE(seen(viewer, "shape-1").provisional());
  EXPECT_EQ(seen(viewer, "shape-1").provisional_by(), 0U);
  // What each has active is shown to all.
  EXPECT_TRUE(seen(viewer, "shape-1").selected());
  EXPECT_TRUE(seen(viewer, "shape-2").selected());
}

TEST_F(PeersTest, A25_each_client_has_a_workbench_of_its_own) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  const auto two = joined(v1::ROLE_EDITOR, "Bo");
  command(one, "next_page");
  command(one, "symmetry");
  command(two, "trim_mode");
  auto told = presence(two);
  EXPECT_EQ(told.at({one->id(), "Ada"}).palette_page(), 2U);
  EXPECT_TRUE(told.at({one->id(), "Ada"}).symmetry());
  EXPECT_EQ(told.at({one->id(), "Ada"}).mode(), "profile");
  EXPECT_EQ(told.at({two->id(), "Bo"}).palette_page(), 1U);
  EXPECT_FALSE(told.at({two->id(), "Bo"}).symmetry());
  EXPECT_EQ(told.at({two->id(), "Bo"}).mode(), "boundary");
  EXPECT_EQ(told.at({two->id(), "Bo"}).tool(), "pointing draws boundaries");
}

TEST_F(PeersTest, V7_presence_of_a_clients_hand_goes_to_everybody_and_to_itself) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  const auto viewer = joined(v1::ROLE_VIEWER, "Cy");
  v1::TrackingFrame frame = script_.laying({0.1, 0.0, 0.1});
  frame = test::with_second_hand(frame, script_.closed({-0.2, 0.0, 0.2}, 0.5, 0.25));
  frame.mutable_head()->set_state(v1::TRACKING_TRACKED);
  frame.mutable_head()->mutable_world_from_head()->mutable_position()->set_z(0.6);
  show(one, frame);
  for (const auto& who : {one, viewer}) {
    auto told = presence(who);
    const v1::Presence& first = told.at({one->id(), "Ada"});
    EXPECT_EQ(first.tool(), "laying points");
    EXPECT_EQ(first.entity(), "shape-1");
    EXPECT_EQ(first.hand().gesture(), v1::GESTURE_OPEN);
    EXPECT_EQ(first.head().world_from_head().position().z(), 0.6);
    EXPECT_EQ(first.capture_time_ns(), to_ns(clock_.now()));
    const v1::Presence& second = told.at({one->id(), "Ada (2)"});
    EXPECT_TRUE(second.has_disk());
    EXPECT_EQ(second.range(), 0.25);
  }
  // A client whose hands the server tells of does not tell of itself as well.
  v1::Envelope own;
  own.mutable_presence()->set_tool("dancing");
  ASSERT_TRUE(say(one, own).ok());
  EXPECT_EQ(presence(viewer).at({one->id(), "Ada"}).tool(), "laying points");
  // One without hands does: as ever.
  ASSERT_TRUE(say(viewer, own).ok());
  EXPECT_EQ(presence(one).at({viewer->id(), "Cy"}).tool(), "dancing");
}

TEST_F(PeersTest, U1_a_client_that_leaves_in_mid_stroke_loses_nothing_and_is_gone) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  const auto viewer = joined(v1::ROLE_VIEWER, "Cy");
  for (int i = 0; i < 8; ++i) show(one, script_.laying({0.004 * i, 0.0, 0.1}));
  leave(one);
  const ActorState state = settled();
  EXPECT_EQ(points_of(state, "shape-1"), 8U) << "committed: nobody saw the hand leave it";
  EXPECT_EQ(state.sequence, 1U);
  EXPECT_EQ(state.interaction.strokes_committed, 1U) << "still counted";
  EXPECT_FALSE(seen(viewer, "shape-1").provisional());
  EXPECT_FALSE(seen(viewer, "shape-1").selected());
  EXPECT_TRUE(presence(viewer).at({one->id(), "Ada"}).gone());
  EXPECT_TRUE(presence(viewer).at({one->id(), "Ada (2)"}).gone());
}

TEST_F(PeersTest, U1_one_pushes_while_the_other_draws_on_the_same_shape) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  const auto two = joined(v1::ROLE_EDITOR, "Bo");
  for (int i = 0; i < 25; ++i) show(one, script_.laying({0.01 * (i % 5), 0.01 * (i / 5), 0.1}));
  show(one, script_.resting({0, 0, 0.5}));
  EXPECT_FALSE(ack(one, command(one, "fit")).has_failure());
  EXPECT_FALSE(ack(one, command(one, "both")).has_failure());
  EXPECT_FALSE(ack(two, command(two, "select_next")).has_failure());
  const model::DualPtr before = settled().document.find_dual("shape-1");
  ASSERT_EQ(before->points.size(), 25U);
  // Bo's fist comes down through the points while Ada lays five more beside.
  for (int i = 0; i < 5; ++i) {
    show(two, script_.closed({0.02, 0.02, 0.13 - 0.01 * i}, 1.0, 0.0));
    show(one, script_.laying({0.01 * i, 0.06, 0.1}));
  }
  EXPECT_EQ(seen(two, "shape-1").points().total(), 30U) << "both are seen: points on top of the push";
  show(two, script_.resting({0.02, 0.02, 0.5}));
  show(one, script_.laying({0.05, 0.06, 0.1}));
  show(one, script_.resting({0, 0, 0.5}));
  const ActorState state = settled();
  EXPECT_EQ(state.interaction.gestures_committed, 3U);
  EXPECT_EQ(state.interaction.gestures_cancelled, 0U);
  const model::DualPtr after = state.document.find_dual("shape-1");
  ASSERT_EQ(after->points.size(), 31U) << "neither is lost";
  double pushed = 0;
  for (std::size_t i = 0; i < 25; ++i) pushed = std::max(pushed, before->points[i].z - after->points[i].z);
  EXPECT_GT(pushed, 0.005);
}

TEST_F(PeersTest, D19_an_icon_that_one_drives_is_not_taken_by_another) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  const auto two = joined(v1::ROLE_EDITOR, "Bo");
  EXPECT_FALSE(ack(one, command(one, "new_shape")).has_failure());
  v1::Envelope envelope;
  v1::Operation& sheet = *envelope.mutable_submit()->mutable_operation();
  sheet.mutable_create_sculpt_surface()->set_id("sheet");
  sheet.mutable_create_sculpt_surface()->mutable_rectangle()->set_width_m(0.2);
  sheet.mutable_create_sculpt_surface()->mutable_rectangle()->set_depth_m(0.2);
  ASSERT_TRUE(say(one, envelope).ok());
  v1::Operation& icon = *envelope.mutable_submit()->mutable_operation();
  icon.mutable_add_icon()->set_entity("sheet");
  icon.mutable_add_icon()->set_shape(v1::ICON_POINT);
  icon.mutable_add_icon()->set_role(v1::ICON_CONSTRAINT);
  icon.mutable_add_icon()->add_sensors("hand");
  icon.mutable_add_icon()->add_places();
  ASSERT_TRUE(say(one, envelope).ok());
  for (int i = 0; i < 6; ++i) {
    show(one, script_.closed({0, 0, 0.01 * i}, 0.5, 1.0));
    show(two, script_.closed({0, 0, 0.01 * i}, 0.5, 1.0));
  }
  ASSERT_EQ(seen(two, "sheet").icons_size(), 1);
  EXPECT_TRUE(seen(two, "sheet").icons(0).held());
  EXPECT_EQ(seen(two, "sheet").provisional_by(), one->id());
  show(one, script_.resting({0, 0, 0.5}));
  // Let go of, the other may have it.
  show(two, script_.resting({0, 0, 0.05}));
  for (int i = 0; i < 6; ++i) show(two, script_.closed({0, 0, 0.05 + 0.01 * i}, 0.5, 1.0));
  EXPECT_EQ(seen(one, "sheet").provisional_by(), two->id());
}

TEST_F(PeersTest, A25_commands_by_name_are_answered) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  EXPECT_EQ(ack(one, command(one, "fit")).failure().code(), "not_found") << "there is no shape yet";
  for (int i = 0; i < 25; ++i) show(one, script_.laying({0.01 * (i % 5), 0.01 * (i / 5), 0.1}));
  show(one, script_.resting({0, 0, 0.5}));
  const v1::Ack fitted = ack(one, command(one, "fit"));
  EXPECT_FALSE(fitted.has_failure()) << fitted.failure().message();
  EXPECT_EQ(fitted.sequence(), 2U);
  EXPECT_THAT(fitted.entities(), ::testing::ElementsAre("shape-1"));
  EXPECT_EQ(presence(one).at({one->id(), "Ada"}).tool(), "fit");
  EXPECT_EQ(presence(one).at({one->id(), "Ada"}).entity(), "shape-1");
  // One that needs the potentiometer when it is touched: a step of it.
  EXPECT_EQ(ack(one, command(one, "exponent")).sequence(), 3U);
  EXPECT_EQ(settled().document.find_dual("shape-1")->superellipse_exponent, 3.0);
  // Modes change no document; undo does.
  EXPECT_EQ(ack(one, command(one, "move")).sequence(), 0U);
  EXPECT_EQ(ack(one, command(one, "undo", 1)).sequence(), 4U);
  EXPECT_EQ(settled().document.find_dual("shape-1")->superellipse_exponent, 2.0);
  const v1::Ack unknown = ack(one, command(one, "fitt"));
  EXPECT_EQ(unknown.failure().code(), "invalid_argument");
  EXPECT_EQ(unknown.failure().field(), "hand_command.command");
  EXPECT_THAT(unknown.failure().message(), HasSubstr("fitt"));
  EXPECT_EQ(ack(one, command(one, "fit", 2)).failure().field(), "hand_command.hand");
  EXPECT_EQ(ack(one, command(one, "fit", 0xFFFFFFFF)).failure().code(), "invalid_argument");
}

TEST_F(PeersTest, A26_an_export_by_name_is_answered_when_it_is_written_and_told) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  const auto two = joined(v1::ROLE_EDITOR, "Bo");
  command(two, "move");
  EXPECT_EQ(ack(one, command(one, "export_file")).failure().code(), "failed_precondition");
  EXPECT_THAT(presence(one).at({one->id(), "Ada"}).tool(), HasSubstr("export refused"));
  for (int i = 0; i < 25; ++i) show(one, script_.laying({0.01 * (i % 5), 0.01 * (i / 5), 0.1}));
  show(one, script_.resting({0, 0, 0.5}));
  EXPECT_FALSE(ack(one, command(one, "fit")).has_failure());
  const v1::Ack written = ack(one, command(one, "export_file"));
  EXPECT_FALSE(written.has_failure());
  ASSERT_GE(written.notes_size(), 1);
  EXPECT_EQ(written.notes(0), "exported main-1.step");
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "main-1.step"));
  EXPECT_EQ(presence(one).at({one->id(), "Ada"}).tool(), "exported main-1.step");
  EXPECT_EQ(presence(one).at({two->id(), "Bo"}).tool(), "move") << "whose export it is not";
}

TEST_F(PeersTest, A25_frames_commands_and_submits_of_one_client_are_done_in_their_order) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  for (int i = 0; i < 6; ++i) show(one, script_.laying({0.01 * i, 0.0, 0.1}));
  show(one, script_.resting({0, 0, 0.5}));
  command(one, "new_shape");
  for (int i = 0; i < 6; ++i) show(one, script_.laying({0.01 * i, 0.1, 0.1}));
  show(one, script_.resting({0, 0, 0.5}));
  command(one, "undo");
  const ActorState state = settled();
  EXPECT_EQ(points_of(state, "shape-1"), 6U);
  EXPECT_EQ(state.document.find_dual("shape-2"), nullptr);
  EXPECT_EQ(state.sequence, 3U);
}

TEST_F(PeersTest, U2_viewers_and_who_has_not_joined_bring_no_hands) {
  const auto viewer = joined(v1::ROLE_VIEWER, "Cy");
  const auto early = connect(v1::ROLE_EDITOR, "Di");
  for (const auto& who : {viewer, early}) {
    for (int i = 0; i < 5; ++i) show(who, script_.laying({0.01 * i, 0, 0.1}));
  }
  ASSERT_EQ(failures(viewer).size(), 1U) << "one word, not one a frame";
  EXPECT_EQ(failures(viewer)[0].code(), "permission_denied");
  EXPECT_THAT(failures(viewer)[0].message(), HasSubstr("viewer"));
  EXPECT_FALSE(failures(viewer)[0].closing());
  ASSERT_EQ(failures(early).size(), 1U);
  EXPECT_EQ(failures(early)[0].code(), "failed_precondition");
  EXPECT_EQ(ack(viewer, command(viewer, "undo")).failure().code(), "permission_denied");
  EXPECT_EQ(ack(early, command(early, "undo")).failure().code(), "failed_precondition");
  clock_.advance(std::chrono::seconds(2));
  show(viewer, script_.laying({0, 0, 0.1}));
  EXPECT_EQ(failures(viewer).size(), 2U);
  const ActorState state = settled();
  EXPECT_EQ(state.sequence, 0U);
  EXPECT_EQ(state.client_frames.frames, 0U);
  EXPECT_TRUE(presence(viewer).empty());
}

TEST_F(PeersTest, X5_frames_that_cannot_be_used_harm_only_their_sender) {
  const auto bad = joined(v1::ROLE_EDITOR, "Eve");
  const auto good = joined(v1::ROLE_EDITOR, "Ada");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 10; ++i) {
    v1::TrackingFrame frame = script_.laying({0.01 * i, 0.3, 0.1});
    frame.mutable_hands(0)->set_pressure(nan);
    show(bad, frame);
    v1::TrackingFrame huge = script_.laying({0, 0.3, 0.1});
    huge.mutable_hands(0)->mutable_fingertip_positions()->Resize(100'000, 1.0);
    show(bad, huge);
    v1::TrackingFrame mouse = script_.resting();
    mouse.mutable_space_mouse()->mutable_rotation()->set_y(nan);
    show(bad, mouse);
    show(good, script_.laying({0.01 * i, 0, 0.1}));
  }
  show(good, script_.resting({0, 0, 0.5}));
  ASSERT_FALSE(failures(bad).empty());
  EXPECT_EQ(failures(bad)[0].field(), "tracking.hands[0].pressure");
  EXPECT_EQ(failures(bad)[0].code(), "invalid_argument");
  EXPECT_LE(failures(bad).size(), 2U);
  EXPECT_TRUE(failures(good).empty());
  const ActorState state = settled();
  EXPECT_EQ(points_of(state, "shape-1"), 10U);
  EXPECT_EQ(state.document.entities.size(), 1U);
  EXPECT_EQ(state.client_frames.frames, 11U);
  EXPECT_FALSE(bad->closed());
}

TEST_F(PeersTest, X5_a_clients_end_of_recording_ends_nothing_for_the_others) {
  bool ended = false;
  peers_->actor().stop();
  peers_ = Peers::start(model::Model(), {}, clock_, Logger("test", LogLevel::off), [&] { ended = true; });
  events_ = peers_->events(net::Endpoint::Kind::unix_socket);
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  v1::TrackingFrame frame = script_.laying({0, 0, 0.1});
  frame.set_end_of_recording(true);
  show(one, frame);
  (void)settled();
  EXPECT_FALSE(ended);
  frame.set_capture_time_ns(to_ns(clock_.now()));
  peers_->actor().push_frame(frame);
  (void)settled();
  EXPECT_TRUE(ended) << "negative control: the server's own tracking ends it";
}

TEST_F(PeersTest, X5_a_message_that_is_not_for_the_model_closes_its_sender) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  v1::Envelope envelope;
  envelope.mutable_glove_feedback();
  const Status status = say(one, envelope);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("glove_feedback"));
}

TEST_F(PeersTest, T4_a_clients_hand_has_a_clock_that_only_goes_on) {
  const auto one = joined(v1::ROLE_EDITOR, "Ada");
  show(one, script_.laying({0, 0, 0.1}));
  const TimePoint first = clock_.now();
  v1::TrackingFrame frame = script_.laying({0.01, 0, 0.1});
  frame.set_capture_time_ns(to_ns(first) - 1000);
  send_frame(one, frame);  // Backwards: left out.
  frame.set_capture_time_ns(to_ns(first) + 100'000'000'000);
  send_frame(one, frame);  // From the future: now.
  frame.set_capture_time_ns(std::numeric_limits<std::int64_t>::min());
  send_frame(one, frame);
  frame.set_capture_time_ns(std::numeric_limits<std::int64_t>::max());
  send_frame(one, frame);
  show(one, script_.resting({0, 0, 0.5}));
  const ActorState state = settled();
  EXPECT_EQ(state.interaction.frames_out_of_order, 1U);
  EXPECT_EQ(points_of(state, "shape-1"), 4U);
}

}  // namespace
}  // namespace handloft::session
