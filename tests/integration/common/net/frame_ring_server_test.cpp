// The video ring's descriptor over its own socket.

#include "common/net/frame_ring.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include "tests/integration/common/net/server_fixture.h"

namespace handloft::net {
namespace {

TEST(FrameRingServer, AReaderInAnotherPlaceSeesTheNewestFrame) {
  const test::TemporaryDirectory folder;
  const auto endpoint = video_endpoint(*parse_endpoint("unix:" + (folder.path() / "tracking.sock").string()));
  boost::asio::io_context io;
  auto work = boost::asio::make_work_guard(io);
  std::thread thread([&] { io.run(); });
  auto writer = FrameRingWriter::create();
  ASSERT_TRUE(writer.ok());
  {
    auto server =
        FrameRingServer::listen(io.get_executor(), *endpoint, writer->fd(), Logger("test", LogLevel::off));
    ASSERT_TRUE(server.ok()) << server.error().describe();
    for (int i = 0; i < 3; ++i) {
      auto reader = FrameRingReader::connect(*endpoint, patience);
      ASSERT_TRUE(reader.ok()) << reader.error().describe();
      VideoFrameInfo info;
      info.sequence = static_cast<std::uint64_t>(i + 1);
      ASSERT_TRUE(writer->write(info, std::vector<std::uint8_t>{7, 8, 9}).ok());
      VideoFrame frame;
      ASSERT_TRUE(reader->read_newest(frame));
      EXPECT_EQ(frame.info.sequence, info.sequence);
      EXPECT_EQ(frame.bytes.size(), 3u);
    }
  }
  work.reset();
  thread.join();
  EXPECT_FALSE(std::filesystem::exists(endpoint->path));
}

TEST(FrameRingServer, SomethingElseThatListensIsRefused) {
  Server server;
  const auto reader = FrameRingReader::connect(server.endpoint(), std::chrono::milliseconds(50));
  ASSERT_FALSE(reader.ok());
  EXPECT_EQ(reader.error().code, ErrorCode::timeout);
}

}  // namespace
}  // namespace handloft::net
