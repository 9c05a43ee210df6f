#pragma once
// Where a program listens or connects: "unix:/run/user/1000/handloft/tracking.sock" or "tcp:127.0.0.1:7400",
// or across hosts "tls:studio.example:7401" (tls.h).

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace handloft::net {

/// A sockaddr_un holds 108 bytes with the final zero.
inline constexpr std::size_t max_unix_path_bytes = 107;

struct Endpoint {
  enum class Kind { unix_socket, tcp, tls };
  Kind kind = Kind::unix_socket;
  std::string path;  ///< unix: absolute or relative path of the socket.
  std::string host;  ///< tcp, tls: name or address, IPv6 without its brackets.
  std::uint16_t port =
      0;  ///< tcp, tls: 0 lets the system choose; a listening server reports the port it got.

  /// As parse_endpoint() reads it.
  std::string to_string() const;
  bool operator==(const Endpoint&) const = default;
};

/// Refuses with invalid_argument (field "endpoint"): an unknown scheme, an empty or too long path, no or a
/// bad port. IPv6 addresses stand in brackets: "tcp:[::1]:7400".
Result<Endpoint> parse_endpoint(std::string_view text);

/// $XDG_RUNTIME_DIR/handloft, or /tmp/handloft-<uid> without that variable: 0700 and ours. Created when
/// missing; a folder that others may write to is refused with permission_denied.
Result<std::string> runtime_folder();

/// unix:<runtime_folder>/tracking.sock and model.sock.
Result<Endpoint> default_tracking_endpoint();
Result<Endpoint> default_model_endpoint();
/// The video ring's own socket beside the tracking socket: "<path>.video". Refused for tcp: video is shared
/// memory.
Result<Endpoint> video_endpoint(const Endpoint& tracking);

/// A file descriptor that closes itself.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() { reset(); }
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(other.release()) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    if (this != &other) reset(other.release());
    return *this;
  }
  int get() const { return fd_; }
  bool valid() const { return fd_ >= 0; }
  int release() {
    const int fd = fd_;
    fd_ = -1;
    return fd;
  }
  void reset(int fd = -1);

 private:
  int fd_ = -1;
};

/// Plain TCP knows no users, so other hosts must be asked for. TLS does: it listens wherever it is told to.
enum class TcpExposure { loopback_only, any_address };

struct Listener {
  FileDescriptor fd;
  Endpoint endpoint;         ///< With the port that the system chose.
  std::uint64_t device = 0;  ///< unix: which file it is, so that only our own is removed.
  std::uint64_t inode = 0;
};

/// A non-blocking listening socket. unix: the socket file gets mode 0600; a stale one (nobody answers) is
/// removed, a live one is refused with already_exists.
Result<Listener> listen_on(const Endpoint& endpoint, TcpExposure exposure = TcpExposure::loopback_only);

/// A listening socket that was made for us, as by systemd's socket activation: made non-blocking; its file is
/// its maker's and stays. Errors (field "endpoint"): invalid_argument for what is no listening stream socket,
/// permission_denied for a TCP one beyond loopback.
Result<Listener> adopt_listener(FileDescriptor fd);

/// Closes it and removes its socket file, unless another server has put its own there meanwhile.
void close_listener(Listener& listener);

/// A connected blocking socket, TCP_NODELAY set. Errors: not_found (nobody listens), timeout, io.
Result<FileDescriptor> connect_to(const Endpoint& endpoint, int timeout_ms);

/// Refuses a unix peer of another user (root and ourselves may); tcp and tls peers pass.
Status check_peer(int fd, const Endpoint& endpoint);

}  // namespace handloft::net
