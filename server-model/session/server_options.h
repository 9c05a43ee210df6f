#pragma once
// What may be set of a session's server.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "common/net/message_server.h"
#include "server-model/access/gate.h"
#include "server-model/session/client_frame.h"
#include "server-model/session/model_actor.h"
#include "server-model/session/resolve_operation.h"
#include "server-model/session/rooms.h"
#include "server-model/stream/viewer.h"

namespace handloft::session {

/// What one client that reads nothing costs at most (U4): 16 MiB together, each part bounded by itself.
/// Beside that there is the kernel's buffer (net::ServerOptions::send_buffer_bytes).
struct ClientMemory {
  std::size_t answers_bytes = 8U << 20;   ///< More that nobody reads: the client is closed with that reason.
  std::size_t presence_bytes = 1U << 20;  ///< More is dropped: the next one tells all.
  std::size_t notices_bytes = 1U << 20;   ///< The same.
  /// Of scenes that the server has gone on from, kept for what this client holds; more: it begins anew with a
  /// snapshot when it reads again.
  std::size_t scene_bytes = 2U << 20;
  /// Beside the one message of a scene that is being sent: ViewerLimits::max_message_bytes, or one large
  /// entity.
  std::size_t max_presences = 1024;  ///< Hands of everybody.
};

/// Of one client, and may change while the server runs.
struct ClientLimits {
  std::size_t max_pending_requests = 0;  ///< ServerOptions has what the three are.
  std::size_t max_pending_bytes = 0;
  std::size_t scene_bytes = 0;
};

struct ServerOptions {
  std::string model_name = "main";  ///< Of the first model, which an empty Join means.
  /// Not ok: the model that an empty Join means could not be opened, and the first model is another one,
  /// which nobody comes to without naming it.
  Status nameless = {};
  RoomsOptions rooms;          ///< The other models; by default there are none.
  ClientMemory client_memory;  ///< In place of net.outbox.
  /// The wall clock, ns since 1970 UTC, for people: when something was done and who came. Empty: the
  /// system's.
  std::function<std::int64_t()> wall_ns = {};
  net::ServerOptions net;  ///< `roles` is set by the server: viewer to owner.
  /// Who may come in and what they may do; null: Gate::without_file().
  std::shared_ptr<access::Gate> gate = {};
  stream::ViewerLimits viewer;
  stream::PackCacheOptions packs;  ///< What viewers share of what they are sent, of all models together.
  /// Submits, asks and commands of one peer that are not yet answered. With so many under way nothing more is
  /// read of the peer until half are answered, so that none can fill our memory; the one that reaches the
  /// bytes is still taken.
  std::size_t max_pending_requests = 64;
  std::size_t max_pending_bytes = 32U << 20;
  ClientFrameOptions client_frames;
  /// Between two words to a peer whose frames cannot be used.
  Duration complain_every = std::chrono::seconds(1);
  ActorOptions actor;
  model::FileAccess files;  ///< See ServeOptions::files.
};

}  // namespace handloft::session
