#include "client-hmd/view/tracking_feed.h"

#include <mutex>

#include "common/base/version.h"
#include "common/net/message_client.h"
#include "proto/session.pb.h"

namespace handloft::client {
namespace {

/// Ten times that at most, so that a daemon that is back is found within half a second.
constexpr auto retry_interval = std::chrono::milliseconds(50);
constexpr auto silence_timeout = std::chrono::seconds(15);
/// Two hands and sixteen cameras have some hundred; 20 MiB.
constexpr std::size_t max_message_parts = 100'000;

}  // namespace

struct TrackingFeed::Implementation {
  Implementation(const net::Endpoint& where, const Clock& time, Logger logger)
      : endpoint(where), clock(time), log(std::move(logger)) {}

  const net::Endpoint endpoint;
  const Clock& clock;
  const Logger log;
  mutable std::mutex mutex;  ///< Guards `history`; held for lookups and for adding a frame, never for I/O.
  TrackingHistory history;
  Duration to_local{};  ///< The network's thread only.

  std::mutex client_mutex;  ///< Held while `client` is being made: its thread may call back at once.
  std::unique_ptr<net::MessageClient> client;

  void on_connected(const net::ClockOffset& offset) {
    // On one host both read the same clock, and the estimate would only add its error.
    to_local =
        endpoint.kind == net::Endpoint::Kind::unix_socket ? Duration::zero() : -offset.server_minus_client;
    {
      const std::lock_guard lock(mutex);
      history.clear();
      history.status().connected = true;
      history.status().problem.clear();
      ++history.status().connects;
    }
    v1::Envelope envelope;
    envelope.mutable_subscribe()->set_delivery(v1::Subscribe::LATEST);
    const std::lock_guard lock(client_mutex);
    if (client == nullptr) return;  // Shutting down.
    if (const Status sent = client->send(envelope); !sent) {
      log.warning("cannot subscribe: {}", sent.error().describe());
    }
  }

  void on_message(const v1::Envelope& envelope) {
    if (!envelope.has_tracking()) return;
    const std::lock_guard lock(mutex);
    history.add(envelope.tracking(), to_local, clock.now());
  }

  void on_disconnected(const Error& error) {
    constexpr std::size_t longest_words = 256;
    const std::lock_guard lock(mutex);
    history.status().connected = false;
    history.status().problem = error.message.substr(0, longest_words);
  }
};

TrackingFeed::TrackingFeed(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

TrackingFeed::~TrackingFeed() {
  // The client's destructor waits for its thread, whose callbacks use the rest.
  std::unique_ptr<net::MessageClient> client;
  {
    const std::lock_guard lock(implementation_->client_mutex);
    client.swap(implementation_->client);
  }
}

std::unique_ptr<TrackingFeed> TrackingFeed::start(const net::Endpoint& endpoint, const Clock& clock,
                                                  Logger log) {
  auto parts = std::make_unique<Implementation>(endpoint, clock, log);
  Implementation* self = parts.get();
  net::ClientOptions options;
  options.role = v1::ROLE_SUBSCRIBER;
  options.program = program_version("handloft-hmd");
  options.reconnect = net::Reconnect::always;
  options.retry_interval = retry_interval;
  options.silence_timeout = silence_timeout;
  options.max_message_parts = max_message_parts;
  net::ClientEvents events;
  events.on_connected = [self](const v1::Welcome&, const net::ClockOffset& offset) {
    self->on_connected(offset);
  };
  events.on_message = [self](v1::Envelope& envelope) { self->on_message(envelope); };
  events.on_disconnected = [self](const Error& error) { self->on_disconnected(error); };
  events.on_attempt_failed = [self](const Error& error) { self->on_disconnected(error); };
  {
    const std::lock_guard lock(self->client_mutex);
    self->client = net::MessageClient::start(endpoint, options, std::move(events), clock, std::move(log));
  }
  return std::unique_ptr<TrackingFeed>(new TrackingFeed(std::move(parts)));
}

TrackingStatus TrackingFeed::status() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->history.status();
}
std::optional<PoseAnswer> TrackingFeed::head_at(TimePoint time) const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->history.head_at(time);
}
std::optional<PoseAnswer> TrackingFeed::camera_at(std::uint32_t index, TimePoint time) const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->history.camera_at(index, time);
}
std::array<std::optional<FingerAnswer>, finger_count> TrackingFeed::fingers_at(TimePoint time) const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->history.fingers_at(time);
}

}  // namespace handloft::client
