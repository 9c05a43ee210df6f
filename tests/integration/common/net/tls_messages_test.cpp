// Messages through TLS (A1, A2): everything that works over a unix socket, and strangers who get nowhere.

#include <ctime>
#include <future>

#include "common/net/certificates.h"
#include "common/net/tls.h"
#include "tests/integration/common/net/server_fixture.h"

namespace handloft::net {
namespace {

using testing::HasSubstr;

const Logger quiet("test", LogLevel::off);

Validity today() {
  const std::int64_t now = std::time(nullptr);
  return {now - 3600, now + 3600};
}

struct Workshop {
  CertificateAuthority authority = CertificateAuthority::create("workshop", today()).value();

  std::shared_ptr<const TlsContext> door(TlsClients clients = TlsClients::known) const {
    return TlsContext::for_server(authority.issue_server(today()).value(),
                                  authority.identity().certificate_pem, clients)
        .value();
  }
  std::shared_ptr<const TlsContext> pass(const std::string& name) const {
    const std::string key = make_key().value();
    const std::string request = make_certificate_request(key, name).value();
    return TlsContext::for_client({authority.issue_client(request, name, today()).value(), key},
                                  authority.identity().certificate_pem)
        .value();
  }
};

Server::Settings over_tls(const Workshop& workshop) {
  Server::Settings settings;
  settings.endpoint = "tls:127.0.0.1:0";
  settings.options.tls = workshop.door();
  settings.on_message = [](const ConnectionPtr& connection, const v1::Envelope& message) {
    connection->send(message);
    return Status();
  };
  return settings;
}

ClientOptions with(std::shared_ptr<const TlsContext> pass, std::string name = "Ann") {
  ClientOptions options = Server::client_options(std::move(name));
  options.tls = std::move(pass);
  return options;
}

TEST(TlsMessages, MegabytesGoBothWaysAndTheServerKnowsWhoItIs) {
  const Workshop workshop;
  Server server(over_tls(workshop));
  EXPECT_THAT(server.endpoint().to_string(), HasSubstr("tls:127.0.0.1:"));
  std::promise<std::vector<std::size_t>> all;
  std::vector<std::size_t> sizes;
  constexpr std::size_t messages = 12;
  ClientEvents events;
  events.on_message = [&](v1::Envelope& message) {
    sizes.push_back(message.presence().tool().size());
    if (sizes.size() == messages) all.set_value(sizes);
  };
  auto client = MessageClient::connect(server.endpoint(), with(workshop.pass("Ann"), "calls herself Eve"),
                                       events, server.clock(), quiet);
  ASSERT_TRUE(client.ok()) << client.error().describe();
  const ConnectionPtr connection = server.connection((*client)->client_id());
  ASSERT_TRUE(connection->peer().certificate);
  EXPECT_EQ(connection->peer().certificate->name, "Ann");
  std::vector<std::size_t> expected;
  for (std::size_t i = 0; i < messages; ++i) {
    expected.push_back(i % 2 == 0 ? 10 : 600'000);
    ASSERT_TRUE((*client)->send(presence("x", 0, expected.back())).ok());
  }
  auto received = all.get_future();
  ASSERT_EQ(received.wait_for(patience), std::future_status::ready);
  EXPECT_EQ(received.get(), expected);
}

TEST(TlsMessages, ASyncClientTalksAndALastWordIsHeardBeforeTheEnd) {
  const Workshop workshop;
  Server::Settings settings = over_tls(workshop);
  settings.on_message = [](const ConnectionPtr&, const v1::Envelope&) {
    return make_error(ErrorCode::invalid_argument, "not like this", "body");
  };
  Server server(std::move(settings));
  auto client = SyncClient::connect(server.endpoint(), with(workshop.pass("Ann")), server.clock());
  ASSERT_TRUE(client.ok()) << client.error().describe();
  ASSERT_TRUE(client->send(presence("x")).ok());
  const auto last = client->receive(patience);
  ASSERT_TRUE(last.ok()) << last.error().describe();
  EXPECT_EQ(last->failure().message(), "not like this");
  const auto after = client->receive(patience);
  ASSERT_FALSE(after.ok());
  EXPECT_THAT(after.error().message, HasSubstr("closed"));
}

TEST(TlsMessages, WhoIsNotPairedWithThisServerGetsNoWelcomeA2) {
  const Workshop workshop, other;
  Server server(over_tls(workshop));
  ClientOptions options = with(other.pass("Ann"));
  options.connect_timeout = std::chrono::milliseconds(100);
  const auto stranger = SyncClient::connect(server.endpoint(), options, server.clock());
  ASSERT_FALSE(stranger.ok());
  EXPECT_THAT(stranger.error().message, HasSubstr("certificate"));
  options.tls = nullptr;
  const auto nobody = SyncClient::connect(server.endpoint(), options, server.clock());
  ASSERT_FALSE(nobody.ok());
  EXPECT_THAT(nobody.error().message, HasSubstr("not paired"));
  // And plain bytes on that port are no hello.
  Endpoint plain = server.endpoint();
  plain.kind = Endpoint::Kind::tcp;
  RawPeer peer(plain);
  peer.send(hello());
  const auto answer = peer.receive();
  EXPECT_FALSE(answer && answer->has_welcome());
}

TEST(TlsMessages, AServerWithoutACertificateDoesNotListen) {
  boost::asio::io_context io;
  const SystemClock clock;
  const auto server = MessageServer::listen(io.get_executor(), parse_endpoint("tls:127.0.0.1:0").value(), {},
                                            {}, clock, quiet);
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.error().field, "endpoint");
}

TEST(TlsMessages, WhoNeverFinishesTheHandshakeIsLetGoA1) {
  const Workshop workshop;
  Server::Settings settings = over_tls(workshop);
  settings.options.hello_timeout = std::chrono::milliseconds(50);
  Server server(std::move(settings));
  Endpoint plain = server.endpoint();
  plain.kind = Endpoint::Kind::tcp;
  const auto idle = connect_to(plain, 5000);
  ASSERT_TRUE(idle.ok());
  pollfd readable{idle->get(), POLLIN, 0};
  ASSERT_EQ(poll(&readable, 1, static_cast<int>(patience.count())), 1);
  server.wait_until([&] { return (*server).connection_count() == 0; });
}

TEST(TlsMessages, ASilentServerIsNoticedOverTlsToo) {
  const Workshop workshop;
  Server::Settings settings = over_tls(workshop);
  Server server(std::move(settings));
  ClientOptions options = with(workshop.pass("Ann"));
  options.silence_timeout = std::chrono::milliseconds(300);
  std::promise<Error> ended;
  ClientEvents events;
  events.on_disconnected = [&](const Error& error) { ended.set_value(error); };
  auto client = MessageClient::connect(server.endpoint(), options, events, server.clock(), quiet);
  ASSERT_TRUE(client.ok());
  server.connection((*client)->client_id())->pause_reading();
  ASSERT_TRUE((*client)->send(presence("the last that is handled")).ok());
  auto error = ended.get_future();
  ASSERT_EQ(error.wait_for(patience), std::future_status::ready);
  EXPECT_EQ(error.get().code, ErrorCode::timeout);
}

}  // namespace
}  // namespace handloft::net
