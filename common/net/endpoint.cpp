#include "common/net/endpoint.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <memory>

namespace handloft::net {

namespace {

static_assert(sizeof(sockaddr_un{}.sun_path) == max_unix_path_bytes + 1);

/// Connections that wait to be accepted: 32 subscribers that all start at once, twice.
constexpr int listen_backlog = 64;

Error endpoint_error(ErrorCode code, std::string_view text, const std::string& problem) {
  return make_error(code, fmt::format("\"{}\": {}", text, problem), "endpoint");
}

Error system_error(ErrorCode code, const Endpoint& endpoint, std::string_view what, int number) {
  return endpoint_error(code, endpoint.to_string(), fmt::format("{}: {}", what, std::strerror(number)));
}

sockaddr_un unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), std::min(path.size(), max_unix_path_bytes));
  return address;
}

using AddressList = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

Result<AddressList> resolve(const Endpoint& endpoint, int flags) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int status =
      getaddrinfo(endpoint.host.c_str(), std::to_string(endpoint.port).c_str(), &hints, &found);
  if (status != 0 || found == nullptr) {
    return endpoint_error(ErrorCode::not_found, endpoint.to_string(),
                          fmt::format("the host is unknown: {}", gai_strerror(status)));
  }
  return AddressList(found, &freeaddrinfo);
}

bool is_loopback(const sockaddr* address) {
  if (address->sa_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, address, sizeof(v4));
    return (ntohl(v4.sin_addr.s_addr) >> 24) == 127;
  }
  if (address->sa_family == AF_INET6) {
    sockaddr_in6 v6{};
    std::memcpy(&v6, address, sizeof(v6));
    return IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr) != 0;
  }
  return false;
}

void set_no_delay(int fd) {
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
}

// Makes way for our socket file: a socket that nobody answers is what a crash left behind.
Status clear_stale_socket(const Endpoint& endpoint, const sockaddr_un& address) {
  struct stat status {};
  if (lstat(endpoint.path.c_str(), &status) != 0) return {};
  if (!S_ISSOCK(status.st_mode)) {
    return endpoint_error(ErrorCode::already_exists, endpoint.to_string(),
                          "there is a file of that name that is not a socket");
  }
  const FileDescriptor probe(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!probe.valid()) return system_error(ErrorCode::io, endpoint, "socket", errno);
  const int connected = connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  if (connected == 0 || errno == EAGAIN) {
    return endpoint_error(ErrorCode::already_exists, endpoint.to_string(), "another server listens there");
  }
  if (errno != ECONNREFUSED)
    return system_error(ErrorCode::io, endpoint, "a socket file is in the way", errno);
  if (unlink(endpoint.path.c_str()) != 0) {
    return system_error(ErrorCode::io, endpoint, "cannot remove the stale socket file", errno);
  }
  return {};
}

Result<Listener> listen_unix(const Endpoint& endpoint) {
  const sockaddr_un address = unix_address(endpoint.path);
  if (const Status cleared = clear_stale_socket(endpoint, address); !cleared) return cleared.error();
  Listener listener;
  listener.endpoint = endpoint;
  listener.fd.reset(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!listener.fd.valid()) return system_error(ErrorCode::io, endpoint, "socket", errno);
  // The mode of the descriptor becomes the file's, so that there is no moment at which others may connect.
  fchmod(listener.fd.get(), S_IRUSR | S_IWUSR);
  if (bind(listener.fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return system_error(ErrorCode::io, endpoint, "cannot listen", errno);
  }
  struct stat status {};
  if (stat(endpoint.path.c_str(), &status) == 0) {
    listener.device = static_cast<std::uint64_t>(status.st_dev);
    listener.inode = static_cast<std::uint64_t>(status.st_ino);
  }
  if (chmod(endpoint.path.c_str(), S_IRUSR | S_IWUSR) != 0 ||
      listen(listener.fd.get(), listen_backlog) != 0) {
    return system_error(ErrorCode::io, endpoint, "cannot listen", errno);
  }
  return listener;
}

Result<Listener> listen_tcp(const Endpoint& endpoint, TcpExposure exposure) {
  Result<AddressList> addresses = resolve(endpoint, AI_PASSIVE);
  if (!addresses) return addresses.error();
  const addrinfo& address = **addresses;
  if (endpoint.kind == Endpoint::Kind::tcp && exposure == TcpExposure::loopback_only &&
      !is_loopback(address.ai_addr)) {
    return endpoint_error(ErrorCode::permission_denied, endpoint.to_string(),
                          "plain TCP has no users or passwords, so only loopback addresses are allowed");
  }
  Listener listener;
  listener.endpoint = endpoint;
  listener.fd.reset(socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!listener.fd.valid()) return system_error(ErrorCode::io, endpoint, "socket", errno);
  const int on = 1;
  setsockopt(listener.fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  if (bind(listener.fd.get(), address.ai_addr, address.ai_addrlen) != 0 ||
      listen(listener.fd.get(), listen_backlog) != 0) {
    const ErrorCode code = errno == EADDRINUSE ? ErrorCode::already_exists : ErrorCode::io;
    return system_error(code, endpoint, "cannot listen", errno);
  }
  sockaddr_storage bound{};
  socklen_t length = sizeof(bound);
  if (getsockname(listener.fd.get(), reinterpret_cast<sockaddr*>(&bound), &length) != 0) {
    return system_error(ErrorCode::io, endpoint, "getsockname", errno);
  }
  // Port and family lie at the same place in both kinds of address.
  sockaddr_in as_v4{};
  std::memcpy(&as_v4, &bound, sizeof(as_v4));
  listener.endpoint.port = ntohs(as_v4.sin_port);
  return listener;
}

// Connects a fresh non-blocking socket and makes it blocking. ETIMEDOUT, or what connect() says; 0 when it is
// done.
int finish_connect(int fd, const sockaddr* address, socklen_t length, int timeout_ms) {
  if (connect(fd, address, length) != 0) {
    if (errno != EINPROGRESS) return errno;
    pollfd writable{fd, POLLOUT, 0};
    const int ready = poll(&writable, 1, timeout_ms);
    if (ready <= 0) return ready == 0 ? ETIMEDOUT : errno;
    int error = 0;
    socklen_t size = sizeof(error);
    getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) return error;
  }
  const int flags = fcntl(fd, F_GETFL);
  return fcntl(fd, F_SETFL, flags & ~O_NONBLOCK) == 0 ? 0 : errno;
}

Error connect_error(const Endpoint& endpoint, int number) {
  switch (number) {
    case ENOENT:
    case ECONNREFUSED:
      return endpoint_error(ErrorCode::not_found, endpoint.to_string(), "nobody listens there");
    case ETIMEDOUT:
    case EAGAIN:
      return endpoint_error(ErrorCode::timeout, endpoint.to_string(), "no answer");
    case EACCES:
    case EPERM:
      return endpoint_error(ErrorCode::permission_denied, endpoint.to_string(), "it belongs to another user");
    default:
      return system_error(ErrorCode::io, endpoint, "cannot connect", number);
  }
}

}  // namespace

void FileDescriptor::reset(int fd) {
  if (fd_ >= 0) ::close(fd_);
  fd_ = fd;
}

std::string Endpoint::to_string() const {
  if (kind == Kind::unix_socket) return "unix:" + path;
  const bool is_v6 = host.find(':') != std::string::npos;
  const std::string_view scheme = kind == Kind::tls ? "tls" : "tcp";
  return is_v6 ? fmt::format("{}:[{}]:{}", scheme, host, port) : fmt::format("{}:{}:{}", scheme, host, port);
}

Result<Endpoint> parse_endpoint(std::string_view text) {
  const auto bad = [text](const std::string& problem) {
    return endpoint_error(ErrorCode::invalid_argument, text.substr(0, 200), problem);
  };
  if (text.find('\0') != std::string_view::npos) return bad("holds a zero byte");
  Endpoint endpoint;
  if (text.starts_with("unix:")) {
    endpoint.path = text.substr(5);
    if (endpoint.path.empty()) return bad("expected a path after unix:");
    if (endpoint.path.size() > max_unix_path_bytes) {
      return bad(fmt::format("the path has {} bytes, a socket's may have {}", endpoint.path.size(),
                             max_unix_path_bytes));
    }
    return endpoint;
  }
  if (!text.starts_with("tcp:") && !text.starts_with("tls:"))
    return bad("expected unix:PATH, tcp:HOST:PORT or tls:HOST:PORT");
  endpoint.kind = text.starts_with("tls:") ? Endpoint::Kind::tls : Endpoint::Kind::tcp;
  const std::string_view rest = text.substr(4);
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos) return bad("expected HOST:PORT");
  std::string_view host = rest.substr(0, colon);
  const std::string_view port = rest.substr(colon + 1);
  const bool in_brackets = host.starts_with('[') && host.ends_with(']') && host.size() > 2;
  if (in_brackets) {
    host = host.substr(1, host.size() - 2);
    if (host.find(':') == std::string_view::npos || host.find_first_of("[]") != std::string_view::npos) {
      return bad("expected an IPv6 address in the brackets");
    }
  } else if (host.find_first_of(":[]") != std::string_view::npos) {
    return bad("an IPv6 address stands in brackets: tcp:[::1]:7400");
  }
  if (host.empty() || host.size() > 255) return bad("expected a host of 1 to 255 bytes");
  const auto [stop, error] = std::from_chars(port.data(), port.data() + port.size(), endpoint.port);
  if (error != std::errc{} || stop != port.data() + port.size()) {
    return bad(fmt::format("found port \"{}\", expected 0 to 65535", port));
  }
  endpoint.host = host;
  return endpoint;
}

Result<std::string> runtime_folder() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  const std::string folder = runtime != nullptr && runtime[0] == '/'
                                 ? std::string(runtime) + "/handloft"
                                 : fmt::format("/tmp/handloft-{}", geteuid());
  if (mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST) {
    return make_error(ErrorCode::io,
                      fmt::format("cannot make the folder {}: {}", folder, std::strerror(errno)),
                      "runtime_folder");
  }
  struct stat status {};
  if (lstat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) || status.st_uid != geteuid() ||
      (status.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    return make_error(ErrorCode::permission_denied,
                      fmt::format("{} must be a folder of ours that nobody else may write to", folder),
                      "runtime_folder");
  }
  return folder;
}

namespace {
Result<Endpoint> in_runtime_folder(std::string_view name) {
  const Result<std::string> folder = runtime_folder();
  if (!folder) return folder.error();
  return parse_endpoint(fmt::format("unix:{}/{}", *folder, name));
}
}  // namespace

Result<Endpoint> default_tracking_endpoint() {
  return in_runtime_folder("tracking.sock");
}
Result<Endpoint> default_model_endpoint() {
  return in_runtime_folder("model.sock");
}

Result<Endpoint> video_endpoint(const Endpoint& tracking) {
  if (tracking.kind != Endpoint::Kind::unix_socket) {
    return endpoint_error(ErrorCode::unsupported, tracking.to_string(),
                          "video goes through shared memory, which needs a unix: endpoint");
  }
  return parse_endpoint("unix:" + tracking.path + ".video");
}

Result<Listener> listen_on(const Endpoint& endpoint, TcpExposure exposure) {
  return endpoint.kind == Endpoint::Kind::unix_socket ? listen_unix(endpoint)
                                                      : listen_tcp(endpoint, exposure);
}

Result<Listener> adopt_listener(FileDescriptor fd) {
  const auto refuse = [](ErrorCode code, const std::string& problem) {
    return endpoint_error(code, "inherited socket", problem);
  };
  int type = 0, listening = 0;
  socklen_t length = sizeof(type);
  if (getsockopt(fd.get(), SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_STREAM)
    return refuse(ErrorCode::invalid_argument, "expected a stream socket (ListenStream=)");
  length = sizeof(listening);
  if (getsockopt(fd.get(), SOL_SOCKET, SO_ACCEPTCONN, &listening, &length) != 0 || listening == 0)
    return refuse(ErrorCode::invalid_argument, "expected one that listens (Accept=no)");
  sockaddr_storage bound{};
  socklen_t size = sizeof(bound);
  if (getsockname(fd.get(), reinterpret_cast<sockaddr*>(&bound), &size) != 0)
    return refuse(ErrorCode::io, fmt::format("getsockname: {}", std::strerror(errno)));
  Listener listener;
  if (bound.ss_family == AF_UNIX) {
    sockaddr_un address{};
    std::memcpy(&address, &bound, sizeof(address));
    listener.endpoint.path.assign(address.sun_path, strnlen(address.sun_path, sizeof(address.sun_path)));
    if (listener.endpoint.path.empty())
      return refuse(ErrorCode::invalid_argument, "expected a socket with a file, found an abstract one");
  } else {
    if (!is_loopback(reinterpret_cast<const sockaddr*>(&bound)))
      return refuse(ErrorCode::permission_denied, "plain TCP is for loopback addresses only");
    listener.endpoint.kind = Endpoint::Kind::tcp;
    std::array<char, NI_MAXHOST> host{};
    std::array<char, NI_MAXSERV> port{};
    if (getnameinfo(reinterpret_cast<const sockaddr*>(&bound), size, host.data(), host.size(), port.data(),
                    port.size(), NI_NUMERICHOST | NI_NUMERICSERV) != 0)
      return refuse(ErrorCode::io, "its address can't be read");
    listener.endpoint.host = host.data();
    sockaddr_in as_v4{};  // Port and family lie at the same place in both kinds of address.
    std::memcpy(&as_v4, &bound, sizeof(as_v4));
    listener.endpoint.port = ntohs(as_v4.sin_port);
  }
  const int flags = fcntl(fd.get(), F_GETFL);
  if (fcntl(fd.get(), F_SETFL, flags | O_NONBLOCK) != 0 || fcntl(fd.get(), F_SETFD, FD_CLOEXEC) != 0)
    return refuse(ErrorCode::io, fmt::format("fcntl: {}", std::strerror(errno)));
  listener.fd = std::move(fd);
  return listener;
}

void close_listener(Listener& listener) {
  if (!listener.fd.valid()) return;
  listener.fd.reset();
  if (listener.endpoint.kind != Endpoint::Kind::unix_socket) return;
  struct stat status {};
  if (lstat(listener.endpoint.path.c_str(), &status) == 0 &&
      static_cast<std::uint64_t>(status.st_dev) == listener.device &&
      static_cast<std::uint64_t>(status.st_ino) == listener.inode) {
    unlink(listener.endpoint.path.c_str());
  }
}

Result<FileDescriptor> connect_to(const Endpoint& endpoint, int timeout_ms) {
  if (endpoint.kind == Endpoint::Kind::unix_socket) {
    const sockaddr_un address = unix_address(endpoint.path);
    FileDescriptor fd(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!fd.valid()) return system_error(ErrorCode::io, endpoint, "socket", errno);
    const int error =
        finish_connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address), timeout_ms);
    if (error != 0) return connect_error(endpoint, error);
    return fd;
  }
  Result<AddressList> addresses = resolve(endpoint, 0);
  if (!addresses) return addresses.error();
  int last_error = ECONNREFUSED;
  for (const addrinfo* address = addresses->get(); address != nullptr; address = address->ai_next) {
    FileDescriptor fd(socket(address->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!fd.valid()) continue;
    last_error = finish_connect(fd.get(), address->ai_addr, address->ai_addrlen, timeout_ms);
    if (last_error != 0) continue;
    set_no_delay(fd.get());
    return fd;
  }
  return connect_error(endpoint, last_error);
}

Status check_peer(int fd, const Endpoint& endpoint) {
  if (endpoint.kind != Endpoint::Kind::unix_socket) return {};
  ucred peer{};
  socklen_t size = sizeof(peer);
  if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    return system_error(ErrorCode::io, endpoint, "cannot tell who connects", errno);
  }
  if (peer.uid == geteuid() || peer.uid == 0) return {};
  return endpoint_error(ErrorCode::permission_denied, endpoint.to_string(),
                        fmt::format("user {} may not connect, only user {}", peer.uid, geteuid()));
}

}  // namespace handloft::net
