#include "server-model/session/peers.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "common/base/wall_clock.h"
#include "server-model/session/client_id.h"
#include "server-model/session/peer.h"
#include "server-model/session/presence.h"

namespace handloft::session {
namespace {

ServerOptions completed(ServerOptions options) {
  if (!options.wall_ns) options.wall_ns = wall_clock_ns;
  return options;
}

}  // namespace

Peers::Peers(ServerOptions options, const Clock& clock, Logger log)
    : options_(completed(std::move(options))),
      clock_(clock),
      log_(std::move(log)),
      gate_(options_.gate ? options_.gate : access::Gate::without_file()),
      packs_(std::make_shared<stream::PackCache>(clock_, options_.packs)),
      limits_{options_.max_pending_requests, options_.max_pending_bytes, options_.client_memory.scene_bytes} {
}

Peers::~Peers() = default;

std::shared_ptr<Peers> Peers::start(model::Model initial, ServerOptions options, const Clock& clock,
                                    const Logger& log, std::function<void()> on_end_of_recording) {
  const std::shared_ptr<Peers> peers(new Peers(std::move(options), clock, log));
  const std::weak_ptr<Peers> weak = peers;
  peers->last_epoch_ = peers->options_.actor.epoch;
  RoomPtr first = peers->furnish(peers->options_.model_name, std::move(initial), peers->options_.actor,
                                 std::move(on_end_of_recording));
  const auto furnish = [weak](std::string name, OpenedModel opened) -> RoomPtr {
    const auto self = weak.lock();
    if (!self) return nullptr;
    ActorOptions actor = self->options_.actor;
    actor.store = std::move(opened.store);
    // Unlike every other of this server, and of one that was here before it.
    const auto now = static_cast<std::uint64_t>(to_ns(self->clock_.now()));
    std::uint64_t last = self->last_epoch_;
    while (!self->last_epoch_.compare_exchange_weak(last, std::max(last + 1, now))) {
    }
    actor.epoch = std::max(last + 1, now);
    return self->furnish(std::move(name), std::move(opened.model), std::move(actor), {});
  };
  peers->rooms_ = std::make_unique<Rooms>(peers->options_.rooms, std::move(first), furnish, clock,
                                          log.component("models"));
  return peers;
}

RoomPtr Peers::furnish(std::string name, model::Model model, ActorOptions options,
                       std::function<void()> on_end_of_recording) {
  auto room = std::make_shared<Room>();
  room->name = std::move(name);
  options.name = room->name;
  room->epoch = options.epoch;
  room->store = options.store;
  const std::weak_ptr<Peers> weak = weak_from_this();
  const std::weak_ptr<Room> weak_room = room;
  ActorEvents events;
  events.on_scene = [weak, weak_room] {
    const auto self = weak.lock();
    const auto its_room = weak_room.lock();
    if (self && its_room) self->notify_viewers(*its_room);
  };
  events.on_presence = [weak, weak_room](const v1::Presence& presence) {
    const auto self = weak.lock();
    const auto its_room = weak_room.lock();
    if (self && its_room) self->send_presence(*its_room, presence, nullptr);
  };
  events.on_end_of_recording = std::move(on_end_of_recording);
  room->actor = std::make_unique<ModelActor>(std::move(model), std::move(options), std::move(events), clock_,
                                             log_.component("model").with("model", room->name));
  return room;
}

void Peers::close() {
  closed_ = true;
}

void Peers::stop() {
  close();
  rooms_->stop();
}

void Peers::tick() {
  look_at_access();
  for (const RoomPtr& room : rooms_->open_rooms()) room->actor->tick();
  rooms_->tick();
  packs_->sweep();
  const std::size_t scene_bytes = limits().scene_bytes;
  for (const PeerPtr& peer : everybody()) {
    if (peer->connection->statistics().queued_frames == 0) continue;
    const RoomPtr room = room_of(*peer);
    const stream::ScenePtr scene = room->actor->scene();
    const std::unique_lock viewer_lock(peer->viewer_mutex, std::try_to_lock);
    if (!viewer_lock) continue;  // It is being written to.
    bool begins = false;
    {
      const std::lock_guard lock(peer->mutex);
      if (!peer->seated) continue;
      begins = peer->beginning != nullptr;
    }
    // Who joins again and reads nothing keeps nothing of what it had; resume() begins with that, too.
    if (begins) peer->viewer.reset();
    if (begins || peer->viewer.stale_bytes(*scene) <= scene_bytes) continue;
    peer->log.with("model", room->name)
        .warning("\"{}\" ({}) reads too slowly: begins anew with a snapshot", peer->hands.name, peer->id);
    peer->viewer.reset();
    const std::lock_guard lock(peer->mutex);
    peer->has.reset();
  }
}

net::ServerEvents Peers::events(net::Endpoint::Kind kind) {
  const std::weak_ptr<Peers> weak = weak_from_this();
  net::ServerEvents events;
  events.admit = [weak, kind](const net::PeerInfo& info) -> Result<net::Admission> {
    const auto self = weak.lock();
    if (!self || self->closed_) return make_error(ErrorCode::cancelled, "the server is stopping");
    return self->admit(info, kind);
  };
  events.on_pair = [weak](const net::PairingRequest& request, const net::PairingAnswer& answer) {
    const auto self = weak.lock();
    if (!self || self->closed_) {
      answer(make_error(ErrorCode::cancelled, "the server is stopping"));
      return;
    }
    self->gate_->pair(request.pair, request.address, answer);
  };
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
  events.on_refused = [weak](net::RefusedAt where, const Error& error) {
    if (const auto self = weak.lock()) self->count_refusal(where, error);
  };
  events.on_overflow = [weak](const net::ConnectionPtr& connection) {
    const auto self = weak.lock();
    return self ? self->on_overflow(connection) : net::OverflowAction::close;
  };
  return events;
}

// ---- coming

ClientLimits Peers::limits() const {
  const std::lock_guard lock(limits_mutex_);
  return limits_;
}

void Peers::set_limits(const ClientLimits& limits) {
  const std::lock_guard lock(limits_mutex_);
  limits_ = limits;
}

Logger Peers::log_of(const net::Connection& connection, const std::string& user) const {
  Logger log = log_.with("client", std::to_string(connection.id()));
  if (!user.empty()) log = log.with("user", user);
  return log.with("remote", net::shown_remote(connection.peer()));
}

void Peers::count_refusal(net::RefusedAt where, const Error& error) const {
  const RefusalCounter counter{options_.actor.metrics, {}};
  switch (where) {
    case net::RefusedAt::connection:
      return counter.add(Asked::connection, error);
    case net::RefusedAt::tls:
      return counter.add(Asked::tls, error);
    case net::RefusedAt::hello:
      return counter.add(Asked::hello, error);
    case net::RefusedAt::pairing:
      return counter.add(Asked::pairing, error);
  }
}

Result<net::Admission> Peers::admit(const net::PeerInfo& info, net::Endpoint::Kind kind) {
  auto user = gate_->authenticate(info, kind);
  if (!user) return user.error();
  net::Admission admission;
  admission.user = user->name;
  if (!info.client_key.empty()) admission.client_id = derived_client_id(user->name, info.client_key);
  return admission;
}

Status Peers::on_join(const net::ConnectionPtr& connection, net::Endpoint::Kind kind) {
  auto user = gate_->authenticate(connection->peer(), kind);
  if (!user) return user.error();
  Logger log = log_of(*connection, user->name);
  auto peer = std::make_shared<Peer>(connection, kind, *std::move(user), rooms_->first(), options_, limits(),
                                     packs_, std::move(log));
  connection->user_data = std::weak_ptr<Peer>(peer);  // `peers` holds it: the two must not hold each other
  PeerPtr older;
  {
    const std::lock_guard lock(peers_mutex_);
    if (const auto found = peers_.find(peer->id); found != peers_.end()) older = found->second;
  }
  if (older) {
    // It has come anew before we knew that its connection was lost. What it held is free before it asks for
    // it again.
    depart(older, "the same client has connected anew");
    older->connection->fail(
        make_error(ErrorCode::cancelled, "the same client has connected anew", "hello.client_key"));
  }
  peer->log.info("{} \"{}\" connected as {}", connection->peer().program, connection->peer().name, peer->id);
  const std::lock_guard lock(peers_mutex_);
  peers_[peer->id] = peer;
  peer->number = ++clients_served_;
  return {};
}

v1::Role Peers::role_of(const Peer& peer, const Room& room) const {
  return access::lesser(peer.connection->peer().role, gate_->role_of(peer.user, room.name));
}

void Peers::send_joined(const Peer& peer, const Room& room, v1::Role role, bool resumed) const {
  if (!knows_sharing(peer)) return;
  v1::Envelope envelope;
  envelope.mutable_joined()->set_model(room.name);
  envelope.mutable_joined()->set_role(role);
  envelope.mutable_joined()->set_epoch(room.epoch);
  envelope.mutable_joined()->set_resumed(resumed);
  peer.connection->send(envelope);
}

void Peers::look_at_access() {
  // Certificates end without anybody changing the file.
  constexpr std::uint32_t looks_until_all = 50;
  if (!gate_->poll() && ++looks_ % looks_until_all != 0) return;
  for (const PeerPtr& peer : everybody()) {
    const RoomPtr room = room_of(*peer);
    const v1::Role role = role_of(*peer, *room);
    bool joined = false, hands_end = false, shapes = true;
    {
      const std::lock_guard lock(peer->mutex);
      joined = peer->joined;
    }
    // Whoever has not joined may still mean a model where they have a role.
    if (!gate_->still_welcome(peer->user) || (joined && role == v1::ROLE_UNSPECIFIED)) {
      peer->connection->fail(
          make_error(ErrorCode::permission_denied, "your access to this server was revoked", "user"));
      // What it held is free at once, not when its connection is over.
      depart(peer, "access was revoked");
      continue;
    }
    {
      const std::lock_guard lock(peer->mutex);
      if (!peer->joined || std::exchange(peer->told_role, role) == role) continue;
      shapes = access::at_least(role, v1::ROLE_EDITOR);
      if (!shapes) hands_end = std::exchange(peer->brings_hands, false);
    }
    if (hands_end) room->actor->hand_gone(peer->hands);
    if (!shapes) room->actor->end_leases(peer->id);
    peer->log.with("model", room->name).info("the role is now {}", access::role_name(role));
    send_joined(*peer, *room, role, true);
    send_people(*room);
  }
}

Status Peers::join(const PeerPtr& peer, const v1::Join& message) {
  Status begun = try_join(peer, message);
  // The name that it said may be none, and of no model.
  if (!begun) RefusalCounter{options_.actor.metrics, {}}.add(Asked::join, begun.error());
  return begun;
}

Status Peers::try_join(const PeerPtr& peer, const v1::Join& message) {
  if (message.model().empty() && !options_.nameless) return options_.nameless;
  const std::string name = message.model().empty() ? rooms_->first()->name : message.model();
  if (Status good = check_model_name(name); !good) return good;
  const auto role = gate_->enter(peer->user, name, peer->connection->peer().role);
  if (!role) return role.error();
  RoomPtr again;
  {
    const std::lock_guard lock(peer->mutex);
    if (peer->entering || (peer->counted && peer->room->name != name)) {
      return make_error(ErrorCode::failed_precondition,
                        fmt::format("found \"{}\" on a connection that has joined another model", name),
                        "join.model");
    }
    if (peer->counted) {
      again = peer->room;
    } else {
      peer->entering = true;
    }
  }
  if (again) {
    begin(peer, again, message, *role);
    return {};
  }
  // What it says next is about the model that it asked for.
  peer->connection->pause_reading();
  const bool may_make =
      access::at_least(*role, v1::ROLE_EDITOR) && gate_->role_of(peer->user, name) == v1::ROLE_OWNER;
  rooms_->enter(name, may_make ? Rooms::IfMissing::make : Rooms::IfMissing::refuse,
                [weak = weak_from_this(), peer, message, granted = *role](const Result<RoomPtr>& room) {
                  if (const auto self = weak.lock()) self->entered(peer, message, granted, room);
                });
  return {};
}

void Peers::entered(const PeerPtr& peer, const v1::Join& message, v1::Role role,
                    const Result<RoomPtr>& room) {
  bool gone = false;
  {
    const std::lock_guard lock(peer->mutex);
    peer->entering = false;
    gone = peer->gone;
    if (room && !gone) {
      peer->room = *room;
      peer->counted = true;
    }
  }
  if (!room) {
    RefusalCounter{options_.actor.metrics, {}}.add(Asked::join, room.error());
    peer->connection->fail(room.error());
  } else if (gone) {
    rooms_->leave(*room);
  } else {
    begin(peer, *room, message, role);
  }
  peer->connection->resume_reading();
}

void Peers::begin(const PeerPtr& peer, const RoomPtr& room, const v1::Join& message, v1::Role role) {
  note_coming(*peer, *room, role);
  peer->log.with("model", room->name).info("joined as {}", access::role_name(role));
  {
    const std::lock_guard lock(peer->mutex);
    peer->joined = true;
    peer->seated = false;
    peer->told_role = role;
    if (peer->joined_ns == 0) peer->joined_ns = options_.wall_ns();
  }
  forget_seats();
  room->actor->viewer_came(
      peer->id, peer->hands.name,
      [weak = weak_from_this(), peer, room, asked = std::make_shared<const v1::Join>(message)] {
        if (const auto self = weak.lock()) self->seat(peer, room, asked);
      });
}

/// Scripts may work on a model without watching it.
void Peers::note_coming(Peer& peer, const Room& room, v1::Role role) const {
  {
    const std::lock_guard lock(peer.mutex);
    if (peer.noted_in == room.name) return;
    peer.noted_in = room.name;
  }
  gate_->joined(peer.user, room.name, role, peer.connection->peer().program);
}

void Peers::seat(const PeerPtr& peer, const RoomPtr& room, const std::shared_ptr<const v1::Join>& message) {
  bool resumed = false;
  v1::Role role = v1::ROLE_UNSPECIFIED;
  {
    const std::lock_guard lock(peer->mutex);
    if (!peer->joined) return;
    resumed = peer->viewer.can_resume(*message, *room->actor->scene());
    // What cannot be gone on with is not kept: it may be large.
    peer->beginning = resumed ? message : std::make_shared<const v1::Join>();
    peer->seated = false;
    peer->behind = true;
    peer->has.reset();
    role = peer->told_role;
  }
  send_joined(*peer, *room, role, resumed);
  {
    const std::lock_guard lock(peer->mutex);
    peer->seated = true;  // From now on, since the scene comes after that.
  }
  forget_seats();
  peer->connection->set_pull(
      [weak = weak_from_this(), weak_peer = std::weak_ptr(peer)]() -> std::optional<net::Frame> {
        const auto self = weak.lock();
        const auto viewer = weak_peer.lock();
        return self && viewer ? self->pull(*viewer) : std::nullopt;
      });
  peer->connection->notify_pull();
  send_people(*room);
}

// ---- going

void Peers::on_closed(const net::ConnectionPtr& connection, const std::string& reason) {
  if (const PeerPtr peer = peer_of(connection)) depart(peer, reason);
}

void Peers::depart(const PeerPtr& peer, const std::string& reason) {
  RoomPtr room;
  bool present = false;
  bool brings_hands = false;
  bool counted = false;
  std::string noted_in;
  {
    const std::lock_guard lock(peer->mutex);
    if (std::exchange(peer->gone, true)) return;
    noted_in = peer->noted_in;
    room = peer->room;
    present = peer->present;
    brings_hands = peer->brings_hands;
    counted = peer->counted;
    peer->joined = peer->seated = false;
    peer->beginning.reset();
  }
  forget_seats();
  {
    const std::lock_guard lock(peer->viewer_mutex);
    peer->viewer.reset();
  }
  {
    const std::lock_guard lock(peers_mutex_);
    const auto found = peers_.find(peer->id);
    if (found != peers_.end() && found->second == peer) peers_.erase(found);
  }
  const Logger log = counted ? peer->log.with("model", room->name) : peer->log;
  log.info("\"{}\" ({}) is gone: {}", peer->hands.name, peer->id, reason);
  if (!noted_in.empty()) gate_->left(peer->user, noted_in, reason);
  if (brings_hands)
    room->actor->hand_gone(peer->hands);  // Which tells the others when the last frame is handled.
  if (present && !brings_hands) {
    v1::Presence gone;
    gone.set_client_id(peer->id);
    gone.set_name(peer->hands.name);
    gone.set_gone(true);
    send_presence(*room, clean_presence(std::move(gone)), peer.get());
  }
  if (!counted) return;
  room->actor->viewer_gone(peer->id);
  rooms_->leave(room);
  send_people(*room);
}

// Only answers come to that: a scene is composed when there is room for it, and presence is dropped. Who has
// left so many unread would not miss a closed connection, and by its client_op_ids it may ask for them again.
net::OverflowAction Peers::on_overflow(const net::ConnectionPtr& connection) {
  if (const PeerPtr peer = peer_of(connection)) {
    peer->log.warning("\"{}\" ({}) leaves its answers unread: closed", connection->peer().name, peer->id);
  }
  return net::OverflowAction::close;
}

}  // namespace handloft::session
