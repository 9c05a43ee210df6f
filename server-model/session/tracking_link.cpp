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
    const std::lock_guard lock(line_->mutex);
    line_->wants_subscription = true;
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
  {
    const std::lock_guard lock(line_->mutex);
    line_->client = std::move(client);
    subscribe();
  }
  actor.set_feel([line = line_](const v1::GloveFeedback& feedback) {
    const std::lock_guard lock(line->mutex);
    if (!line->client) return;
    v1::Envelope envelope;
    *envelope.mutable_glove_feedback() = feedback;
    // Felt late is worse than not felt: what cannot be sent now is not kept, nor worth a word.
    static_cast<void>(line->client->send(envelope));
  });
}

TrackingLink::~TrackingLink() {
  std::unique_ptr<net::MessageClient> client;
  {
    const std::lock_guard lock(line_->mutex);
    client.swap(line_->client);
  }
  // Its destructor waits for callbacks, which may want the lock.
}

void TrackingLink::subscribe() {
  if (!line_->client || !line_->wants_subscription) return;
  line_->wants_subscription = false;
  v1::Envelope envelope;
  envelope.mutable_subscribe()->set_delivery(v1::Subscribe::EVERY);
  if (const Status sent = line_->client->send(envelope); !sent) {
    log_.warning("cannot subscribe to tracking: {}", sent.error().describe());
  }
}

}  // namespace handloft::session
