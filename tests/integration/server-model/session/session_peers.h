#pragma once
// Both ends of a session as tests play them: a peer that keeps what it is sent, and a tracking daemon whose
// recording is the same every time.

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/codec/point_codec.h"
#include "common/net/message_client.h"
#include "common/net/message_server.h"
#include "tests/support/hand_script.h"

namespace handloft::session {

using namespace std::chrono_literals;

// A deadline, not a pause: under sanitizers on a loaded machine all is slow.
inline constexpr auto patience = 20s;

/// A peer that keeps what it was sent, as simply as can be.
class TestPeer {
 public:
  TestPeer(const net::Endpoint& endpoint, v1::Role role, std::string name) : clock_() {
    net::ClientOptions options;
    options.role = role;
    options.name = std::move(name);
    auto client = net::SyncClient::connect(endpoint, options, clock_);
    if (!client) throw std::runtime_error(client.error().describe());
    client_.emplace(*std::move(client));
  }
  void join() {
    v1::Envelope envelope;
    envelope.mutable_join();
    send(envelope);
  }
  void send(const v1::Envelope& envelope) { ASSERT_TRUE(client_->send(envelope).ok()); }
  void submit(std::uint64_t request, const v1::Operation& operation) {
    v1::Envelope envelope;
    envelope.mutable_submit()->set_request(request);
    *envelope.mutable_submit()->mutable_operation() = operation;
    send(envelope);
  }
  /// Reads until `done` holds of what was received so far; false when the time is up or the connection ended.
  template <typename Done>
  bool read_until(const Done& done) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (!done()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      auto envelope = client_->receive(1000ms);
      if (!envelope) {
        if (envelope.error().code == ErrorCode::timeout) continue;
        closed = true;
        return done();
      }
      take(*envelope);
    }
    return true;
  }
  bool read_ack(std::uint64_t request) {
    return read_until([&] { return acks.contains(request); });
  }
  void take(const v1::Envelope& envelope) {
    const auto take_state = [&](const v1::EntityState& state) {
      if (state.has_points()) {
        const auto tail = codec::decode_points(state.points());
        ASSERT_TRUE(tail.ok());
        ASSERT_TRUE(codec::merge_points(points[state.id()], *tail).ok());
      }
      v1::EntityState& entity = entities[state.id()];
      const std::optional<v1::Mesh> before =
          entity.has_surface() ? std::optional(entity.surface()) : std::nullopt;
      entity = state;
      entity.clear_points();
      if (!state.has_surface() && state.surface_shown() && before) *entity.mutable_surface() = *before;
    };
    if (envelope.has_snapshot()) {
      ++snapshots;
      entities.clear();
      points.clear();
      sequence = envelope.snapshot().sequence();
      for (const auto& state : envelope.snapshot().entities()) take_state(state);
    } else if (envelope.has_delta()) {
      sequence = envelope.delta().sequence();
      capture_time_ns = envelope.delta().capture_time_ns();
      for (const auto& id : envelope.delta().removed()) entities.erase(id);
      for (const auto& state : envelope.delta().changed()) take_state(state);
    } else if (envelope.has_ack()) {
      acks[envelope.ack().request()] = envelope.ack();
    } else if (envelope.has_presence()) {
      presence[envelope.presence().name()] = envelope.presence();
    } else if (envelope.has_failure()) {
      failure = envelope.failure();
    }
  }
  net::SyncClient& client() { return *client_; }

  std::map<std::string, v1::EntityState> entities;
  std::map<std::string, codec::PointTail> points;
  std::map<std::uint64_t, v1::Ack> acks;
  std::map<std::string, v1::Presence> presence;
  v1::Failure failure;
  std::uint64_t sequence = 0;
  std::int64_t capture_time_ns = 0;
  int snapshots = 0;
  bool closed = false;

 private:
  SystemClock clock_;
  std::optional<net::SyncClient> client_;
};

/// Five strokes on one shape, one frame of them lost.
inline std::vector<v1::TrackingFrame> five_strokes() {
  std::vector<v1::TrackingFrame> frames;
  test::HandScript script;
  for (int i = 0; i < 300; ++i) {
    v1::TrackingFrame frame = i % 60 == 59 ? script.resting() : script.laying({0.001 * i, 0.0, 0.1});
    if (i == 100) continue;  // one that gets lost
    frame.set_end_of_recording(i == 299);
    frames.push_back(std::move(frame));
  }
  return frames;
}

/// A tracking daemon as far as a subscriber can tell, which has these frames to give.
class FakeDaemon {
 public:
  FakeDaemon(boost::asio::io_context& context, const net::Endpoint& endpoint, const Clock& clock,
             const Logger& log, std::vector<v1::TrackingFrame> frames = five_strokes())
      : frames_(std::move(frames)) {
    net::ServerEvents events;
    events.on_message = [this](const net::ConnectionPtr& connection, const v1::Envelope& envelope) -> Status {
      if (envelope.has_subscribe() && envelope.subscribe().delivery() == v1::Subscribe::EVERY)
        publish(connection);
      if (envelope.has_glove_feedback()) {
        const std::lock_guard lock(mutex_);
        feedback_.push_back(envelope.glove_feedback());
        told_.notify_all();
      }
      return {};
    };
    auto server =
        net::MessageServer::listen(context.get_executor(), endpoint, {}, std::move(events), clock, log);
    if (!server) throw std::runtime_error(server.error().describe());
    server_ = *std::move(server);
  }

  /// Waits until it was told so many times what the glove should do; what it was told.
  std::vector<v1::GloveFeedback> feedback(std::size_t count) {
    std::unique_lock lock(mutex_);
    told_.wait_for(lock, patience, [&] { return feedback_.size() >= count; });
    return feedback_;
  }

 private:
  void publish(const net::ConnectionPtr& connection) const {
    for (const v1::TrackingFrame& frame : frames_) {
      v1::Envelope envelope;
      *envelope.mutable_tracking() = frame;
      connection->send(envelope);
    }
  }
  std::vector<v1::TrackingFrame> frames_;
  std::mutex mutex_;
  std::condition_variable told_;
  std::vector<v1::GloveFeedback> feedback_;
  std::unique_ptr<net::MessageServer> server_;
};

}  // namespace handloft::session
