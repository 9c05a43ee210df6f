// Several clients on one model (U1, U3, U4, U5): who they are when they come again, what they are told of
// what is safe and of each other, and what one may not do while another is at it.

#include <cstdlib>

#include "server-model/session/client_id.h"
#include "server-model/store/model_store.h"
#include "tests/unit/server-model/session/peers_fixture.h"

namespace handloft::session {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

constexpr std::uint64_t ann_id = first_derived_client_id + 7;

v1::Operation points(const std::string& entity, int count, double z = 0.1) {
  v1::Operation operation;
  operation.mutable_add_points()->set_entity(entity);
  operation.mutable_add_points()->mutable_create();
  for (int i = 0; i < count; ++i) {
    v1::Point& point = *operation.mutable_add_points()->add_points();
    point.mutable_position()->set_x(0.01 * (i % 10));
    point.mutable_position()->set_y(0.01 * (i / 10));
    point.mutable_position()->set_z(z);
    point.set_pressure(0.5);
  }
  return operation;
}
v1::Operation more_points(const std::string& entity, int count, double z = 0.1) {
  v1::Operation operation = points(entity, count, z);
  operation.mutable_add_points()->clear_create();
  return operation;
}
v1::Operation moved(const std::string& entity) {
  v1::Operation operation;
  operation.mutable_transform()->add_entities(entity);
  operation.mutable_transform()->mutable_translation()->set_x(0.01);
  return operation;
}
v1::Operation renamed(const std::string& entity, const std::string& name) {
  v1::Operation operation;
  operation.mutable_rename()->set_entity(entity);
  operation.mutable_rename()->set_name(name);
  return operation;
}

struct Sharing : PeersTest {
  /// On a model that is kept.
  void start_kept(ServerOptions options = {}) {
    auto opened = store::ModelStore::open(folder_.path() / "kept.handloft", {}, {});
    ASSERT_TRUE(opened.ok()) << opened.error().describe();
    options.actor.store = opened->store;
    kept_ = opened->store;
    start(std::move(options), std::move(opened->model));
  }
  /// When the disk has it.
  v1::Ack kept_ack(const ConnectionPtr& connection, std::uint64_t request) {
    (void)settled();
    kept_->flush();
    return ack(connection, request);
  }
  std::uint64_t lease(const ConnectionPtr& connection, const std::string& entity, bool release = false) {
    v1::Envelope envelope;
    envelope.mutable_lease()->set_request(++last_request_);
    envelope.mutable_lease()->set_entity(entity);
    envelope.mutable_lease()->set_release(release);
    EXPECT_TRUE(say(connection, envelope).ok());
    return last_request_;
  }
  /// What it was told last of one kind.
  template <typename Has, typename Get>
  auto last(const ConnectionPtr& connection, Has has, Get get) {
    (void)settled();
    std::decay_t<decltype(get(std::declval<const v1::Envelope&>()))> result{};
    for (const v1::Envelope& envelope : connection->sent()) {
      if (has(envelope)) result = get(envelope);
    }
    return result;
  }
  v1::HistoryState history(const ConnectionPtr& connection) {
    return last(
        connection, [](const v1::Envelope& e) { return e.has_snapshot() || e.has_delta(); },
        [](const v1::Envelope& e) {
          return e.has_snapshot() ? e.snapshot().history() : e.delta().history();
        });
  }
  v1::StorageState storage(const ConnectionPtr& connection) {
    return last(
        connection,
        [](const v1::Envelope& e) { return e.has_snapshot() || (e.has_delta() && e.delta().has_storage()); },
        [](const v1::Envelope& e) {
          return e.has_snapshot() ? e.snapshot().storage() : e.delta().storage();
        });
  }
  v1::People people(const ConnectionPtr& connection) {
    return last(
        connection, [](const v1::Envelope& e) { return e.has_people(); },
        [](const v1::Envelope& e) { return e.people(); });
  }
  v1::Joined told_joined(const ConnectionPtr& connection) {
    return last(
        connection, [](const v1::Envelope& e) { return e.has_joined(); },
        [](const v1::Envelope& e) { return e.joined(); });
  }

  std::shared_ptr<store::ModelStore> kept_;
};

// ---- who they are

TEST(ClientId, U1_is_the_same_for_the_same_user_and_key_and_below_none_that_is_counted) {
  const std::string key(32, 'k');
  const std::uint64_t id = derived_client_id("ann", key);
  EXPECT_EQ(id, derived_client_id("ann", key));
  EXPECT_NE(id, derived_client_id("bo", key));
  EXPECT_NE(id, derived_client_id("ann", std::string(32, 'l')));
  EXPECT_NE(derived_client_id("an", "n" + key), id) << "user and key are told apart";
  EXPECT_GE(id, first_derived_client_id);
  EXPECT_LT(id, std::uint64_t{1} << 53U) << "a double holds it";
}

TEST_F(Sharing, U1_a_client_that_comes_anew_closes_its_former_connection_and_keeps_its_steps) {
  const auto first = connect_as(ann_id, v1::ROLE_EDITOR, "Ann");
  join(first, {});
  const auto bo = joined(v1::ROLE_EDITOR, "Bo");
  EXPECT_FALSE(ack(first, submit(first, points("seat", 3))).has_failure());
  lease(first, "seat");
  EXPECT_EQ(seen(bo, "seat").leased_by_name(), "Ann");
  const auto second = connect_as(ann_id, v1::ROLE_EDITOR, "Ann");
  EXPECT_TRUE(first->closed());
  join(second, {});
  EXPECT_EQ(seen(bo, "seat").leased_by_name(), "") << "it ends with the connection";
  EXPECT_EQ(history(second).undo_steps(), 1U) << "hers";
  EXPECT_EQ(history(bo).undo_steps(), 0U);
  // The old connection's end, told later, harms the new one not.
  events_.on_closed(first, "at last");
  EXPECT_THAT(people(second).people(), SizeIs(2));
  v1::Operation undo;
  undo.mutable_undo();
  EXPECT_FALSE(ack(second, submit(second, undo)).has_failure());
  EXPECT_EQ(settled().document.find_dual("seat"), nullptr);
}

TEST_F(Sharing, H3_an_operation_that_is_sent_again_after_a_reconnect_applies_once) {
  start_kept();
  const int rounds = std::getenv("HANDLOFT_LONG") != nullptr ? 20'000 : 500;
  std::uint64_t expected = 0;
  auto ann = connect_as(ann_id, v1::ROLE_EDITOR, "Ann");
  v1::Operation first = points("seat", 1);
  first.set_client_op_id(1);
  (void)kept_ack(ann, submit(ann, first));
  ++expected;
  for (int i = 0; i < rounds; ++i) {
    v1::Operation operation = more_points("seat", 1, 0.001 * (i % 50));
    operation.set_client_op_id(static_cast<std::uint64_t>(i) + 2);
    const std::uint64_t lost = submit(ann, operation);
    if (i % 2 == 0) (void)settled();  // Else the retry may overtake the answer.
    (void)lost;                       // Nobody reads it: the line is cut, and the client comes anew.
    auto again = connect_as(ann_id, v1::ROLE_EDITOR, "Ann");
    const v1::Ack answer = kept_ack(again, submit(again, operation));
    ASSERT_FALSE(answer.has_failure()) << answer.failure().message();
    ASSERT_EQ(answer.sequence(), ++expected) << "round " << i;
    ASSERT_EQ(answer.level(), v1::SAVE_LEVEL_DURABLE);
    ann = std::move(again);
  }
  const ActorState state = settled();
  EXPECT_EQ(points_of(state, "seat"), static_cast<std::size_t>(rounds) + 1);
  EXPECT_EQ(state.sequence, expected);
}

TEST_F(Sharing, U1_the_server_says_who_did_what_and_when) {
  ServerOptions options;
  options.wall_ns = [] { return std::int64_t{1'800'000'000'000'000'000}; };
  start(std::move(options));
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  v1::Operation lie = points("seat", 2);
  lie.set_author("somebody else");
  lie.set_client_id(99);
  lie.set_made_ns(5);
  EXPECT_FALSE(ack(ann, submit(ann, lie)).has_failure());
  v1::Query query;
  query.mutable_history();
  const v1::HistoryResult result = ask(ann, query).history();
  ASSERT_EQ(result.steps_size(), 1);
  EXPECT_EQ(result.steps(0).client_id(), ann->id());
  EXPECT_NE(result.steps(0).author(), "somebody else");
  EXPECT_EQ(result.steps(0).made_ns(), 1'800'000'000'000'000'000);
}

// ---- what is safe

TEST_F(Sharing, U5_what_is_kept_is_told_and_the_durable_mark_follows) {
  start_kept();
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  EXPECT_TRUE(storage(ann).kept());
  for (int i = 0; i < 20; ++i) submit(ann, i == 0 ? points("seat", 1) : more_points("seat", 1));
  (void)settled();
  kept_->flush();
  EXPECT_EQ(storage(ann).durable_sequence(), 20U);
  EXPECT_EQ(storage(ann).problem(), "");
  std::uint64_t before = 0;
  std::uint64_t sequence = 0;
  for (const v1::Envelope& envelope : ann->sent()) {
    if (envelope.has_delta()) sequence = envelope.delta().sequence();
    if (!envelope.delta().has_storage()) continue;
    EXPECT_GE(envelope.delta().storage().durable_sequence(), before);
    before = envelope.delta().storage().durable_sequence();
    EXPECT_LE(before, sequence) << "not of what the viewer has not seen";
  }
}

TEST_F(Sharing, U5_an_answer_says_how_safe_the_operation_is) {
  start_kept();
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  EXPECT_EQ(ack(ann, submit(ann, points("seat", 1), v1::SAVE_LEVEL_APPLIED)).level(), v1::SAVE_LEVEL_APPLIED);
  const std::uint64_t durable = submit(ann, more_points("seat", 1), v1::SAVE_LEVEL_DURABLE);
  (void)settled();
  kept_->flush();
  EXPECT_EQ(ack(ann, durable).level(), v1::SAVE_LEVEL_DURABLE);
  const std::uint64_t usual = submit(ann, more_points("seat", 1));
  (void)settled();
  kept_->flush();
  EXPECT_EQ(ack(ann, usual).level(), v1::SAVE_LEVEL_DURABLE) << "as the server is configured";
}

TEST_F(Sharing, U5_nothing_is_called_durable_where_nothing_is_kept) {
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  EXPECT_FALSE(storage(ann).kept());
  const v1::Ack refused = ack(ann, submit(ann, points("seat", 1), v1::SAVE_LEVEL_DURABLE));
  EXPECT_EQ(refused.failure().code(), "failed_precondition");
  EXPECT_EQ(refused.failure().field(), "submit.answer_when");
  EXPECT_EQ(settled().sequence, 0U);
  EXPECT_EQ(ack(ann, submit(ann, points("seat", 1))).level(), v1::SAVE_LEVEL_APPLIED);
}

// ---- history, comments, versions

TEST_F(Sharing, U1_each_viewer_is_told_of_its_own_steps_and_why_it_cannot_undo) {
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  const auto bo = joined(v1::ROLE_EDITOR, "Bo");
  EXPECT_FALSE(ack(ann, submit(ann, points("seat", 3))).has_failure());
  EXPECT_FALSE(ack(ann, submit(ann, renamed("seat", "Seat"))).has_failure());
  EXPECT_EQ(history(ann).undo_steps(), 2U);
  EXPECT_EQ(history(ann).undo_refused(), "");
  EXPECT_EQ(history(bo).undo_steps(), 0U);
  EXPECT_FALSE(ack(bo, submit(bo, renamed("seat", "Chair"))).has_failure());
  EXPECT_EQ(history(bo).undo_steps(), 1U);
  EXPECT_NE(history(ann).undo_refused(), "") << "Bo has changed the name since";
}

TEST_F(Sharing, U6_comments_and_versions_are_in_snapshots_and_deltas) {
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  EXPECT_FALSE(ack(ann, submit(ann, points("seat", 3))).has_failure());
  v1::Operation comment;
  comment.mutable_add_comment()->set_text("too high");
  comment.mutable_add_comment()->set_entity("seat");
  EXPECT_FALSE(ack(ann, submit(ann, comment)).has_failure());
  v1::Operation version;
  version.mutable_name_version()->set_name("first");
  EXPECT_FALSE(ack(ann, submit(ann, version)).has_failure());
  const auto comments = last(
      ann, [](const v1::Envelope& e) { return e.delta().has_comments(); },
      [](const v1::Envelope& e) { return e.delta().comments(); });
  const auto versions = last(
      ann, [](const v1::Envelope& e) { return e.delta().has_versions(); },
      [](const v1::Envelope& e) { return e.delta().versions(); });
  ASSERT_EQ(comments.comments_size(), 1);
  EXPECT_EQ(comments.comments(0).text(), "too high");
  ASSERT_EQ(versions.versions_size(), 1);
  const std::size_t told = ann->sent().size();
  EXPECT_FALSE(ack(ann, submit(ann, renamed("seat", "Seat"))).has_failure());
  const auto all = ann->sent();
  for (std::size_t i = told; i < all.size(); ++i) {
    EXPECT_FALSE(all[i].delta().has_comments()) << "the same ones are not told again";
    EXPECT_FALSE(all[i].delta().has_versions());
  }
  const auto late = joined(v1::ROLE_VIEWER, "Cy");
  const auto snapshot = last(
      late, [](const v1::Envelope& e) { return e.has_snapshot(); },
      [](const v1::Envelope& e) { return e.snapshot(); });
  EXPECT_EQ(snapshot.comments().comments_size(), 1);
  EXPECT_EQ(snapshot.versions().versions_size(), 1);
}

// ---- who is there

TEST_F(Sharing, U1_everybody_is_told_who_is_there) {
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  const auto cy = joined(v1::ROLE_VIEWER, "Cy");
  ASSERT_EQ(people(ann).people_size(), 2);
  EXPECT_EQ(people(ann).people(0).name(), "Ann");
  EXPECT_EQ(people(ann).people(0).client_id(), ann->id());
  EXPECT_EQ(people(ann).people(0).role(), "editor");
  EXPECT_EQ(people(ann).people(1).role(), "viewer");
  EXPECT_GT(people(ann).people(1).joined_ns(), 0);
  v1::Query query;
  query.mutable_people();
  EXPECT_EQ(ask(cy, query).people().people_size(), 2);
  leave(ann);
  EXPECT_EQ(people(cy).people_size(), 1);
  EXPECT_EQ(told_joined(cy).role(), v1::ROLE_VIEWER);
  EXPECT_EQ(told_joined(cy).model(), "main");
  EXPECT_FALSE(told_joined(cy).resumed());
}

TEST_F(Sharing, who_speaks_an_older_protocol_is_not_sent_what_it_does_not_know) {
  net::PeerInfo info;
  info.role = v1::ROLE_VIEWER;
  info.protocol_minor = 1;
  auto old = std::make_shared<test::FakeConnection>(++last_id_, info);
  ASSERT_TRUE(events_.on_join(old).ok());
  join(old, {});
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  (void)settled();
  bool snapshot = false;
  for (const v1::Envelope& envelope : old->sent()) {
    EXPECT_FALSE(envelope.has_joined());
    EXPECT_FALSE(envelope.has_people());
    snapshot |= envelope.has_snapshot();
  }
  EXPECT_TRUE(snapshot);
}

TEST_F(Sharing, U1_presence_tells_what_is_selected) {
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  const auto bo = joined(v1::ROLE_EDITOR, "Bo");
  for (int i = 0; i < 4; ++i) show(ann, script_.laying({0.004 * i, 0.0, 0.1}));
  show(ann, script_.resting({0, 0, 0.5}));
  show(ann, script_.resting({0, 0, 0.5}));
  EXPECT_THAT(presence(bo).at({ann->id(), "Ann"}).selection(), ElementsAre("shape-1"));
  v1::Envelope own;
  for (int i = 0; i < 100; ++i) own.mutable_presence()->add_selection(std::string(1000, 'x'));
  ASSERT_TRUE(say(bo, own).ok());
  const v1::Presence told = presence(ann).at({bo->id(), "Bo"});
  EXPECT_EQ(told.selection_size(), 64);
  EXPECT_EQ(told.selection(0).size(), 256U);
}

// ---- leases

TEST_F(Sharing, U1_what_one_has_leased_another_may_name_but_not_deform) {
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  const auto bo = joined(v1::ROLE_EDITOR, "Bo");
  EXPECT_FALSE(ack(ann, submit(ann, points("seat", 3))).has_failure());
  EXPECT_FALSE(ack(ann, lease(ann, "seat")).has_failure());
  EXPECT_EQ(seen(bo, "seat").leased_by(), ann->id());
  EXPECT_EQ(seen(bo, "seat").leased_by_name(), "Ann");
  const v1::Ack refused = ack(bo, submit(bo, moved("seat")));
  EXPECT_EQ(refused.failure().code(), "failed_precondition");
  EXPECT_THAT(refused.failure().message(), HasSubstr("Ann shapes \"seat\""));
  EXPECT_FALSE(ack(bo, submit(bo, renamed("seat", "Chair"))).has_failure()) << "the last writer wins";
  EXPECT_FALSE(ack(bo, submit(bo, more_points("seat", 1))).has_failure()) << "nothing is lost by that";
  EXPECT_TRUE(ack(bo, lease(bo, "seat")).has_failure());
  EXPECT_FALSE(ack(ann, submit(ann, moved("seat"))).has_failure()) << "her own";
  EXPECT_FALSE(ack(ann, lease(ann, "seat", true)).has_failure());
  EXPECT_FALSE(ack(bo, submit(bo, moved("seat"))).has_failure());
  EXPECT_EQ(ack(bo, lease(bo, "nothing")).failure().code(), "not_found");
}

TEST_F(Sharing, U1_a_lease_that_is_not_renewed_ends_and_is_seen_to_end) {
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  const auto bo = joined(v1::ROLE_EDITOR, "Bo");
  EXPECT_FALSE(ack(ann, submit(ann, points("seat", 3))).has_failure());
  lease(ann, "seat");
  EXPECT_EQ(seen(bo, "seat").leased_by(), ann->id());
  clock_.advance(std::chrono::seconds(4));
  peers_->tick();
  EXPECT_EQ(seen(bo, "seat").leased_by(), ann->id());
  clock_.advance(std::chrono::seconds(1));
  peers_->tick();
  EXPECT_EQ(seen(bo, "seat").leased_by(), 0U);
  EXPECT_FALSE(ack(bo, submit(bo, moved("seat"))).has_failure());
}

TEST_F(Sharing, U1_a_hand_that_pushes_keeps_others_from_pushing_the_same) {
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  const auto bo = joined(v1::ROLE_EDITOR, "Bo");
  EXPECT_FALSE(ack(ann, submit(ann, points("seat", 100))).has_failure());
  for (int i = 0; i < 4; ++i) show(ann, script_.closed({0.05, 0.05, 0.13 - 0.01 * i}, 1.0, 0.0));
  EXPECT_EQ(seen(bo, "seat").leased_by(), ann->id());
  for (int i = 0; i < 4; ++i) show(bo, script_.closed({0.02, 0.02, 0.13 - 0.01 * i}, 1.0, 0.0));
  EXPECT_THAT(presence(ann).at({bo->id(), "Bo"}).tool(), HasSubstr("Ann shapes \"seat\""));
  EXPECT_TRUE(ack(bo, submit(bo, moved("seat"))).has_failure());
  show(ann, script_.resting({0.05, 0.05, 0.5}));
  show(bo, script_.resting({0.05, 0.05, 0.5}));
  EXPECT_EQ(seen(bo, "seat").leased_by(), 0U);
  EXPECT_FALSE(ack(bo, submit(bo, moved("seat"))).has_failure());
  EXPECT_EQ(settled().interaction.gestures_committed, 1U);
}

// ---- who is slow

TEST_F(Sharing, U4_who_stalls_costs_little_and_begins_anew_when_it_reads_again) {
  ServerOptions options;
  options.client_memory.scene_bytes = 10'000;
  start(std::move(options));
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  const auto slow = joined(v1::ROLE_VIEWER, "Cy");
  EXPECT_FALSE(ack(ann, submit(ann, points("seat", 1000))).has_failure());
  slow->stall();
  const std::size_t had = slow->sent().size();
  EXPECT_FALSE(ack(ann, submit(ann, renamed("seat", "Seat"))).has_failure());
  peers_->tick();
  EXPECT_FALSE(ack(ann, submit(ann, moved("seat"))).has_failure());
  peers_->tick();  // What only Cy holds is more than its share by now.
  slow->read_on();
  (void)settled();
  bool snapshot = false;
  const auto sent = slow->sent();
  for (std::size_t i = had; i < sent.size(); ++i) snapshot |= sent[i].has_snapshot();
  EXPECT_TRUE(snapshot);
  EXPECT_EQ(seen(slow, "seat").name(), "Seat");
  for (const v1::Envelope& envelope : ann->sent()) {
    EXPECT_TRUE(!envelope.has_snapshot() || envelope.snapshot().sequence() == 0)
        << "the others do not notice";
  }
  // One that stalls while little changes goes on from what it holds.
  slow->stall();
  const std::size_t before = slow->sent().size();
  EXPECT_FALSE(ack(ann, submit(ann, renamed("seat", "Chair"))).has_failure());
  peers_->tick();
  slow->read_on();
  (void)settled();
  const auto all = slow->sent();
  for (std::size_t i = before; i < all.size(); ++i) EXPECT_FALSE(all[i].has_snapshot());
  EXPECT_EQ(seen(slow, "seat").name(), "Chair");
}

TEST_F(Sharing, U4_who_leaves_its_answers_unread_is_let_go) {
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  EXPECT_EQ(events_.on_overflow(ann), net::OverflowAction::close);
}

// ---- resume

TEST_F(Sharing, C3_who_comes_again_is_sent_what_differs) {
  ServerOptions options;
  options.actor.epoch = 5;
  start(std::move(options));
  const auto ann = joined(v1::ROLE_EDITOR, "Ann");
  EXPECT_FALSE(ack(ann, submit(ann, points("seat", 2000))).has_failure());
  EXPECT_FALSE(ack(ann, submit(ann, points("back", 2000, 0.2))).has_failure());
  const v1::EntityState seat = seen(ann, "seat");
  const v1::EntityState back = seen(ann, "back");
  v1::Join join_again;
  join_again.set_epoch(told_joined(ann).epoch());
  for (const auto& state : {seat, back}) {
    v1::HeldEntity& have = *join_again.add_have();
    have.set_id(state.id());
    have.set_revision(state.revision());
    have.set_points(2000);
  }
  v1::HeldEntity& gone = *join_again.add_have();
  gone.set_id("gone-by-now");
  gone.set_revision(1);
  const auto bo = joined(v1::ROLE_EDITOR, "Bo");
  EXPECT_FALSE(ack(bo, submit(bo, renamed("back", "Rest"))).has_failure());
  const auto again = connect(v1::ROLE_VIEWER, "Ann");
  join(again, join_again);
  EXPECT_TRUE(told_joined(again).resumed());
  std::vector<std::string> order;
  for (const v1::Envelope& envelope : again->sent()) {
    EXPECT_FALSE(envelope.has_snapshot());
    if (envelope.has_joined()) order.emplace_back("joined");
    if (!envelope.has_delta()) continue;
    order.emplace_back("delta");
    for (const auto& state : envelope.delta().changed())
      EXPECT_FALSE(state.has_points()) << "a new name brings no new points: " << state.id();
    EXPECT_THAT(envelope.delta().removed(), ElementsAre("gone-by-now"));
    EXPECT_TRUE(envelope.delta().has_storage());
    EXPECT_TRUE(envelope.delta().has_comments());
  }
  EXPECT_THAT(order, ElementsAre("joined", "delta"));
  // Of another start it holds nothing that counts.
  join_again.set_epoch(join_again.epoch() + 1);
  const auto other = connect(v1::ROLE_VIEWER, "Ann");
  join(other, join_again);
  EXPECT_FALSE(told_joined(other).resumed());
  EXPECT_FALSE(seen(other, "seat").points().positions().empty());
}

}  // namespace
}  // namespace handloft::session
