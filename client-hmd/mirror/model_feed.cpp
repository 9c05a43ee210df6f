#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/mirror/read_shared_work.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "client-hmd/mirror/control_net_asker.h"
#include "client-hmd/mirror/difference_asker.h"
#include "client-hmd/mirror/latest.h"
#include "client-hmd/mirror/pending_requests.h"
#include "client-hmd/mirror/resume.h"
#include "common/base/plain_text.h"
#include "common/base/version.h"
#include "common/net/client_handshake.h"
#include "common/net/message_client.h"
#include "proto/session.pb.h"

namespace handloft::client {
namespace {

/// A server that keeps sending nonsense costs one snapshot in so long; twice as long each time that the
/// snapshot itself is refused.
constexpr auto rejoin_interval = std::chrono::seconds(1);
constexpr auto longest_rejoin_interval = std::chrono::seconds(32);
/// Ten times that at most, so that a server that is back is found within half a second.
constexpr auto retry_interval = std::chrono::milliseconds(50);
/// A server's host may lose power, which no socket tells.
constexpr auto silence_timeout = std::chrono::seconds(15);
/// Of one message: all icons that a scene may have, of six parts each, and its points' styles. Some 150 MiB.
constexpr std::size_t max_message_parts = 600'000;
constexpr auto complaint_interval = std::chrono::seconds(1);
/// A server's times beyond this are nonsense, and sums with them would overflow.
constexpr std::int64_t latest_ns = std::int64_t{1} << 60;
constexpr std::size_t max_activities = 64;  ///< Hands in one picture.
/// Ten seconds of a hand: what waits longer would be done to something else.
constexpr std::size_t max_queued_bytes = std::size_t{1} << 20;
constexpr std::uint32_t hands_since_minor = 1;  ///< PROTOCOL.md, "Versions".
constexpr std::uint32_t resume_since_minor = 2;
constexpr std::size_t max_text_bytes = 256;
constexpr std::size_t max_notes = 16;  ///< Of one answer.

std::string shortened(const std::string& text) {
  return plain_text(text, max_text_bytes);
}

}  // namespace

struct ModelFeed::Implementation {
  Implementation(const net::Endpoint& where, const Clock& time, Logger logger, const FeedOptions& chosen)
      : endpoint(where), clock(time), log(std::move(logger)), options(chosen) {}

  const net::Endpoint endpoint;
  const Clock& clock;
  const Logger log;
  const FeedOptions options;
  Latest<ModelState> latest;
  PendingRequests requests;

  mutable std::mutex statistics_mutex;
  ModelFeedStatistics statistics;

  // ---- the network's thread only ----
  SceneMirror mirror;
  ModelState state;
  Resumption resumption;
  std::optional<TimePoint> joined_at;
  std::optional<TimePoint> connected_at;  ///< Until its first snapshot is applied.
  std::optional<TimePoint> gone_at;       ///< Until the next server's first snapshot is applied.
  Duration rejoin_after = rejoin_interval;
  bool await_snapshot = true;
  net::ClockOffset offset;
  RateLimit complaints{complaint_interval};

  std::mutex nets_mutex;
  ControlNetAsker nets;         ///< Under nets_mutex, as the next one.
  bool nets_are_shown = false;  ///< Then they are asked for.

  std::mutex difference_mutex;
  DifferenceAsker difference;  ///< Under difference_mutex; comes into `state` on the network's thread.
  std::optional<VersionDifference> newest_difference() {
    const std::lock_guard lock(difference_mutex);
    return difference.newest();
  }

  std::mutex client_mutex;  ///< Held while `client` is being made: its thread may call back at once.
  std::unique_ptr<net::MessageClient> client;

  void publish() {
    if (state.coming != nullptr) show(state.coming);
    state.difference = newest_difference();
    latest.publish(std::make_shared<const ModelState>(state));
  }

  void show(const std::shared_ptr<const Scene>& newest) {
    state.scene = resumption.choose(state.scene, newest, clock.now());
    state.coming = state.scene == newest ? nullptr : newest;
    state.coming_until = resumption.until();
  }

  enum class Begin { anew, with_what_is_held };

  void join(Begin begin = Begin::anew) {
    v1::Envelope envelope;
    envelope.mutable_join();
    if (begin == Begin::with_what_is_held) *envelope.mutable_join() = join_with(*mirror.scene());
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
    state.takes_hands = (options.role == v1::ROLE_EDITOR || options.role == v1::ROLE_OWNER) &&
                        welcome.protocol_minor() >= hands_since_minor;
    state.problem.clear();
    state.refusal.clear();
    state.activities.clear();
    state.has_capture_time = false;
    state.last_heard = clock.now();
    connected_at = clock.now();
    rejoin_after = rejoin_interval;
    publish();
    const bool resumes = welcome.protocol_minor() >= resume_since_minor && mirror.scene()->epoch != 0;
    join(resumes ? Begin::with_what_is_held : Begin::anew);
  }

  /// What follows is a delta on what is held; else it is a snapshot.
  void on_joined(const v1::Joined& joined) {
    state.role = joined.role();
    state.takes_hands = joined.role() == v1::ROLE_EDITOR || joined.role() == v1::ROLE_OWNER;
    state.denied.reset();
    publish();
    if (joined.resumed() && joined.epoch() == mirror.scene()->epoch) await_snapshot = false;
  }

  void on_disconnected(const Error& error) {
    if (!gone_at) gone_at = clock.now();
    {
      const std::lock_guard lock(nets_mutex);
      nets.forget();
    }
    {
      const std::lock_guard lock(difference_mutex);
      difference.abandon("the connection broke before the answer");
    }
    state.connected = false;
    state.problem = shortened(error.message);
    state.activities.clear();
    state.people = nullptr;
    state.takes_hands = false;
    requests.abandon("the connection broke, so it is not known whether this was done");
    if (state.coming != nullptr) show(state.coming);
    state.coming = nullptr;  // Less than what is shown.
    publish();
    log.info("the model server is gone: {}", error.describe());
  }

  /// Nothing that passes with time; the connection is tried again all the same, for access may be given.
  void note_denial(const Error& error) {
    if (error.code != ErrorCode::permission_denied && error.code != ErrorCode::unsupported) return;
    state.denied = make_error(error.code, shortened(error.message), shortened(error.field));
  }

  void on_attempt_failed(const Error& error) {
    state.problem = shortened(error.message);
    note_denial(error);
    publish();
  }

  static bool is_time(std::int64_t ns) { return ns > 0 && ns <= latest_ns; }

  void note_capture(std::int64_t capture_time_ns) {
    if (!is_time(capture_time_ns)) return;
    const TimePoint captured = offset.to_client(from_ns(capture_time_ns));
    if (!state.has_capture_time || captured > state.capture_time) state.capture_time = captured;
    state.has_capture_time = true;
  }

  template <typename Message>
  bool apply(const Message& message, std::int64_t capture_time_ns, TimePoint received) {
    const bool timed = is_time(capture_time_ns);
    const TimePoint captured = timed ? offset.to_client(from_ns(capture_time_ns)) : TimePoint{};
    const Status applied = mirror.apply(message);
    {
      const std::lock_guard lock(statistics_mutex);
      statistics.mirror = mirror.statistics();
      if (applied.ok() && timed) statistics.capture_to_receipt.add(received - captured);
    }
    if (!applied) {
      refuse(applied.error(), received);
      return false;
    }
    state.received_at = received;
    state.scene_capture_time = captured;
    note_capture(capture_time_ns);
    return true;
  }

  void refuse(const Error& error, TimePoint received) {
    if (await_snapshot) return;  // Already asked for one.
    state.refusal = shortened(error.describe());
    if (const auto kept_back = complaints.allow(received)) {
      log.warning("refused what the server sent: {} ({} more)", error.describe(), *kept_back);
    }
    publish();
    if (!joined_at || received - *joined_at >= rejoin_after) join();
  }

  void on_snapshot(const v1::SceneSnapshot& snapshot, TimePoint received) {
    await_snapshot = false;
    if (!apply(snapshot, 0, received)) {
      rejoin_after = std::min<Duration>(rejoin_after * 2, longest_rejoin_interval);
      return;
    }
    ++state.snapshots;
    state.denied.reset();
    state.refusal.clear();
    rejoin_after = rejoin_interval;
    if (connected_at) tell_of_return(received);
    resumption.begin(received);
    show(mirror.scene());
    publish();
  }

  void tell_of_return(TimePoint received) {
    const Duration joining = received - *connected_at;
    const std::lock_guard lock(statistics_mutex);
    statistics.join_to_scene.add(joining);
    if (gone_at) statistics.outages.add(received - *gone_at);
    connected_at.reset();
    gone_at.reset();
    log.info("has the scene, {:.0f} ms after it connected", to_seconds(joining) * 1e3);
  }

  void on_delta(const v1::SceneDelta& delta, TimePoint received) {
    if (!apply(delta, delta.capture_time_ns(), received)) return;
    if (connected_at && !await_snapshot) tell_of_return(received);
    show(mirror.scene());
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

  void on_ack(const v1::Ack& ack) {
    std::vector<std::string> notes;
    for (const std::string& note : ack.notes()) {
      if (notes.size() < max_notes) notes.push_back(shortened(note));
    }
    std::string refusal;
    if (ack.has_failure()) {
      refusal = shortened(ack.failure().message().empty() ? "refused" : ack.failure().message());
    }
    if (!requests.answer(ack.request(), std::move(refusal), std::move(notes))) return;
    if (!ack.has_failure()) return;
    const std::lock_guard lock(statistics_mutex);
    ++statistics.requests_refused;
  }

  // ---- any thread ----

  Status send(const v1::Envelope& envelope) {
    if (options.role == v1::ROLE_VIEWER) {
      return make_error(ErrorCode::permission_denied, "this client only looks");
    }
    const std::shared_ptr<const ModelState> now = latest.get();
    const bool hand = envelope.has_tracking() || envelope.has_hand_command();
    if (!now->connected || (!now->takes_hands && (hand || now->role == v1::ROLE_UNSPECIFIED))) {
      return make_error(ErrorCode::failed_precondition, "the model server is not there, or knows no hands");
    }
    const std::lock_guard lock(client_mutex);
    if (client == nullptr) return make_error(ErrorCode::failed_precondition, "shutting down");
    return client->send(envelope);
  }

  Status request(std::string what, v1::Envelope envelope, std::uint64_t number) {
    // Before it is sent: the answer may be here before send() returns.
    Status status = requests.add(number, std::move(what));
    if (status.ok()) {
      status = send(envelope);
      if (!status) requests.forget(number);
    }
    const std::lock_guard lock(statistics_mutex);
    ++(status.ok() ? statistics.requests_sent : statistics.requests_refused);
    return status;
  }

  /// Never waits; what cannot be sent now is asked for with the next scene.
  void ask_for_nets(const Scene& scene) {
    const std::lock_guard lock(nets_mutex);
    if (!nets_are_shown) return;
    for (const v1::Envelope& question : nets.questions(scene)) {
      const std::lock_guard sending(client_mutex);
      if (client == nullptr || !client->send(question).ok()) return nets.forget();
    }
  }

  bool take_difference(const v1::Answer& answer) {
    const std::lock_guard lock(difference_mutex);
    return difference.take(answer);
  }

  void on_answer(const v1::Answer& answer) {
    if (take_difference(answer)) return publish();
    {
      const std::lock_guard lock(nets_mutex);
      if (!nets.take(answer)) return;
      state.control_nets = nets.nets();
    }
    publish();
    ask_for_nets(*state.scene);
  }

  void on_message(const v1::Envelope& envelope) {
    const TimePoint received = clock.now();
    state.last_heard = received;
    switch (envelope.body_case()) {
      case v1::Envelope::kSnapshot:
        on_snapshot(envelope.snapshot(), received);
        ask_for_nets(*state.scene);
        break;
      case v1::Envelope::kDelta:
        on_delta(envelope.delta(), received);
        ask_for_nets(*state.scene);
        break;
      case v1::Envelope::kJoined:
        on_joined(envelope.joined());
        break;
      case v1::Envelope::kPeople:
        state.people = read_people(envelope.people(), MirrorLimits());
        publish();
        break;
      case v1::Envelope::kPresence:
        on_presence(envelope.presence());
        break;
      case v1::Envelope::kAck:
        on_ack(envelope.ack());
        break;
      case v1::Envelope::kAnswer:
        on_answer(envelope.answer());
        break;
      case v1::Envelope::kFailure:
        state.problem = shortened(envelope.failure().message());
        if (await_snapshot || envelope.failure().closing()) note_denial(net::error_of(envelope.failure()));
        if (complaints.allow(received)) {
          log.warning("the server says {}: {}", shortened(envelope.failure().code()), state.problem);
        }
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

std::unique_ptr<ModelFeed> ModelFeed::start(const net::Endpoint& endpoint, const Clock& clock, Logger log,
                                            const FeedOptions& who) {
  auto parts = std::make_unique<Implementation>(endpoint, clock, log, who);
  Implementation* self = parts.get();
  self->publish();
  net::ClientOptions options;
  options.role = who.role;
  options.name = who.name;
  options.max_queued_bytes = max_queued_bytes;
  options.program = program_version("handloft-hmd");
  // At least the same one as long as this program runs: to undo, to resume.
  options.client_key = who.client_key.empty() ? net::random_client_key() : who.client_key;
  options.tls = who.tls;
  options.reconnect = net::Reconnect::always;
  options.retry_interval = retry_interval;
  options.silence_timeout = silence_timeout;
  options.max_message_parts = max_message_parts;
  net::ClientEvents events;
  events.on_connected = [self](const v1::Welcome& welcome, const net::ClockOffset& offset) {
    self->on_connected(welcome, offset);
  };
  events.on_message = [self](v1::Envelope& envelope) { self->on_message(envelope); };
  events.on_disconnected = [self](const Error& error) { self->on_disconnected(error); };
  events.on_attempt_failed = [self](const Error& error) { self->on_attempt_failed(error); };
  {
    const std::lock_guard lock(self->client_mutex);
    self->client = net::MessageClient::start(endpoint, options, std::move(events), clock, std::move(log));
  }
  return std::unique_ptr<ModelFeed>(new ModelFeed(std::move(parts)));
}

std::shared_ptr<const ModelState> ModelFeed::state() const {
  std::shared_ptr<const ModelState> state = implementation_->latest.get();
  if (state->coming == nullptr || implementation_->clock.now() < state->coming_until) return state;
  // Nothing more came that would have brought it to the screen.
  auto resumed = std::make_shared<ModelState>(*state);
  resumed->scene = std::exchange(resumed->coming, nullptr);
  implementation_->latest.replace(state, resumed);
  return resumed;
}

ModelFeedStatistics ModelFeed::statistics() const {
  const std::lock_guard lock(implementation_->statistics_mutex);
  return implementation_->statistics;
}

void ModelFeed::want_control_nets(ControlNetWish wish) {
  {
    const std::lock_guard lock(implementation_->nets_mutex);
    const bool shown = wish == ControlNetWish::shown;
    if (implementation_->nets_are_shown == shown) return;
    implementation_->nets_are_shown = shown;
  }
  implementation_->ask_for_nets(*state()->scene);
}

void ModelFeed::ask_difference(const std::string& from, const std::string& to) {
  const std::lock_guard lock(implementation_->difference_mutex);
  const v1::Envelope question = implementation_->difference.question(from, to);
  const std::lock_guard sending(implementation_->client_mutex);
  const auto& client = implementation_->client;
  if (client == nullptr || !client->send(question).ok())
    implementation_->difference.abandon("the model server is not there");
}

Status ModelFeed::send_hand(const v1::TrackingFrame& frame) {
  v1::Envelope envelope;
  *envelope.mutable_tracking() = frame;
  const Status sent = implementation_->send(envelope);
  const std::lock_guard lock(implementation_->statistics_mutex);
  ModelFeedStatistics& statistics = implementation_->statistics;
  ++(sent.ok() ? statistics.hands_sent : statistics.hands_dropped);
  return sent;
}

Status ModelFeed::send_command(PaletteCommand command, std::uint32_t hand) {
  v1::Envelope envelope;
  const std::string_view name = palette_command_name(command);
  const std::uint64_t number = implementation_->requests.next();
  envelope.mutable_hand_command()->set_request(number);
  envelope.mutable_hand_command()->set_hand(hand);
  envelope.mutable_hand_command()->set_command(std::string(name));
  return implementation_->request(std::string(name), std::move(envelope), number);
}

Status ModelFeed::submit(const v1::Operation& operation) {
  v1::Envelope envelope;
  const std::uint64_t number = implementation_->requests.next();
  envelope.mutable_submit()->set_request(number);
  *envelope.mutable_submit()->mutable_operation() = operation;
  const auto* kind = v1::Operation::descriptor()->FindFieldByNumber(operation.body_case());
  return implementation_->request(kind == nullptr ? "operation" : kind->name(), std::move(envelope), number);
}

std::vector<Acknowledgement> ModelFeed::take_acknowledgements() {
  return implementation_->requests.take();
}

}  // namespace handloft::client
