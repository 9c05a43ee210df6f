#include "common/net/client_handshake.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <random>
#include <utility>

#include "common/base/plain_text.h"
#include "common/net/message_server.h"

namespace handloft::net {

namespace {

int milliseconds_left(SteadyTime deadline) {
  const auto left =
      std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  return static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, 3'600'000));
}

Error lost(std::string_view why) {
  return make_error(ErrorCode::io, fmt::format("the connection is gone: {}", why), "connection");
}

}  // namespace

std::string random_client_key() {
  constexpr std::size_t key_bytes = 32;
  std::string key(key_bytes, '\0');
  std::random_device random;  // The kernel's.
  for (char& byte : key) byte = static_cast<char>(random() & 0xFFU);
  return key;
}

Error error_of(const v1::Failure& failure) {
  constexpr std::size_t longest_message = 512, longest_field = 128;
  constexpr std::array codes{ErrorCode::invalid_argument,
                             ErrorCode::not_found,
                             ErrorCode::already_exists,
                             ErrorCode::failed_precondition,
                             ErrorCode::rank_deficient,
                             ErrorCode::resource_exhausted,
                             ErrorCode::unsupported,
                             ErrorCode::permission_denied,
                             ErrorCode::io,
                             ErrorCode::data_corrupt,
                             ErrorCode::cancelled,
                             ErrorCode::timeout,
                             ErrorCode::internal};
  const auto* code = std::find_if(codes.begin(), codes.end(),
                                  [&](ErrorCode known) { return to_string(known) == failure.code(); });
  return make_error(code == codes.end() ? ErrorCode::internal : *code,
                    plain_text(failure.message(), longest_message),
                    plain_text(failure.field(), longest_field));
}

bool worth_retrying(const Error& error) {
  return error.code == ErrorCode::not_found || error.code == ErrorCode::timeout ||
         error.code == ErrorCode::io;
}

short poll_events(const StreamOutcome& outcome) {
  return outcome.state == StreamOutcome::State::wants_write ? POLLOUT : POLLIN;
}

namespace {

/// Whether there is time for another look. A socket that is always ready, and gives nothing, must not keep
/// anybody beyond the deadline: after it there is one look more.
class Looks {
 public:
  explicit Looks(SteadyTime deadline) : deadline_(deadline) {}
  bool another() { return !std::exchange(last_, std::chrono::steady_clock::now() >= deadline_); }

 private:
  SteadyTime deadline_;
  bool last_ = false;
};

}  // namespace

Status send_all(Link& link, std::string_view bytes, SteadyTime deadline) {
  Looks looks(deadline);
  while (!bytes.empty()) {
    const StreamOutcome outcome =
        link.stream->write({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    if (outcome.state == StreamOutcome::State::moved) {
      bytes.remove_prefix(outcome.bytes);
      continue;
    }
    if (outcome.state == StreamOutcome::State::failed) return lost(outcome.problem);
    pollfd waiting{link.fd.get(), poll_events(outcome), 0};
    const int ready = poll(&waiting, 1, milliseconds_left(deadline));
    if (ready < 0 && errno != EINTR) return lost(std::strerror(errno));
    if (ready == 0 || !looks.another()) {
      return make_error(ErrorCode::timeout, "the server does not read", "connection");
    }
  }
  return {};
}

Status receive_one(Link& link, FrameDecoder& decoder, v1::Envelope& envelope, SteadyTime deadline,
                   int cancel_fd) {
  Looks looks(deadline);
  for (;;) {
    const auto payload = decoder.next();
    if (!payload) return payload.error();
    if (payload.value()) return parse_envelope(*payload.value(), envelope);
    const StreamOutcome outcome = link.stream->read(decoder.prepare());
    if (outcome.state == StreamOutcome::State::moved) {
      decoder.commit(outcome.bytes);
      continue;
    }
    if (outcome.state == StreamOutcome::State::failed) return lost(outcome.problem);
    if (outcome.state == StreamOutcome::State::ended)
      return lost(decoder.mid_frame() ? "it was cut in the middle of a frame" : "the server closed it");
    // poll() passes over a negative descriptor.
    std::array<pollfd, 2> waiting{pollfd{link.fd.get(), poll_events(outcome), 0},
                                  pollfd{cancel_fd, POLLIN, 0}};
    const int ready = poll(waiting.data(), waiting.size(), milliseconds_left(deadline));
    if (ready < 0 && errno != EINTR) return lost(std::strerror(errno));
    if (ready > 0 && waiting[1].revents != 0) {
      return make_error(ErrorCode::cancelled, "stopped by us", "connection");
    }
    if (ready == 0 || !looks.another())
      return make_error(ErrorCode::timeout, "no message came in time", "connection");
  }
}

namespace {

Result<Link> open_link(const Endpoint& endpoint, const ClientOptions& options,
                       std::chrono::milliseconds timeout) {
  if (endpoint.kind == Endpoint::Kind::tls && options.tls == nullptr)
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("\"{}\": this device is not paired with that server", endpoint.to_string()),
                      "endpoint");
  Result<FileDescriptor> fd = connect_to(endpoint, static_cast<int>(timeout.count()));
  if (!fd) return fd.error();
  if (const Status status = check_peer(fd->get(), endpoint); !status) return status.error();
  Link link{std::move(*fd), nullptr, endpoint.kind == Endpoint::Kind::tls};
  if (link.secured) {
    auto stream = options.tls->open(link.fd.get());
    if (!stream) return stream.error();
    link.stream = std::move(*stream);
  } else {
    link.stream = make_plain_stream(link.fd.get());
  }
  return link;
}

}  // namespace

Result<Handshake> shake_hands(const Endpoint& endpoint, const ClientOptions& options, const Clock& clock,
                              std::chrono::milliseconds timeout, int cancel_fd) {
  const SteadyTime deadline = std::chrono::steady_clock::now() + timeout;
  Result<Link> link = open_link(endpoint, options, timeout);
  if (!link) return link.error();

  v1::Envelope envelope;
  v1::Hello& hello = *envelope.mutable_hello();
  hello.set_protocol_major(protocol_major);
  hello.set_protocol_minor(protocol_minor);
  hello.set_role(options.role);
  hello.set_program(options.program);
  hello.set_name(options.name);
  hello.set_client_key(options.client_key);
  const TimePoint sent = clock.now();
  hello.set_sent_ns(to_ns(sent));
  const Result<Frame> frame = encode_frame(envelope, hello_max_frame_bytes);
  if (!frame) return frame.error();
  // A server that refuses at once may have closed its half already; its reason still waits to be read.
  const Status said = send_all(*link, **frame, deadline);

  FrameDecoder decoder(options.max_frame_bytes);
  if (const Status status = receive_one(*link, decoder, envelope, deadline, cancel_fd); !status) {
    return said.ok() ? status.error() : said.error();
  }
  const TimePoint received = clock.now();
  if (envelope.has_failure()) return error_of(envelope.failure());
  if (!envelope.has_welcome()) {
    return make_error(ErrorCode::data_corrupt, "the server's first message is no welcome", "welcome");
  }
  v1::Welcome welcome = envelope.welcome();
  if (welcome.protocol_major() != protocol_major) {
    return make_error(
        ErrorCode::unsupported,
        fmt::format("the server speaks protocol {}.{}, this program {}.{}", welcome.protocol_major(),
                    welcome.protocol_minor(), protocol_major, protocol_minor),
        "welcome.protocol_major");
  }
  // Sums of times within this are no overflow: 36 years of a monotonic clock.
  constexpr std::int64_t latest_ns = std::int64_t{1} << 60;
  for (const std::int64_t time_ns : {welcome.received_ns(), welcome.sent_ns()}) {
    if (time_ns < 0 || time_ns > latest_ns) {
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("found {}, expected a time of 0..{} ns", time_ns, latest_ns),
                        "welcome.sent_ns");
    }
  }
  ClockOffset offset;
  const TimePoint their_receipt = from_ns(welcome.received_ns());
  const TimePoint their_answer = from_ns(welcome.sent_ns());
  offset.round_trip = (received - sent) - (their_answer - their_receipt);
  offset.server_minus_client = ((their_receipt - sent) + (their_answer - received)) / 2;
  return Handshake{std::move(*link), std::move(decoder), std::move(welcome), offset};
}

}  // namespace handloft::net
