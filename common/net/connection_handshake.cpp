// How a connection comes in: the hello, its answer, and pairing, which is instead of both. Nothing else is
// done for a peer before that (A1).

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/asio/post.hpp>

#include "common/base/plain_text.h"
#include "common/net/server_connection.h"

namespace handloft::net {

namespace asio = boost::asio;

namespace {

constexpr std::size_t max_name_bytes = 256;
constexpr std::size_t shortest_key_bytes = 16, longest_key_bytes = 64;

/// `roles`: those that the server gives; empty: all.
Status check_hello(const v1::Hello& hello, const std::vector<v1::Role>& roles) {
  if (hello.protocol_major() != protocol_major) {
    return make_error(
        ErrorCode::unsupported,
        fmt::format("found protocol version {}.{}, this program speaks {}.{}", hello.protocol_major(),
                    hello.protocol_minor(), protocol_major, protocol_minor),
        "hello.protocol_major");
  }
  if (hello.name().size() > max_name_bytes || hello.program().size() > max_name_bytes) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("a name of more than {} bytes", max_name_bytes), "hello.name");
  }
  if (!v1::Role_IsValid(hello.role()) || hello.role() == v1::ROLE_UNSPECIFIED) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected subscriber, viewer, commenter, editor or owner",
                                  static_cast<int>(hello.role())),
                      "hello.role");
  }
  if (!roles.empty() && std::find(roles.begin(), roles.end(), hello.role()) == roles.end()) {
    std::vector<std::string> names;
    names.reserve(roles.size());
    for (const v1::Role role : roles) names.push_back(v1::Role_Name(role));
    return make_error(
        ErrorCode::permission_denied,
        fmt::format("found {}, expected {}", v1::Role_Name(hello.role()), fmt::join(names, " or ")),
        "hello.role");
  }
  const std::size_t key_bytes = hello.client_key().size();
  if (key_bytes != 0 && (key_bytes < shortest_key_bytes || key_bytes > longest_key_bytes)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} bytes, expected {} to {} or none", key_bytes, shortest_key_bytes,
                                  longest_key_bytes),
                      "hello.client_key");
  }
  return {};
}

}  // namespace

Status ServerConnection::shake_hands() {
  const TimePoint received = shared_->clock->now();
  if (!received_.has_hello()) {
    return make_error(ErrorCode::failed_precondition, "the first message must be a hello", "hello");
  }
  const v1::Hello& hello = received_.hello();
  if (Status good = check_hello(hello, shared_->options.roles); !good) return good;
  // Shown to others and logged: no lines of its own, and nothing that moves a cursor.
  peer_ = {hello.role(),
           plain_text(hello.program(), max_name_bytes),
           plain_text(hello.name(), max_name_bytes),
           hello.protocol_minor(),
           hello.sent_ns(),
           received,
           stream_->peer(),
           hello.client_key(),
           origin_.uid,
           origin_.address};
  if (shared_->events.admit) {
    const Result<Admission> admission = shared_->events.admit(peer_);
    if (!admission) return admission.error();
    if (admission->client_id != 0) id_ = admission->client_id;
    const Lock lock(mutex_);
    user_ = admission->user;
  }
  // Whatever the callback says, over TLS nobody comes in without having proved who they are.
  if (origin_.channel == ConnectionOrigin::Channel::tls && !peer_.certificate)
    return make_error(ErrorCode::permission_denied, "this device is not paired with this server", "hello");
  hello_timer_.cancel();
  said_hello_ = true;
  decoder_.set_max_frame_bytes(shared_->options.max_frame_bytes);

  v1::Envelope answer;
  v1::Welcome& welcome = *answer.mutable_welcome();
  welcome.set_protocol_major(protocol_major);
  welcome.set_protocol_minor(protocol_minor);
  welcome.set_program(shared_->options.program);
  welcome.set_client_id(id());
  welcome.set_max_frame_bytes(shared_->options.max_frame_bytes);
  welcome.set_hello_sent_ns(hello.sent_ns());
  welcome.set_received_ns(to_ns(received));
  welcome.set_sent_ns(to_ns(shared_->clock->now()));
  Result<Frame> frame = encode_frame(answer);
  if (!frame) return frame.error();
  {
    Lock lock(mutex_);
    if (phase_ != Phase::handshake) return {};
    phase_ = Phase::joined;
    outbox_.push(std::move(*frame));
    flush(lock);
  }
  shared_->on_joined(origin_.number);
  if (shared_->events.on_join) {
    if (Status status = shared_->events.on_join(shared_from_this()); !status) return status;
  }
  announced_ = true;
  return {};
}

// Of a peer that nobody knows yet: one message of at most hello_max_frame_bytes, one answer, the end. It
// counts as half-open all the time.
Status ServerConnection::begin_pairing() {
  if (pairing_) return make_error(ErrorCode::failed_precondition, "found a message after a pair", "pair");
  if (origin_.channel != ConnectionOrigin::Channel::tls || !shared_->events.on_pair) {
    return make_error(ErrorCode::unsupported, "devices are paired over tls: endpoints only", "pair");
  }
  pairing_ = true;
  shared_->events.on_pair(
      {received_.pair(), origin_.address}, [weak = weak_from_this()](Result<v1::Paired> outcome) {
        const auto self = weak.lock();
        if (!self) return;
        asio::post(self->strand_, [self, outcome = std::move(outcome)] { self->end_pairing(outcome); });
      });
  return {};
}

void ServerConnection::end_pairing(const Result<v1::Paired>& outcome) {
  if (!outcome) {
    fail(outcome.error());
    return;
  }
  v1::Envelope answer;
  *answer.mutable_paired() = *outcome;
  Result<Frame> frame = encode_frame(answer);
  if (!frame) {
    fail(frame.error());
    return;
  }
  Lock lock(mutex_);
  if (phase_ != Phase::handshake) return;
  outbox_.push(std::move(*frame));
  drain("paired");
  flush(lock);
}

}  // namespace handloft::net
