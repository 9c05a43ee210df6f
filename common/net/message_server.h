#pragma once
// Listens, shakes hands (Hello/Welcome, PROTOCOL.md "Handshake") and runs one Connection a peer. A peer that
// sends something malformed, unknown or too large gets Failure{closing} and is closed; the others don't
// notice. Accepting and turning away have a thread of their own, so that a crowd at the door takes none of
// the time of those who are in (A1).

#include <boost/asio/any_io_executor.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/connection.h"
#include "common/net/endpoint.h"
#include "common/net/handshake_budget.h"
#include "common/net/tls.h"

namespace handloft::net {

inline constexpr std::uint32_t protocol_major = 1;
inline constexpr std::uint32_t protocol_minor = 3;

/// Whom a unix socket lets in.
enum class LocalUsers {
  own,  ///< Our own user and root; the socket file has mode 0600.
  any   ///< All of this host, 0666: ServerEvents::admit decides by PeerInfo::uid.
};

struct ServerOptions {
  std::string program = "handloft";  ///< In the Welcome: "handloft-modeld 0.1.0".
  std::uint32_t max_frame_bytes = default_max_frame_bytes;
  std::vector<v1::Role> roles = {};  ///< Who may come in; others are refused by name. Empty: every role.
  std::chrono::milliseconds hello_timeout{5000};  ///< A peer that has not said hello by then is closed.
  std::size_t max_connections = 256;  ///< With those in the handshake; more are refused with a reason.
  std::size_t max_half_open = 64;     ///< Peers in the handshake at a time.
  /// Of those of one address (of IPv6 one /64), so that one host alone cannot keep the others out; tcp and
  /// tls.
  std::size_t max_half_open_per_address = 32;
  HandshakeRates handshakes = {};  ///< By tls:; more are let go without a word.
  /// Messages of one peer in a second, on average over some seconds: whoever sends more is read more slowly,
  /// and nobody else notices. 0: any number.
  std::uint32_t max_messages_per_s = 0;
  /// Of the first connection; those after it count on. Servers of one session begin far apart, so that no two
  /// of its clients have the same.
  std::uint64_t first_client_id = 1;
  OutboxLimits outbox = {};
  /// States (send_latest()) that come sooner than this after the last ones wait for the rest of it, so that
  /// those of many people go to a receiver together, with one write, and wake it once. 0: each at once.
  std::chrono::microseconds states_apart{0};
  /// The kernel's buffer for each peer: what a slow reader still gets of the past before the newest. 0: the
  /// system's.
  int send_buffer_bytes = 256 << 10;
  LocalUsers local_users = LocalUsers::own;
  TcpExposure tcp_exposure = TcpExposure::loopback_only;
  std::shared_ptr<const TlsContext> tls = {};  ///< For tls: endpoints, which need one.
};

enum class OverflowAction {
  close,   ///< The peer gets Failure resource_exhausted and is closed.
  reseed,  ///< The callback has queued a whole new state.
};

/// Where somebody was refused, or failed by themselves.
enum class RefusedAt {
  connection,  ///< There was no room, or too many came at once.
  tls,         ///< In the TLS handshake.
  hello,
  pairing,
};

/// What a server decides of a peer before it says Welcome.
struct Admission {
  std::uint64_t client_id = 0;  ///< 0: the server's next free number.
  std::string user = {};        ///< For the log; empty: nobody that is known.
};

/// The first message of a peer that has no certificate yet, over TLS.
struct PairingRequest {
  v1::Pair pair;
  std::string address;
};
using PairingAnswer = std::function<void(Result<v1::Paired>)>;

/// Callbacks of one connection come one after another (a strand); those of different connections may come at
/// once when the executor has several threads. Any of them may be empty.
struct ServerEvents {
  /// After a good Hello and before the Welcome, by which the peer learns the id: an error refuses the peer
  /// with that Failure, and no other callback follows.
  std::function<Result<Admission>(const PeerInfo&)> admit;
  /// A Pair instead of a Hello, over TLS. The answer may be given later and by any thread, once; with it the
  /// connection ends. Empty: Pair is refused.
  std::function<void(const PairingRequest&, PairingAnswer)> on_pair;
  /// The handshake is done and the Welcome queued; an error refuses the peer with that Failure, and no other
  /// callback follows.
  std::function<Status(const ConnectionPtr&)> on_join;
  /// Every later message but Ping (answered already) and Hello (a violation). An error fails the connection.
  std::function<Status(const ConnectionPtr&, const v1::Envelope&)> on_message;
  /// Once for each joined connection; nothing follows. `reason` says why, in words.
  std::function<void(const ConnectionPtr&, const std::string& reason)> on_closed;
  /// Somebody did not come in. It must not call any connection, and may come from any thread.
  std::function<void(RefusedAt, const Error&)> on_refused;
  /// The outbox was full and has been emptied; send the whole state anew or let go.
  std::function<OverflowAction(const ConnectionPtr&)> on_overflow;
};

class MessageServer {
 public:
  /// Listens at once; callbacks come from the executor's threads, on_refused also from the door's. `clock`
  /// (for the Welcome's times) must outlive it. Errors: as listen_on(); invalid_argument for a tls: endpoint
  /// without ServerOptions::tls; resource_exhausted when no thread is to be had.
  static Result<std::unique_ptr<MessageServer>> listen(boost::asio::any_io_executor executor,
                                                       const Endpoint& endpoint, ServerOptions options,
                                                       ServerEvents events, const Clock& clock, Logger log);
  /// The same on a socket that listens already (adopt_listener()).
  static Result<std::unique_ptr<MessageServer>> serve(boost::asio::any_io_executor executor,
                                                      Listener listener, ServerOptions options,
                                                      ServerEvents events, const Clock& clock, Logger log);
  /// stop().
  ~MessageServer();
  MessageServer(const MessageServer&) = delete;
  MessageServer& operator=(const MessageServer&) = delete;

  /// Other limits for who comes from now on: counts, rates, times, buffers and the outbox of `options`. What
  /// else it holds stays as it was.
  void set_limits(const ServerOptions& options);

  const Endpoint& endpoint() const;  ///< As bound: with the real port.
  std::size_t connection_count() const;

  /// Accepts nobody any more, closes every connection (after its queued frames, at most a second) and removes
  /// the socket file. Returns at once; the executor must go on running for the rest (on_closed comes from
  /// there).
  void stop();
  /// The same, and every peer is told why: Failure{closing}, after what waits for it.
  void stop(const Error& reason);

 private:
  struct Implementation;
  explicit MessageServer(std::shared_ptr<Implementation> implementation);
  std::shared_ptr<Implementation> implementation_;
  std::thread door_;
};

}  // namespace handloft::net
