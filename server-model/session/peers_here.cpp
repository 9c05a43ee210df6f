// Who is there: what all of them are told, and the figures of who looks after the server.

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "server-model/session/peer.h"
#include "server-model/session/peers.h"

namespace handloft::session {
namespace {

/// Outbox slots: one for each person's presence, one for who is there.
constexpr std::uint32_t presence_slot = 1;
constexpr std::uint32_t people_slot = 2;

/// Of whom a presence tells: a client may have two hands.
std::string presence_key(const v1::Presence& presence) {
  return fmt::format("{}/{}", presence.client_id(), presence.name());
}

}  // namespace

std::vector<PeerPtr> Peers::everybody() const {
  const std::lock_guard lock(peers_mutex_);
  std::vector<PeerPtr> result;
  result.reserve(peers_.size());
  for (const auto& [id, peer] : peers_) result.push_back(peer);
  return result;
}

std::vector<PeerPtr> Peers::everybody_in(const Room& room) const {
  std::vector<PeerPtr> result = everybody();
  std::erase_if(result, [&](const PeerPtr& peer) {
    const std::lock_guard lock(peer->mutex);
    return !peer->joined || peer->room.get() != &room;
  });
  return result;
}

Peers::Seats Peers::seated_in(const Room& room) const {
  std::uint64_t version = 0;
  {
    const std::lock_guard lock(seats_mutex_);
    const auto found = seats_.find(&room);
    if (found != seats_.end()) return found->second;
    version = seats_version_;
  }
  std::vector<PeerPtr> seated = everybody_in(room);
  std::erase_if(seated, [](const PeerPtr& peer) {
    const std::lock_guard lock(peer->mutex);
    return !peer->seated;
  });
  auto result = std::make_shared<const std::vector<PeerPtr>>(std::move(seated));
  const std::lock_guard lock(seats_mutex_);
  if (version == seats_version_) seats_[&room] = result;
  return result;
}

void Peers::forget_seats() const {
  const std::lock_guard lock(seats_mutex_);
  seats_.clear();
  ++seats_version_;
}

void Peers::notify_viewers(const Room& room) const {
  for (const PeerPtr& peer : everybody_in(room)) {
    {
      const std::lock_guard lock(peer->mutex);
      peer->news = true;
      if (peer->behind) continue;
    }
    peer->connection->notify_pull();
  }
}

void Peers::send_presence(const Room& room, const v1::Presence& presence, const Peer* from) const {
  v1::Envelope envelope;
  *envelope.mutable_presence() = presence;
  const auto frame = net::encode_frame(envelope);
  if (!frame) return;  // cleaned presence is small
  const net::SlotKey slot{presence_slot, presence_key(presence)};
  const Seats seated = seated_in(room);
  for (const PeerPtr& peer : *seated) {
    if (peer.get() != from) peer->connection->send_latest(slot, *frame);
  }
}

v1::People Peers::people_in(const Room& room) const {
  std::vector<std::pair<std::uint64_t, v1::Person>> in_order;
  for (const PeerPtr& peer : everybody_in(room)) {
    const net::PeerInfo& info = peer->connection->peer();
    v1::Person person;
    person.set_client_id(peer->id);
    person.set_user(peer->user.name);
    person.set_name(info.name);
    person.set_program(info.program);
    const std::lock_guard lock(peer->mutex);
    person.set_role(std::string(access::role_name(peer->told_role)));
    person.set_joined_ns(peer->joined_ns);
    in_order.emplace_back(peer->number, std::move(person));
  }
  std::sort(in_order.begin(), in_order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  v1::People people;
  for (auto& [number, person] : in_order) *people.add_people() = std::move(person);
  return people;
}

void Peers::send_people(const Room& room) const {
  v1::Envelope envelope;
  *envelope.mutable_people() = people_in(room);
  const auto frame = net::encode_frame(envelope);
  if (!frame) return;  // Names are short, connections few.
  const net::SlotKey slot{people_slot, "", net::Lane::notices};
  const Seats seated = seated_in(room);
  for (const PeerPtr& peer : *seated) {
    if (knows_sharing(*peer)) peer->connection->send_latest(slot, *frame);
  }
}

// ---- figures

bool Peers::flushed() const {
  for (const PeerPtr& peer : everybody()) {
    const stream::ScenePtr scene = room_of(*peer)->actor->scene();
    {
      const std::lock_guard lock(peer->mutex);
      if (!peer->joined) continue;
      if (peer->has.lock() != scene) return false;
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

std::vector<ClientFigures> Peers::clients() const {
  std::vector<ClientFigures> figures;
  for (const PeerPtr& peer : everybody()) {
    const net::ConnectionStatistics statistics = peer->connection->statistics();
    figures.push_back(
        {role_word(peer->connection->peer().role), statistics.queued_bytes, statistics.overflows});
  }
  return figures;
}

std::vector<ModelFigures> Peers::models() const {
  std::vector<ModelFigures> figures;
  for (const RoomPtr& room : rooms_->open_rooms()) {
    ModelFigures model;
    model.name = room->name;
    model.clients = everybody_in(*room).size();
    model.sequence = room->actor->scene()->sequence;
    if (room->store) {
      model.kept = true;
      model.durable_sequence = room->store->durable_sequence();
      model.file_bytes = file_bytes(room->store->path().string());
      model.writable = room->store->failure().ok();
      model.recovery_s = std::chrono::duration<double>(room->store->opening()).count();
    }
    figures.push_back(std::move(model));
  }
  return figures;
}

void Peers::flush() const {
  for (const RoomPtr& room : rooms_->open_rooms()) {
    if (room->store) room->store->flush();
  }
}

LatencySummary Peers::capture_to_delta() const {
  const std::lock_guard lock(latency_mutex_);
  return capture_to_delta_.summary();
}

}  // namespace handloft::session
