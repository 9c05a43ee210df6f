#pragma once
// Connecting and shaking hands, as MessageClient and SyncClient both do it.

#include <chrono>

#include "common/net/byte_stream.h"
#include "common/net/message_client.h"

namespace handloft::net {

using SteadyTime = std::chrono::steady_clock::time_point;

/// A connection and what goes through it.
struct Link {
  FileDescriptor fd;                   ///< Blocking; the streams over it do not.
  std::unique_ptr<ByteStream> stream;  ///< Over fd; freed before it.
  bool secured = false;                ///< TLS.
};

struct Handshake {
  Link link;
  FrameDecoder decoder;  ///< May already hold bytes that followed the Welcome.
  v1::Welcome welcome;
  ClockOffset offset;
};

/// For `cancel_fd`: nothing ends the wait early.
inline constexpr int never_cancelled = -1;

/// One attempt. A Failure of the server comes back as its own error code and message. While it waits for the
/// server's words, `cancel_fd` (an eventfd) becoming readable ends it with `cancelled`.
Result<Handshake> shake_hands(const Endpoint& endpoint, const ClientOptions& options, const Clock& clock,
                              std::chrono::milliseconds timeout, int cancel_fd = never_cancelled);

/// The next whole message, timeout or cancelled. `envelope` is reused.
Status receive_one(Link& link, FrameDecoder& decoder, v1::Envelope& envelope, SteadyTime deadline,
                   int cancel_fd = never_cancelled);

/// Whether another attempt may succeed where this one failed: nobody listens yet, no answer.
bool worth_retrying(const Error& error);

/// What a closing Failure says, as an Error.
Error error_of(const v1::Failure& failure);

/// All bytes, waiting for room until the deadline.
Status send_all(Link& link, std::string_view bytes, SteadyTime deadline);

/// What poll() is to wait for before a call that had this outcome is made again.
short poll_events(const StreamOutcome& outcome);

}  // namespace handloft::net
