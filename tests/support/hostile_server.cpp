#include "tests/support/hostile_server.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>

namespace handloft::test {

bool HostileConnection::wait_for(short events) {
  std::array<pollfd, 2> waiting{pollfd{socket_.get(), events, 0}, pollfd{stop_, POLLIN, 0}};
  const int ready =
      poll(waiting.data(), waiting.size(),
           static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(hostile_patience).count()));
  return ready > 0 && waiting[1].revents == 0;
}

bool HostileConnection::send_bytes(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      if (!wait_for(POLLOUT)) return false;
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

bool HostileConnection::send(const v1::Envelope& envelope) {
  constexpr std::uint32_t any_size = 1U << 30U;
  const Result<net::Frame> frame = net::encode_frame(envelope, any_size);
  return frame.ok() && send_bytes(**frame);
}

std::optional<v1::Envelope> HostileConnection::receive() {
  for (;;) {
    const auto payload = decoder_.next();
    if (!payload) return std::nullopt;
    if (payload.value()) {
      v1::Envelope envelope;
      if (!net::parse_envelope(*payload.value(), envelope)) return std::nullopt;
      return envelope;
    }
    if (!wait_for(POLLIN)) return std::nullopt;
    const std::span<std::uint8_t> room = decoder_.prepare();
    const ssize_t count = ::recv(socket_.get(), room.data(), room.size(), 0);
    if (count <= 0) return std::nullopt;
    decoder_.commit(static_cast<std::size_t>(count));
  }
}

bool HostileConnection::receive_until(const std::function<bool(const v1::Envelope&)>& wanted) {
  while (const std::optional<v1::Envelope> envelope = receive()) {
    if (wanted(*envelope)) return true;
  }
  return false;
}

bool HostileConnection::greet() {
  if (!receive_until([](const v1::Envelope& e) { return e.has_hello(); })) return false;
  v1::Envelope answer;
  v1::Welcome& welcome = *answer.mutable_welcome();
  welcome.set_protocol_major(1);
  welcome.set_program("hostile 1.0");
  welcome.set_client_id(1);
  return send(answer);
}

bool HostileConnection::wait_for_join() {
  return receive_until([](const v1::Envelope& e) { return e.has_join(); });
}

bool HostileConnection::survives() {
  v1::Envelope question;
  question.mutable_ping()->set_id(++pings_);
  return send(question) &&
         receive_until([this](const v1::Envelope& e) { return e.has_pong() && e.pong().id() == pings_; });
}

void HostileConnection::hold() {
  while (const std::optional<v1::Envelope> envelope = receive()) {
    if (!envelope->has_ping()) continue;
    v1::Envelope answer;
    answer.mutable_pong()->set_id(envelope->ping().id());
    if (!send(answer)) return;
  }
}

HostileServer::HostileServer(const net::Endpoint& endpoint, Serve serve)
    : serve_(std::move(serve)), stop_(eventfd(0, EFD_CLOEXEC)) {
  Result<net::Listener> listener = net::listen_on(endpoint);
  EXPECT_TRUE(listener.ok()) << listener.error().describe();
  if (!listener) return;
  listener_.emplace(std::move(*listener));
  thread_ = std::thread([this] { run(); });
}

HostileServer::~HostileServer() {
  const std::uint64_t one = 1;
  EXPECT_EQ(::write(stop_.get(), &one, sizeof(one)), static_cast<ssize_t>(sizeof(one)));
  if (thread_.joinable()) thread_.join();
  if (listener_) net::close_listener(*listener_);
}

void HostileServer::run() {
  for (;;) {
    std::array<pollfd, 2> waiting{pollfd{listener_->fd.get(), POLLIN, 0}, pollfd{stop_.get(), POLLIN, 0}};
    if (poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) return;
    if (waiting[1].revents != 0) return;
    net::FileDescriptor accepted(accept4(listener_->fd.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!accepted.valid()) continue;
    HostileConnection connection(std::move(accepted), stop_.get());
    serve_(connection);
  }
}

}  // namespace handloft::test
