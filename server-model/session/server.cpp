#include "server-model/session/server.h"

#include <fmt/core.h>

#include <atomic>
#include <map>
#include <utility>

#include "server-model/session/presence.h"
#include "server-model/session/remote_target.h"

namespace handloft::session {
namespace {

/// Outbox slots: one for each person's presence.
constexpr std::uint32_t presence_slot = 1;

/// Connections of different endpoints have ids of their own; here they become one numbering.
constexpr int endpoint_shift = 40;

struct Peer {
  Peer(net::ConnectionPtr its_connection, std::uint64_t its_id, net::Endpoint::Kind its_kind,
       const ServerOptions& options)
      : connection(std::move(its_connection)),
        id(its_id),
        kind(its_kind),
        max_pending_requests(options.max_pending_requests),
        max_pending_bytes(options.max_pending_bytes),
        viewer(options.viewer) {}

  const net::ConnectionPtr connection;
  const std::uint64_t id;  ///< Unlike any other peer's of this server.
  const net::Endpoint::Kind kind;
  const std::size_t max_pending_requests;
  const std::size_t max_pending_bytes;

  std::mutex mutex;  ///< Guards what follows; never held while calling the connection.
  bool joined = false;
  bool present = false;  ///< Has told of itself.
  stream::Viewer viewer;
  stream::ScenePtr has;  ///< The scene that it has been given whole; null: not yet.
  std::int64_t shown_capture_ns = 0;
  std::size_t pending_requests = 0;
  std::size_t pending_bytes = 0;
};
using PeerPtr = std::shared_ptr<Peer>;

}  // namespace

struct Server::Implementation : std::enable_shared_from_this<Server::Implementation> {
  Implementation(ServerOptions its_options, const Clock& its_clock, Logger its_log)
      : options(std::move(its_options)), clock(its_clock), log(std::move(its_log)) {}

  ServerOptions options;
  const Clock& clock;
  Logger log;
  std::vector<std::unique_ptr<net::MessageServer>> servers;
  std::unique_ptr<ModelActor> actor;
  std::atomic<bool> stopped = false;

  mutable std::mutex peers_mutex;
  std::map<std::uint64_t, PeerPtr> peers;
  std::uint64_t clients_served = 0;
  mutable std::mutex latency_mutex;
  LatencyHistogram capture_to_delta;

  net::ServerEvents events_for(std::size_t endpoint_index, net::Endpoint::Kind kind);
  std::vector<PeerPtr> everybody() const;
  void notify_viewers() const;
  void send_presence(const v1::Presence& presence, const std::string& key, const Peer* from) const;

  Status on_join(const net::ConnectionPtr& connection, std::uint64_t id, net::Endpoint::Kind kind);
  Status on_message(const net::ConnectionPtr& connection, const v1::Envelope& envelope);
  void on_closed(const net::ConnectionPtr& connection, const std::string& reason);
  net::OverflowAction on_overflow(const net::ConnectionPtr& connection);

  Status join(const PeerPtr& peer, const v1::Join& message);
  void submit(const PeerPtr& peer, const v1::Submit& message);
  void ask(const PeerPtr& peer, const v1::Ask& message);
  void presence(const PeerPtr& peer, v1::Presence message);
  std::optional<net::Frame> pull(Peer& peer);
  /// Counts a request that is under way until finish_request(); at the limit nothing more is read of the
  /// peer.
  static void begin_request(Peer& peer, std::size_t bytes);
  static void finish_request(Peer& peer, std::size_t bytes);
};

net::ServerEvents Server::Implementation::events_for(std::size_t endpoint_index, net::Endpoint::Kind kind) {
  const std::weak_ptr<Implementation> weak = weak_from_this();
  const std::uint64_t base = static_cast<std::uint64_t>(endpoint_index) << endpoint_shift;
  net::ServerEvents events;
  events.on_join = [weak, base, kind](const net::ConnectionPtr& connection) -> Status {
    const auto self = weak.lock();
    if (!self || self->stopped) return make_error(ErrorCode::cancelled, "the server is stopping");
    return self->on_join(connection, base + connection->id(), kind);
  };
  events.on_message = [weak](const net::ConnectionPtr& connection, const v1::Envelope& envelope) -> Status {
    const auto self = weak.lock();
    if (!self || self->stopped) return make_error(ErrorCode::cancelled, "the server is stopping");
    return self->on_message(connection, envelope);
  };
  events.on_closed = [weak](const net::ConnectionPtr& connection, const std::string& reason) {
    if (const auto self = weak.lock()) self->on_closed(connection, reason);
  };
  events.on_overflow = [weak](const net::ConnectionPtr& connection) {
    const auto self = weak.lock();
    return self ? self->on_overflow(connection) : net::OverflowAction::close;
  };
  return events;
}

std::vector<PeerPtr> Server::Implementation::everybody() const {
  const std::lock_guard lock(peers_mutex);
  std::vector<PeerPtr> result;
  result.reserve(peers.size());
  for (const auto& [id, peer] : peers) result.push_back(peer);
  return result;
}

void Server::Implementation::notify_viewers() const {
  for (const PeerPtr& peer : everybody()) {
    bool joined = false;
    {
      const std::lock_guard lock(peer->mutex);
      joined = peer->joined;
    }
    if (joined) peer->connection->notify_pull();
  }
}

void Server::Implementation::send_presence(const v1::Presence& presence, const std::string& key,
                                           const Peer* from) const {
  v1::Envelope envelope;
  *envelope.mutable_presence() = presence;
  const auto frame = net::encode_frame(envelope);
  if (!frame) return;  // cleaned presence is small
  for (const PeerPtr& peer : everybody()) {
    if (peer.get() == from) continue;
    bool joined = false;
    {
      const std::lock_guard lock(peer->mutex);
      joined = peer->joined;
    }
    if (joined) peer->connection->send_latest({presence_slot, key}, *frame);
  }
}

namespace {

PeerPtr peer_of(const net::ConnectionPtr& connection) {
  const auto* held = std::any_cast<std::weak_ptr<Peer>>(&connection->user_data);
  return held == nullptr ? nullptr : held->lock();
}

}  // namespace

Status Server::Implementation::on_join(const net::ConnectionPtr& connection, std::uint64_t id,
                                       net::Endpoint::Kind kind) {
  auto peer = std::make_shared<Peer>(connection, id, kind, options);
  connection->user_data = std::weak_ptr<Peer>(peer);  // `peers` holds it: the two must not hold each other
  log.info("{} \"{}\" connected as {}", connection->peer().program, connection->peer().name, id);
  const std::lock_guard lock(peers_mutex);
  peers.emplace(id, std::move(peer));
  ++clients_served;
  return {};
}

Status Server::Implementation::on_message(const net::ConnectionPtr& connection,
                                          const v1::Envelope& envelope) {
  const PeerPtr peer = peer_of(connection);
  if (!peer) return make_error(ErrorCode::internal, "a message of nobody");
  switch (envelope.body_case()) {
    case v1::Envelope::kJoin:
      return join(peer, envelope.join());
    case v1::Envelope::kSubmit:
      submit(peer, envelope.submit());
      return {};
    case v1::Envelope::kAsk:
      ask(peer, envelope.ask());
      return {};
    case v1::Envelope::kPresence:
      presence(peer, envelope.presence());
      return {};
    default:
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found the message \"{}\", expected join, submit, ask or presence",
                      v1::Envelope::descriptor()->FindFieldByNumber(envelope.body_case())->name()),
          "body");
  }
}

void Server::Implementation::on_closed(const net::ConnectionPtr& connection, const std::string& reason) {
  const PeerPtr peer = peer_of(connection);
  if (!peer) return;
  {
    const std::lock_guard lock(peers_mutex);
    peers.erase(peer->id);
  }
  log.info("\"{}\" ({}) is gone: {}", connection->peer().name, peer->id, reason);
  bool present = false;
  {
    const std::lock_guard lock(peer->mutex);
    present = peer->present;
    peer->joined = false;
  }
  if (present) {
    v1::Presence gone;
    gone.set_client_id(peer->id);
    gone.set_name(connection->peer().name);
    gone.set_gone(true);
    send_presence(clean_presence(std::move(gone)), std::to_string(peer->id), peer.get());
  }
}

net::OverflowAction Server::Implementation::on_overflow(const net::ConnectionPtr& connection) {
  const PeerPtr peer = peer_of(connection);
  if (!peer) return net::OverflowAction::close;
  const std::lock_guard lock(peer->mutex);
  if (!peer->joined) return net::OverflowAction::close;
  log.warning("\"{}\" ({}) reads too slowly: begins anew with a snapshot", connection->peer().name, peer->id);
  peer->viewer.reset();
  peer->has = nullptr;
  return net::OverflowAction::reseed;
}

Status Server::Implementation::join(const PeerPtr& peer, const v1::Join& message) {
  if (!message.model().empty() && message.model() != options.model_name) {
    return make_error(
        ErrorCode::not_found,
        fmt::format("found \"{}\", expected \"{}\" or nothing", message.model(), options.model_name),
        "join.model");
  }
  {
    const std::lock_guard lock(peer->mutex);
    peer->joined = true;
    peer->viewer.reset();
    peer->has = nullptr;
  }
  const std::weak_ptr<Implementation> weak = weak_from_this();
  const std::weak_ptr<Peer> weak_peer = peer;
  peer->connection->set_pull([weak, weak_peer]() -> std::optional<net::Frame> {
    const auto self = weak.lock();
    const auto viewer = weak_peer.lock();
    return self && viewer ? self->pull(*viewer) : std::nullopt;
  });
  peer->connection->notify_pull();
  return {};
}

std::optional<net::Frame> Server::Implementation::pull(Peer& peer) {
  const stream::ScenePtr scene = actor->scene();
  const std::lock_guard lock(peer.mutex);
  if (!peer.joined || peer.has == scene) return std::nullopt;
  const std::optional<v1::Envelope> envelope = peer.viewer.next(*scene);
  if (!envelope) {
    peer.has = scene;
    return std::nullopt;
  }
  auto frame = net::encode_frame(*envelope, options.net.max_frame_bytes);
  if (!frame) {
    log.error("a scene message cannot be sent: {}", frame.error().describe());
    return std::nullopt;
  }
  if (envelope->has_delta() && scene->capture_time_ns > peer.shown_capture_ns) {
    peer.shown_capture_ns = scene->capture_time_ns;
    const std::lock_guard latency_lock(latency_mutex);
    capture_to_delta.add(clock.now() - from_ns(scene->capture_time_ns));
  }
  return *std::move(frame);
}

// To be called before the request is handed over: so it ends, and finish_request() looks, after the pause,
// whatever other requests do meanwhile, and no peer stays paused with nothing under way.
void Server::Implementation::begin_request(Peer& peer, std::size_t bytes) {
  bool full = false;
  {
    const std::lock_guard lock(peer.mutex);
    ++peer.pending_requests;
    peer.pending_bytes += bytes;
    full = peer.pending_requests >= peer.max_pending_requests || peer.pending_bytes >= peer.max_pending_bytes;
  }
  if (full) peer.connection->pause_reading();
}

void Server::Implementation::finish_request(Peer& peer, std::size_t bytes) {
  bool room = false;
  {
    const std::lock_guard lock(peer.mutex);
    --peer.pending_requests;
    peer.pending_bytes -= bytes;
    // Half, so that a peer that keeps the limit filled isn't paused and resumed with every request.
    room = peer.pending_requests <= peer.max_pending_requests / 2 &&
           peer.pending_bytes <= peer.max_pending_bytes / 2;
  }
  if (room) peer.connection->resume_reading();
}

void Server::Implementation::submit(const PeerPtr& peer, const v1::Submit& message) {
  const std::uint64_t request = message.request();
  const auto answer = [peer, request](const Result<ModelActor::Outcome>& outcome) {
    v1::Envelope envelope;
    v1::Ack& ack = *envelope.mutable_ack();
    ack.set_request(request);
    if (outcome) {
      ack.set_sequence(outcome->sequence);
      ack.mutable_entities()->Assign(outcome->entities.begin(), outcome->entities.end());
      ack.mutable_notes()->Assign(outcome->notes.begin(), outcome->notes.end());
    } else {
      set_failure(*ack.mutable_failure(), outcome.error());
    }
    peer->connection->send(envelope);  // false: the peer is gone, or about to begin anew
  };
  if (peer->connection->peer().role != v1::ROLE_EDITOR) {
    answer(
        make_error(ErrorCode::permission_denied, "a viewer may not change the model, expected ROLE_EDITOR"));
    return;
  }
  const std::size_t bytes = message.ByteSizeLong();
  begin_request(*peer, bytes);
  v1::Operation operation = message.operation();
  operation.set_client_id(peer->id);
  model::FileAccess files = options.files;
  // TCP knows no users: whoever connects gets the folders, not the machine.
  if (peer->kind == net::Endpoint::Kind::tcp) files.scope = model::FileAccess::Scope::within_folders;
  actor->submit(std::move(operation), std::move(files), [peer, bytes, answer](const auto& outcome) {
    answer(outcome);
    finish_request(*peer, bytes);
  });
}

void Server::Implementation::ask(const PeerPtr& peer, const v1::Ask& message) {
  const std::uint64_t request = message.request();
  const auto answer = [peer, request, limit = options.net.max_frame_bytes](Result<v1::QueryResult> result) {
    v1::Envelope envelope;
    envelope.mutable_answer()->set_request(request);
    if (result) {
      *envelope.mutable_answer()->mutable_result() = *std::move(result);
      const auto frame = net::encode_frame(envelope, limit);
      if (frame) {
        peer->connection->send(*frame);
        return;
      }
      envelope.mutable_answer()->clear_result();
      set_failure(*envelope.mutable_answer()->mutable_failure(), frame.error());
    } else {
      set_failure(*envelope.mutable_answer()->mutable_failure(), result.error());
    }
    peer->connection->send(envelope);
  };
  const std::size_t bytes = message.ByteSizeLong();
  begin_request(*peer, bytes);
  actor->ask(message.query(), [peer, bytes, answer](Result<v1::QueryResult> result) {
    answer(std::move(result));
    finish_request(*peer, bytes);
  });
}

void Server::Implementation::presence(const PeerPtr& peer, v1::Presence message) {
  message.set_client_id(peer->id);
  message.set_name(peer->connection->peer().name);
  message.set_gone(false);
  {
    const std::lock_guard lock(peer->mutex);
    peer->present = true;
  }
  send_presence(clean_presence(std::move(message)), std::to_string(peer->id), peer.get());
}

Server::Server(std::shared_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}

Server::~Server() {
  stop();
}

Result<std::unique_ptr<Server>> Server::start(const boost::asio::any_io_executor& executor,
                                              const std::vector<net::Endpoint>& endpoints,
                                              model::Model initial, ServerOptions options, const Clock& clock,
                                              const Logger& log, std::function<void()> on_end_of_recording) {
  if (endpoints.empty()) return make_error(ErrorCode::invalid_argument, "found no endpoint", "listen");
  options.net.roles = {v1::ROLE_VIEWER, v1::ROLE_EDITOR};
  auto implementation = std::make_shared<Implementation>(std::move(options), clock, log);
  const std::weak_ptr<Implementation> weak = implementation;
  ActorEvents events;
  events.on_scene = [weak] {
    if (const auto self = weak.lock()) self->notify_viewers();
  };
  events.on_presence = [weak](const v1::Presence& presence) {
    if (const auto self = weak.lock()) self->send_presence(presence, presence.name(), nullptr);
  };
  events.on_end_of_recording = std::move(on_end_of_recording);
  implementation->actor = std::make_unique<ModelActor>(std::move(initial), implementation->options.actor,
                                                       std::move(events), clock, log.component("model"));
  for (std::size_t i = 0; i < endpoints.size(); ++i) {
    auto server = net::MessageServer::listen(executor, endpoints[i], implementation->options.net,
                                             implementation->events_for(i, endpoints[i].kind), clock,
                                             log.component("net"));
    if (!server) return server.error();
    implementation->servers.push_back(*std::move(server));
  }
  return std::unique_ptr<Server>(new Server(std::move(implementation)));
}

std::vector<net::Endpoint> Server::endpoints() const {
  std::vector<net::Endpoint> result;
  for (const auto& server : implementation_->servers) result.push_back(server->endpoint());
  return result;
}

ModelActor& Server::actor() {
  return *implementation_->actor;
}

bool Server::flushed() const {
  const stream::ScenePtr scene = implementation_->actor->scene();
  for (const PeerPtr& peer : implementation_->everybody()) {
    {
      const std::lock_guard lock(peer->mutex);
      if (!peer->joined) continue;
      if (peer->has != scene) return false;
    }
    if (peer->connection->statistics().queued_frames > 0) return false;
  }
  return true;
}

std::size_t Server::viewer_count() const {
  std::size_t count = 0;
  for (const PeerPtr& peer : implementation_->everybody()) {
    const std::lock_guard lock(peer->mutex);
    if (peer->joined) ++count;
  }
  return count;
}

std::size_t Server::peer_count() const {
  return implementation_->everybody().size();
}

std::uint64_t Server::clients_served() const {
  const std::lock_guard lock(implementation_->peers_mutex);
  return implementation_->clients_served;
}

LatencySummary Server::capture_to_delta() const {
  const std::lock_guard lock(implementation_->latency_mutex);
  return implementation_->capture_to_delta.summary();
}

void Server::stop() {
  if (implementation_->stopped.exchange(true)) return;
  for (const auto& server : implementation_->servers) server->stop();
  implementation_->actor->stop();
}

}  // namespace handloft::session
