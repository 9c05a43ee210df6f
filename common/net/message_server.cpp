#include "common/net/message_server.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <array>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cerrno>
#include <cstring>
#include <map>
#include <mutex>
#include <set>
#include <vector>

#include "common/net/address.h"
#include "common/net/server_connection.h"

namespace handloft::net {

namespace asio = boost::asio;

namespace {
/// Out of file descriptors: try again when some may have been closed.
constexpr std::chrono::milliseconds accept_pause{100};
/// A crowd at the door lets those who are in have their turn after so many.
constexpr int accepts_per_turn = 8;

/// "192.0.2.7"; IPv4 peers of an IPv6 socket as IPv4; empty for unix sockets.
std::string address_of(const sockaddr_storage& from) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (from.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(from);
    inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
  } else if (from.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(from);
    if (IN6_IS_ADDR_V4MAPPED(&v6.sin6_addr)) {
      inet_ntop(AF_INET, &v6.sin6_addr.s6_addr[12], text.data(), text.size());
    } else {
      inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
    }
  }
  return text.data();
}

std::optional<std::uint32_t> user_of(int fd) {
  ucred credentials{};
  socklen_t bytes = sizeof(credentials);
  if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &bytes) != 0) return std::nullopt;
  return credentials.uid;
}
}  // namespace

struct MessageServer::Implementation : std::enable_shared_from_this<MessageServer::Implementation> {
  Implementation(asio::any_io_executor io, Listener taken, std::shared_ptr<ServerShared> common)
      : executor(std::move(io)),
        strand(asio::make_strand(executor)),
        acceptor(strand, ::dup(taken.fd.get())),
        pause(strand),
        listener(std::move(taken)),
        shared(std::move(common)) {}

  asio::any_io_executor executor;
  asio::strand<asio::any_io_executor> strand;
  asio::posix::stream_descriptor acceptor;
  asio::steady_timer pause;
  Listener listener;
  std::shared_ptr<ServerShared> shared;

  mutable std::mutex mutex;
  std::map<std::uint64_t, std::weak_ptr<ServerConnection>> connections;
  std::map<std::uint64_t, std::string> half_open;   ///< With their addresses.
  std::map<std::string, std::size_t> half_open_of;  ///< How many of each address.
  std::set<std::uint64_t> refused;                  ///< Still being told why.
  std::uint64_t next_id = shared->options.first_client_id;
  bool stopped = false;

  asio::awaitable<void> accept_all() {
    for (int accepted = 0;;) {
      sockaddr_storage from{};
      socklen_t from_bytes = sizeof(from);
      const int fd = ::accept4(listener.fd.get(), reinterpret_cast<sockaddr*>(&from), &from_bytes,
                               SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fd >= 0) {
        welcome(FileDescriptor(fd), address_of(from));
        if (++accepted % accepts_per_turn == 0) co_await asio::post(strand, asio::use_awaitable);
        continue;
      }
      if (errno == EINTR || errno == ECONNABORTED) continue;
      if (errno != EAGAIN && errno != EWOULDBLOCK) {
        shared->log.warning("cannot accept a connection: {}", std::strerror(errno));
        pause.expires_after(accept_pause);
        const auto [error] = co_await pause.async_wait(asio::as_tuple(asio::use_awaitable));
        if (error || is_stopped()) co_return;
        continue;
      }
      const auto [error] = co_await acceptor.async_wait(asio::posix::stream_descriptor::wait_read,
                                                        asio::as_tuple(asio::use_awaitable));
      if (error || is_stopped()) co_return;
    }
  }

  bool is_stopped() const {
    const std::lock_guard lock(mutex);
    return stopped;
  }

  /// Why nobody else can come from there now; nullopt: they can. With the mutex held.
  std::optional<Error> no_room(const std::string& address) const {
    const auto told = [](std::string message) {
      return make_error(ErrorCode::resource_exhausted, std::move(message), "connection");
    };
    const std::size_t taken = connections.size() - refused.size();
    if (taken >= shared->options.max_connections)
      return told(fmt::format("there are {} connections already", taken));
    if (half_open.size() >= shared->options.max_half_open)
      return told(fmt::format("{} connections have not said hello yet", half_open.size()));
    const auto of_address = half_open_of.find(limited_address(address));
    if (!address.empty() && of_address != half_open_of.end() &&
        of_address->second >= shared->options.max_half_open_per_address)
      return told(fmt::format("{} connections of {} have not said hello yet", of_address->second, address));
    return std::nullopt;
  }

  /// Those who are told why they are refused take a descriptor for up to a second; a crowd is not even told,
  /// and costs no more than the accepting.
  bool turned_away(const std::string& address) const {
    const std::lock_guard lock(mutex);
    return stopped || (refused.size() >= shared->options.max_half_open && no_room(address));
  }

  void welcome(FileDescriptor fd, std::string address) {
    if (turned_away(address)) return;
    const Status known =
        shared->options.local_users == LocalUsers::any ? Status() : check_peer(fd.get(), listener.endpoint);
    if (!known) {
      shared->log.warning("a connection is refused: {}", known.error().describe());
      return;
    }
    if (listener.endpoint.kind != Endpoint::Kind::unix_socket) {
      const int on = 1;
      setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    }
    if (const int bytes = shared->options.send_buffer_bytes; bytes > 0) {
      setsockopt(fd.get(), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
    }
    ConnectionOrigin origin;
    origin.address = std::move(address);
    if (listener.endpoint.kind == Endpoint::Kind::unix_socket) origin.uid = user_of(fd.get());
    std::unique_ptr<ByteStream> stream;
    if (listener.endpoint.kind == Endpoint::Kind::tls) {
      auto opened = shared->options.tls->open(fd.get());
      if (!opened) {
        shared->log.warning("a connection is refused: {}", opened.error().describe());
        return;
      }
      stream = std::move(*opened);
      origin.channel = ConnectionOrigin::Channel::tls;
    } else {
      stream = make_plain_stream(fd.get());
    }
    std::optional<Error> full;
    std::shared_ptr<ServerConnection> connection;
    {
      const std::lock_guard lock(mutex);
      if (stopped) return;
      full = no_room(origin.address);
      const std::uint64_t id = next_id++;
      origin.number = id;
      if (full) {
        refused.insert(id);
      } else {
        const std::string counted = limited_address(origin.address);
        half_open.emplace(id, counted);
        ++half_open_of[counted];
      }
      connection = std::make_shared<ServerConnection>(executor, std::move(fd), std::move(stream),
                                                      std::move(origin), shared);
      connections.emplace(id, connection);
    }
    if (full) {
      connection->refuse(*full);
    } else {
      connection->start();
    }
  }

  void joined(std::uint64_t id) {
    const std::lock_guard lock(mutex);
    no_longer_half_open(id);
  }

  void no_longer_half_open(std::uint64_t id) {
    const auto found = half_open.find(id);
    if (found == half_open.end()) return;
    const auto count = half_open_of.find(found->second);
    if (count != half_open_of.end() && --count->second == 0) half_open_of.erase(count);
    half_open.erase(found);
  }

  void over(std::uint64_t id) {
    const std::lock_guard lock(mutex);
    no_longer_half_open(id);
    refused.erase(id);
    connections.erase(id);
  }

  void stop(const Error* reason) {
    std::vector<std::shared_ptr<ServerConnection>> open;
    {
      const std::lock_guard lock(mutex);
      if (stopped) return;
      stopped = true;
      for (const auto& [id, weak] : connections) {
        if (auto connection = weak.lock()) open.push_back(std::move(connection));
      }
    }
    for (const auto& connection : open) {
      if (reason != nullptr) {
        connection->fail(*reason);
      } else {
        connection->close();
      }
    }
    // The accepting coroutine uses the descriptors on its strand, so they are closed there.
    asio::dispatch(strand, [self = shared_from_this()] {
      boost::system::error_code ignored;
      self->acceptor.close(ignored);
      self->pause.cancel();
      close_listener(self->listener);
    });
  }
};

MessageServer::MessageServer(std::shared_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

MessageServer::~MessageServer() {
  stop();
}

Result<std::unique_ptr<MessageServer>> MessageServer::listen(asio::any_io_executor executor,
                                                             const Endpoint& endpoint, ServerOptions options,
                                                             ServerEvents events, const Clock& clock,
                                                             Logger log) {
  if (endpoint.kind == Endpoint::Kind::tls && options.tls == nullptr)
    return make_error(ErrorCode::invalid_argument,
                      "a tls: endpoint needs a certificate of the server's own and an authority", "endpoint");
  Result<Listener> listener = listen_on(endpoint, options.tcp_exposure);
  if (!listener) return listener.error();
  constexpr mode_t everybody = 0666;
  if (endpoint.kind == Endpoint::Kind::unix_socket && options.local_users == LocalUsers::any &&
      ::chmod(endpoint.path.c_str(), everybody) != 0)
    return make_error(
        ErrorCode::io,
        fmt::format("cannot open \"{}\" to other users: {}", endpoint.path, std::strerror(errno)),
        "endpoint");
  return serve(std::move(executor), std::move(*listener), std::move(options), std::move(events), clock,
               std::move(log));
}

Result<std::unique_ptr<MessageServer>> MessageServer::serve(asio::any_io_executor executor, Listener listener,
                                                            ServerOptions options, ServerEvents events,
                                                            const Clock& clock, Logger log) {
  auto shared = std::make_shared<ServerShared>(
      ServerShared{std::move(options), std::move(events), &clock, std::move(log), {}, {}});
  auto implementation =
      std::make_shared<Implementation>(std::move(executor), std::move(listener), std::move(shared));
  const std::weak_ptr<Implementation> weak = implementation;
  implementation->shared->on_joined = [weak](std::uint64_t id) {
    if (const auto self = weak.lock()) self->joined(id);
  };
  implementation->shared->on_over = [weak](std::uint64_t id) {
    if (const auto self = weak.lock()) self->over(id);
  };
  asio::co_spawn(
      implementation->strand,
      [implementation]() -> asio::awaitable<void> { co_await implementation->accept_all(); }, asio::detached);
  return std::unique_ptr<MessageServer>(new MessageServer(std::move(implementation)));
}

const Endpoint& MessageServer::endpoint() const {
  return implementation_->listener.endpoint;
}

std::size_t MessageServer::connection_count() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->connections.size();
}

void MessageServer::stop() {
  implementation_->stop(nullptr);
}

void MessageServer::stop(const Error& reason) {
  implementation_->stop(&reason);
}

}  // namespace handloft::net
