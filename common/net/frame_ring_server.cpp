// How a ring's descriptor gets from the writer's process to a reader's: one message of 8 bytes (the ring's
// magic) with the descriptor as SCM_RIGHTS, over a unix socket, at once after connecting.

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cerrno>
#include <cstring>

#include "common/net/frame_ring.h"
#include "common/net/frame_ring_layout.h"

namespace handloft::net {

namespace asio = boost::asio;

namespace {

/// Out of file descriptors: try again when some may have been closed.
constexpr std::chrono::milliseconds accept_pause{100};

union ControlBuffer {
  cmsghdr aligned;
  char bytes[CMSG_SPACE(sizeof(int))];
};

bool send_descriptor(int socket, int fd) {
  std::array<char, 8> greeting = ring::magic;
  iovec part{greeting.data(), greeting.size()};
  ControlBuffer control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.bytes;
  message.msg_controllen = sizeof(control.bytes);
  cmsghdr* header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(header), &fd, sizeof(fd));
  return ::sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT) == static_cast<ssize_t>(greeting.size());
}

}  // namespace

struct FrameRingServer::Implementation : std::enable_shared_from_this<FrameRingServer::Implementation> {
  Implementation(const asio::any_io_executor& executor, Listener taken, FileDescriptor memory, Logger logger)
      : strand(asio::make_strand(executor)),
        acceptor(strand, ::dup(taken.fd.get())),
        pause(strand),
        listener(std::move(taken)),
        ring(std::move(memory)),
        log(std::move(logger)) {}

  asio::strand<asio::any_io_executor> strand;
  asio::posix::stream_descriptor acceptor;
  asio::steady_timer pause;
  Listener listener;
  FileDescriptor ring;
  Logger log;

  asio::awaitable<void> accept_all() {
    while (listener.fd.valid()) {
      const FileDescriptor peer(::accept4(listener.fd.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (peer.valid()) {
        const Status allowed = check_peer(peer.get(), listener.endpoint);
        if (!allowed) log.warning("a video reader is refused: {}", allowed.error().describe());
        if (allowed && !send_descriptor(peer.get(), ring.get())) log.warning("a video reader went away");
        continue;
      }
      if (errno == EINTR || errno == ECONNABORTED) continue;
      if (errno != EAGAIN && errno != EWOULDBLOCK) {
        log.warning("cannot accept a video reader: {}", std::strerror(errno));
        pause.expires_after(accept_pause);
        const auto [error] = co_await pause.async_wait(asio::as_tuple(asio::use_awaitable));
        if (error) co_return;
        continue;
      }
      const auto [error] = co_await acceptor.async_wait(asio::posix::stream_descriptor::wait_read,
                                                        asio::as_tuple(asio::use_awaitable));
      if (error) co_return;
    }
  }
};

FrameRingServer::FrameRingServer(std::shared_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
FrameRingServer::~FrameRingServer() {
  stop();
}

void FrameRingServer::stop() {
  asio::dispatch(implementation_->strand, [self = implementation_] {
    boost::system::error_code ignored;
    self->acceptor.close(ignored);
    self->pause.cancel();
    close_listener(self->listener);
  });
}

Result<std::unique_ptr<FrameRingServer>> FrameRingServer::listen(const asio::any_io_executor& executor,
                                                                 const Endpoint& video_endpoint, int fd,
                                                                 Logger log) {
  // Opened anew for reading only: readers get no means to write.
  FileDescriptor memory(::open(fmt::format("/proc/self/fd/{}", fd).c_str(), O_RDONLY | O_CLOEXEC));
  if (!memory.valid()) {
    return make_error(ErrorCode::io, fmt::format("cannot share the ring: {}", std::strerror(errno)),
                      "video ring");
  }
  Result<Listener> listener = listen_on(video_endpoint);
  if (!listener) return listener.error();
  auto implementation =
      std::make_shared<Implementation>(executor, std::move(*listener), std::move(memory), std::move(log));
  asio::co_spawn(
      implementation->strand,
      [implementation]() -> asio::awaitable<void> { co_await implementation->accept_all(); }, asio::detached);
  return std::unique_ptr<FrameRingServer>(new FrameRingServer(std::move(implementation)));
}

Result<FrameRingReader> FrameRingReader::connect(const Endpoint& video_endpoint,
                                                 std::chrono::milliseconds timeout) {
  const Result<FileDescriptor> socket = connect_to(video_endpoint, static_cast<int>(timeout.count()));
  if (!socket) return socket.error();
  if (const Status status = check_peer(socket->get(), video_endpoint); !status) return status.error();
  pollfd readable{socket->get(), POLLIN, 0};
  if (poll(&readable, 1, static_cast<int>(timeout.count())) <= 0) {
    return make_error(ErrorCode::timeout, "no answer", "video ring");
  }
  std::array<char, 8> greeting{};
  iovec part{greeting.data(), greeting.size()};
  ControlBuffer control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.bytes;
  message.msg_controllen = sizeof(control.bytes);
  const ssize_t count = ::recvmsg(socket->get(), &message, MSG_CMSG_CLOEXEC);
  FileDescriptor ring;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level == SOL_SOCKET && header->cmsg_type == SCM_RIGHTS &&
        header->cmsg_len == CMSG_LEN(sizeof(int))) {
      int fd = -1;
      std::memcpy(&fd, CMSG_DATA(header), sizeof(fd));
      ring.reset(fd);
    }
  }
  if (count != static_cast<ssize_t>(greeting.size()) || greeting != ring::magic || !ring.valid()) {
    return make_error(ErrorCode::data_corrupt, "what listens there hands out no video ring", "video ring");
  }
  return map(std::move(ring));
}

}  // namespace handloft::net
