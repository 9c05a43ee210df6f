#pragma once
// The server's side of a connection: how message_server.cpp makes and runs it. Everything else sees
// connection.h.

#include <atomic>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>

#include "common/net/byte_stream.h"
#include "common/net/connection.h"
#include "common/net/message_server.h"

namespace handloft::net {

/// What all connections of a server share; outlives them by shared ownership.
struct ServerShared {
  ServerOptions options;
  ServerEvents events;
  const Clock* clock = nullptr;
  Logger log;
  /// Called once by each connection when it is over, and when its handshake is.
  std::function<void(std::uint64_t id)> on_over;
  std::function<void(std::uint64_t id)> on_joined;
};

/// Where a connection came in, before it has said a word.
struct ConnectionOrigin {
  std::uint64_t number = 0;  ///< Never used twice by one server.
  std::optional<std::uint32_t> uid = {};
  std::string address = {};
  enum class Channel { plain, tls } channel = Channel::plain;
  enum class Room { enough, none } room = Room::enough;  ///< none: it is only told why it must go.
};

class ServerConnection final : public Connection, public std::enable_shared_from_this<ServerConnection> {
 public:
  /// `stream` is over `socket`.
  ServerConnection(const boost::asio::any_io_executor& executor, FileDescriptor socket,
                   std::unique_ptr<ByteStream> stream, ConnectionOrigin origin,
                   std::shared_ptr<const ServerShared> shared);

  /// Handshake, then messages until the end. Call once.
  void start();
  /// Refuses the peer with a Failure without a handshake.
  void refuse(const Error& error);
  /// Lets it go at once and without a word, unless it has come in meanwhile.
  void drop(const std::string& reason);

  std::uint64_t id() const override { return id_.load(std::memory_order_relaxed); }
  const PeerInfo& peer() const override { return peer_; }
  bool send(const v1::Envelope& envelope) override;
  bool send(const Frame& frame) override;
  bool send_latest(const SlotKey& slot, const Frame& frame) override;
  void set_pull(Pull pull) override;
  void notify_pull() override;
  bool wait_until_queued_below(std::size_t frames, std::chrono::milliseconds timeout) override;
  void pause_reading() override;
  void resume_reading() override;
  void fail(const Error& error) override;
  void close() override;
  bool closed() const override;
  ConnectionStatistics statistics() const override;

 private:
  enum class Phase { handshake, joined, draining, closed };
  using Strand = boost::asio::strand<boost::asio::any_io_executor>;
  using Lock = std::unique_lock<std::mutex>;

  /// Says in its lines who it is.
  Logger log() const;
  void tell_refused(RefusedAt where, const Error& error) const;

  // On the strand.
  boost::asio::awaitable<void> run();
  boost::asio::awaitable<std::size_t> read_some();
  boost::asio::awaitable<void> wait_while_paused();
  bool paused() const;
  Status handle(std::span<const std::uint8_t> payload);
  Status shake_hands();
  Status begin_pairing();
  void end_pairing(const Result<v1::Paired>& outcome);
  boost::asio::awaitable<void> wait_for_a_turn();
  void answer_ping(const v1::Ping& ping);
  void finish();

  // With mutex_ held (flush lets go of it while it asks the pull function).
  void flush(Lock& lock);
  bool write_at_once(const Frame& frame);
  bool states_wait();
  void note_states_written();
  bool write_in_flight();
  void overflow();
  void drain(std::string reason);
  void hang_up(const std::string& reason);
  void wake_reader();
  bool accepts() const { return phase_ == Phase::joined && !overflowed_; }

  void write_when(boost::asio::posix::stream_descriptor::wait_type ready);
  void arm_close_timer();

  const ConnectionOrigin origin_;
  std::atomic<std::uint64_t> id_;  ///< The origin's number until ServerEvents::admit chooses another.
  const std::shared_ptr<const ServerShared> shared_;
  Strand strand_;
  boost::asio::posix::stream_descriptor descriptor_;
  boost::asio::steady_timer hello_timer_;
  boost::asio::steady_timer close_timer_;
  boost::asio::steady_timer pause_;         ///< never expires; cancelled to wake the reading coroutine
  boost::asio::steady_timer states_timer_;  ///< Guarded by mutex_.
  boost::asio::steady_timer turn_;          ///< until the peer may be read again (max_messages_per_s)
  const int fd_;
  const std::unique_ptr<ByteStream> stream_;
  FrameDecoder decoder_;
  v1::Envelope received_;
  PeerInfo peer_;
  std::string user_;  ///< Set with mutex_ held, before anybody else has the connection.

  mutable std::mutex mutex_;
  std::condition_variable room_;
  int waiting_for_room_ = 0;
  Phase phase_ = Phase::handshake;
  bool announced_ = false;  ///< on_join said yes, so on_closed will come
  bool said_hello_ = false;
  bool pairing_ = false;
  double turns_ = 0;  ///< messages that may be handled now
  std::chrono::steady_clock::time_point turns_at_;
  bool overflowed_ = false;
  bool reading_paused_ = false;
  bool write_blocked_ = false;  ///< the kernel's buffer is full; the strand waits for room
  bool flushing_ = false;
  bool pull_wanted_ = false;
  std::size_t written_this_turn_ = 0;  ///< By whoever writes now.
  int states_in_a_row_ = 0;            ///< Written since something was pulled.
  Outbox outbox_;
  std::chrono::steady_clock::time_point states_at_{};  ///< When some were written last.
  bool states_waiting_ = false;                        ///< The timer runs.
  Frame in_flight_;
  int in_flight_frames_ = 0;
  std::size_t in_flight_done_ = 0;
  Pull pull_;
  std::string reason_;
  ConnectionStatistics statistics_;
};

}  // namespace handloft::net
