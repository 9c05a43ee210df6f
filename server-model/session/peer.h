#pragma once
// One who is connected, as the peers keep it (peers.h).

#include <any>
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

/// Of protocol 1.3: who is older is sent meshes as they were before.
inline constexpr std::uint32_t residuals_since_minor = 3;

struct Peer {
  Peer(net::ConnectionPtr its_connection, net::Endpoint::Kind its_kind, access::User its_user,
       RoomPtr first_room, const ServerOptions& options, const ClientLimits& limits,
       std::shared_ptr<stream::PackCache> packs, Logger its_log)
      : connection(std::move(its_connection)),
        id(connection->id()),
        kind(its_kind),
        user(std::move(its_user)),
        log(std::move(its_log)),
        hands{id, connection->peer().name, log},
        // On one host both read the same clock, and an estimate would only add its error.
        clock(its_kind == net::Endpoint::Kind::unix_socket ? ClientClock{}
                                                           : ClientClock::of(connection->peer())),
        max_pending_requests(limits.max_pending_requests),
        max_pending_bytes(limits.max_pending_bytes),
        complaints(options.complain_every),
        room(std::move(first_room)),
        viewer(options.viewer,
               connection->peer().protocol_minor >= residuals_since_minor
                   ? stream::MeshReading::residuals
                   : stream::MeshReading::vertex_streams,
               std::move(packs)) {}

  const net::ConnectionPtr connection;
  const std::uint64_t id;  ///< Unlike that of anybody else who is here now.
  const net::Endpoint::Kind kind;
  const access::User user;
  const Logger log;  ///< Its lines say the client's id, user and address; about a model also which.
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
  std::string noted_in;  ///< The model to which it came, as the audit log says; empty: to none yet.
  v1::Role told_role = v1::ROLE_UNSPECIFIED;  ///< By the last Joined.
  std::uint64_t number = 0;                   ///< In the order of coming.
  std::int64_t joined_ns = 0;                 ///< Wall clock.
  bool present = false;                       ///< Has told of itself.
  bool brings_hands = false;  ///< The server tells of its hands, from its frames and commands.
  std::weak_ptr<const stream::Scene>
      has;  ///< The scene that it has been given whole; weak: it must not keep one.
  std::shared_ptr<const v1::Join>
      beginning;  ///< What it says that it holds, until the next message is composed.
  /// Much is on its way to it, and who writes that goes on until it has all: nobody else, and above all not
  /// the model's thread, composes anything for it. What comes meanwhile is `news` for who writes.
  bool behind = false;
  bool news = false;
  std::size_t pending_requests = 0;
  std::size_t pending_bytes = 0;

  /// Guards what follows; held while a message is composed, some milliseconds, so that nobody may wait for it
  /// who others wait for. To be taken before `mutex`.
  std::mutex viewer_mutex;
  stream::Viewer viewer;
  std::int64_t shown_capture_ns = 0;
};

/// Of protocol 1.2: who is older must not be sent what came with it.
inline constexpr std::uint32_t sharing_since_minor = 2;
inline bool knows_sharing(const Peer& peer) {
  return peer.connection->peer().protocol_minor >= sharing_since_minor;
}

/// Null: of nobody who is here.
inline std::shared_ptr<Peer> peer_of(const net::ConnectionPtr& connection) {
  const auto* held = std::any_cast<std::weak_ptr<Peer>>(&connection->user_data);
  return held == nullptr ? nullptr : held->lock();
}

inline RoomPtr room_of(Peer& peer) {
  const std::lock_guard lock(peer.mutex);
  return peer.room;
}

}  // namespace handloft::session
