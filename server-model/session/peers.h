#pragma once
// Everybody who is connected to a server's models, whatever their messages come by: who they are, what they
// may do (U2), which model they work on (rooms.h), and what each is sent. All of the server but its sockets
// (server.h).
//
//   peers.cpp          who comes, joins and goes
//   peers_here.cpp     what all who are there are told, and figures
//   peer_requests.cpp  what they ask for, and the scenes that they are sent

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
#include "server-model/access/gate.h"
#include "server-model/session/latency.h"
#include "server-model/session/model_actor.h"
#include "server-model/session/rooms.h"
#include "server-model/session/server_options.h"
#include "server-model/stream/pack_cache.h"

namespace handloft::session {

struct Peer;
using PeerPtr = std::shared_ptr<Peer>;

class Peers : public std::enable_shared_from_this<Peers> {
 public:
  /// Starts the first model's thread. `clock` must outlive it; `on_end_of_recording` comes from the model's
  /// thread.
  static std::shared_ptr<Peers> start(model::Model initial, ServerOptions options, const Clock& clock,
                                      const Logger& log, std::function<void()> on_end_of_recording = {});
  ~Peers();
  Peers(const Peers&) = delete;
  Peers& operator=(const Peers&) = delete;

  /// What a server whose endpoints are of that kind calls. Connections of all servers must have different
  /// ids, but for a client with a key (client_id.h) that comes anew: then the older one is closed.
  net::ServerEvents events(net::Endpoint::Kind kind);
  /// Of the first model: the one that the server's own tracking shapes.
  ModelActor& actor() { return *rooms_->first()->actor; }
  Rooms& rooms() { return *rooms_; }
  const ServerOptions& options() const { return options_; }

  /// See Server.
  bool flushed() const;
  std::size_t viewer_count() const;
  std::size_t peer_count() const;
  std::uint64_t clients_served() const;
  std::vector<ClientFigures> clients() const;
  std::vector<ModelFigures> models() const;  ///< That are open.
  stream::PackCacheStatistics packs() const { return packs_->statistics(); }
  /// Waits until all that was applied is on the disk or has failed to be, and told.
  void flush() const;
  LatencySummary capture_to_delta() const;

  /// To be called a few times a second: ends leases that nobody renews, closes models that nobody uses,
  /// re-seeds who has stalled (U4), and looks at access.
  void tick();
  /// No message is handled any more, and nobody comes in.
  void close();
  /// close(), and returns when all models are on the disk.
  void stop();
  /// Limits that hold from now on; what has a client for as long as it is there holds for those who come.
  void set_limits(const ClientLimits& limits);
  /// Part of tick(): closes whom `handloft-modeld revoke` has revoked, and tells those whose role has
  /// changed.
  void look_at_access();

 private:
  Peers(ServerOptions options, const Clock& clock, Logger log);

  RoomPtr furnish(std::string name, model::Model model, ActorOptions options,
                  std::function<void()> on_end_of_recording);
  std::vector<PeerPtr> everybody() const;
  std::vector<PeerPtr> everybody_in(const Room& room) const;
  /// Those of them who have been told that they are there: nothing of others comes before that.
  using Seats = std::shared_ptr<const std::vector<PeerPtr>>;
  Seats seated_in(const Room& room) const;
  /// After every change of who is seated: what seated_in() remembers is not so any more.
  void forget_seats() const;
  void notify_viewers(const Room& room) const;
  /// To all in the room but `from`; null: to all.
  void send_presence(const Room& room, const v1::Presence& presence, const Peer* from) const;
  void send_people(const Room& room) const;
  v1::People people_in(const Room& room) const;
  void send_joined(const Peer& peer, const Room& room, v1::Role role, bool resumed) const;

  Status on_join(const net::ConnectionPtr& connection, net::Endpoint::Kind kind);
  Status on_message(const net::ConnectionPtr& connection, const v1::Envelope& envelope);
  /// Lines about a client: its id, its user where one is known, and where from.
  Logger log_of(const net::Connection& connection, const std::string& user) const;
  RefusalCounter refusals_of(const Room& room) const { return {options_.actor.metrics, room.name}; }
  void count_refusal(net::RefusedAt where, const Error& error) const;
  Result<net::Admission> admit(const net::PeerInfo& info, net::Endpoint::Kind kind);
  /// What it may do on a model now: what it asked for at most.
  v1::Role role_of(const Peer& peer, const Room& room) const;
  void on_closed(const net::ConnectionPtr& connection, const std::string& reason);
  net::OverflowAction on_overflow(const net::ConnectionPtr& connection);
  /// Once for each peer, whatever ends it.
  void depart(const PeerPtr& peer, const std::string& reason);

  Status join(const PeerPtr& peer, const v1::Join& message);
  Status try_join(const PeerPtr& peer, const v1::Join& message);
  void entered(const PeerPtr& peer, const v1::Join& message, v1::Role role, const Result<RoomPtr>& room);
  void begin(const PeerPtr& peer, const RoomPtr& room, const v1::Join& message, v1::Role role);
  void note_coming(Peer& peer, const Room& room, v1::Role role) const;
  /// On the model's thread: the scene is as this viewer is to see it.
  void seat(const PeerPtr& peer, const RoomPtr& room, const std::shared_ptr<const v1::Join>& message);
  void submit(const PeerPtr& peer, const v1::Submit& message);
  void ask(const PeerPtr& peer, const v1::Ask& message);
  /// What the models themselves do not know; nullopt: they do.
  std::optional<v1::QueryResult> answer_of_peers(const Peer& peer, const Room& room,
                                                 const v1::Query& query) const;
  void presence(const PeerPtr& peer, v1::Presence message);
  void tracking(const PeerPtr& peer, const v1::TrackingFrame& frame);
  void hand_command(const PeerPtr& peer, const v1::HandCommand& message);
  void lease(const PeerPtr& peer, const v1::Lease& message);
  /// Editors that have joined may; from then on the server tells of them.
  Result<RoomPtr> begin_hands(Peer& peer, v1::Envelope::BodyCase message);
  /// Tells a peer what is wrong with its frames, now and then.
  void complain(Peer& peer, const Error& error) const;
  /// The next message of the scene for it; nullopt: it has all.
  std::optional<net::Frame> pull(Peer& peer);
  std::optional<v1::Envelope> compose(Peer& peer, const RoomPtr& room);

  const ServerOptions options_;
  const Clock& clock_;
  Logger log_;
  const std::shared_ptr<access::Gate> gate_;
  std::atomic<std::uint32_t> looks_ = 0;  ///< Of look_at_access().
  std::unique_ptr<Rooms> rooms_;
  const std::shared_ptr<stream::PackCache> packs_;
  mutable std::mutex limits_mutex_;
  ClientLimits limits_;
  ClientLimits limits() const;
  std::atomic<bool> closed_ = false;
  std::atomic<std::uint64_t> last_epoch_ = 0;

  mutable std::mutex peers_mutex_;
  std::map<std::uint64_t, PeerPtr> peers_;
  std::uint64_t clients_served_ = 0;
  mutable std::mutex seats_mutex_;
  mutable std::map<const Room*, Seats> seats_;  ///< Asked for with every presence that comes.
  mutable std::uint64_t seats_version_ = 0;
  mutable std::mutex latency_mutex_;
  LatencyHistogram capture_to_delta_;
};

}  // namespace handloft::session
