#include "common/net/endpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/support/test_data.h"

namespace handloft::net {
namespace {

using testing::HasSubstr;

Endpoint unix_endpoint(const std::filesystem::path& path) {
  return {.kind = Endpoint::Kind::unix_socket, .path = path.string(), .host = {}, .port = 0};
}

TEST(Endpoint, ParsesBothKindsAndWritesThemAgain) {
  for (const char* text :
       {"unix:/run/x.sock", "unix:relative", "tcp:localhost:7400", "tcp:127.0.0.1:0", "tcp:[::1]:65535"}) {
    const auto endpoint = parse_endpoint(text);
    ASSERT_TRUE(endpoint.ok()) << endpoint.error().describe();
    EXPECT_EQ(endpoint->to_string(), text);
  }
  EXPECT_EQ(parse_endpoint("tcp:[::1]:80")->host, "::1");
  EXPECT_EQ(parse_endpoint("tcp:h:80")->port, 80);
}

TEST(Endpoint, RefusesWhatItCannotMean) {
  for (const char* text : {"", "unix:", "/run/x.sock", "tcp:", "tcp:host", "tcp:host:", "tcp::80",
                           "tcp:host:65536", "tcp:host:-1", "tcp:host:8o", "tcp:::1:80", "tcp:[]:80",
                           "tcp:[]]:1", "tcp:[host]:80", "udp:host:80", "UNIX:/x"}) {
    const auto endpoint = parse_endpoint(text);
    ASSERT_FALSE(endpoint.ok()) << text;
    EXPECT_EQ(endpoint.error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(endpoint.error().field, "endpoint");
  }
  EXPECT_FALSE(parse_endpoint(std::string_view("unix:/a\0b", 9)).ok());
}

TEST(Endpoint, APathMayBeAsLongAsASocketsAddressAndNoLonger) {
  EXPECT_TRUE(parse_endpoint("unix:" + std::string(max_unix_path_bytes, 'x')).ok());
  const auto longer = parse_endpoint("unix:" + std::string(max_unix_path_bytes + 1, 'x'));
  ASSERT_FALSE(longer.ok());
  EXPECT_THAT(longer.error().message, HasSubstr("108 bytes"));
}

TEST(Endpoint, VideoStandsBesideAUnixSocketOnly) {
  EXPECT_EQ(video_endpoint(unix_endpoint("/run/t.sock"))->path, "/run/t.sock.video");
  EXPECT_EQ(video_endpoint(*parse_endpoint("tcp:localhost:1")).error().code, ErrorCode::unsupported);
}

TEST(Endpoint, ASocketFileIsOursAlone) {
  const test::TemporaryDirectory folder;
  auto listener = listen_on(unix_endpoint(folder.path() / "s"));
  ASSERT_TRUE(listener.ok()) << listener.error().describe();
  struct stat status {};
  ASSERT_EQ(stat(listener->endpoint.path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0600u);
  close_listener(*listener);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "s"));
}

TEST(Endpoint, AStaleSocketIsReplacedALiveOneIsNot) {
  const test::TemporaryDirectory folder;
  const Endpoint endpoint = unix_endpoint(folder.path() / "s");
  auto first = listen_on(endpoint);
  ASSERT_TRUE(first.ok());
  const auto second = listen_on(endpoint);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::already_exists);
  first->fd.reset();  // as a crash leaves it: the file stays
  ASSERT_TRUE(std::filesystem::exists(endpoint.path));
  auto third = listen_on(endpoint);
  EXPECT_TRUE(third.ok()) << third.error().describe();
  // The first one must not take the third one's file with it.
  first->fd = FileDescriptor(dup(0));
  first->inode += first->inode == third->inode ? 1 : 0;  // the file system may have used the number again
  close_listener(*first);
  EXPECT_TRUE(std::filesystem::exists(endpoint.path));
}

TEST(Endpoint, AFileThatIsNoSocketIsLeftAlone) {
  const test::TemporaryDirectory folder;
  std::ofstream(folder.path() / "s") << "precious";
  const auto listener = listen_on(unix_endpoint(folder.path() / "s"));
  ASSERT_FALSE(listener.ok());
  EXPECT_EQ(listener.error().code, ErrorCode::already_exists);
  EXPECT_TRUE(std::filesystem::is_regular_file(folder.path() / "s"));
}

TEST(Endpoint, TcpReportsItsPortAndStaysOnLoopback) {
  const auto listener = listen_on(*parse_endpoint("tcp:127.0.0.1:0"));
  ASSERT_TRUE(listener.ok()) << listener.error().describe();
  EXPECT_NE(listener->endpoint.port, 0);
  EXPECT_TRUE(connect_to(listener->endpoint, 1000).ok());
  const auto exposed = listen_on(*parse_endpoint("tcp:0.0.0.0:0"));
  ASSERT_FALSE(exposed.ok());
  EXPECT_EQ(exposed.error().code, ErrorCode::permission_denied);
  EXPECT_TRUE(listen_on(*parse_endpoint("tcp:0.0.0.0:0"), TcpExposure::any_address).ok());
}

TEST(Endpoint, ConnectingToNobodyIsNotFound) {
  const test::TemporaryDirectory folder;
  EXPECT_EQ(connect_to(unix_endpoint(folder.path() / "none"), 100).error().code, ErrorCode::not_found);
}

TEST(Endpoint, TheRuntimeFolderIsPrivate) {
  const test::TemporaryDirectory folder;
  const char* before = getenv("XDG_RUNTIME_DIR");
  const std::string saved = before != nullptr ? before : "";
  setenv("XDG_RUNTIME_DIR", folder.path().c_str(), 1);
  EXPECT_EQ(default_tracking_endpoint()->path, (folder.path() / "handloft/tracking.sock").string());
  EXPECT_EQ(default_model_endpoint()->path, (folder.path() / "handloft/model.sock").string());
  struct stat status {};
  ASSERT_EQ(stat((folder.path() / "handloft").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0700u);
  chmod((folder.path() / "handloft").c_str(), 0777);
  EXPECT_EQ(default_tracking_endpoint().error().code, ErrorCode::permission_denied);
  if (before != nullptr) {
    setenv("XDG_RUNTIME_DIR", saved.c_str(), 1);
  } else {
    unsetenv("XDG_RUNTIME_DIR");
  }
}

}  // namespace
}  // namespace handloft::net
