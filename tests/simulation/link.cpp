#include "tests/simulation/link.h"

#include <utility>

namespace handloft::simulation {

Link::Link(Timeline& timeline, LinkOptions options, net::ServerEvents events, std::uint64_t id,
           net::PeerInfo peer, ClientEnd client)
    : timeline_(timeline),
      options_(std::move(options)),
      events_(std::move(events)),
      id_(id),
      peer_(std::move(peer)),
      client_(std::move(client)),
      outbox_(options_.outbox) {}

bool Link::begin() {
  v1::Envelope welcome;
  welcome.mutable_welcome()->set_client_id(id_);
  (void)send(welcome);
  if (const Status joined = events_.on_join(shared_from_this()); !joined) {
    fail(joined.error());
    return false;
  }
  announced_ = true;
  return true;
}

// ---- the client's side ----

bool Link::client_send(const v1::Envelope& envelope) {
  const std::size_t bytes = envelope.ByteSizeLong();
  if (lost_told_ || (to_server_bytes_ > 0 && to_server_bytes_ + bytes > options_.kernel_bytes)) return false;
  to_server_bytes_ += bytes;
  server_gets_ = std::max(server_gets_, timeline_.now() + from_seconds(delay()));
  timeline_.at(server_gets_, [self = shared_from_this(), envelope] {
    if (self->broken_ || self->phase_ != Phase::joined) return;
    self->received_.push_back(envelope);
    self->handle_received();
  });
  return true;
}

void Link::handle_received() {
  while (!paused_ && !received_.empty() && phase_ == Phase::joined && !broken_) {
    const v1::Envelope envelope = std::move(received_.front());
    received_.pop_front();
    to_server_bytes_ -= envelope.ByteSizeLong();
    ++statistics_.frames_received;
    if (const Status handled = events_.on_message(shared_from_this(), envelope); !handled)
      fail(handled.error());
  }
}

void Link::client_reads() {
  stalled_ = false;
  deliver();
}

void Link::client_leaves(double server_hears_after_s) {
  lost_told_ = true;
  broken_ = true;
  client_ = {};
  timeline_.after(server_hears_after_s, [self = shared_from_this()] { self->hang_up("the peer is gone"); });
}

void Link::client_hears_the_end(double after_s) {
  timeline_.after(after_s, [self = shared_from_this()] {
    if (std::exchange(self->lost_told_, true)) return;
    const auto told = std::exchange(self->client_, {});
    if (told.on_lost) told.on_lost();
  });
}

void Link::cut(double server_hears_after_s, double client_hears_after_s) {
  if (broken_) return;
  broken_ = true;
  timeline_.after(server_hears_after_s, [self = shared_from_this()] { self->hang_up("reset"); });
  client_hears_the_end(client_hears_after_s);
}

void Link::server_dies(double client_hears_after_s) {
  broken_ = true;
  phase_ = Phase::closed;
  events_ = {};
  pull_ = {};
  outbox_.clear();
  client_hears_the_end(client_hears_after_s);
}

// ---- the server's end ----

bool Link::send(const v1::Envelope& envelope) {
  const auto frame = net::encode_frame(envelope);
  return frame && send(*frame);
}

bool Link::send(const net::Frame& frame) {
  if (!accepts()) return false;
  if (!outbox_.push(frame)) {
    overflow();
    return false;
  }
  flush();
  return true;
}

bool Link::send_latest(const net::SlotKey& slot, const net::Frame& frame) {
  if (!accepts()) return false;
  if (!outbox_.put_latest(slot, frame)) {
    ++statistics_.dropped;
    return false;
  }
  flush();
  return true;
}

void Link::set_pull(Pull pull) {
  if (phase_ == Phase::closed) return;
  pull_ = std::move(pull);
  notify_pull();
}

void Link::notify_pull() {
  pull_wanted_ = true;
  flush();
}

void Link::resume_reading() {
  if (!std::exchange(paused_, false)) return;
  timeline_.after(0, [self = shared_from_this()] { self->handle_received(); });
}

// As common/net/connection.cpp has it.
void Link::overflow() {
  ++statistics_.overflows;
  overflowed_ = true;
  outbox_.clear();
  timeline_.after(0, [self = shared_from_this()] {
    if (self->phase_ != Phase::joined || self->broken_) return;
    self->overflowed_ = false;
    if (self->events_.on_overflow && self->events_.on_overflow(self) == net::OverflowAction::reseed) {
      self->notify_pull();
      return;
    }
    self->fail(make_error(ErrorCode::resource_exhausted, "reads too slowly"));
  });
}

void Link::flush() {
  most_queued_bytes_ = std::max(most_queued_bytes_, outbox_.queued_bytes());
  if (flushing_ || broken_) return;
  flushing_ = true;
  while (phase_ != Phase::closed && in_kernel_ < options_.kernel_bytes) {
    std::optional<net::Frame> next;
    const bool may_pull = pull_ && pull_wanted_ && phase_ == Phase::joined && !overflowed_;
    // In turn, where both want to.
    if (!(may_pull && pull_turn_)) next = outbox_.take();
    if (!next && may_pull) {
      pull_wanted_ = false;
      next = pull_();
      if (next) pull_wanted_ = true;
    }
    if (!next) next = outbox_.take();
    pull_turn_ = !pull_turn_;
    if (!next) break;
    carry(*next);
  }
  flushing_ = false;
  if (phase_ == Phase::draining && outbox_.empty() && in_kernel_ == 0) hang_up("closed");
}

void Link::carry(net::Frame frame) {
  ++statistics_.frames_sent;
  statistics_.bytes_sent += frame->size();
  in_kernel_ += frame->size();
  const bool vanishes = timeline_.random().below(1'000'000) < options_.vanishing_per_million;
  arrives_ = std::max(arrives_, timeline_.now() + from_seconds(delay()));
  timeline_.at(arrives_, [self = shared_from_this(), frame = std::move(frame), vanishes] {
    if (self->broken_) return;
    if (vanishes) {
      self->in_kernel_ -= frame->size();
      self->flush();
      return;
    }
    self->unread_.push_back(frame);
    self->deliver();
  });
}

void Link::deliver() {
  while (!stalled_ && !unread_.empty() && !broken_) {
    const net::Frame frame = std::move(unread_.front());
    unread_.pop_front();
    in_kernel_ -= frame->size();
    v1::Envelope envelope;
    const bool read = envelope.ParseFromArray(frame->data() + net::frame_header_bytes,
                                              static_cast<int>(frame->size() - net::frame_header_bytes));
    if (read && client_.on_message) {
      const auto on_message = client_.on_message;  // It may leave meanwhile.
      on_message(envelope);
    }
  }
  if (!broken_) flush();
}

void Link::fail(const Error& error) {
  if (phase_ != Phase::joined) return;
  v1::Envelope last;
  last.mutable_failure()->set_code(std::string(to_string(error.code)));
  last.mutable_failure()->set_message(error.message);
  last.mutable_failure()->set_closing(true);
  if (const auto frame = net::encode_frame(last)) {
    if (!outbox_.push(*frame)) {
      outbox_.clear();
      (void)outbox_.push(*frame);
    }
  }
  close();
}

void Link::close() {
  if (phase_ != Phase::joined) return;
  phase_ = Phase::draining;
  received_.clear();
  timeline_.after(1.0, [self = shared_from_this()] { self->hang_up("closed"); });
  // Not from within the callback that asked for it.
  timeline_.after(0, [self = shared_from_this()] { self->flush(); });
}

void Link::hang_up(const std::string& reason) {
  if (phase_ == Phase::closed) return;
  phase_ = Phase::closed;
  outbox_.clear();
  pull_ = {};
  if (!broken_) client_hears_the_end(delay());
  if (std::exchange(announced_, false) && events_.on_closed) events_.on_closed(shared_from_this(), reason);
  events_ = {};
}

net::ConnectionStatistics Link::statistics() const {
  net::ConnectionStatistics statistics = statistics_;
  statistics.queued_bytes = outbox_.queued_bytes();
  // What the kernel has no room for.
  const bool blocked = in_kernel_ >= options_.kernel_bytes;
  statistics.queued_frames = outbox_.queued_frames() + (blocked ? 1 : 0);
  return statistics;
}

}  // namespace handloft::simulation
