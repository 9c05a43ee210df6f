#pragma once
// One who is connected, as the peers keep it (peers.h).

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "common/base/log.h"
#include "common/net/connection.h"
#include "common/net/endpoint.h"
#include "proto/session.pb.h"
#include "server-model/access/roles.h"
#include "server-model/session/client_frame.h"
#include "server-model/session/presence.h"
#include "server-model/session/room.h"
#include "server-model/session/server_options.h"
#include "server-model/stream/viewer.h"

namespace handloft::session {

struct Peer {
  Peer(net::ConnectionPtr its_connection, net::Endpoint::Kind its_kind, access::User its_user,
       RoomPtr first_room, const ServerOptions& options)
      : connection(std::move(its_connection)),
        id(connection->id()),
        kind(its_kind),
        user(std::move(its_user)),
        hands{id, connection->peer().name},
        // On one host both read the same clock, and an estimate would only add its error.
        clock(its_kind == net::Endpoint::Kind::unix_socket ? ClientClock{}
                                                           : ClientClock::of(connection->peer())),
        max_pending_requests(options.max_pending_requests),
        max_pending_bytes(options.max_pending_bytes),
        complaints(options.complain_every),
        room(std::move(first_room)),
        viewer(options.viewer) {}

  const net::ConnectionPtr connection;
  const std::uint64_t id;  ///< Unlike that of anybody else who is here now.
  const net::Endpoint::Kind kind;
  const access::User user;
  const HandOwner hands;
  const ClientClock clock;
  const std::size_t max_pending_requests;
  const std::size_t max_pending_bytes;
  RateLimit complaints;  ///< About its frames.

  std::mutex mutex;       ///< Guards what follows; never held while calling the connection.
  RoomPtr room;           ///< Whose model it works on: the first one's until it has joined another.
  bool entering = false;  ///< Its model is being opened.
  bool counted = false;   ///< Among the room's people.
  bool joined = false;
  bool seated = false;  ///< Has been told so, and is sent the scene.
  bool gone = false;
  v1::Role told_role = v1::ROLE_UNSPECIFIED;  ///< By the last Joined.
  std::uint64_t number = 0;                   ///< In the order of coming.
  std::int64_t joined_ns = 0;                 ///< Wall clock.
  bool present = false;                       ///< Has told of itself.
  bool brings_hands = false;  ///< The server tells of its hands, from its frames and commands.
  stream::Viewer viewer;
  std::weak_ptr<const stream::Scene>
      has;  ///< The scene that it has been given whole; weak: it must not keep one.
  std::int64_t shown_capture_ns = 0;
  std::size_t pending_requests = 0;
  std::size_t pending_bytes = 0;
};

/// Of protocol 1.2: who is older must not be sent what came with it.
inline constexpr std::uint32_t sharing_since_minor = 2;
inline bool knows_sharing(const Peer& peer) {
  return peer.connection->peer().protocol_minor >= sharing_since_minor;
}

inline RoomPtr room_of(Peer& peer) {
  const std::lock_guard lock(peer.mutex);
  return peer.room;
}

}  // namespace handloft::session
