#include "server-model/session/tracking_link.h"

#include <utility>

#include "common/base/version.h"

namespace handloft::session {

TrackingLink::TrackingLink(const net::Endpoint& endpoint, ModelActor& actor, const Clock& clock, Logger log)
    : log_(std::move(log)) {
  net::ClientOptions options;
  options.role = v1::ROLE_SUBSCRIBER;
  options.program = program_version("handloft-modeld");
  options.name = "model server";
  options.reconnect = net::Reconnect::always;
  net::ClientEvents events;
  events.on_connected = [this](const v1::Welcome& welcome, const net::ClockOffset&) {
    log_.info("tracking by {}", welcome.program());
    const std::lock_guard lock(mutex_);
    wants_subscription_ = true;
    subscribe();
  };
  events.on_message = [this, &actor](v1::Envelope& envelope) {
    if (envelope.has_tracking()) {
      actor.push_frame(std::move(*envelope.mutable_tracking()));
    } else if (envelope.has_failure()) {
      log_.warning("the tracking daemon says: {}", envelope.failure().message());
    }
  };
  events.on_disconnected = [this, &actor](const Error& error) {
    log_.info("no tracking: {}", error.message);
    actor.tracking_lost();
  };
  auto client = net::MessageClient::start(endpoint, std::move(options), std::move(events), clock, log_);
  const std::lock_guard lock(mutex_);
  client_ = std::move(client);
  subscribe();
}

TrackingLink::~TrackingLink() {
  std::unique_ptr<net::MessageClient> client;
  {
    const std::lock_guard lock(mutex_);
    client.swap(client_);
  }
  // Its destructor waits for callbacks, which may want the lock.
}

void TrackingLink::subscribe() {
  if (!client_ || !wants_subscription_) return;
  wants_subscription_ = false;
  v1::Envelope envelope;
  envelope.mutable_subscribe()->set_delivery(v1::Subscribe::EVERY);
  if (const Status sent = client_->send(envelope); !sent) {
    log_.warning("cannot subscribe to tracking: {}", sent.error().describe());
  }
}

}  // namespace handloft::session
