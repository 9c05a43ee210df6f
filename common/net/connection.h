#pragma once
// One peer of a MessageServer after its handshake. Sending never blocks: when nothing waits, the bytes are
// written at once from the caller's thread (one system call, the shortest way to the receiver); otherwise
// they wait in the bounded Outbox and are written by the server's I/O threads as the peer reads.

#include <any>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/net/certificates.h"
#include "common/net/framing.h"
#include "common/net/outbox.h"
#include "proto/session.pb.h"

namespace handloft::net {

struct PeerInfo {
  v1::Role role = v1::ROLE_UNSPECIFIED;
  std::string program;
  std::string name;
  std::uint32_t protocol_minor = 0;
  std::int64_t hello_sent_ns = 0;  ///< t0 on the peer's clock, as it says.
  TimePoint hello_received;        ///< t1 on ours.
  /// Over TLS: who it has proved to be; what it calls itself in `name` is only its word.
  std::optional<CertificateFacts> certificate;
  std::string client_key = {};  ///< Of its Hello; checked for its length.
  /// unix: the user id that the kernel says the other end has (SO_PEERCRED).
  std::optional<std::uint32_t> uid = {};
  std::string address = {};  ///< tcp, tls: the other end's address, "192.0.2.7"; else empty.
};

/// Where it comes from, for people: its address, or on a unix socket whose it is.
std::string shown_remote(const PeerInfo& peer);

struct ConnectionStatistics {
  std::uint64_t frames_sent = 0;
  std::uint64_t writes = 0;  ///< In which they went: small ones that wait go together.
  std::uint64_t bytes_sent = 0;
  std::uint64_t frames_received = 0;
  std::uint64_t replaced = 0;   ///< Unsent states that a newer one replaced.
  std::uint64_t dropped = 0;    ///< States and notices for which there was no room.
  std::uint64_t overflows = 0;  ///< Times that the reliable queue was full.
  std::size_t queued_bytes = 0;
  std::size_t queued_frames = 0;
};

/// All methods are thread-safe and may be called from callbacks.
class Connection {
 public:
  virtual ~Connection() = default;

  /// The client_id of its Welcome: what ServerEvents::admit chose, else never used twice by one server.
  virtual std::uint64_t id() const = 0;
  virtual const PeerInfo& peer() const = 0;

  /// Into the reliable queue. When that is full, it is emptied, and on_overflow decides (ServerEvents); what
  /// is sent until then is dropped. False: closed, overflowed or larger than the peer's limit; the frame was
  /// not taken.
  virtual bool send(const v1::Envelope& envelope) = 0;
  virtual bool send(const Frame& frame) = 0;
  /// Newest wins among unsent frames of the same slot. Where the slot's lane is full, the frame is dropped
  /// and counted; the connection goes on. False: it was not taken.
  virtual bool send_latest(const SlotKey& slot, const Frame& frame) = 0;

  /// Asked for the next frame whenever the peer can take one and nothing else waits; nullopt: nothing to say
  /// until notify_pull(). Called by one thread at a time, with no lock of the connection's user held, but
  /// possibly from within notify_pull() or send(): so the function must not send to this connection itself.
  using Pull = std::function<std::optional<Frame>()>;
  virtual void set_pull(Pull pull) = 0;
  virtual void notify_pull() = 0;

  /// Waits until fewer than `frames` wait here: for replays, which may be slowed (never called by live
  /// sources). False: closed or timed out.
  virtual bool wait_until_queued_below(std::size_t frames, std::chrono::milliseconds timeout) = 0;

  /// Back-pressure: after the message that is being handled no further one is read or handled until
  /// resume_reading(); the peer's bytes wait in the kernel, and the peer with them. Pings wait too. Several
  /// pauses are one.
  virtual void pause_reading() = 0;
  virtual void resume_reading() = 0;

  /// Sends Failure{closing} after what already waits in the reliable queue, then closes.
  virtual void fail(const Error& error) = 0;
  /// Closes after what waits in the reliable queue is written, or after a second.
  virtual void close() = 0;
  virtual bool closed() const = 0;

  virtual ConnectionStatistics statistics() const = 0;

  /// Whatever the session layer keeps with a peer; touch it only from this connection's callbacks.
  std::any user_data;
};

using ConnectionPtr = std::shared_ptr<Connection>;

}  // namespace handloft::net
