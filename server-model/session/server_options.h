#pragma once
// What may be set of a session's server.

#include <cstddef>
#include <string>

#include "common/net/message_server.h"
#include "server-model/session/client_frame.h"
#include "server-model/session/model_actor.h"
#include "server-model/session/resolve_operation.h"
#include "server-model/stream/viewer.h"

namespace handloft::session {

struct ServerOptions {
  std::string model_name = "main";  ///< What a Join may name; empty always means this one.
  net::ServerOptions net;           ///< `roles` is set by the server: viewers and editors.
  stream::ViewerLimits viewer;
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
