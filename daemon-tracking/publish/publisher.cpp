#include "daemon-tracking/publish/publisher.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <utility>
#include <vector>

#include "common/base/version.h"
#include "common/net/message_server.h"
#include "daemon-tracking/publish/tracking_message.h"
#include "proto/session.pb.h"

namespace handloft::tracking {

namespace {

// A subscriber to every frame may have this many unread before a replay waits for it.
constexpr std::size_t replay_window_frames = 32;
constexpr std::chrono::milliseconds reader_wait_step{100};
const net::SlotKey newest_frame_slot{1, "tracking"};

struct Subscriber {
  net::ConnectionPtr connection;
  v1::Subscribe::Delivery delivery = v1::Subscribe::LATEST;
  std::uint64_t ordinal = 0;  // Counts the subscribers from 1.
  double feedback_credit = Publisher::feedback_burst;
  TimePoint last_feedback = {};

  void send(const net::Frame& bytes) const {
    if (delivery == v1::Subscribe::EVERY) {
      connection->send(bytes);
    } else {
      connection->send_latest(newest_frame_slot, bytes);
    }
  }
};

constexpr std::uint32_t largest_colour = 0xFFFFFF;
constexpr std::uint32_t longest_vibration_ms = 1000;

Status check(const v1::GloveFeedback& feedback) {
  if (feedback.led_rgb() > largest_colour) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {:#x}, expected 0x00RRGGBB", feedback.led_rgb()),
                      "glove_feedback.led_rgb");
  }
  // Refuses what is not finite too.
  if (!(feedback.vibration() >= 0.0 && feedback.vibration() <= 1.0)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 0..1", feedback.vibration()),
                      "glove_feedback.vibration");
  }
  if (feedback.vibration_ms() > longest_vibration_ms) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected at most {}", feedback.vibration_ms(), longest_vibration_ms),
        "glove_feedback.vibration_ms");
  }
  return {};
}

}  // namespace

struct Publisher::Implementation {
  Implementation(const Clock& clock_in, Logger log_in) : clock(clock_in), log(std::move(log_in)) {}

  const Clock& clock;
  Logger log;
  std::unique_ptr<net::MessageServer> server;
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::vector<Subscriber> subscribers;
  std::uint64_t subscribed = 0;
  std::uint64_t missed_by_the_gone = 0;
  std::uint64_t overflows = 0;
  v1::Envelope envelope;       // Reused from frame to frame.
  net::Frame newest;           // For those who come later, as it was sent; null before the first.
  net::Frame newest_standing;  // The newest with standing parts.

  std::mutex feedback_mutex;  // One call at a time; taken after `mutex` is let go.
  std::function<void(const v1::GloveFeedback&)> feedback_callback;
  std::uint64_t feedback_dropped = 0;

  Status on_feedback(const net::ConnectionPtr& connection, const v1::GloveFeedback& feedback) {
    if (Status status = check(feedback); !status) return status;
    {
      const std::lock_guard lock(mutex);
      const auto known = find(connection);
      if (known == subscribers.end()) {
        return make_error(ErrorCode::failed_precondition, "found before 'subscribe', expected after it",
                          "glove_feedback");
      }
      const TimePoint now = clock.now();
      const double earned = to_seconds(now - known->last_feedback) * feedback_rate_hz;
      known->feedback_credit = std::min(feedback_burst, known->feedback_credit + std::max(earned, 0.0));
      known->last_feedback = now;
      if (known->feedback_credit < 1.0) {
        ++feedback_dropped;
        return {};
      }
      known->feedback_credit -= 1.0;
    }
    const std::lock_guard lock(feedback_mutex);
    if (feedback_callback) feedback_callback(feedback);
    return {};
  }

  Status on_message(const net::ConnectionPtr& connection, const v1::Envelope& message) {
    if (message.has_glove_feedback()) return on_feedback(connection, message.glove_feedback());
    if (!message.has_subscribe()) {
      return make_error(ErrorCode::unsupported,
                        "the tracking daemon takes 'subscribe' and 'glove_feedback' only", "envelope.body");
    }
    const std::lock_guard lock(mutex);
    const auto known = find(connection);
    if (known != subscribers.end()) {
      known->delivery = message.subscribe().delivery();
    } else {
      subscribers.push_back({connection, message.subscribe().delivery(), ++subscribed});
      seed(subscribers.back());
      log.info("{} ({}) subscribes", connection->peer().program, connection->id());
    }
    changed.notify_all();
    return {};
  }

  // With the mutex held: what was published last, as a whole. Nothing else may come for a long time, or ever.
  void seed(const Subscriber& subscriber) const {
    if (newest == nullptr) return;
    if (newest_standing == nullptr || newest == newest_standing) return subscriber.send(newest);
    v1::Envelope first, standing;
    if (!parse(newest, first) || !parse(newest_standing, standing)) return;
    copy_standing_parts(standing.tracking(), *first.mutable_tracking());
    if (const Result<net::Frame> bytes = net::encode_frame(first)) subscriber.send(*bytes);
  }

  // Our own bytes, past their length.
  static bool parse(const net::Frame& frame, v1::Envelope& envelope) {
    return envelope.ParseFromArray(frame->data() + net::frame_header_bytes,
                                   static_cast<int>(frame->size() - net::frame_header_bytes));
  }

  void on_closed(const net::ConnectionPtr& connection, const std::string& reason) {
    const std::lock_guard lock(mutex);
    const auto known = find(connection);
    if (known == subscribers.end()) return;
    missed_by_the_gone += connection->statistics().replaced;
    log.info("{} ({}) is gone: {}", connection->peer().program, connection->id(), reason);
    subscribers.erase(known);
    changed.notify_all();
  }

  std::vector<Subscriber>::iterator find(const net::ConnectionPtr& connection) {
    return std::find_if(subscribers.begin(), subscribers.end(),
                        [&](const Subscriber& each) { return each.connection == connection; });
  }

  std::vector<Subscriber> present() const {
    const std::lock_guard lock(mutex);
    return subscribers;
  }
};

Publisher::Publisher(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
Publisher::~Publisher() {
  stop();
}

Result<std::unique_ptr<Publisher>> Publisher::listen(boost::asio::any_io_executor executor,
                                                     const net::Endpoint& endpoint, const Clock& clock,
                                                     Logger log) {
  Result<net::Listener> listener = net::listen_on(endpoint);
  if (!listener) return listener.error();
  return serve(std::move(executor), std::move(*listener), clock, std::move(log));
}

Result<std::unique_ptr<Publisher>> Publisher::serve(boost::asio::any_io_executor executor,
                                                    net::Listener listener, const Clock& clock, Logger log) {
  auto implementation = std::make_unique<Implementation>(clock, log);
  Implementation* self = implementation.get();
  net::ServerOptions options;
  options.program = program_version("handloft-trackd");
  net::ServerEvents events;
  events.on_message = [self](const net::ConnectionPtr& connection, const v1::Envelope& message) {
    return self->on_message(connection, message);
  };
  events.on_closed = [self](const net::ConnectionPtr& connection, const std::string& reason) {
    self->on_closed(connection, reason);
  };
  events.on_overflow = [self](const net::ConnectionPtr&) {
    // State, not events: the next frame is the whole state, so nothing needs to be sent anew.
    const std::lock_guard lock(self->mutex);
    ++self->overflows;
    return net::OverflowAction::reseed;
  };
  auto server = net::MessageServer::serve(std::move(executor), std::move(listener), std::move(options),
                                          std::move(events), clock, std::move(log));
  if (!server) return server.error();
  implementation->server = std::move(*server);
  return std::unique_ptr<Publisher>(new Publisher(std::move(implementation)));
}

const net::Endpoint& Publisher::endpoint() const {
  return implementation_->server->endpoint();
}

void Publisher::on_glove_feedback(std::function<void(const v1::GloveFeedback&)> callback) {
  const std::lock_guard lock(implementation_->feedback_mutex);
  implementation_->feedback_callback = std::move(callback);
}

std::uint64_t Publisher::feedback_dropped() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->feedback_dropped;
}

void Publisher::publish(v1::TrackingFrame& frame) {
  std::vector<Subscriber> subscribers;
  std::uint64_t known = 0;
  {
    const std::lock_guard lock(implementation_->mutex);
    subscribers = implementation_->subscribers;
    known = implementation_->subscribed;
  }
  frame.set_publish_time_ns(to_ns(implementation_->clock.now()));
  implementation_->envelope.mutable_tracking()->Swap(&frame);
  const Result<net::Frame> bytes = net::encode_frame(implementation_->envelope);
  implementation_->envelope.mutable_tracking()->Swap(&frame);
  if (!bytes) {
    implementation_->log.error("a tracking frame was not sent: {}", bytes.error().describe());
    return;
  }
  for (const Subscriber& subscriber : subscribers) subscriber.send(*bytes);

  const std::lock_guard lock(implementation_->mutex);
  implementation_->newest = *bytes;
  if (has_standing_parts(frame)) implementation_->newest_standing = *bytes;
  // Who came in the meantime was given the frame before.
  for (const Subscriber& subscriber : implementation_->subscribers) {
    if (subscriber.ordinal > known) implementation_->seed(subscriber);
  }
}

void Publisher::wait_for_readers(std::chrono::milliseconds timeout, const std::function<bool()>& give_up) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  for (const Subscriber& subscriber : implementation_->present()) {
    if (subscriber.delivery != v1::Subscribe::EVERY) continue;
    while (!subscriber.connection->closed() &&
           !subscriber.connection->wait_until_queued_below(replay_window_frames, reader_wait_step)) {
      if (give_up && give_up()) return;
      if (std::chrono::steady_clock::now() < deadline || subscriber.connection->closed()) continue;
      subscriber.connection->fail(
          make_error(ErrorCode::timeout, "the replay waited too long for this subscriber to read"));
    }
  }
}

bool Publisher::drain(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  bool all = true;
  for (const Subscriber& subscriber : implementation_->present()) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    all &= subscriber.connection->wait_until_queued_below(1, std::max(left, std::chrono::milliseconds(0)));
  }
  return all;
}

bool Publisher::wait_for_subscribers(std::size_t count, std::chrono::milliseconds timeout) {
  std::unique_lock lock(implementation_->mutex);
  return implementation_->changed.wait_for(lock, timeout,
                                           [&] { return implementation_->subscribers.size() >= count; });
}

std::size_t Publisher::subscriber_count() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->subscribers.size();
}

std::uint64_t Publisher::frames_missed() const {
  const std::lock_guard lock(implementation_->mutex);
  std::uint64_t missed = implementation_->missed_by_the_gone + implementation_->overflows;
  for (const Subscriber& subscriber : implementation_->subscribers) {
    missed += subscriber.connection->statistics().replaced;
  }
  return missed;
}

void Publisher::stop() {
  implementation_->server->stop();
}

}  // namespace handloft::tracking
