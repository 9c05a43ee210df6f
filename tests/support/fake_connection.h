#pragma once
// A peer's connection without a socket: keeps what it is sent.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "common/net/connection.h"

namespace handloft::test {

class FakeConnection final : public net::Connection {
 public:
  FakeConnection(std::uint64_t its_id, net::PeerInfo info) : id_(its_id), peer_(std::move(info)) {}

  std::uint64_t id() const override { return id_; }
  const net::PeerInfo& peer() const override { return peer_; }
  bool send(const v1::Envelope& envelope) override {
    const std::lock_guard lock(mutex_);
    sent_.push_back(envelope);
    return true;
  }
  bool send(const net::Frame& frame) override { return keep(frame); }
  bool send_latest(const net::SlotKey& /*slot*/, const net::Frame& frame) override { return keep(frame); }
  void set_pull(Pull pull) override {
    const std::lock_guard lock(mutex_);
    pull_ = std::move(pull);
  }
  void notify_pull() override {
    ++notified_;
    if (stalled_) return;
    const std::lock_guard turn(pull_mutex_);
    Pull pull;
    {
      const std::lock_guard lock(mutex_);
      pull = pull_;
    }
    while (pull) {
      const auto frame = pull();
      if (!frame) return;
      keep(*frame);
    }
  }
  bool wait_until_queued_below(std::size_t /*frames*/, std::chrono::milliseconds /*timeout*/) override {
    return true;
  }
  void pause_reading() override { paused_ = true; }
  void resume_reading() override { paused_ = false; }
  void fail(const Error& /*error*/) override { closed_ = true; }
  void close() override { closed_ = true; }
  bool closed() const override { return closed_; }
  net::ConnectionStatistics statistics() const override {
    net::ConnectionStatistics statistics;
    statistics.queued_frames = stalled_ ? 1 : 0;
    return statistics;
  }
  /// The peer reads nothing (any more): nothing is pulled, and something waits.
  void stall() { stalled_ = true; }
  void read_on() {
    stalled_ = false;
    notify_pull();
  }

  /// Asks for one message of what is pulled, whether or not it is stalled; false: there is none.
  bool pull_one() {
    const std::lock_guard turn(pull_mutex_);
    Pull pull;
    {
      const std::lock_guard lock(mutex_);
      pull = pull_;
    }
    const auto frame = pull ? pull() : std::nullopt;
    return frame && keep(*frame);
  }
  /// How often there was said to be something to pull.
  int notified() const { return notified_; }

  bool paused() const { return paused_; }
  /// All that was sent so far.
  std::vector<v1::Envelope> sent() const {
    const std::lock_guard lock(mutex_);
    return sent_;
  }

 private:
  bool keep(const net::Frame& frame) {
    v1::Envelope envelope;
    const std::string& bytes = *frame;
    if (!envelope.ParseFromArray(bytes.data() + net::frame_header_bytes,
                                 static_cast<int>(bytes.size() - net::frame_header_bytes))) {
      return false;
    }
    const std::lock_guard lock(mutex_);
    sent_.push_back(std::move(envelope));
    return true;
  }

  const std::uint64_t id_;
  const net::PeerInfo peer_;
  mutable std::mutex mutex_;
  std::mutex pull_mutex_;
  Pull pull_;
  std::vector<v1::Envelope> sent_;
  std::atomic<bool> paused_ = false;
  std::atomic<bool> closed_ = false;
  std::atomic<bool> stalled_ = false;
  std::atomic<int> notified_ = 0;
};

}  // namespace handloft::test
