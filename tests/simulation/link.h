#pragma once
// A connection that is not there: the server's end is a net::Connection with the real outbox, the client's
// end a few calls, and between them a network with delays, buffers that fill, and ends that come in every
// order. Within a direction nothing overtakes.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/net/connection.h"
#include "common/net/message_server.h"
#include "tests/simulation/timeline.h"

namespace handloft::simulation {

struct LinkOptions {
  double longest_delay_s = 0.05;
  /// What the two kernels hold of one direction.
  std::size_t kernel_bytes = std::size_t{128} << 10;
  net::OutboxLimits outbox = {};
  /// Negative control: frames to the client that vanish, of a million. Nothing real does that.
  std::uint64_t vanishing_per_million = 0;
};

/// What the client's program sees of it.
struct ClientEnd {
  std::function<void(const v1::Envelope&)> on_message;
  std::function<void()> on_lost;
};

class Link final : public net::Connection, public std::enable_shared_from_this<Link> {
 public:
  Link(Timeline& timeline, LinkOptions options, net::ServerEvents events, std::uint64_t id,
       net::PeerInfo peer, ClientEnd client);

  /// The server's Welcome is on its way and on_join done. False: refused.
  bool begin();

  // --- the client's side
  /// False: the kernel's buffer is full, or the connection is lost.
  bool client_send(const v1::Envelope& envelope);
  /// False: nothing arrives any more, whether the ends know it or not.
  bool whole() const { return !broken_; }
  /// The server takes what comes.
  bool served() const { return !broken_ && phase_ == Phase::joined; }
  void client_stalls() { stalled_ = true; }
  void client_reads();
  /// The client is gone or gives up; the server hears of it after a while, if ever.
  void client_leaves(double server_hears_after_s);

  // --- the network's
  /// Both ends hear of it, each after its own while; nothing that is on the way arrives.
  void cut(double server_hears_after_s, double client_hears_after_s);
  /// The server's machine is gone: no callback of its comes any more.
  void server_dies(double client_hears_after_s);

  // --- the server's end (net::Connection)
  std::uint64_t id() const override { return id_; }
  const net::PeerInfo& peer() const override { return peer_; }
  bool send(const v1::Envelope& envelope) override;
  bool send(const net::Frame& frame) override;
  bool send_latest(const net::SlotKey& slot, const net::Frame& frame) override;
  void set_pull(Pull pull) override;
  void notify_pull() override;
  bool wait_until_queued_below(std::size_t, std::chrono::milliseconds) override { return true; }
  void pause_reading() override { paused_ = true; }
  void resume_reading() override;
  void fail(const Error& error) override;
  void close() override;
  bool closed() const override { return phase_ == Phase::closed; }
  net::ConnectionStatistics statistics() const override;

  void hang_up(const std::string& reason);
  /// Of the outbox, at any moment.
  std::size_t most_queued_bytes() const { return most_queued_bytes_; }

 private:
  enum class Phase { joined, draining, closed };
  double delay() { return timeline_.random().unit() * options_.longest_delay_s; }
  bool accepts() const { return phase_ == Phase::joined && !overflowed_; }
  void overflow();
  void flush();
  void carry(net::Frame frame);
  void deliver();
  void handle_received();
  void client_hears_the_end(double after_s);

  Timeline& timeline_;
  const LinkOptions options_;
  net::ServerEvents events_;
  const std::uint64_t id_;
  const net::PeerInfo peer_;
  ClientEnd client_;

  Phase phase_ = Phase::joined;
  bool announced_ = false;
  bool broken_ = false;  ///< Nothing arrives any more, in either direction.
  bool lost_told_ = false;
  bool paused_ = false;
  bool stalled_ = false;
  bool overflowed_ = false;
  bool flushing_ = false;
  bool pull_wanted_ = false;
  bool pull_turn_ = false;
  net::Outbox outbox_;
  Pull pull_;
  std::size_t most_queued_bytes_ = 0;
  net::ConnectionStatistics statistics_;

  // To the client.
  TimePoint arrives_ = Timeline::begin();
  std::size_t in_kernel_ = 0;
  std::deque<net::Frame> unread_;
  // To the server.
  TimePoint server_gets_ = Timeline::begin();
  std::size_t to_server_bytes_ = 0;
  std::deque<v1::Envelope> received_;
};

using LinkPtr = std::shared_ptr<Link>;

}  // namespace handloft::simulation
