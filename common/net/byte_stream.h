#pragma once
// What frames travel through: a socket as it is, or TLS over one. Never blocks; the caller waits for what an
// outcome asks for and calls again with the same bytes.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/net/certificates.h"
#include "common/net/endpoint.h"

namespace handloft::net {

struct StreamOutcome {
  enum class State {
    moved,        ///< `bytes` were read or written, at least one.
    wants_read,   ///< Nothing moved until the socket is readable,
    wants_write,  ///< or writable: with TLS either may be asked of either call.
    ended,        ///< The peer sends no more; only of read().
    failed,       ///< The connection is over; `problem` says why.
  };
  State state = State::failed;
  std::size_t bytes = 0;
  std::string problem = {};
};

/// read() and write() may be called by two threads at once, each by one.
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  virtual StreamOutcome read(std::span<std::uint8_t> room) = 0;
  virtual StreamOutcome write(std::span<const std::uint8_t> bytes) = 0;
  /// Tells the peer that nothing more comes.
  virtual void end_writing() = 0;
  /// Bytes that were read from the socket and not yet asked for: it may not become readable again for them.
  virtual bool has_unread() const = 0;
  /// Who the peer has proved to be; nullopt without a certificate, and until the handshake is over.
  virtual std::optional<CertificateFacts> peer() const = 0;
};

/// `fd` is a connected non-blocking socket that outlives the stream.
std::unique_ptr<ByteStream> make_plain_stream(int fd);

}  // namespace handloft::net
