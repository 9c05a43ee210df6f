// TLS (A2): who is believed and who is not, on both sides, and that bytes arrive whole.

#include "common/net/tls.h"

#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>

#include <atomic>
#include <ctime>
#include <numeric>
#include <thread>
#include <vector>

#include "common/net/endpoint.h"
#include "common/net/message_client.h"

namespace handloft::net {
namespace {

using State = StreamOutcome::State;

constexpr std::int64_t day_s = 86'400;

Validity now_on() {
  const std::int64_t now = std::time(nullptr);
  return {now - day_s, now + day_s};
}

Validity long_ago() {
  const std::int64_t now = std::time(nullptr);
  return {now - 2 * day_s, now - day_s};
}

Validity not_yet() {
  const std::int64_t now = std::time(nullptr);
  return {now + day_s, now + 2 * day_s};
}

TlsIdentity client_of(const CertificateAuthority& authority, const std::string& name, Validity validity) {
  const std::string key = make_key().value();
  const std::string request = make_certificate_request(key, "whatever it asks for").value();
  return {authority.issue_client(request, name, validity).value(), key};
}

/// Two ends of a connection and what became of them.
struct Talk {
  std::unique_ptr<ByteStream> server, client;
  std::string server_problem, client_problem;
  std::string heard;  ///< By the server.
  bool answered = false;
};

/// Says a word each way, as far as it comes.
Talk talk(const std::shared_ptr<const TlsContext>& server_context,
          const std::shared_ptr<const TlsContext>& client_context) {
  int ends[2];
  EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends), 0);
  const FileDescriptor server_end(ends[0]);
  FileDescriptor client_end(ends[1]);
  Talk talk;
  talk.server = server_context->open(server_end.get()).value();
  talk.client = client_context->open(client_end.get()).value();
  const std::string word = "hello";
  const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(word.data()), word.size());
  std::array<std::uint8_t, 64> room{};
  bool said = false, replied = false;
  for (int turn = 0; turn < 50; ++turn) {
    if (talk.client_problem.empty()) {
      const StreamOutcome outcome = said ? talk.client->read(room) : talk.client->write(bytes);
      if (outcome.state == State::moved) (said ? talk.answered : said) = true;
      if (outcome.state == State::failed) talk.client_problem = outcome.problem;
    }
    if (talk.server_problem.empty()) {
      if (talk.heard.empty()) {
        const StreamOutcome outcome = talk.server->read(room);
        if (outcome.state == State::moved)
          talk.heard.assign(reinterpret_cast<const char*>(room.data()), outcome.bytes);
        if (outcome.state == State::failed) talk.server_problem = outcome.problem;
      } else if (!replied) {
        replied = talk.server->write(bytes).state == State::moved;
      }
    }
  }
  return talk;
}

class Tls : public testing::Test {
 protected:
  CertificateAuthority ours = CertificateAuthority::create("the workshop", now_on()).value();
  CertificateAuthority theirs = CertificateAuthority::create("another workshop", now_on()).value();
  TlsIdentity server = ours.issue_server(now_on()).value();
  TlsIdentity ann = client_of(ours, "Ann", now_on());

  std::shared_ptr<const TlsContext> serving(const TlsIdentity& identity,
                                            TlsClients clients = TlsClients::known) const {
    return TlsContext::for_server(identity, ours.identity().certificate_pem, clients).value();
  }
  std::shared_ptr<const TlsContext> asking(const TlsIdentity& identity) const {
    return TlsContext::for_client(identity, ours.identity().certificate_pem).value();
  }
};

// As a server that has no room, or something that speaks no TLS at all: nobody may wait for it for ever.
TEST_F(Tls, ClientsGiveUpOnAServerThatClosesWithinTheHandshake_L2) {
  auto listener = listen_on(*parse_endpoint("tcp:127.0.0.1:0"));
  ASSERT_TRUE(listener.ok()) << listener.error().describe();
  Endpoint endpoint = listener->endpoint;
  endpoint.kind = Endpoint::Kind::tls;
  for (const bool half : {false, true}) {
    std::atomic<bool> over = false;
    std::thread closing([&] {
      pollfd waiting{listener->fd.get(), POLLIN, 0};
      ASSERT_EQ(::poll(&waiting, 1, 30'000), 1);
      const FileDescriptor client(::accept(listener->fd.get(), nullptr, nullptr));
      ASSERT_GE(client.get(), 0);
      if (half) ::shutdown(client.get(), SHUT_WR);
      while (half && !over) std::this_thread::yield();
    });
    const SystemClock clock;
    ClientOptions options;
    options.tls = asking(ann);
    options.handshake_timeout = std::chrono::milliseconds(300);
    const auto met = SyncClient::connect(endpoint, options, clock);
    over = true;
    closing.join();
    ASSERT_FALSE(met.ok());
    EXPECT_EQ(met.error().field, "connection") << met.error().describe();
  }
}

TEST_F(Tls, APairedClientIsHeardAndKnownByNameA2) {
  const Talk good = talk(serving(server), asking(ann));
  EXPECT_EQ(good.server_problem + good.client_problem, "");
  EXPECT_EQ(good.heard, "hello");
  EXPECT_TRUE(good.answered);
  ASSERT_TRUE(good.server->peer());
  EXPECT_EQ(good.server->peer()->name, "Ann");
  EXPECT_EQ(good.server->peer()->serial, read_certificate(ann.certificate_pem)->serial);
  EXPECT_EQ(good.client->peer()->name, tls_server_name);
}

TEST_F(Tls, EveryOtherClientIsRefusedBeforeAByteOfItIsReadA2) {
  const TlsIdentity expired = client_of(ours, "Ann", long_ago()), early = client_of(ours, "Ann", not_yet()),
                    stranger = client_of(theirs, "Ann", now_on());
  const std::pair<const char*, TlsIdentity> refused[] = {{"expired", expired},
                                                         {"not yet valid", early},
                                                         {"another authority's", stranger},
                                                         {"a server's certificate", server}};
  for (const auto& [what, identity] : refused) {
    const Talk bad = talk(serving(server), asking(identity));
    EXPECT_EQ(bad.heard, "") << what;
    EXPECT_NE(bad.server_problem, "") << what;
    EXPECT_FALSE(bad.answered) << what;
    EXPECT_FALSE(bad.server->peer()) << what;
  }
  const auto nobody =
      TlsContext::for_pairing(read_certificate(ours.identity().certificate_pem)->fingerprint).value();
  const Talk without = talk(serving(server), nobody);
  EXPECT_EQ(without.heard, "");
  EXPECT_NE(without.server_problem, "");
}

TEST_F(Tls, EveryOtherServerIsRefusedBeforeAByteIsSaidA2) {
  const TlsIdentity others = theirs.issue_server(now_on()).value(),
                    expired = ours.issue_server(long_ago()).value();
  const auto fake = [&](const TlsIdentity& identity, const CertificateAuthority& authority) {
    return TlsContext::for_server(identity, authority.identity().certificate_pem, TlsClients::also_unknown)
        .value();
  };
  const TlsIdentity bob = client_of(ours, "Bob", now_on());
  for (const auto& context : {fake(others, theirs), fake(expired, ours), fake(bob, ours)}) {
    const Talk bad = talk(context, asking(ann));
    EXPECT_EQ(bad.heard, "");
    EXPECT_NE(bad.client_problem, "");
  }
}

TEST_F(Tls, WhoIsPairedKnowsTheServerByItsFingerprintU2) {
  const std::string fingerprint = read_certificate(ours.identity().certificate_pem)->fingerprint;
  const auto door = serving(server, TlsClients::also_unknown);
  const Talk good = talk(door, TlsContext::for_pairing(fingerprint.substr(0, 32)).value());
  EXPECT_EQ(good.heard, "hello");
  EXPECT_FALSE(good.server->peer());
  EXPECT_EQ(TlsContext::shown_authority(*good.client), ours.identity().certificate_pem);

  const Talk wrong =
      talk(door,
           TlsContext::for_pairing(read_certificate(theirs.identity().certificate_pem)->fingerprint).value());
  EXPECT_EQ(wrong.heard, "");
  EXPECT_NE(wrong.client_problem, "");
  // A right fingerprint shown by somebody whose own certificate that authority never signed.
  const auto thief = TlsContext::for_server(theirs.issue_server(now_on()).value(),
                                            ours.identity().certificate_pem, TlsClients::also_unknown);
  const Talk stolen = talk(*thief, TlsContext::for_pairing(fingerprint).value());
  EXPECT_EQ(stolen.heard, "");
  EXPECT_FALSE(TlsContext::for_pairing("abcd").ok());
  EXPECT_FALSE(TlsContext::for_pairing(std::string(64, 'X')).ok());
}

TEST_F(Tls, OlderVersionsAreRefusedA2) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends), 0);
  const FileDescriptor server_end(ends[0]);
  const FileDescriptor client_end(ends[1]);
  const auto stream = serving(server, TlsClients::also_unknown)->open(server_end.get()).value();
  SSL_CTX* context = SSL_CTX_new(TLS_client_method());
  SSL_CTX_set_max_proto_version(context, TLS1_2_VERSION);
  SSL* old = SSL_new(context);
  SSL_set_fd(old, client_end.get());
  std::array<std::uint8_t, 64> room{};
  StreamOutcome outcome{State::wants_read};
  for (int turn = 0; turn < 20 && outcome.state == State::wants_read; ++turn) {
    SSL_connect(old);
    outcome = stream->read(room);
  }
  EXPECT_EQ(outcome.state, State::failed);
  EXPECT_NE(outcome.problem.find("protocol"), std::string::npos) << outcome.problem;
  SSL_free(old);
  SSL_CTX_free(context);
}

TEST_F(Tls, GarbageIsAFailureInWordsAndAPeerThatGoesAwayAnEnd) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends), 0);
  const FileDescriptor server_end(ends[0]);
  FileDescriptor client_end(ends[1]);
  const auto stream = serving(server)->open(server_end.get()).value();
  std::array<std::uint8_t, 64> room{};
  EXPECT_EQ(stream->read(room).state, State::wants_read);
  const std::string garbage(200, 'x');
  ASSERT_EQ(::send(client_end.get(), garbage.data(), garbage.size(), 0), 200);
  const StreamOutcome wrong = stream->read(room);
  EXPECT_EQ(wrong.state, State::failed);
  EXPECT_NE(wrong.problem, "");

  int others[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, others), 0);
  const FileDescriptor here(others[0]);
  FileDescriptor there(others[1]);
  const auto lost = serving(server)->open(here.get()).value();
  EXPECT_EQ(lost->read(room).state, State::wants_read);
  there.reset();
  EXPECT_EQ(lost->read(room).state, State::ended);  // And no SIGPIPE when it answers.
}

TEST_F(Tls, MegabytesArriveWholeInBothDirectionsThroughSmallBuffers) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends), 0);
  const FileDescriptor server_end(ends[0]);
  const FileDescriptor client_end(ends[1]);
  const auto server_stream = serving(server)->open(server_end.get()).value();
  const auto client_stream = asking(ann)->open(client_end.get()).value();
  std::vector<std::uint8_t> sent(3 << 20);
  std::iota(sent.begin(), sent.end(), std::uint8_t{0});
  struct Way {
    ByteStream* from;
    ByteStream* to;
    std::size_t done = 0;
    std::vector<std::uint8_t> got;
  };
  Way ways[] = {{client_stream.get(), server_stream.get(), 0, {}},
                {server_stream.get(), client_stream.get(), 0, {}}};
  std::vector<std::uint8_t> room(5000);
  for (int turn = 0; turn < 100'000 && (ways[0].got.size() < sent.size() || ways[1].got.size() < sent.size());
       ++turn) {
    for (Way& way : ways) {
      // From another place in memory each time: what was refused is offered again by a copy.
      const std::vector<std::uint8_t> rest(
          sent.begin() + static_cast<std::ptrdiff_t>(way.done),
          sent.begin() + static_cast<std::ptrdiff_t>(std::min(sent.size(), way.done + 40'000)));
      if (!rest.empty()) {
        const StreamOutcome outcome = way.from->write(rest);
        ASSERT_NE(outcome.state, State::failed) << outcome.problem;
        way.done += outcome.bytes;
      }
      const StreamOutcome outcome = way.to->read(room);
      ASSERT_NE(outcome.state, State::failed) << outcome.problem;
      way.got.insert(way.got.end(), room.begin(), room.begin() + static_cast<std::ptrdiff_t>(outcome.bytes));
    }
  }
  EXPECT_EQ(ways[0].got, sent);
  EXPECT_EQ(ways[1].got, sent);
  client_stream->end_writing();
  EXPECT_EQ(server_stream->read(room).state, State::ended);
}

TEST(Certificates, SayWhoTheyAreForAndRefuseWhatTheyAreNot) {
  const Validity validity{1'700'000'000, 1'900'000'000};
  const auto authority = CertificateAuthority::create("Werkstatt Süd", validity).value();
  const auto facts = read_certificate(authority.identity().certificate_pem).value();
  EXPECT_EQ(facts.name, "Werkstatt Süd");
  EXPECT_EQ(facts.fingerprint.size(), 64u);
  EXPECT_EQ(facts.validity.from_s, validity.from_s);
  EXPECT_EQ(facts.validity.until_s, validity.until_s);
  EXPECT_TRUE(CertificateAuthority::load(authority.identity()).ok());

  const auto other = CertificateAuthority::create("x", validity).value();
  EXPECT_FALSE(
      CertificateAuthority::load({authority.identity().certificate_pem, other.identity().key_pem}).ok());
  EXPECT_FALSE(CertificateAuthority::load(authority.issue_server(validity).value()).ok());
  EXPECT_FALSE(CertificateAuthority::load({"", ""}).ok());
  EXPECT_FALSE(CertificateAuthority::create("", validity).ok());
  EXPECT_FALSE(CertificateAuthority::create(std::string(65, 'a'), validity).ok());
  EXPECT_FALSE(CertificateAuthority::create("line\nbreak", validity).ok());
  EXPECT_FALSE(CertificateAuthority::create("x", {5, 5}).ok());
  EXPECT_FALSE(read_certificate("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n").ok());
}

TEST(Certificates, ARequestIsSignedForTheNameThatWeSayAndOnlyWithItsOwnKeyU2) {
  const auto authority = CertificateAuthority::create("x", now_on()).value();
  const std::string key = make_key().value();
  std::string request = make_certificate_request(key, "root of everything").value();
  const auto facts = read_certificate(authority.issue_client(request, "Ann", now_on()).value()).value();
  EXPECT_EQ(facts.name, "Ann");
  EXPECT_FALSE(authority.issue_client("nothing", "Ann", now_on()).ok());
  EXPECT_FALSE(authority.issue_client(request, "", now_on()).ok());
  // One changed byte of the signed part.
  const std::size_t body = request.find('\n') + 40;
  request[body] = request[body] == 'A' ? 'B' : 'A';
  EXPECT_FALSE(authority.issue_client(request, "Ann", now_on()).ok());
  EXPECT_FALSE(make_certificate_request("no key", "Ann").ok());
}

}  // namespace
}  // namespace handloft::net
