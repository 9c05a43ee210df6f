#pragma once
// Everybody who is connected to a model, whatever their messages come by: who they are, what they may do
// (U2), and what each is sent. All of the server but its sockets (server.h).

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/connection.h"
#include "common/net/endpoint.h"
#include "common/net/message_server.h"
#include "proto/session.pb.h"
#include "server-model/session/latency.h"
#include "server-model/session/model_actor.h"
#include "server-model/session/server_options.h"

namespace handloft::session {

struct Peer;
using PeerPtr = std::shared_ptr<Peer>;

class Peers : public std::enable_shared_from_this<Peers> {
 public:
  /// Starts the model's thread. `clock` must outlive it; `on_end_of_recording` comes from the model's thread.
  static std::shared_ptr<Peers> start(model::Model initial, ServerOptions options, const Clock& clock,
                                      const Logger& log, std::function<void()> on_end_of_recording = {});
  ~Peers();
  Peers(const Peers&) = delete;
  Peers& operator=(const Peers&) = delete;

  /// What a server whose endpoints are of that kind calls. Connections of all servers must have different
  /// ids.
  net::ServerEvents events(net::Endpoint::Kind kind);
  ModelActor& actor() { return *actor_; }
  const ServerOptions& options() const { return options_; }

  /// See Server.
  bool flushed() const;
  std::size_t viewer_count() const;
  std::size_t peer_count() const;
  std::uint64_t clients_served() const;
  LatencySummary capture_to_delta() const;

  /// No message is handled any more, and nobody comes in.
  void close();

 private:
  Peers(ServerOptions options, const Clock& clock, Logger log);

  std::vector<PeerPtr> everybody() const;
  void notify_viewers() const;
  /// To all that have joined but `from`; null: to all.
  void send_presence(const v1::Presence& presence, const Peer* from) const;

  Status on_join(const net::ConnectionPtr& connection, net::Endpoint::Kind kind);
  Status on_message(const net::ConnectionPtr& connection, const v1::Envelope& envelope);
  void on_closed(const net::ConnectionPtr& connection, const std::string& reason);
  net::OverflowAction on_overflow(const net::ConnectionPtr& connection);

  Status join(const PeerPtr& peer, const v1::Join& message);
  void submit(const PeerPtr& peer, const v1::Submit& message);
  void ask(const PeerPtr& peer, const v1::Ask& message);
  void presence(const PeerPtr& peer, v1::Presence message);
  void tracking(const PeerPtr& peer, const v1::TrackingFrame& frame);
  void hand_command(const PeerPtr& peer, const v1::HandCommand& message);
  /// Editors that have joined may; from then on the server tells of them.
  static Status begin_hands(Peer& peer);
  /// Tells a peer what is wrong with its frames, now and then.
  void complain(Peer& peer, const Error& error) const;
  std::optional<net::Frame> pull(Peer& peer);

  const ServerOptions options_;
  const Clock& clock_;
  Logger log_;
  std::unique_ptr<ModelActor> actor_;
  std::atomic<bool> closed_ = false;

  mutable std::mutex peers_mutex_;
  std::map<std::uint64_t, PeerPtr> peers_;
  std::uint64_t clients_served_ = 0;
  mutable std::mutex latency_mutex_;
  LatencyHistogram capture_to_delta_;
};

}  // namespace handloft::session
