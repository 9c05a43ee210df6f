#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cerrno>
#include <cstring>

#include "common/net/server_connection.h"

namespace handloft::net {

namespace asio = boost::asio;

namespace {

/// How long a connection that is being closed may take to get rid of its last frames.
constexpr std::chrono::milliseconds close_grace{1000};
/// A peer that sends without a pause lets the others have their turn after so many reads.
constexpr int reads_per_turn = 16;
/// A caller of send() writes at most so many frames itself; the rest is the I/O thread's.
constexpr int frames_per_flush = 32;
/// And at most so many bytes: a peer that reads as fast as we write would take all of a large scene in one
/// turn, and those who share its I/O thread would wait for the end of that.
constexpr std::size_t bytes_per_turn = 256 << 10;
/// States (presence) that go before what is pulled (the scene), so that neither waits for ever for the other:
/// one of every hand of 32 people.
constexpr int most_states_in_a_row = 64;
/// Small frames that wait go together in writes of at most so many bytes: one TLS record.
constexpr std::size_t together_bytes = 16 << 10;
constexpr std::size_t max_last_words_bytes = 256;

Frame failure_frame(const Error& error) {
  v1::Envelope envelope;
  v1::Failure& failure = *envelope.mutable_failure();
  failure.set_code(std::string(to_string(error.code)));
  failure.set_message(error.message.substr(0, 1000));
  failure.set_field(error.field.substr(0, 1000));
  failure.set_closing(true);
  return encode_frame(envelope).value();  // a few kilobytes at most
}

}  // namespace

std::string shown_remote(const PeerInfo& peer) {
  if (!peer.address.empty()) return peer.address;
  return peer.uid ? fmt::format("unix, uid {}", *peer.uid) : "unix";
}

ServerConnection::ServerConnection(const asio::any_io_executor& executor, FileDescriptor socket,
                                   std::unique_ptr<ByteStream> stream, ConnectionOrigin origin,
                                   std::shared_ptr<const ServerShared> shared)
    : origin_(std::move(origin)),
      id_(origin_.number),
      shared_(std::move(shared)),
      strand_(asio::make_strand(executor)),
      descriptor_(strand_, socket.get()),
      hello_timer_(strand_),
      close_timer_(strand_),
      pause_(strand_),
      states_timer_(strand_),
      turn_(strand_),
      fd_(socket.release()),
      stream_(std::move(stream)),
      decoder_(std::min(hello_max_frame_bytes, shared_->options.max_frame_bytes)),
      turns_(shared_->options.max_messages_per_s),
      turns_at_(std::chrono::steady_clock::now()),
      outbox_(shared_->options.outbox) {}

void ServerConnection::start() {
  asio::co_spawn(
      strand_,
      [self = shared_from_this()]() -> asio::awaitable<void> {
        try {
          co_await self->run();
        } catch (const std::exception& error) {  // out of memory, or a callback that breaks its promise
          self->log().error("connection {}: {}", self->id(), error.what());
          const Lock lock(self->mutex_);
          self->hang_up(fmt::format("internal: {}", error.what()));
        }
        self->finish();
      },
      asio::detached);
}

void ServerConnection::refuse(const Error& error) {
  fail(error);
  start();
}

void ServerConnection::drop(const std::string& reason) {
  const Lock lock(mutex_);
  if (phase_ != Phase::handshake) return;
  tell_refused(RefusedAt::connection, make_error(ErrorCode::resource_exhausted, reason, "connection"));
  hang_up(reason);
}

Logger ServerConnection::log() const {
  PeerInfo from;
  from.uid = origin_.uid;
  from.address = origin_.address;
  const Logger log = shared_->log.with("client", std::to_string(id()));
  return (user_.empty() ? log : log.with("user", user_)).with("remote", shown_remote(from));
}

void ServerConnection::tell_refused(RefusedAt where, const Error& error) const {
  if (shared_->events.on_refused) shared_->events.on_refused(where, error);
}

// ---- receiving ----

// 0: the peer is gone (reason_ is set).
asio::awaitable<std::size_t> ServerConnection::read_some() {
  for (;;) {
    const StreamOutcome outcome = stream_->read(decoder_.prepare());
    using State = StreamOutcome::State;
    if (outcome.state == State::moved) {
      decoder_.commit(outcome.bytes);
      co_return outcome.bytes;
    }
    if (outcome.state == State::ended || outcome.state == State::failed) {
      if (outcome.state == State::failed && !said_hello_ && origin_.channel == ConnectionOrigin::Channel::tls)
        tell_refused(RefusedAt::tls, make_error(ErrorCode::io, outcome.problem, "tls"));
      Lock lock(mutex_);
      hang_up(outcome.state == State::failed ? fmt::format("the peer is gone: {}", outcome.problem)
              : decoder_.mid_frame()         ? "the peer went away in the middle of a frame"
                                             : "the peer closed");
      co_return 0;
    }
    const auto ready = outcome.state == State::wants_write ? asio::posix::stream_descriptor::wait_write
                                                           : asio::posix::stream_descriptor::wait_read;
    const auto [error] = co_await descriptor_.async_wait(ready, asio::as_tuple(asio::use_awaitable));
    if (error) {
      Lock lock(mutex_);
      hang_up("closed");
      co_return 0;
    }
  }
}

asio::awaitable<void> ServerConnection::run() {
  hello_timer_.expires_after(shared_->options.hello_timeout);
  hello_timer_.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (error || !self) return;
    self->fail(make_error(ErrorCode::timeout,
                          fmt::format("no hello within {} ms", self->shared_->options.hello_timeout.count()),
                          "hello"));
  });
  int reads = 0;
  for (;;) {
    const std::size_t count = co_await read_some();
    if (count == 0) break;
    for (;;) {
      if (paused()) co_await wait_while_paused();
      {
        const Lock lock(mutex_);
        if (phase_ == Phase::draining) {  // nothing that comes now matters any more
          decoder_ = FrameDecoder(hello_max_frame_bytes);
          break;
        }
      }
      const auto payload = decoder_.next();
      if (!payload) {
        fail(payload.error());
        continue;
      }
      if (!payload.value()) break;
      if (shared_->options.max_messages_per_s > 0) co_await wait_for_a_turn();
      if (const Status status = handle(*payload.value()); !status) fail(status.error());
    }
    if (++reads % reads_per_turn == 0) co_await asio::post(strand_, asio::use_awaitable);
  }
}

bool ServerConnection::paused() const {
  const Lock lock(mutex_);
  return reading_paused_ && phase_ == Phase::joined;
}

// Checked and begun on the strand, where wake_reader() cancels: no waking is missed.
asio::awaitable<void> ServerConnection::wait_while_paused() {
  while (paused()) {
    pause_.expires_at(asio::steady_timer::time_point::max());
    co_await pause_.async_wait(asio::as_tuple(asio::use_awaitable));
  }
}

void ServerConnection::pause_reading() {
  const Lock lock(mutex_);
  reading_paused_ = true;
}

void ServerConnection::resume_reading() {
  const Lock lock(mutex_);
  if (!reading_paused_) return;
  wake_reader();
  reading_paused_ = false;
}

void ServerConnection::wake_reader() {
  if (!reading_paused_) return;
  asio::post(strand_, [self = shared_from_this()] { self->pause_.cancel(); });
}

Status ServerConnection::handle(std::span<const std::uint8_t> payload) {
  if (const Status status = parse_envelope(payload, received_); !status) return status;
  if (!said_hello_) return received_.has_pair() || pairing_ ? begin_pairing() : shake_hands();
  {
    const Lock lock(mutex_);
    ++statistics_.frames_received;
  }
  switch (received_.body_case()) {
    case v1::Envelope::kHello:
      return make_error(ErrorCode::failed_precondition, "a second hello on one connection", "hello");
    case v1::Envelope::kPing:
      answer_ping(received_.ping());
      return {};
    case v1::Envelope::kPong:
      return {};
    case v1::Envelope::kFailure:
      if (received_.failure().closing()) {
        const Lock lock(mutex_);
        hang_up("the peer gave up: " + received_.failure().message().substr(0, max_last_words_bytes));
        return {};
      }
      break;
    default:
      break;
  }
  if (!shared_->events.on_message) return {};
  return shared_->events.on_message(shared_from_this(), received_);
}

// A peer that sends faster than it may is read more slowly: its bytes wait in its own kernel.
asio::awaitable<void> ServerConnection::wait_for_a_turn() {
  const double rate = shared_->options.max_messages_per_s;
  const auto now = std::chrono::steady_clock::now();
  turns_ = std::min(rate, turns_ + rate * std::chrono::duration<double>(now - turns_at_).count());
  turns_at_ = now;
  turns_ -= 1;
  if (turns_ >= 0) co_return;
  turn_.expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(-turns_ / rate)));
  co_await turn_.async_wait(asio::as_tuple(asio::use_awaitable));
}

void ServerConnection::answer_ping(const v1::Ping& ping) {
  v1::Envelope answer;
  v1::Pong& pong = *answer.mutable_pong();
  pong.set_id(ping.id());
  pong.set_sent_ns(ping.sent_ns());
  const std::int64_t now = to_ns(shared_->clock->now());
  pong.set_received_ns(now);
  pong.set_replied_ns(now);
  send(answer);
}

void ServerConnection::finish() {
  std::string reason;
  Pull pull;
  {
    const Lock lock(mutex_);
    phase_ = Phase::closed;
    outbox_.clear();
    in_flight_.reset();
    pull.swap(pull_);
    states_timer_.cancel();
    reason = reason_;
    boost::system::error_code ignored;
    descriptor_.close(ignored);
  }
  room_.notify_all();
  hello_timer_.cancel();
  close_timer_.cancel();
  log().debug("connection {} is over: {}", id(), reason);
  if (announced_ && shared_->events.on_closed) shared_->events.on_closed(shared_from_this(), reason);
  shared_->on_over(origin_.number);
}

// ---- sending ----

bool ServerConnection::send(const v1::Envelope& envelope) {
  Result<Frame> frame = encode_frame(envelope, shared_->options.max_frame_bytes);
  if (!frame) {
    log().error("a message to connection {} was not sent: {}", id(), frame.error().describe());
    return false;
  }
  return send(*frame);
}

bool ServerConnection::send(const Frame& frame) {
  if (frame->size() > std::size_t{shared_->options.max_frame_bytes} + frame_header_bytes) return false;
  Lock lock(mutex_);
  if (!accepts()) return false;
  if (write_at_once(frame)) return true;
  if (!outbox_.push(frame)) {
    overflow();
    return false;
  }
  flush(lock);
  return true;
}

bool ServerConnection::send_latest(const SlotKey& slot, const Frame& frame) {
  if (frame->size() > std::size_t{shared_->options.max_frame_bytes} + frame_header_bytes) return false;
  Lock lock(mutex_);
  if (!accepts()) return false;
  const bool state = slot.lane == Lane::states;
  if (!(state && states_wait()) && write_at_once(frame)) {
    if (state) note_states_written();
    return true;
  }
  if (!outbox_.put_latest(slot, frame)) {
    ++statistics_.dropped;
    return false;
  }
  if (!(state && states_waiting_)) flush(lock);
  return true;
}

void ServerConnection::note_states_written() {
  if (shared_->options.states_apart.count() > 0) states_at_ = std::chrono::steady_clock::now();
}

// Whatever else is sent meanwhile takes them along.
bool ServerConnection::states_wait() {
  const std::chrono::microseconds apart = shared_->options.states_apart;
  if (apart.count() == 0 || flushing_ || write_blocked_) return false;
  if (states_waiting_) return true;
  const auto until = states_at_ + apart;
  if (std::chrono::steady_clock::now() >= until) return false;
  states_waiting_ = true;
  states_timer_.expires_at(until);
  states_timer_.async_wait([self = shared_from_this()](const boost::system::error_code&) {
    Lock of_self(self->mutex_);
    self->states_waiting_ = false;
    self->flush(of_self);
  });
  return true;
}

void ServerConnection::set_pull(Pull pull) {
  Lock lock(mutex_);
  if (phase_ == Phase::closed) return;
  pull_ = std::move(pull);
  pull_wanted_ = true;
  // The first ones are the largest: an I/O thread asks for them, not the caller.
  if (!flushing_ && !write_blocked_) write_when(asio::posix::stream_descriptor::wait_write);
}

void ServerConnection::notify_pull() {
  Lock lock(mutex_);
  pull_wanted_ = true;
  flush(lock);
}

// The usual case, a receiver that keeps up, without the detour through the outbox.
bool ServerConnection::write_at_once(const Frame& frame) {
  if (flushing_ || write_blocked_ || in_flight_ || !outbox_.empty()) return false;
  in_flight_ = frame;
  written_this_turn_ = 0;
  in_flight_frames_ = 1;
  static_cast<void>(write_in_flight());
  return true;
}

bool ServerConnection::write_in_flight() {
  while (in_flight_done_ < in_flight_->size()) {
    if (written_this_turn_ >= bytes_per_turn) {
      write_when(asio::posix::stream_descriptor::wait_write);
      return false;
    }
    const StreamOutcome outcome =
        stream_->write({reinterpret_cast<const std::uint8_t*>(in_flight_->data()) + in_flight_done_,
                        std::min(in_flight_->size() - in_flight_done_, bytes_per_turn)});
    using State = StreamOutcome::State;
    if (outcome.state == State::moved) {
      in_flight_done_ += outcome.bytes;
      written_this_turn_ += outcome.bytes;
      statistics_.bytes_sent += outcome.bytes;
      continue;
    }
    if (outcome.state == State::wants_write) {
      write_when(asio::posix::stream_descriptor::wait_write);
    } else if (outcome.state == State::wants_read) {
      write_when(asio::posix::stream_descriptor::wait_read);
    } else {
      hang_up(fmt::format("the peer is gone: {}", outcome.problem));
    }
    return false;
  }
  in_flight_.reset();
  in_flight_done_ = 0;
  statistics_.frames_sent += static_cast<std::uint64_t>(in_flight_frames_);
  ++statistics_.writes;
  return true;
}

void ServerConnection::flush(Lock& lock) {
  if (flushing_ || write_blocked_) return;
  flushing_ = true;
  written_this_turn_ = 0;
  int frames = 0;
  while (phase_ != Phase::closed) {
    if (!in_flight_) {
      if (++frames > frames_per_flush || written_this_turn_ >= bytes_per_turn) {
        write_when(asio::posix::stream_descriptor::wait_write);
        break;
      }
      const bool pull_waits = pull_ && pull_wanted_ && phase_ == Phase::joined;
      std::optional<Frame> next;
      in_flight_frames_ = 1;
      if (outbox_.has_answers() || !pull_waits || states_in_a_row_ < most_states_in_a_row) {
        const bool states = !outbox_.has_answers();
        if (auto together = outbox_.take_together(together_bytes)) {
          next = std::move(together->bytes);
          in_flight_frames_ = together->frames;
          if (states) {
            states_in_a_row_ += together->frames;
            note_states_written();
          }
        }
      }
      if (!next && pull_waits) {
        states_in_a_row_ = 0;
        pull_wanted_ = false;
        const Pull pull = pull_;
        lock.unlock();
        next = pull();
        lock.lock();
        if (next) pull_wanted_ = true;
        if (!next && !outbox_.empty()) continue;
        if (!next && pull_wanted_) continue;
      }
      if (!next) break;
      in_flight_ = std::move(*next);
      if (phase_ == Phase::closed) break;
    }
    if (!write_in_flight()) break;
  }
  flushing_ = false;
  if (phase_ == Phase::draining && !in_flight_ && outbox_.empty()) stream_->end_writing();
  if (waiting_for_room_ > 0) room_.notify_all();
}

void ServerConnection::write_when(asio::posix::stream_descriptor::wait_type ready) {
  write_blocked_ = true;
  asio::post(strand_, [self = shared_from_this(), ready] {
    if (self->closed()) return;
    self->descriptor_.async_wait(ready, [self](const boost::system::error_code&) {
      Lock lock(self->mutex_);
      self->write_blocked_ = false;
      self->flush(lock);
    });
  });
}

void ServerConnection::overflow() {
  ++statistics_.overflows;
  outbox_.clear();
  overflowed_ = true;
  asio::post(strand_, [self = shared_from_this()] {
    {
      const Lock lock(self->mutex_);
      if (self->phase_ != Phase::joined) return;
      self->overflowed_ = false;
    }
    const auto& ask = self->shared_->events.on_overflow;
    if (ask && self->announced_ && ask(self) == OverflowAction::reseed) {
      self->notify_pull();  // what is composed on demand begins anew as well
      return;
    }
    self->fail(make_error(ErrorCode::resource_exhausted, "too slow: more was waiting to be sent than is kept",
                          "connection"));
  });
}

bool ServerConnection::wait_until_queued_below(std::size_t frames, std::chrono::milliseconds timeout) {
  Lock lock(mutex_);
  const auto has_room = [this, frames] {
    return phase_ == Phase::closed || phase_ == Phase::draining ||
           outbox_.queued_frames() + (in_flight_ ? 1 : 0) < frames;
  };
  ++waiting_for_room_;
  const bool in_time = room_.wait_for(lock, timeout, has_room);
  --waiting_for_room_;
  if (!in_time) return false;
  return phase_ == Phase::joined;
}

// ---- ending ----

void ServerConnection::fail(const Error& error) {
  Lock lock(mutex_);
  if (phase_ == Phase::draining || phase_ == Phase::closed) return;
  log().info("connection {} ({}) fails: {}", id(), peer_.name.empty() ? peer_.program : peer_.name,
             error.describe());
  if (phase_ == Phase::handshake) {
    tell_refused(origin_.room == ConnectionOrigin::Room::none ? RefusedAt::connection
                 : pairing_                                   ? RefusedAt::pairing
                                                              : RefusedAt::hello,
                 error);
  }
  Frame last = failure_frame(error);
  if (!outbox_.push(last)) {  // the failure matters more than what is too much anyway
    outbox_.clear();
    outbox_.push(std::move(last));
  }
  drain(error.describe());
  flush(lock);
}

void ServerConnection::close() {
  Lock lock(mutex_);
  if (phase_ == Phase::draining || phase_ == Phase::closed) return;
  drain("closed by us");
  flush(lock);
}

// From here on only what is queued is written, then our half is shut; what the peer still sends is thrown
// away, so that it can read our last words (a socket closed over unread data would destroy them).
void ServerConnection::drain(std::string reason) {
  phase_ = Phase::draining;
  if (reason_.empty()) reason_ = std::move(reason);
  wake_reader();
  arm_close_timer();
}

void ServerConnection::arm_close_timer() {
  asio::post(strand_, [self = shared_from_this()] {
    self->close_timer_.expires_after(close_grace);
    self->close_timer_.async_wait([self](const boost::system::error_code& error) {
      if (error) return;
      const Lock lock(self->mutex_);
      self->hang_up("closed");
    });
  });
}

// Wakes the reading coroutine, which then finishes; the descriptor itself is closed there only.
void ServerConnection::hang_up(const std::string& reason) {
  if (phase_ == Phase::closed) return;
  if (reason_.empty()) reason_ = reason;
  phase_ = Phase::draining;
  wake_reader();
  in_flight_.reset();
  outbox_.clear();
  ::shutdown(fd_, SHUT_RDWR);
}

bool ServerConnection::closed() const {
  const Lock lock(mutex_);
  return phase_ == Phase::closed;
}

ConnectionStatistics ServerConnection::statistics() const {
  const Lock lock(mutex_);
  ConnectionStatistics now = statistics_;
  now.replaced = outbox_.replaced();
  now.queued_bytes = outbox_.queued_bytes() + (in_flight_ ? in_flight_->size() - in_flight_done_ : 0);
  now.queued_frames = outbox_.queued_frames() + (in_flight_ ? 1 : 0);
  return now;
}

}  // namespace handloft::net
