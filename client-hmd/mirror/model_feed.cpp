#include "client-hmd/mirror/model_feed.h"

#include <algorithm>
#include <mutex>
#include <optional>

#include "client-hmd/mirror/latest.h"
#include "common/base/version.h"
#include "common/net/message_client.h"
#include "proto/session.pb.h"

namespace handloft::client {
namespace {

constexpr auto rejoin_interval =
    std::chrono::seconds(1);  ///< A server that keeps sending nonsense costs one snapshot a second.
constexpr std::size_t max_activities = 64;  ///< Hands in one picture.
constexpr std::size_t max_text_bytes = 256;

std::string shortened(const std::string& text) {
  return text.substr(0, max_text_bytes);
}

}  // namespace

struct ModelFeed::Implementation {
  Implementation(const net::Endpoint& where, const Clock& time, Logger logger)
      : endpoint(where), clock(time), log(std::move(logger)) {}

  const net::Endpoint endpoint;
  const Clock& clock;
  const Logger log;
  Latest<ModelState> latest;

  mutable std::mutex statistics_mutex;
  ModelFeedStatistics statistics;

  // ---- the network's thread only ----
  SceneMirror mirror;
  ModelState state;
  std::optional<TimePoint> joined_at;
  bool await_snapshot = true;
  net::ClockOffset offset;

  std::mutex client_mutex;  ///< Held while `client` is being made: its thread may call back at once.
  std::unique_ptr<net::MessageClient> client;

  void publish() { latest.publish(std::make_shared<const ModelState>(state)); }

  void join() {
    v1::Envelope envelope;
    envelope.mutable_join();
    const std::lock_guard lock(client_mutex);
    joined_at = clock.now();
    await_snapshot = true;
    if (client == nullptr) return;  // Shutting down.
    if (const Status sent = client->send(envelope); !sent)
      log.warning("cannot join: {}", sent.error().describe());
  }

  void on_connected(const v1::Welcome& welcome, const net::ClockOffset& clock_offset) {
    // On one host both read the same clock, and the estimate would only add its error.
    offset = endpoint.kind == net::Endpoint::Kind::unix_socket ? net::ClockOffset{} : clock_offset;
    {
      const std::lock_guard lock(statistics_mutex);
      ++statistics.connects;
    }
    state.connected = true;
    state.own_client_id = welcome.client_id();
    state.problem.clear();
    state.activities.clear();
    state.last_heard = clock.now();
    publish();
    join();
  }

  void on_disconnected(const Error& error) {
    state.connected = false;
    state.problem = error.message;
    state.activities.clear();
    publish();
    log.info("the model server is gone: {}", error.describe());
  }

  void note_capture(std::int64_t capture_time_ns) {
    if (capture_time_ns <= 0) return;
    const TimePoint captured = offset.to_client(from_ns(capture_time_ns));
    if (!state.has_capture_time || captured > state.capture_time) state.capture_time = captured;
    state.has_capture_time = true;
  }

  template <typename Message>
  void on_scene(const Message& message, std::int64_t capture_time_ns, TimePoint received) {
    const Status applied = mirror.apply(message);
    {
      const std::lock_guard lock(statistics_mutex);
      statistics.mirror = mirror.statistics();
      if (applied.ok() && capture_time_ns > 0) {
        statistics.capture_to_receipt.add(received - offset.to_client(from_ns(capture_time_ns)));
      }
    }
    if (!applied) {
      if (await_snapshot) return;  // Already asked for one.
      log.warning("refused what the server sent: {}", applied.error().describe());
      if (!joined_at || received - *joined_at >= rejoin_interval) join();
      return;
    }
    state.scene = mirror.scene();
    state.received_at = received;
    state.scene_capture_time = capture_time_ns > 0 ? offset.to_client(from_ns(capture_time_ns)) : TimePoint{};
    note_capture(capture_time_ns);
    publish();
  }

  void on_presence(const v1::Presence& presence) {
    note_capture(presence.capture_time_ns());
    if (presence.gone()) {
      std::erase_if(state.activities,
                    [&presence](const auto& item) { return item.first.client_id == presence.client_id(); });
      publish();
      return;
    }
    Result<Activity> activity = read_activity(presence);
    if (!activity) {
      const std::lock_guard lock(statistics_mutex);
      if (statistics.activities_refused++ == 0) {
        log.warning("refused what somebody says of a hand: {}", activity.error().describe());
      }
      return;
    }
    activity->received_at = clock.now();
    ActivityKey key{activity->client_id, activity->name};
    if (state.activities.count(key) != 0 || state.activities.size() < max_activities) {
      state.activities[std::move(key)] = std::move(*activity);
    }
    publish();
  }

  void on_message(const v1::Envelope& envelope) {
    const TimePoint received = clock.now();
    state.last_heard = received;
    switch (envelope.body_case()) {
      case v1::Envelope::kSnapshot:
        await_snapshot = false;
        ++state.snapshots;
        on_scene(envelope.snapshot(), 0, received);
        break;
      case v1::Envelope::kDelta:
        on_scene(envelope.delta(), envelope.delta().capture_time_ns(), received);
        break;
      case v1::Envelope::kPresence:
        on_presence(envelope.presence());
        break;
      case v1::Envelope::kFailure:
        state.problem = shortened(envelope.failure().message());
        log.warning("the server says {}: {}", envelope.failure().code(), state.problem);
        publish();
        break;
      default:
        break;  // For editors and others.
    }
  }
};

ModelFeed::ModelFeed(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

ModelFeed::~ModelFeed() {
  // The client's destructor waits for its thread, whose callbacks use the rest.
  std::unique_ptr<net::MessageClient> client;
  {
    const std::lock_guard lock(implementation_->client_mutex);
    client.swap(implementation_->client);
  }
}

std::unique_ptr<ModelFeed> ModelFeed::start(const net::Endpoint& endpoint, const Clock& clock, Logger log) {
  auto parts = std::make_unique<Implementation>(endpoint, clock, log);
  Implementation* self = parts.get();
  self->publish();
  net::ClientOptions options;
  options.role = v1::ROLE_VIEWER;
  options.program = program_version("handloft-hmd");
  options.reconnect = net::Reconnect::always;
  net::ClientEvents events;
  events.on_connected = [self](const v1::Welcome& welcome, const net::ClockOffset& offset) {
    self->on_connected(welcome, offset);
  };
  events.on_message = [self](v1::Envelope& envelope) { self->on_message(envelope); };
  events.on_disconnected = [self](const Error& error) { self->on_disconnected(error); };
  {
    const std::lock_guard lock(self->client_mutex);
    self->client = net::MessageClient::start(endpoint, options, std::move(events), clock, std::move(log));
  }
  return std::unique_ptr<ModelFeed>(new ModelFeed(std::move(parts)));
}

std::shared_ptr<const ModelState> ModelFeed::state() const {
  return implementation_->latest.get();
}

ModelFeedStatistics ModelFeed::statistics() const {
  const std::lock_guard lock(implementation_->statistics_mutex);
  return implementation_->statistics;
}

}  // namespace handloft::client
