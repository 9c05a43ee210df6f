#include "server-model/session/peers.h"

#include <fmt/core.h>

#include <any>
#include <utility>

#include "server-model/session/presence.h"
#include "server-model/session/remote_target.h"

namespace handloft::session {
namespace {

/// Outbox slots: one for each person's presence.
constexpr std::uint32_t presence_slot = 1;

/// Of whom a presence tells: a client may have two hands.
std::string presence_key(const v1::Presence& presence) {
  return fmt::format("{}/{}", presence.client_id(), presence.name());
}

}  // namespace

struct Peer {
  Peer(net::ConnectionPtr its_connection, net::Endpoint::Kind its_kind, const ServerOptions& options)
      : connection(std::move(its_connection)),
        id(connection->id()),
        kind(its_kind),
        hands{id, connection->peer().name},
        // On one host both read the same clock, and an estimate would only add its error.
        clock(its_kind == net::Endpoint::Kind::unix_socket ? ClientClock{}
                                                           : ClientClock::of(connection->peer())),
        max_pending_requests(options.max_pending_requests),
        max_pending_bytes(options.max_pending_bytes),
        complaints(options.complain_every),
        viewer(options.viewer) {}

  const net::ConnectionPtr connection;
  const std::uint64_t id;  ///< Unlike any other peer's of this server.
  const net::Endpoint::Kind kind;
  const HandOwner hands;
  const ClientClock clock;
  const std::size_t max_pending_requests;
  const std::size_t max_pending_bytes;
  RateLimit complaints;  ///< About its frames.

  std::mutex mutex;  ///< Guards what follows; never held while calling the connection.
  bool joined = false;
  bool present = false;       ///< Has told of itself.
  bool brings_hands = false;  ///< The server tells of its hands, from its frames and commands.
  stream::Viewer viewer;
  stream::ScenePtr has;  ///< The scene that it has been given whole; null: not yet.
  std::int64_t shown_capture_ns = 0;
  std::size_t pending_requests = 0;
  std::size_t pending_bytes = 0;
};

namespace {

/// Counts a request that is under way until finish_request(); at the limit nothing more is read of the peer.
/// To be called before the request is handed over: so it ends, and finish_request() looks, after the pause,
/// whatever other requests do meanwhile, and no peer stays paused with nothing under way.
void begin_request(Peer& peer, std::size_t bytes) {
  bool full = false;
  {
    const std::lock_guard lock(peer.mutex);
    ++peer.pending_requests;
    peer.pending_bytes += bytes;
    full = peer.pending_requests >= peer.max_pending_requests || peer.pending_bytes >= peer.max_pending_bytes;
  }
  if (full) peer.connection->pause_reading();
}

void finish_request(Peer& peer, std::size_t bytes) {
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

PeerPtr peer_of(const net::ConnectionPtr& connection) {
  const auto* held = std::any_cast<std::weak_ptr<Peer>>(&connection->user_data);
  return held == nullptr ? nullptr : held->lock();
}

}  // namespace

Peers::Peers(ServerOptions options, const Clock& clock, Logger log)
    : options_(std::move(options)), clock_(clock), log_(std::move(log)) {}

Peers::~Peers() = default;

std::shared_ptr<Peers> Peers::start(model::Model initial, ServerOptions options, const Clock& clock,
                                    const Logger& log, std::function<void()> on_end_of_recording) {
  const std::shared_ptr<Peers> peers(new Peers(std::move(options), clock, log));
  const std::weak_ptr<Peers> weak = peers;
  ActorEvents events;
  events.on_scene = [weak] {
    if (const auto self = weak.lock()) self->notify_viewers();
  };
  events.on_presence = [weak](const v1::Presence& presence) {
    if (const auto self = weak.lock()) self->send_presence(presence, nullptr);
  };
  events.on_end_of_recording = std::move(on_end_of_recording);
  peers->actor_ = std::make_unique<ModelActor>(std::move(initial), peers->options_.actor, std::move(events),
                                               clock, log.component("model"));
  return peers;
}

void Peers::close() {
  closed_ = true;
}

net::ServerEvents Peers::events(net::Endpoint::Kind kind) {
  const std::weak_ptr<Peers> weak = weak_from_this();
  net::ServerEvents events;
  events.on_join = [weak, kind](const net::ConnectionPtr& connection) -> Status {
    const auto self = weak.lock();
    if (!self || self->closed_) return make_error(ErrorCode::cancelled, "the server is stopping");
    return self->on_join(connection, kind);
  };
  events.on_message = [weak](const net::ConnectionPtr& connection, const v1::Envelope& envelope) -> Status {
    const auto self = weak.lock();
    if (!self || self->closed_) return make_error(ErrorCode::cancelled, "the server is stopping");
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

std::vector<PeerPtr> Peers::everybody() const {
  const std::lock_guard lock(peers_mutex_);
  std::vector<PeerPtr> result;
  result.reserve(peers_.size());
  for (const auto& [id, peer] : peers_) result.push_back(peer);
  return result;
}

void Peers::notify_viewers() const {
  for (const PeerPtr& peer : everybody()) {
    bool joined = false;
    {
      const std::lock_guard lock(peer->mutex);
      joined = peer->joined;
    }
    if (joined) peer->connection->notify_pull();
  }
}

void Peers::send_presence(const v1::Presence& presence, const Peer* from) const {
  v1::Envelope envelope;
  *envelope.mutable_presence() = presence;
  const auto frame = net::encode_frame(envelope);
  if (!frame) return;  // cleaned presence is small
  const net::SlotKey slot{presence_slot, presence_key(presence)};
  for (const PeerPtr& peer : everybody()) {
    if (peer.get() == from) continue;
    bool joined = false;
    {
      const std::lock_guard lock(peer->mutex);
      joined = peer->joined;
    }
    if (joined) peer->connection->send_latest(slot, *frame);
  }
}

Status Peers::on_join(const net::ConnectionPtr& connection, net::Endpoint::Kind kind) {
  auto peer = std::make_shared<Peer>(connection, kind, options_);
  connection->user_data = std::weak_ptr<Peer>(peer);  // `peers` holds it: the two must not hold each other
  log_.info("{} \"{}\" connected as {}", connection->peer().program, connection->peer().name, peer->id);
  const std::lock_guard lock(peers_mutex_);
  peers_.emplace(peer->id, peer);
  ++clients_served_;
  return {};
}

Status Peers::on_message(const net::ConnectionPtr& connection, const v1::Envelope& envelope) {
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
    case v1::Envelope::kTracking:
      tracking(peer, envelope.tracking());
      return {};
    case v1::Envelope::kHandCommand:
      hand_command(peer, envelope.hand_command());
      return {};
    default: {
      const auto* kind = v1::Envelope::descriptor()->FindFieldByNumber(envelope.body_case());
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format(
              "found the message \"{}\", expected join, submit, ask, presence, tracking or hand_command",
              kind == nullptr ? "" : kind->name()),
          "body");
    }
  }
}

void Peers::on_closed(const net::ConnectionPtr& connection, const std::string& reason) {
  const PeerPtr peer = peer_of(connection);
  if (!peer) return;
  {
    const std::lock_guard lock(peers_mutex_);
    peers_.erase(peer->id);
  }
  log_.info("\"{}\" ({}) is gone: {}", connection->peer().name, peer->id, reason);
  bool present = false;
  bool brings_hands = false;
  {
    const std::lock_guard lock(peer->mutex);
    present = peer->present;
    brings_hands = peer->brings_hands;
    peer->joined = false;
  }
  if (brings_hands) actor_->hand_gone(peer->hands);  // Which tells the others when the last frame is handled.
  if (present && !brings_hands) {
    v1::Presence gone;
    gone.set_client_id(peer->id);
    gone.set_name(connection->peer().name);
    gone.set_gone(true);
    send_presence(clean_presence(std::move(gone)), peer.get());
  }
}

net::OverflowAction Peers::on_overflow(const net::ConnectionPtr& connection) {
  const PeerPtr peer = peer_of(connection);
  if (!peer) return net::OverflowAction::close;
  const std::lock_guard lock(peer->mutex);
  if (!peer->joined) return net::OverflowAction::close;
  log_.warning("\"{}\" ({}) reads too slowly: begins anew with a snapshot", connection->peer().name,
               peer->id);
  peer->viewer.reset();
  peer->has = nullptr;
  return net::OverflowAction::reseed;
}

Status Peers::join(const PeerPtr& peer, const v1::Join& message) {
  if (!message.model().empty() && message.model() != options_.model_name) {
    return make_error(
        ErrorCode::not_found,
        fmt::format("found \"{}\", expected \"{}\" or nothing", message.model(), options_.model_name),
        "join.model");
  }
  {
    const std::lock_guard lock(peer->mutex);
    peer->joined = true;
    peer->viewer.reset();
    peer->has = nullptr;
  }
  const std::weak_ptr<Peers> weak = weak_from_this();
  const std::weak_ptr<Peer> weak_peer = peer;
  peer->connection->set_pull([weak, weak_peer]() -> std::optional<net::Frame> {
    const auto self = weak.lock();
    const auto viewer = weak_peer.lock();
    return self && viewer ? self->pull(*viewer) : std::nullopt;
  });
  peer->connection->notify_pull();
  return {};
}

std::optional<net::Frame> Peers::pull(Peer& peer) {
  const stream::ScenePtr scene = actor_->scene();
  const std::lock_guard lock(peer.mutex);
  if (!peer.joined || peer.has == scene) return std::nullopt;
  const std::optional<v1::Envelope> envelope = peer.viewer.next(*scene);
  if (!envelope) {
    peer.has = scene;
    return std::nullopt;
  }
  auto frame = net::encode_frame(*envelope, options_.net.max_frame_bytes);
  if (!frame) {
    log_.error("a scene message cannot be sent: {}", frame.error().describe());
    return std::nullopt;
  }
  if (envelope->has_delta() && scene->capture_time_ns > peer.shown_capture_ns) {
    peer.shown_capture_ns = scene->capture_time_ns;
    const std::lock_guard latency_lock(latency_mutex_);
    capture_to_delta_.add(clock_.now() - from_ns(scene->capture_time_ns));
  }
  return *std::move(frame);
}

namespace {

void send_ack(Peer& peer, std::uint64_t request, const Result<ModelActor::Outcome>& outcome) {
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
  peer.connection->send(envelope);  // false: the peer is gone, or about to begin anew
}

}  // namespace

void Peers::submit(const PeerPtr& peer, const v1::Submit& message) {
  const std::uint64_t request = message.request();
  if (peer->connection->peer().role != v1::ROLE_EDITOR) {
    send_ack(
        *peer, request,
        make_error(ErrorCode::permission_denied, "a viewer may not change the model, expected ROLE_EDITOR"));
    return;
  }
  const std::size_t bytes = message.ByteSizeLong();
  begin_request(*peer, bytes);
  v1::Operation operation = message.operation();
  operation.set_client_id(peer->id);
  model::FileAccess files = options_.files;
  // TCP knows no users: whoever connects gets the folders, not the machine.
  if (peer->kind != net::Endpoint::Kind::unix_socket) files.scope = model::FileAccess::Scope::within_folders;
  actor_->submit(std::move(operation), std::move(files), [peer, bytes, request](const auto& outcome) {
    send_ack(*peer, request, outcome);
    finish_request(*peer, bytes);
  });
}

void Peers::ask(const PeerPtr& peer, const v1::Ask& message) {
  const std::uint64_t request = message.request();
  const auto answer = [peer, request, limit = options_.net.max_frame_bytes](Result<v1::QueryResult> result) {
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
  actor_->ask(message.query(), [peer, bytes, answer](Result<v1::QueryResult> result) {
    answer(std::move(result));
    finish_request(*peer, bytes);
  });
}

void Peers::presence(const PeerPtr& peer, v1::Presence message) {
  message.set_client_id(peer->id);
  message.set_name(peer->connection->peer().name);
  message.set_gone(false);
  {
    const std::lock_guard lock(peer->mutex);
    if (peer->brings_hands) return;  // The server tells more of them, and two stories would alternate.
    peer->present = true;
  }
  send_presence(clean_presence(std::move(message)), peer.get());
}

Status Peers::begin_hands(Peer& peer) {
  if (peer.connection->peer().role != v1::ROLE_EDITOR) {
    return make_error(ErrorCode::permission_denied, "a viewer may bring no hands, expected ROLE_EDITOR");
  }
  const std::lock_guard lock(peer.mutex);
  if (!peer.joined) {
    return make_error(ErrorCode::failed_precondition, "found a hand before its client has joined");
  }
  peer.brings_hands = true;
  return {};
}

void Peers::complain(Peer& peer, const Error& error) const {
  const auto kept_back = peer.complaints.allow(clock_.now());
  if (!kept_back) return;
  log_.debug("a frame of \"{}\" ({}) is left out: {}", peer.hands.name, peer.id, error.describe());
  v1::Envelope envelope;
  set_failure(*envelope.mutable_failure(), error);
  peer.connection->send(envelope);
}

void Peers::tracking(const PeerPtr& peer, const v1::TrackingFrame& frame) {
  const Status allowed = begin_hands(*peer);
  if (!allowed) {
    complain(*peer, allowed.error());
    return;
  }
  auto read = read_client_frame(frame, peer->clock, clock_.now(), options_.client_frames);
  if (!read) {
    complain(*peer, read.error());
    return;
  }
  if (actor_->push_hand(peer->hands, *std::move(read)) == HandInbox::Taken::left_out) {
    complain(*peer, make_error(ErrorCode::resource_exhausted,
                               fmt::format("more than {} frames a second, some are left out",
                                           options_.actor.client_frames.max_frames_per_s),
                               "tracking"));
  }
}

void Peers::hand_command(const PeerPtr& peer, const v1::HandCommand& message) {
  const std::uint64_t request = message.request();
  const Status allowed = begin_hands(*peer);
  if (!allowed) {
    send_ack(*peer, request, allowed.error());
    return;
  }
  const std::size_t bytes = message.ByteSizeLong();
  begin_request(*peer, bytes);
  actor_->command(peer->hands, message, [peer, bytes, request](const auto& outcome) {
    send_ack(*peer, request, outcome);
    finish_request(*peer, bytes);
  });
}

bool Peers::flushed() const {
  const stream::ScenePtr scene = actor_->scene();
  for (const PeerPtr& peer : everybody()) {
    {
      const std::lock_guard lock(peer->mutex);
      if (!peer->joined) continue;
      if (peer->has != scene) return false;
    }
    if (peer->connection->statistics().queued_frames > 0) return false;
  }
  return true;
}

std::size_t Peers::viewer_count() const {
  std::size_t count = 0;
  for (const PeerPtr& peer : everybody()) {
    const std::lock_guard lock(peer->mutex);
    if (peer->joined) ++count;
  }
  return count;
}

std::size_t Peers::peer_count() const {
  return everybody().size();
}

std::uint64_t Peers::clients_served() const {
  const std::lock_guard lock(peers_mutex_);
  return clients_served_;
}

LatencySummary Peers::capture_to_delta() const {
  const std::lock_guard lock(latency_mutex_);
  return capture_to_delta_.summary();
}

}  // namespace handloft::session
