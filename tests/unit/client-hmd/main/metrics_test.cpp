// The client's figures in Prometheus' text format: well-formed, in seconds, and served to whoever asks.

#include "client-hmd/main/metrics.h"

#include <gmock/gmock.h>
#include <sys/socket.h>

#include <regex>
#include <sstream>

#include "tests/support/test_data.h"

namespace handloft::client {
namespace {

using testing::HasSubstr;

TEST(ClientMetrics, EveryLineIsAHelpATypeOrASampleOfIt) {
  RunFigures figures;
  for (int i = 1; i <= 100; ++i) figures.frame_time.add(std::chrono::milliseconds(i));
  figures.photons.camera_to_photon.add(std::chrono::milliseconds(40));
  figures.tracking.refused = 7;
  const std::string text = prometheus_text(figures);
  EXPECT_THAT(text, HasSubstr("handloft_frame_seconds{quantile=\"0.5\"} 0.05"));
  EXPECT_THAT(text, HasSubstr("handloft_frame_seconds_count 100\n"));
  EXPECT_THAT(text, HasSubstr("handloft_camera_to_photon_seconds{quantile=\"0.99\"} 0.04"));
  EXPECT_THAT(text, HasSubstr("handloft_tracking_refused_total 7\n"));
  const std::regex sample(R"(handloft_[a-z_]+(\{[a-z]+="[^"]*"(,[a-z]+="[^"]*")*\})? [0-9.e+-]+)");
  const std::regex comment(R"(# (HELP|TYPE) handloft_[a-z_]+ .+)");
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    EXPECT_TRUE(std::regex_match(line, sample) || std::regex_match(line, comment)) << line;
}

TEST(ClientMetrics, AreServedWhileTheLoopGoesOn) {
  const test::TemporaryDirectory folder;
  const net::Endpoint endpoint = net::parse_endpoint("unix:" + (folder.path() / "m.sock").string()).value();
  auto metrics = Metrics::serve(endpoint, Logger("test", LogLevel::off));
  ASSERT_TRUE(metrics.ok()) << metrics.error().describe();
  RunFigures figures;
  figures.graphics_resets = 3;
  (*metrics)->put(figures);
  const auto socket = net::connect_to(endpoint, 5000);
  ASSERT_TRUE(socket.ok());
  const std::string request = "GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n";
  ASSERT_EQ(::send(socket->get(), request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
  std::string answer;
  char room[4096];
  for (ssize_t count = 1; count > 0;) {
    count = ::recv(socket->get(), room, sizeof room, 0);
    if (count > 0) answer.append(room, static_cast<std::size_t>(count));
  }
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200")) << answer;
  EXPECT_THAT(answer, HasSubstr("handloft_graphics_resets_total 3\n"));
  EXPECT_FALSE(
      Metrics::serve(net::parse_endpoint("tcp:0.0.0.0:0").value(), Logger("test", LogLevel::off)).ok());
}

}  // namespace
}  // namespace handloft::client
