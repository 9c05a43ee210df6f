#include "common/net/message_server.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cerrno>
#include <cstring>
#include <map>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <vector>

#include "common/net/address.h"
#include "common/net/server_connection.h"

namespace handloft::net {

namespace asio = boost::asio;

namespace {
/// Out of file descriptors: try again when some may have been closed.
constexpr std::chrono::milliseconds accept_pause{100};

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
        until_stopped(asio::make_work_guard(executor)),
        door_open(asio::make_work_guard(*door)),
        budget(common->options.handshakes),
        acceptor(*door, ::dup(taken.fd.get())),
        pause(*door),
        listener(std::move(taken)),
        shared(std::move(common)) {}

  asio::any_io_executor executor;
  /// Whoever runs the executor runs it as long as somebody may come in.
  asio::executor_work_guard<asio::any_io_executor> until_stopped;
  /// Runs on a thread of its own, which accepts and turns away: a crowd takes none of the time of those who
  /// are in.
  std::shared_ptr<asio::io_context> door = std::make_shared<asio::io_context>(1);
  asio::executor_work_guard<asio::io_context::executor_type> door_open;
  HandshakeBudget budget;  ///< Guarded by the mutex, as what follows it.
  RateLimit let_go_rate{std::chrono::seconds(1)};
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
    for (;;) {
      sockaddr_storage from{};
      socklen_t from_bytes = sizeof(from);
      const int fd = ::accept4(listener.fd.get(), reinterpret_cast<sockaddr*>(&from), &from_bytes,
                               SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fd >= 0) {
        try {
          welcome(FileDescriptor(fd), address_of(from));
        } catch (const std::exception& error) {  // Out of memory or descriptors: the next may have more.
          current()->log.error("a connection could not be begun: {}", error.what());
        }
        // A crowd may never end: let stop() have its turn.
        co_await asio::post(*door, asio::use_awaitable);
        continue;
      }
      if (errno == EINTR || errno == ECONNABORTED) continue;
      if (errno != EAGAIN && errno != EWOULDBLOCK) {
        current()->log.warning("cannot accept a connection: {}", std::strerror(errno));
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

  std::shared_ptr<ServerShared> current() const {
    const std::lock_guard lock(mutex);
    return shared;
  }

  bool is_stopped() const {
    const std::lock_guard lock(mutex);
    return stopped;
  }

  std::size_t half_open_from(const std::string& address) const {
    const auto found = half_open_of.find(limited_address(address));
    return found == half_open_of.end() ? 0 : found->second;
  }

  /// Of those who have not said hello the oldest of the address that has most of them, where there are as
  /// many as may be and a newcomer's address has fewer; nullopt: nobody has to make room. With the mutex
  /// held.
  std::optional<std::uint64_t> crowded_out_by(const std::string& address) const {
    if (address.empty() || half_open.size() < shared->options.max_half_open) return std::nullopt;
    const auto most = std::max_element(half_open_of.begin(), half_open_of.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most == half_open_of.end() || most->second <= half_open_from(address) + 1) return std::nullopt;
    const auto oldest = std::find_if(half_open.begin(), half_open.end(),
                                     [&](const auto& each) { return each.second == most->first; });
    return oldest == half_open.end() ? std::nullopt : std::optional(oldest->first);
  }

  /// By TLS even a refusal in words costs a handshake: one more than may come of an address is let go
  /// without. Empty: it may begin.
  std::string let_go(const std::string& address) {
    const std::lock_guard lock(mutex);
    if (half_open_from(address) >= shared->options.max_half_open_per_address)
      return "too many connections of its address have not said hello yet";
    if (!budget.take(limited_address(address), std::chrono::steady_clock::now()))
      return "more TLS handshakes a second than may be";
    return {};
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
    const std::size_t of_address = half_open_from(address);
    if (!address.empty() && of_address >= shared->options.max_half_open_per_address)
      return told(fmt::format("{} connections of {} have not said hello yet", of_address, address));
    return std::nullopt;
  }

  /// Those who are told why they are refused take a descriptor for up to a second; a crowd is not even told,
  /// and costs no more than the accepting.
  bool turned_away(const std::string& address) const {
    const std::lock_guard lock(mutex);
    return stopped ||
           (refused.size() >= shared->options.max_half_open && no_room(address) && !crowded_out_by(address));
  }

  void tell_refused(const ServerShared& now, const std::string& address, const Error& error) {
    if (now.events.on_refused) now.events.on_refused(RefusedAt::connection, error);
    const auto kept_back = let_go_rate.allow(from_ns(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                                         std::chrono::steady_clock::now().time_since_epoch())
                                                         .count()));
    if (!kept_back) return;
    now.log.with("remote", address.empty() ? "unix" : address)
        .warning("a connection is refused: {}{}", error.describe(),
                 *kept_back > 0 ? fmt::format(" (and {} more)", *kept_back) : "");
  }

  void welcome(FileDescriptor fd, std::string address) {
    const std::shared_ptr<ServerShared> now = current();
    if (turned_away(address)) {
      tell_refused(*now, address,
                   make_error(ErrorCode::resource_exhausted, "a crowd at the door", "connection"));
      return;
    }
    const Status known =
        now->options.local_users == LocalUsers::any ? Status() : check_peer(fd.get(), listener.endpoint);
    if (!known) {
      tell_refused(*now, address, known.error());
      return;
    }
    if (listener.endpoint.kind == Endpoint::Kind::tls) {
      if (const std::string reason = let_go(address); !reason.empty()) {
        tell_refused(*now, address, make_error(ErrorCode::resource_exhausted, reason, "connection"));
        return;
      }
    }
    if (listener.endpoint.kind != Endpoint::Kind::unix_socket) {
      const int on = 1;
      setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    }
    if (const int bytes = now->options.send_buffer_bytes; bytes > 0) {
      setsockopt(fd.get(), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
    }
    ConnectionOrigin origin;
    origin.address = std::move(address);
    if (listener.endpoint.kind == Endpoint::Kind::unix_socket) origin.uid = user_of(fd.get());
    std::unique_ptr<ByteStream> stream;
    if (listener.endpoint.kind == Endpoint::Kind::tls) {
      auto opened = now->options.tls->open(fd.get());
      if (!opened) {
        tell_refused(*now, origin.address, opened.error());
        return;
      }
      stream = std::move(*opened);
      origin.channel = ConnectionOrigin::Channel::tls;
    } else {
      stream = make_plain_stream(fd.get());
    }
    std::uint64_t id = 0;
    try {
      begin(std::move(fd), std::move(stream), std::move(origin), now, id);
    } catch (...) {
      over(id);
      throw;
    }
  }

  /// `id`: by which it is counted, as soon as it is.
  void begin(FileDescriptor fd, std::unique_ptr<ByteStream> stream, ConnectionOrigin origin,
             const std::shared_ptr<ServerShared>& now, std::uint64_t& id) {
    std::optional<Error> full;
    std::shared_ptr<ServerConnection> connection, crowded_out;
    {
      const std::lock_guard lock(mutex);
      if (stopped) return;
      if (const auto oldest = crowded_out_by(origin.address)) {
        no_longer_half_open(*oldest);
        if (const auto found = connections.find(*oldest); found != connections.end())
          crowded_out = found->second.lock();
      }
      full = no_room(origin.address);
      id = next_id++;
      origin.number = id;
      if (full) {
        refused.insert(id);
        origin.room = ConnectionOrigin::Room::none;
      } else {
        const std::string counted = limited_address(origin.address);
        half_open.emplace(id, counted);
        ++half_open_of[counted];
      }
      connection = std::make_shared<ServerConnection>(executor, std::move(fd), std::move(stream),
                                                      std::move(origin), now);
      connections.emplace(id, connection);
    }
    if (crowded_out) crowded_out->drop("it made room for one of another address");
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
    // The accepting coroutine uses the descriptors on its thread, so they are closed there.
    asio::post(*door, [self = shared_from_this()] {
      boost::system::error_code ignored;
      self->acceptor.close(ignored);
      self->pause.cancel();
      close_listener(self->listener);
      self->door_open.reset();
      self->until_stopped.reset();
    });
  }
};

MessageServer::MessageServer(std::shared_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)), door_([door = implementation_->door] { door->run(); }) {}

MessageServer::~MessageServer() {
  stop();
  // A callback of the door may have held the last reference to the owner of this.
  if (door_.get_id() == std::this_thread::get_id()) {
    door_.detach();
  } else {
    door_.join();
  }
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
  std::shared_ptr<Implementation> implementation;
  try {
    implementation =
        std::make_shared<Implementation>(std::move(executor), std::move(listener), std::move(shared));
    const std::weak_ptr<Implementation> weak = implementation;
    implementation->shared->on_joined = [weak](std::uint64_t id) {
      if (const auto self = weak.lock()) self->joined(id);
    };
    implementation->shared->on_over = [weak](std::uint64_t id) {
      if (const auto self = weak.lock()) self->over(id);
    };
    asio::co_spawn(
        *implementation->door,
        [implementation]() -> asio::awaitable<void> { co_await implementation->accept_all(); },
        asio::detached);
    return std::unique_ptr<MessageServer>(new MessageServer(implementation));
  } catch (const std::system_error& error) {  // No descriptor, or no thread.
    if (implementation) {
      implementation->stop(nullptr);
      implementation->door->run();
    }
    return make_error(ErrorCode::resource_exhausted, fmt::format("nothing to accept with: {}", error.what()),
                      "endpoint");
  }
}

const Endpoint& MessageServer::endpoint() const {
  return implementation_->listener.endpoint;
}

std::size_t MessageServer::connection_count() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->connections.size();
}

void MessageServer::set_limits(const ServerOptions& options) {
  const std::lock_guard lock(implementation_->mutex);
  // Who is here keeps what it began with.
  auto changed = std::make_shared<ServerShared>(*implementation_->shared);
  ServerOptions& own = changed->options;
  own.hello_timeout = options.hello_timeout;
  own.max_connections = options.max_connections;
  own.max_half_open = options.max_half_open;
  own.max_half_open_per_address = options.max_half_open_per_address;
  own.handshakes = options.handshakes;
  own.max_messages_per_s = options.max_messages_per_s;
  own.outbox = options.outbox;
  own.send_buffer_bytes = options.send_buffer_bytes;
  implementation_->budget.set_rates(own.handshakes);
  implementation_->shared = std::move(changed);
}

void MessageServer::stop() {
  implementation_->stop(nullptr);
}

void MessageServer::stop(const Error& reason) {
  implementation_->stop(&reason);
}

}  // namespace handloft::net
