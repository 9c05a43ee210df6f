#include "common/net/byte_stream.h"

#include <sys/socket.h>

#include <cerrno>
#include <cstring>

namespace handloft::net {

namespace {

class PlainStream final : public ByteStream {
 public:
  explicit PlainStream(int fd) : fd_(fd) {}

  StreamOutcome read(std::span<std::uint8_t> room) override {
    for (;;) {
      const ssize_t count = ::recv(fd_, room.data(), room.size(), MSG_DONTWAIT);
      if (count > 0) return {StreamOutcome::State::moved, static_cast<std::size_t>(count)};
      if (count == 0) return {StreamOutcome::State::ended};
      if (errno == EINTR) continue;
      if (errno == EAGAIN || errno == EWOULDBLOCK) return {StreamOutcome::State::wants_read};
      return {StreamOutcome::State::failed, 0, std::strerror(errno)};
    }
  }
  StreamOutcome write(std::span<const std::uint8_t> bytes) override {
    for (;;) {
      const ssize_t count = ::send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (count >= 0) return {StreamOutcome::State::moved, static_cast<std::size_t>(count)};
      if (errno == EINTR) continue;
      if (errno == EAGAIN || errno == EWOULDBLOCK) return {StreamOutcome::State::wants_write};
      return {StreamOutcome::State::failed, 0, std::strerror(errno)};
    }
  }
  void end_writing() override { ::shutdown(fd_, SHUT_WR); }
  bool has_unread() const override { return false; }
  std::optional<CertificateFacts> peer() const override { return std::nullopt; }

 private:
  int fd_;
};

}  // namespace

std::unique_ptr<ByteStream> make_plain_stream(int fd) {
  return std::make_unique<PlainStream>(fd);
}

}  // namespace handloft::net
