#pragma once
// The line to handloft-trackd: every frame goes to the model, in order; when the daemon is gone, gestures
// end, and the link tries again until it is back. Back goes what the hand should feel of its work
// (GloveFeedback), while there is a daemon to tell it to.

#include <memory>
#include <mutex>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/net/endpoint.h"
#include "common/net/message_client.h"
#include "server-model/session/model_actor.h"

namespace handloft::session {

class TrackingLink {
 public:
  /// Returns at once; connects when the daemon is there. `actor` and `clock` must outlive it; stop the actor
  /// first, so that a full queue cannot hold the link's thread.
  TrackingLink(const net::Endpoint& endpoint, ModelActor& actor, const Clock& clock, Logger log);
  ~TrackingLink();
  TrackingLink(const TrackingLink&) = delete;
  TrackingLink& operator=(const TrackingLink&) = delete;

 private:
  /// What the model's thread sends by; it may hold it longer than there is a link.
  struct Line {
    std::mutex mutex;
    std::unique_ptr<net::MessageClient> client;
    bool wants_subscription = false;  ///< Connected before the client's pointer was known.
  };
  void subscribe();

  Logger log_;
  std::shared_ptr<Line> line_ = std::make_shared<Line>();
};

}  // namespace handloft::session
