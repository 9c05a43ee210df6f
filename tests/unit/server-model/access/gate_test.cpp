// The door between connections and models (U2): who is who, what they get, what is written of it.

#include "server-model/access/gate.h"

#include <gmock/gmock.h>

#include <atomic>
#include <future>

#include "common/net/pairing_code.h"
#include "server-model/access/access_file.h"
#include "tests/support/test_data.h"

namespace handloft::access {
namespace {

using Kind = net::Endpoint::Kind;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr Seconds start_s = 1'800'000'000;
constexpr std::uint32_t our_uid = 1000, root_uid = 0, guest_uid = 1001;

class GateTest : public ::testing::Test {
 protected:
  void SetUp() override { start({}); }
  void start(GateOptions options) {
    options.now_ns = [this] { return now_s_.load() * ns_per_s; };
    options.login_of = [](std::uint32_t uid) {
      return uid == our_uid    ? std::string("me")
             : uid == root_uid ? std::string("root")
                               : std::string("guest");
    };
    options.own_uid = our_uid;
    gate_.reset();
    auto gate = Gate::open(path(), options, Logger("test", LogLevel::off));
    ASSERT_TRUE(gate.ok()) << gate.error().describe();
    gate_ = *std::move(gate);
  }
  std::filesystem::path path() const { return folder_.path() / "server.sqlite"; }
  AccessFile command() const { return *AccessFile::open(path(), AccessFile::Mode::existing, now_s_); }

  static net::PeerInfo local(std::optional<std::uint32_t> uid) {
    net::PeerInfo peer;
    peer.uid = uid;
    return peer;
  }
  static net::PeerInfo device(const std::string& certificate) {
    net::PeerInfo peer;
    peer.certificate = *net::read_certificate(certificate);
    peer.address = "192.0.2.7";
    return peer;
  }
  Result<v1::Paired> pair(const std::string& code, const std::string& address = "192.0.2.7") {
    v1::Pair request;
    request.set_code(code);
    static const std::string asked = *net::make_certificate_request(*net::make_key(), "headset");
    request.set_certificate_request(asked);
    request.set_device("headset");
    std::promise<Result<v1::Paired>> promise;
    gate_->pair(request, address, [&](Result<v1::Paired> outcome) { promise.set_value(std::move(outcome)); });
    return promise.get_future().get();
  }
  std::string invited(const std::string& user, v1::Role role, const std::string& model = "*") {
    return *command().invite({user, role, model}, now_s_);
  }
  /// A paired device's certificate.
  std::string paired(const std::string& user, v1::Role role, const std::string& model = "*") {
    const auto outcome = pair(invited(user, role, model));
    EXPECT_TRUE(outcome.ok()) << (outcome.ok() ? "" : outcome.error().describe());
    return outcome.ok() ? outcome->certificate() : std::string();
  }
  std::vector<AuditEntry> audited() {
    gate_->flush();
    return *command().audit(100'000);
  }

  test::TemporaryDirectory folder_;
  std::atomic<Seconds> now_s_ = start_s;
  std::shared_ptr<Gate> gate_;
};

TEST_F(GateTest, TheServersOwnUserAndRootAreOwners) {
  for (const std::uint32_t uid : {our_uid, root_uid}) {
    const auto user = gate_->authenticate(local(uid), Kind::unix_socket);
    ASSERT_TRUE(user.ok());
    EXPECT_EQ(gate_->role_of(*user, "any"), v1::ROLE_OWNER);
    EXPECT_EQ(*gate_->enter(*user, "any", v1::ROLE_OWNER), v1::ROLE_OWNER);
    EXPECT_EQ(*gate_->enter(*user, "any", v1::ROLE_VIEWER), v1::ROLE_VIEWER) << "no more than asked for";
  }
}

TEST_F(GateTest, OtherUsersOfTheHostNeedARole) {
  EXPECT_EQ(gate_->authenticate(local(guest_uid), Kind::unix_socket).error().code,
            ErrorCode::permission_denied);
  EXPECT_EQ(gate_->authenticate(local(std::nullopt), Kind::unix_socket).error().code,
            ErrorCode::permission_denied);
  ASSERT_TRUE(command().set_role("guest", "seat", v1::ROLE_COMMENTER, now_s_).ok());
  EXPECT_TRUE(gate_->poll());
  const auto user = gate_->authenticate(local(guest_uid), Kind::unix_socket);
  ASSERT_TRUE(user.ok()) << user.error().describe();
  EXPECT_EQ(gate_->role_of(*user, "seat"), v1::ROLE_COMMENTER);
  EXPECT_EQ(gate_->role_of(*user, "other"), v1::ROLE_UNSPECIFIED);
}

TEST_F(GateTest, ADeviceIsItsUser) {
  const auto user = gate_->authenticate(device(paired("Ann", v1::ROLE_EDITOR, "seat")), Kind::tls);
  ASSERT_TRUE(user.ok()) << user.error().describe();
  EXPECT_EQ(user->name, "Ann");
  EXPECT_EQ(user->proof, Proof::certificate);
  EXPECT_TRUE(gate_->still_welcome(*user));
  EXPECT_EQ(*gate_->enter(*user, "seat", v1::ROLE_EDITOR), v1::ROLE_EDITOR);
}

TEST_F(GateTest, ARoleAboveOnesOwnIsRefusedByName) {
  const auto user = gate_->authenticate(device(paired("Ann", v1::ROLE_COMMENTER, "seat")), Kind::tls);
  const auto role = gate_->enter(*user, "seat", v1::ROLE_EDITOR);
  ASSERT_FALSE(role.ok());
  EXPECT_EQ(role.error().code, ErrorCode::permission_denied);
  EXPECT_EQ(role.error().message, "\"Ann\" is commenter of \"seat\" and cannot come as editor");
  EXPECT_EQ(gate_->enter(*user, "hood", v1::ROLE_VIEWER).error().message, "\"Ann\" has no role on \"hood\"");
  EXPECT_EQ(gate_->enter(*user, "seat", v1::ROLE_SUBSCRIBER).error().code, ErrorCode::invalid_argument);
}

TEST_F(GateTest, RolesOnAllModelsAndOnOneAddUp) {
  const auto user = gate_->authenticate(device(paired("Ann", v1::ROLE_VIEWER)), Kind::tls);
  ASSERT_TRUE(command().set_role("Ann", "seat", v1::ROLE_EDITOR, now_s_).ok());
  ASSERT_TRUE(gate_->poll());
  EXPECT_EQ(gate_->role_of(*user, "seat"), v1::ROLE_EDITOR);
  EXPECT_EQ(gate_->role_of(*user, "hood"), v1::ROLE_VIEWER);
  ASSERT_TRUE(command().set_role("Ann", "seat", v1::ROLE_UNSPECIFIED, now_s_).ok());
  ASSERT_TRUE(gate_->poll());
  EXPECT_EQ(gate_->role_of(*user, "seat"), v1::ROLE_VIEWER);
}

TEST_F(GateTest, WhoIsRevokedIsNoLongerWelcome) {
  const std::string first = paired("Ann", v1::ROLE_EDITOR), second = paired("Ann", v1::ROLE_EDITOR);
  const auto one = gate_->authenticate(device(first), Kind::tls),
             two = gate_->authenticate(device(second), Kind::tls);
  ASSERT_TRUE(one.ok() && two.ok());
  ASSERT_TRUE(command().revoke_device(one->device, now_s_).ok());
  EXPECT_TRUE(gate_->poll());
  EXPECT_FALSE(gate_->poll()) << "nothing new";
  EXPECT_FALSE(gate_->still_welcome(*one));
  EXPECT_TRUE(gate_->still_welcome(*two));
  EXPECT_THAT(gate_->authenticate(device(first), Kind::tls).error().message, HasSubstr("revoked"));
  ASSERT_TRUE(command().revoke_user("Ann", now_s_).ok());
  EXPECT_TRUE(gate_->poll());
  EXPECT_FALSE(gate_->still_welcome(*two));
  EXPECT_FALSE(gate_->authenticate(device(second), Kind::tls).ok());
}

TEST_F(GateTest, ACertificateEndsAlsoForWhoIsStillThere) {
  const auto user = gate_->authenticate(device(paired("Ann", v1::ROLE_EDITOR)), Kind::tls);
  now_s_ += 731 * 86'400;
  EXPECT_FALSE(gate_->still_welcome(*user));
}

TEST_F(GateTest, AGoodCertificateThatTheFileHasNotIsRefused) {
  const auto key = net::make_key();
  const AccessFile file = command();
  const auto certificate = file.authority().issue_client(*net::make_certificate_request(*key, "Ann"), "Ann",
                                                         {start_s - 100, start_s + 100'000});
  ASSERT_TRUE(command().set_role("Ann", "*", v1::ROLE_OWNER, now_s_).ok());
  gate_->poll();
  EXPECT_FALSE(gate_->authenticate(device(*certificate), Kind::tls).ok());
  EXPECT_FALSE(gate_->authenticate(net::PeerInfo{}, Kind::tls).ok()) << "and none at all";
}

TEST_F(GateTest, PlainTcpHasTheRoleOfTheConfiguration) {
  const auto user = gate_->authenticate(net::PeerInfo{}, Kind::tcp);
  ASSERT_TRUE(user.ok());
  EXPECT_EQ(gate_->role_of(*user, "m"), v1::ROLE_EDITOR);
  EXPECT_FALSE(gate_->enter(*user, "m", v1::ROLE_OWNER).ok());
  GateOptions closed;
  closed.tcp_role = v1::ROLE_UNSPECIFIED;
  start(closed);
  EXPECT_FALSE(gate_->authenticate(net::PeerInfo{}, Kind::tcp).ok());
}

TEST_F(GateTest, WithoutAFileLocalPeersAreOwnersAndOthersStayOut) {
  const auto gate = Gate::without_file();
  const auto user = gate->authenticate(net::PeerInfo{}, Kind::unix_socket);
  ASSERT_TRUE(user.ok());
  EXPECT_EQ(gate->role_of(*user, "m"), v1::ROLE_OWNER);
  EXPECT_FALSE(gate->authenticate(net::PeerInfo{}, Kind::tls).ok());
  EXPECT_FALSE(gate->server_tls().ok());
  EXPECT_FALSE(gate->poll());
  gate->audit({AuditKind::join, "x"});
  gate->flush();
}

// A1, A2: guesses are bounded by address, in all, and for each invitation; a right code still comes through.
TEST_F(GateTest, BruteForceIsBounded) {
  const std::string code = invited("Ann", v1::ROLE_EDITOR);
  const auto authority = net::read_pairing_code(code)->authority;
  std::size_t denied = 0, shut_out = 0;
  for (std::uint64_t guess = 0; guess < 200; ++guess) {
    const auto outcome =
        pair(net::write_pairing_code({authority, guess * 77'777'777'777ULL % net::pairing_secrets}));
    ASSERT_FALSE(outcome.ok());
    (outcome.error().code == ErrorCode::resource_exhausted ? shut_out : denied) += 1;
  }
  EXPECT_EQ(denied, 5U) << "of one address in a minute";
  EXPECT_EQ(shut_out, 195U);
  EXPECT_EQ(pair(code).error().code, ErrorCode::resource_exhausted) << "the same address waits";
  EXPECT_TRUE(pair(code, "192.0.2.8").ok()) << "another does not";
  now_s_ += 60;
  EXPECT_EQ(pair(code).error().code, ErrorCode::permission_denied) << "used by now";
}

TEST_F(GateTest, WrongCodesOfManyAddressesAreBoundedInAll) {
  const std::string code = invited("Ann", v1::ROLE_EDITOR);
  const auto authority = net::read_pairing_code(code)->authority;
  std::size_t denied = 0;
  for (int host = 0; host < 400; ++host) {
    const auto outcome =
        pair(net::write_pairing_code({authority, 5}), "2001:db8:0:" + std::to_string(host) + "::1");
    if (outcome.error().code == ErrorCode::permission_denied) ++denied;
  }
  EXPECT_EQ(denied, GateOptions{}.wrong_codes_per_minute_in_all);
}

TEST_F(GateTest, ANetworkOfAddressesIsOneHost) {
  const std::string code = invited("Ann", v1::ROLE_EDITOR);
  const auto authority = net::read_pairing_code(code)->authority;
  std::size_t denied = 0;
  for (int host = 0; host < 20; ++host) {
    const auto outcome = pair(net::write_pairing_code({authority, 5}), "2001:db8::" + std::to_string(host));
    if (outcome.error().code == ErrorCode::permission_denied) ++denied;
  }
  EXPECT_EQ(denied, GateOptions{}.wrong_codes_per_minute);
  EXPECT_TRUE(pair(code, "2001:db8:0:1::1").ok());
}

TEST_F(GateTest, AFloodOfRefusalsIsNotWrittenDown) {
  GateOptions options;
  options.audit.entries = 1000;
  start(options);
  for (int i = 0; i < 20'000; ++i) {
    net::PeerInfo stranger;
    stranger.address = "198.51.100." + std::to_string(i % 250);
    EXPECT_FALSE(gate_->authenticate(stranger, Kind::tls).ok());
  }
  EXPECT_LE(audited().size(), options.audit.strangers_per_minute);
  const auto user = gate_->authenticate(device(paired("Ann", v1::ROLE_VIEWER)), Kind::tls);
  ASSERT_TRUE(user.ok());
  v1::Operation operation;
  operation.mutable_fit();
  for (int i = 0; i < 20'000; ++i)
    EXPECT_FALSE(gate_->check(*user, "seat", v1::ROLE_VIEWER, operation, Ownership::own).ok());
  std::size_t of_ann = 0;
  for (const AuditEntry& entry : audited())
    of_ann += entry.event.user == "Ann" && entry.kind == "refusal" ? 1 : 0;
  EXPECT_EQ(of_ann, options.audit.per_peer_per_minute);
  // An hour of it fills the file to its bound and no further.
  for (int minute = 0; minute < 60; ++minute) {
    now_s_ += 60;
    for (int i = 0; i < 100; ++i)
      EXPECT_FALSE(gate_->check(*user, "seat", v1::ROLE_VIEWER, operation, Ownership::own).ok());
    gate_->flush();
  }
  EXPECT_THAT(audited(), SizeIs(options.audit.entries));
  EXPECT_LT(std::filesystem::file_size(path()), 2U << 20U);
  bool told = false;
  for (const AuditEntry& entry : audited()) told = told || entry.kind == "suppressed";
  EXPECT_TRUE(told) << "that something was left out is in the log";
}

TEST_F(GateTest, WritesDownWhoCameAndWent) {
  const auto user = gate_->authenticate(local(our_uid), Kind::unix_socket);
  gate_->joined(*user, "seat", v1::ROLE_EDITOR, "handloft-hmd 0.1.0");
  gate_->left(*user, "seat", "the peer closed");
  const auto entries = audited();
  ASSERT_THAT(entries, SizeIs(2));
  EXPECT_EQ(entries[0].kind, "join");
  EXPECT_EQ(entries[0].event.user, "me");
  EXPECT_EQ(entries[0].event.detail, "editor: handloft-hmd 0.1.0");
  EXPECT_EQ(entries[1].kind, "leave");
  EXPECT_EQ(entries[1].time_ns, start_s * ns_per_s);
}

}  // namespace
}  // namespace handloft::access
