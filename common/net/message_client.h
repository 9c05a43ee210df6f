#pragma once
// The other end of a MessageServer. MessageClient receives on a thread of its own, by the shortest way from
// the socket to the callback; SyncClient is for tools and tests that send, wait and look.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/endpoint.h"
#include "common/net/framing.h"
#include "common/net/tls.h"
#include "proto/session.pb.h"

namespace handloft::net {

enum class Reconnect { never, always };

struct ClientOptions {
  v1::Role role = v1::ROLE_UNSPECIFIED;
  std::string program = "handloft";
  std::string name;  ///< Shown to others.
  /// Random bytes (random_client_key()): with the same ones a client is the same when it comes again. Empty:
  /// another one each time.
  std::string client_key = {};
  std::uint32_t max_frame_bytes = default_max_frame_bytes;
  std::chrono::milliseconds connect_timeout{5000};  ///< All attempts of the first connect() together.
  /// Between two attempts; grows to ten times that while they fail, with jitter (backoff.h).
  std::chrono::milliseconds retry_interval{100};
  std::chrono::milliseconds handshake_timeout{5000};
  Reconnect reconnect = Reconnect::never;
  /// What may wait to be sent; more is refused by send().
  std::size_t max_queued_bytes = 8u << 20;
  /// A server that says nothing for a third of this is asked for a sign of life (Ping); when nothing came for
  /// all of it, the connection counts as gone: its host may have lost power, which no socket tells. 0: never.
  std::chrono::milliseconds silence_timeout{0};
  /// Of one received message (message_parts.h); more end the connection. 0: any number.
  std::size_t max_message_parts = 0;
  std::shared_ptr<const TlsContext> tls = {};  ///< For tls: endpoints, which need one.
};

/// The server's clock as seen from here, from the four times of the handshake: good to half the round trip.
struct ClockOffset {
  Duration server_minus_client{};
  Duration round_trip{};
  TimePoint to_server(TimePoint here) const { return here + server_minus_client; }
  TimePoint to_client(TimePoint there) const { return there - server_minus_client; }
};

/// 32 bytes that nobody guesses.
std::string random_client_key();

/// Callbacks come from the client's thread, one after another. Any may be empty.
struct ClientEvents {
  /// After each handshake, also the first one (before connect() returns): ask for the state here (Join,
  /// Subscribe).
  std::function<void(const v1::Welcome&, const ClockOffset&)> on_connected;
  /// Every message but Ping and Pong. The envelope may be moved from; it is reused otherwise.
  std::function<void(v1::Envelope&)> on_message;
  /// The connection is gone; with Reconnect::always another on_connected may follow.
  std::function<void(const Error&)> on_disconnected;
  /// An attempt to connect failed, and another will follow: nobody listens, another version, no answer.
  std::function<void(const Error&)> on_attempt_failed;
};

class MessageClient {
 public:
  /// Connects and shakes hands, trying again while nobody listens until connect_timeout. Errors: timeout,
  /// not_found, and the server's own refusal (unsupported names both versions).
  static Result<std::unique_ptr<MessageClient>> connect(const Endpoint& endpoint, ClientOptions options,
                                                        ClientEvents events, const Clock& clock, Logger log);
  /// Like connect() but returns at once: the first connection is made by the client's thread, and again
  /// whenever it breaks (Reconnect::always is implied).
  static std::unique_ptr<MessageClient> start(const Endpoint& endpoint, ClientOptions options,
                                              ClientEvents events, const Clock& clock, Logger log);
  /// Ends the thread at once, also amid a handshake; no callback comes afterwards. Not from a callback.
  ~MessageClient();
  MessageClient(const MessageClient&) = delete;
  MessageClient& operator=(const MessageClient&) = delete;

  /// Thread-safe, also from callbacks; never blocks. failed_precondition: not connected; resource_exhausted:
  /// too much waits or too large.
  Status send(const v1::Envelope& envelope);
  bool connected() const;
  std::uint64_t client_id() const;   ///< Of the last Welcome; 0 before.
  ClockOffset clock_offset() const;  ///< Of the last handshake.
  std::uint64_t frames_received() const;

 private:
  struct Implementation;
  explicit MessageClient(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

/// A blocking client without threads. Not thread-safe.
class SyncClient {
 public:
  static Result<SyncClient> connect(const Endpoint& endpoint, const ClientOptions& options,
                                    const Clock& clock);
  SyncClient(SyncClient&&) noexcept;
  SyncClient& operator=(SyncClient&&) noexcept;
  ~SyncClient();

  Status send(const v1::Envelope& envelope);
  /// Raw bytes as they are, for tests that misbehave.
  Status send_bytes(std::string_view bytes);
  /// The next message; timeout when none came, io when the connection ended.
  Result<v1::Envelope> receive(std::chrono::milliseconds timeout);

  const v1::Welcome& welcome() const;
  const ClockOffset& clock_offset() const;
  int fd() const;

 private:
  struct Implementation;
  explicit SyncClient(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::net
