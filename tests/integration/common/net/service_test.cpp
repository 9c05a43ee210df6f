// How a service is watched and ended: health over HTTP, words of farewell, and what systemd is told (issue 7,
// part 6).

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/net/metrics_server.h"
#include "common/net/service_manager.h"
#include "tests/integration/common/net/server_fixture.h"
#include "tests/support/eventually.h"

namespace handloft::net {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::string asked(const Endpoint& endpoint, const std::string& request) {
  auto socket = connect_to(endpoint, 5000);
  EXPECT_TRUE(socket.ok());
  EXPECT_EQ(::send(socket->get(), request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
  std::string answer;
  std::array<char, 4096> buffer{};
  for (ssize_t got = 0; (got = ::recv(socket->get(), buffer.data(), buffer.size(), 0)) > 0;)
    answer.append(buffer.data(), static_cast<std::size_t>(got));
  return answer;
}

std::string get(const Endpoint& endpoint, const std::string& target) {
  return asked(endpoint, "GET " + target + " HTTP/1.1\r\nHost: x\r\n\r\n");
}

TEST(Health, IsAskedEachTimeAndSaysWhatIsWrong) {
  const test::TemporaryDirectory folder;
  boost::asio::io_context io;
  auto work = boost::asio::make_work_guard(io);
  std::thread thread([&] { io.run(); });
  std::atomic<bool> ready = false;
  HealthChecks health;
  health.ready = [&]() -> Status {
    return ready ? Status() : Status(make_error(ErrorCode::resource_exhausted, "the disk is full", "store"));
  };
  auto server = MetricsServer::listen(
      io.get_executor(), *parse_endpoint("unix:" + (folder.path() / "m").string()), "handloft-x",
      [] { return std::string("handloft_up 1\n"); }, Logger("test", LogLevel::off), health);
  ASSERT_TRUE(server.ok());
  EXPECT_THAT(get((*server)->endpoint(), "/healthz"), StartsWith("HTTP/1.1 200"));
  const std::string full = get((*server)->endpoint(), "/readyz");
  EXPECT_THAT(full, StartsWith("HTTP/1.1 503"));
  EXPECT_THAT(full, HasSubstr("the disk is full"));
  ready = true;
  EXPECT_THAT(get((*server)->endpoint(), "/readyz"), HasSubstr("\r\n\r\nok\n"));
  EXPECT_THAT(get((*server)->endpoint(), "/metrics"), HasSubstr("handloft_up 1\n"));
  EXPECT_THAT(get((*server)->endpoint(), "/secrets"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(
      asked((*server)->endpoint(), "POST /metrics HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\n\r\nhi"),
      StartsWith("HTTP/1.1 405"));
  // Those who only connect keep nobody out (A1).
  std::vector<FileDescriptor> idle;
  const auto one_more = [&] {  // Refused while more wait than the kernel keeps.
    auto socket = connect_to((*server)->endpoint(), 5000);
    if (socket) idle.push_back(*std::move(socket));
    return socket.ok();
  };
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(test::eventually(one_more)) << i;
  EXPECT_THAT(get((*server)->endpoint(), "/healthz"), StartsWith("HTTP/1.1 200"));
  (*server)->stop();
  work.reset();
  io.stop();
  thread.join();
}

TEST(Stop, TellsEveryoneWhyAfterWhatWaits) {
  Server server;
  SyncClient client = server.connect();
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  v1::Envelope last;
  last.mutable_ack()->set_request(3);
  ASSERT_TRUE(connection->send(last));
  (*server).stop(make_error(ErrorCode::cancelled, "the server stops"));
  auto first = client.receive(patience);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first->ack().request(), 3U);
  auto farewell = client.receive(patience);
  ASSERT_TRUE(farewell.ok());
  EXPECT_TRUE(farewell->failure().closing());
  EXPECT_EQ(farewell->failure().message(), "the server stops");
  EXPECT_EQ(farewell->failure().code(), "cancelled");
  EXPECT_FALSE(client.receive(patience).ok());
}

/// What systemd would hear.
class Listening {
 public:
  Listening() {
    path_ = (folder_.path() / "notify").string();
    socket_ = FileDescriptor(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof(address.sun_path) - 1);
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    ::setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  }
  ~Listening() {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
  }
  std::string heard() {
    std::array<char, 1024> buffer{};
    const ssize_t got = ::recv(socket_.get(), buffer.data(), buffer.size(), 0);
    return got > 0 ? std::string(buffer.data(), static_cast<std::size_t>(got)) : "";
  }

 private:
  test::TemporaryDirectory folder_;
  std::string path_;
  FileDescriptor socket_;
};

TEST(ServiceManager, TellsSystemdThatItIsReadyAliveReloadingAndEnding) {
  Listening systemd;
  ::setenv("WATCHDOG_USEC", "3000000", 1);
  ::unsetenv("WATCHDOG_PID");
  const SystemClock clock;
  ServiceManager service(clock);
  EXPECT_EQ(service.watchdog_interval(), std::chrono::milliseconds(1000));
  service.ready("Serving seat");
  EXPECT_EQ(systemd.heard(), "READY=1\nSTATUS=Serving seat");
  service.alive();
  EXPECT_EQ(systemd.heard(), "WATCHDOG=1");
  service.alive();  // Often enough is often enough.
  EXPECT_EQ(systemd.heard(), "");
  service.reloading("Reading the configuration again");
  EXPECT_THAT(systemd.heard(), StartsWith("RELOADING=1\nMONOTONIC_USEC="));
  service.stopping();
  EXPECT_THAT(systemd.heard(), StartsWith("STOPPING=1"));
}

TEST(ServiceManager, WithoutSystemdDoesNothing) {
  const SystemClock clock;
  ServiceManager service(clock);
  EXPECT_EQ(service.watchdog_interval(), std::nullopt);
  service.ready("x");
  service.alive();
  EXPECT_TRUE(service.take_listeners()->empty());
  EXPECT_FALSE(service.take_listener()->has_value());
}

}  // namespace
}  // namespace handloft::net
