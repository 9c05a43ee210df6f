// Who shares an I/O thread with somebody who reads a large scene as fast as it is written waits for a piece
// of it, not for all (L2).

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "common/base/clock.h"
#include "common/net/server_connection.h"
#include "tests/integration/common/net/server_fixture.h"

namespace handloft::net {
namespace {

/// Takes whatever is written at once, as no socket does; says hello and nothing more.
class QuickReader final : public ByteStream {
 public:
  QuickReader(std::size_t& written, const bool& gone) : written_(written), gone_(gone) {}
  StreamOutcome read(std::span<std::uint8_t> room) override {
    if (gone_) return {StreamOutcome::State::ended};
    if (hello_.empty()) return {StreamOutcome::State::wants_read};
    const std::size_t count = std::min(room.size(), hello_.size());
    std::copy_n(hello_.begin(), count, room.begin());
    hello_.erase(0, count);
    return {StreamOutcome::State::moved, count};
  }
  StreamOutcome write(std::span<const std::uint8_t> bytes) override {
    written_ += bytes.size();
    return {StreamOutcome::State::moved, bytes.size()};
  }
  void end_writing() override {}
  bool has_unread() const override { return !hello_.empty(); }
  std::optional<CertificateFacts> peer() const override { return std::nullopt; }

 private:
  std::size_t& written_;
  const bool& gone_;
  std::string hello_ = **encode_frame(hello());
};

class TurnsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::array<int, 2> ends{};
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data()), 0);
    other_end_ = FileDescriptor(ends[1]);
    auto shared =
        std::make_shared<ServerShared>(ServerShared{.options = {},
                                                    .events = {},
                                                    .clock = &clock_,
                                                    .log = Logger("test", LogLevel::off),
                                                    .on_over = [](std::uint64_t) {},
                                                    .on_joined = [this](std::uint64_t) { joined_ = true; }});
    connection_ = std::make_shared<ServerConnection>(io_.get_executor(), FileDescriptor(ends[0]),
                                                     std::make_unique<QuickReader>(written_, gone_),
                                                     ConnectionOrigin{.number = 1}, shared);
    connection_->start();
    while (!joined_ && io_.run_one() > 0) {
    }
    settle();
    written_ = 0;
  }
  void TearDown() override {
    connection_->set_pull({});
    gone_ = true;
    other_end_.reset();
    settle();
  }
  /// Until nothing is ready.
  void settle() {
    while (io_.poll_one() > 0) {
    }
  }
  /// A message of that many bytes, so many times.
  Connection::Pull scene_of(int messages, std::size_t bytes) {
    return [this, left = std::make_shared<int>(messages),
            message = *encode_frame(presence("scene", 0, bytes))]() -> std::optional<Frame> {
      ++pulls_;
      return (*left)-- > 0 ? std::optional(message) : std::nullopt;
    };
  }

  SystemClock clock_;
  boost::asio::io_context io_{1};
  FileDescriptor other_end_;
  std::size_t written_ = 0;
  int pulls_ = 0;
  bool joined_ = false;
  bool gone_ = false;
  std::shared_ptr<ServerConnection> connection_;
};

TEST_F(TurnsTest, A_large_scene_is_written_in_turns) {
  constexpr int messages = 40;
  constexpr std::size_t message_bytes = 1 << 20, most_a_turn = 512 << 10;
  connection_->set_pull(scene_of(messages, message_bytes));
  EXPECT_EQ(pulls_, 0) << "who begins it does not compose it";
  std::size_t before = 0, turns = 0;
  int pulls_before = 0;
  // Others' handlers come between any two of ours.
  while (io_.poll_one() > 0) {
    EXPECT_LE(written_ - before, most_a_turn);
    EXPECT_LE(pulls_ - pulls_before, 1) << "composing takes longer than writing";
    if (written_ > before) ++turns;
    before = written_;
    pulls_before = pulls_;
  }
  EXPECT_EQ(pulls_, messages + 1);
  EXPECT_GT(written_, messages * message_bytes) << "all of it came";
  EXPECT_GE(turns, messages * message_bytes / most_a_turn);
  EXPECT_EQ(connection_->statistics().queued_frames, 0U);
}

TEST_F(TurnsTest, What_is_sent_meanwhile_waits_for_a_piece_and_comes_in_order) {
  connection_->set_pull(scene_of(4, 1 << 20));
  while (written_ == 0 && io_.poll_one() > 0) {
  }
  const std::size_t of_scene = written_;
  ASSERT_TRUE(connection_->send(presence("answer")));
  EXPECT_EQ(written_, of_scene) << "a frame is not cut in two by another";
  EXPECT_EQ(connection_->statistics().frames_sent, 1U) << "the Welcome";
  settle();
  EXPECT_EQ(connection_->statistics().frames_sent, 1U + 4U + 1U);
  EXPECT_EQ(connection_->statistics().queued_bytes, 0U);
}

TEST_F(TurnsTest, A_small_message_is_written_by_who_sends_it) {
  ASSERT_TRUE(connection_->send(presence("answer")));
  EXPECT_GT(written_, 0U);
}

TEST_F(TurnsTest, What_changed_is_composed_by_who_tells_of_it) {
  int state = 0, told = 0;
  connection_->set_pull([&]() -> std::optional<Frame> {
    if (std::exchange(told, state) == state) return std::nullopt;
    return *encode_frame(presence("delta"));
  });
  settle();
  const std::size_t before = written_;
  state = 1;
  connection_->notify_pull();
  EXPECT_GT(written_, before) << "the shortest way to a viewer that has all the rest";
}

}  // namespace
}  // namespace handloft::net
