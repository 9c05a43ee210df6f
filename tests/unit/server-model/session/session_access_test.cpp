// What peers may do by their roles, seen from the session (U2, A3): refusals, whose a comment is, a role that
// changes and a user who is revoked while they are there.

#include "server-model/access/access_file.h"
#include "tests/unit/server-model/session/peers_fixture.h"

namespace handloft::session {
namespace {

constexpr std::uint32_t our_uid = 1000, ann_uid = 1001, bob_uid = 1002, eve_uid = 1003;
constexpr access::Seconds now_s = 1'800'000'000;

class SessionAccessTest : public PeersTest {
 protected:
  void SetUp() override {
    access::GateOptions options;
    options.own_uid = our_uid;
    options.login_of = [](std::uint32_t uid) {
      return std::string(uid == our_uid ? "me" : uid == ann_uid ? "ann" : uid == bob_uid ? "bob" : "eve");
    };
    options.now_ns = [] { return now_s * 1'000'000'000; };
    auto gate = access::Gate::open(path(), options, Logger("test", LogLevel::off));
    ASSERT_TRUE(gate.ok());
    gate_ = *gate;
    give("ann", v1::ROLE_COMMENTER);
    give("bob", v1::ROLE_COMMENTER);
    ServerOptions server;
    server.gate = gate_;
    start(std::move(server));
  }
  std::filesystem::path path() const { return access_folder_.path() / "server.sqlite"; }
  access::AccessFile command() const {
    return *access::AccessFile::open(path(), access::AccessFile::Mode::existing, now_s);
  }
  void give(const std::string& user, v1::Role role) {
    ASSERT_TRUE(command().set_role(user, "*", role, now_s).ok());
    gate_->poll();
  }
  /// Connected, and in no model; null: not let in.
  ConnectionPtr let_in(std::uint32_t uid, v1::Role role) {
    net::PeerInfo info;
    info.role = role;
    info.name = "client";
    info.protocol_minor = net::protocol_minor;
    info.uid = uid;
    const auto connection = std::make_shared<test::FakeConnection>(++last_id_, info);
    return events_.on_join(connection).ok() ? connection : nullptr;
  }
  ConnectionPtr come(std::uint32_t uid, v1::Role role) {
    const auto connection = let_in(uid, role);
    if (!connection) return nullptr;
    v1::Envelope envelope;
    envelope.mutable_join();
    const Status joined = say(connection, envelope);
    (void)settled();
    return joined.ok() ? connection : nullptr;
  }
  /// What is written of `user` but for their roles: "join main".
  std::vector<std::string> written_of(const std::string& user) const {
    gate_->flush();
    const auto entries = command().audit(100);
    EXPECT_TRUE(entries.ok());
    std::vector<std::string> written;
    if (!entries) return written;
    for (const auto& entry : *entries) {
      if (entry.event.user == user && entry.kind != "role")
        written.push_back(entry.kind + " " + entry.event.model);
    }
    return written;
  }
  std::string outcome(const ConnectionPtr& connection, const v1::Operation& operation) {
    return ack(connection, submit(connection, operation)).failure().code();
  }
  static v1::Operation comment(const std::string& id) {
    v1::Operation operation;
    operation.mutable_add_comment()->set_id(id);
    operation.mutable_add_comment()->set_text("too thin");
    operation.mutable_add_comment()->mutable_place()->set_x(0.1);
    return operation;
  }

  test::TemporaryDirectory access_folder_;
  std::shared_ptr<access::Gate> gate_;
};

TEST_F(SessionAccessTest, NobodyComesAsMoreThanTheyAre) {
  EXPECT_EQ(come(eve_uid, v1::ROLE_VIEWER), nullptr);
  EXPECT_EQ(come(ann_uid, v1::ROLE_EDITOR), nullptr);
  EXPECT_NE(come(ann_uid, v1::ROLE_COMMENTER), nullptr);
  EXPECT_NE(come(ann_uid, v1::ROLE_VIEWER), nullptr);
  EXPECT_NE(come(our_uid, v1::ROLE_OWNER), nullptr);
}

TEST_F(SessionAccessTest, ACommenterCommentsAndShapesNothing) {
  const auto ann = come(ann_uid, v1::ROLE_COMMENTER);
  ASSERT_NE(ann, nullptr);
  v1::Operation shape;
  shape.mutable_create_dual_shape();
  EXPECT_EQ(outcome(ann, shape), "permission_denied");
  EXPECT_EQ(outcome(ann, comment("c1")), "");
  v1::Operation undo;
  undo.mutable_undo();
  EXPECT_EQ(outcome(ann, undo), "permission_denied");
  const auto viewer = come(ann_uid, v1::ROLE_VIEWER);
  EXPECT_EQ(outcome(viewer, comment("c2")), "permission_denied") << "no more than it asked for";
}

// What to ask the owner for: not less than what the operation needs.
TEST_F(SessionAccessTest, ARefusalNamesTheRoleThatTheOperationNeeds) {
  const auto viewer = come(ann_uid, v1::ROLE_VIEWER), editor = come(our_uid, v1::ROLE_EDITOR);
  const auto refusal = [this](const ConnectionPtr& of, const v1::Operation& operation) {
    const v1::Failure failure = ack(of, submit(of, operation)).failure();
    return failure.code() + ", " + failure.field() + ": " + failure.message();
  };
  v1::Operation rename, version;
  rename.mutable_rename()->set_entity("top");
  version.mutable_delete_version()->set_name("first");
  const std::string code = "permission_denied, role: ";
  EXPECT_EQ(refusal(viewer, rename), code + "viewer may not do rename, expected editor");
  EXPECT_EQ(refusal(viewer, comment("c1")), code + "viewer may not do add_comment, expected commenter");
  EXPECT_EQ(refusal(viewer, version), code + "viewer may not do delete_version, expected owner");
  EXPECT_EQ(refusal(editor, version), code + "editor may not do delete_version, expected owner");
  EXPECT_EQ(refusal(viewer, v1::Operation()), code + "viewer may not send submit, expected commenter");
}

TEST_F(SessionAccessTest, ACommentIsItsAuthorsByName) {
  const auto ann = come(ann_uid, v1::ROLE_COMMENTER), bob = come(bob_uid, v1::ROLE_COMMENTER);
  ASSERT_EQ(outcome(ann, comment("c1")), "");
  v1::Operation change, remove;
  change.mutable_change_comment()->set_id("c1");
  change.mutable_change_comment()->set_text("too thick");
  remove.mutable_delete_comment()->set_id("c1");
  EXPECT_EQ(outcome(bob, change), "permission_denied");
  EXPECT_EQ(outcome(bob, remove), "permission_denied");
  const auto again = come(ann_uid, v1::ROLE_COMMENTER);  // Another connection of the same user.
  EXPECT_EQ(outcome(again, change), "");
  const auto editor = come(our_uid, v1::ROLE_EDITOR), owner = come(our_uid, v1::ROLE_OWNER);
  EXPECT_EQ(outcome(editor, remove), "permission_denied");
  EXPECT_EQ(outcome(owner, change), "permission_denied") << "nobody changes another's words";
  EXPECT_EQ(outcome(owner, remove), "");
}

TEST_F(SessionAccessTest, ARoleThatChangesIsToldAndHolds) {
  const auto ann = come(ann_uid, v1::ROLE_COMMENTER);
  v1::Operation shape;
  shape.mutable_create_dual_shape();
  ASSERT_TRUE(command().set_role("ann", "*", v1::ROLE_VIEWER, now_s).ok());
  peers_->look_at_access();
  EXPECT_EQ(outcome(ann, comment("c1")), "permission_denied");
  std::vector<v1::Role> told;
  for (const v1::Envelope& envelope : ann->sent()) {
    if (envelope.has_joined()) told.push_back(envelope.joined().role());
  }
  EXPECT_THAT(told, ::testing::ElementsAre(v1::ROLE_COMMENTER, v1::ROLE_VIEWER));
  ASSERT_TRUE(command().set_role("ann", "*", v1::ROLE_OWNER, now_s).ok());
  peers_->look_at_access();
  EXPECT_EQ(outcome(ann, comment("c1")), "");
  EXPECT_EQ(outcome(ann, shape), "permission_denied") << "it asked for no more than to comment";
}

TEST_F(SessionAccessTest, H3_WhatWasDoneIsAnsweredSoWhenItsAuthorMayNoMore) {
  const auto bob = come(bob_uid, v1::ROLE_COMMENTER);
  v1::Operation done = comment("c1"), late = comment("c2");
  done.set_client_op_id(7);
  late.set_client_op_id(8);
  const v1::Ack first = ack(bob, submit(bob, done));
  ASSERT_FALSE(first.has_failure()) << first.failure().message();
  ASSERT_TRUE(command().set_role("bob", "*", v1::ROLE_VIEWER, now_s).ok());
  peers_->look_at_access();
  const v1::Ack again = ack(bob, submit(bob, done));
  EXPECT_FALSE(again.has_failure()) << again.failure().message();
  EXPECT_EQ(again.sequence(), first.sequence());
  EXPECT_EQ(outcome(bob, late), "permission_denied");
  const auto other = come(bob_uid, v1::ROLE_VIEWER);
  EXPECT_EQ(outcome(other, done), "permission_denied") << "another client's number 7";
}

TEST_F(SessionAccessTest, WhoIsRevokedIsClosed) {
  const auto ann = come(ann_uid, v1::ROLE_COMMENTER), bob = come(bob_uid, v1::ROLE_COMMENTER),
             me = come(our_uid, v1::ROLE_EDITOR);
  ASSERT_TRUE(command().revoke_user("ann", now_s).ok());
  peers_->look_at_access();
  EXPECT_TRUE(ann->closed());
  EXPECT_FALSE(bob->closed());
  EXPECT_FALSE(me->closed());
  EXPECT_EQ(come(ann_uid, v1::ROLE_VIEWER), nullptr);
}

// U1, U2: who may shape no longer holds nothing, from the moment on that the server knows. The clock stands
// still: no lease ends by itself.
TEST_F(SessionAccessTest, LeasesOfWhoIsDemotedOrRevokedEndAtOnce) {
  for (const std::string what : {"demoted", "revoked"}) {
    give("ann", v1::ROLE_EDITOR);
    const auto ann = come(ann_uid, v1::ROLE_EDITOR), me = come(our_uid, v1::ROLE_EDITOR);
    ASSERT_NE(ann, nullptr) << what;
    v1::Operation shape, move;
    shape.mutable_create_dual_shape()->set_id(what);
    ASSERT_EQ(outcome(me, shape), "");
    move.mutable_transform()->add_entities(what);
    move.mutable_transform()->mutable_translation()->set_x(0.1);
    v1::Envelope lease;
    lease.mutable_lease()->set_request(++last_request_);
    lease.mutable_lease()->set_entity(what);
    ASSERT_TRUE(say(ann, lease).ok());
    EXPECT_EQ(ack(ann, last_request_).failure().code(), "");
    EXPECT_EQ(outcome(me, move), "failed_precondition") << "it is ann's";
    if (what == "demoted") {
      ASSERT_TRUE(command().set_role("ann", "*", v1::ROLE_VIEWER, now_s).ok());
    } else {
      ASSERT_TRUE(command().revoke_user("ann", now_s).ok());
    }
    peers_->look_at_access();
    EXPECT_EQ(outcome(me, move), "") << what;
    EXPECT_EQ(ann->closed(), what == "revoked");
    leave(ann);
    leave(me);
  }
}

// A script that works on a model and never joins it.
TEST_F(SessionAccessTest, WritesDownOnceWhoWorksWithoutJoining) {
  const auto ann = let_in(ann_uid, v1::ROLE_COMMENTER), asks_only = let_in(ann_uid, v1::ROLE_COMMENTER);
  ASSERT_TRUE(ann && asks_only);
  v1::Query models;
  models.mutable_models();
  EXPECT_EQ(ask(asks_only, models).models().models_size(), 1);
  leave(asks_only);
  EXPECT_EQ(outcome(ann, comment("c1")), "");
  EXPECT_EQ(outcome(ann, comment("c2")), "");
  leave(ann);
  EXPECT_THAT(written_of("ann"), ::testing::ElementsAre("join main", "leave main"));
}

TEST_F(SessionAccessTest, WhoHasARoleInAnotherModelOnlyIsToldOfIt) {
  ASSERT_TRUE(command().set_role("eve", "seat", v1::ROLE_VIEWER, now_s).ok());
  gate_->poll();
  const auto eve = let_in(eve_uid, v1::ROLE_VIEWER);
  ASSERT_NE(eve, nullptr);
  v1::Envelope models, history;
  models.mutable_ask()->set_request(1);
  models.mutable_ask()->mutable_query()->mutable_models();
  history.mutable_ask()->set_request(2);
  history.mutable_ask()->mutable_query()->mutable_people();
  ASSERT_TRUE(say(eve, models).ok());
  ASSERT_TRUE(say(eve, history).ok());
  (void)settled();
  std::vector<std::string> answers;
  for (const v1::Envelope& sent : eve->sent()) {
    if (sent.has_answer()) answers.push_back(sent.answer().failure().code());
  }
  EXPECT_THAT(answers, ::testing::ElementsAre("", "permission_denied"));
}

TEST_F(SessionAccessTest, IsWrittenDown) {
  const auto ann = come(ann_uid, v1::ROLE_COMMENTER);
  v1::Operation shape;
  shape.mutable_create_dual_shape();
  EXPECT_EQ(outcome(ann, shape), "permission_denied");
  EXPECT_EQ(come(ann_uid, v1::ROLE_OWNER), nullptr);
  leave(ann);
  EXPECT_THAT(written_of("ann"),
              ::testing::ElementsAre("join main", "refusal main", "refusal main", "leave main"));
}

}  // namespace
}  // namespace handloft::session
