#include "common/net/message_client.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <google/protobuf/arena.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

#include "common/net/backoff.h"
#include "common/net/client_handshake.h"
#include "common/net/message_parts.h"

namespace handloft::net {

namespace {

constexpr int largest_backoff = 10;
/// A connection that ends sooner counts as a failed attempt: else a server that greets and then sends
/// nonsense would be joined again ten times a second.
constexpr auto worth_keeping = std::chrono::seconds(2);
/// A message below this is parsed without counting its parts: it cannot ask for more than some megabytes.
constexpr std::size_t harmless_bytes = 64U << 10;
constexpr int signs_of_life = 3;  ///< In a silence_timeout.
/// Messages are taken apart in memory that is used again; larger ones than this take more from the heap.
constexpr std::size_t arena_bytes = 64u << 10;
/// The writer looks at least so often whether its connection still exists.
constexpr int writer_patience_ms = 200;

}  // namespace

struct MessageClient::Implementation {
  Implementation(const Endpoint& where, ClientOptions settings, ClientEvents callbacks, const Clock& time,
                 Logger logger)
      : endpoint(where),
        options(std::move(settings)),
        events(std::move(callbacks)),
        clock(time),
        log(std::move(logger)),
        wake(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
        backoff(options.retry_interval, options.retry_interval * largest_backoff,
                static_cast<std::uint64_t>(to_ns(time.now())) ^ static_cast<std::uint64_t>(::getpid())) {}

  const Endpoint endpoint;
  const ClientOptions options;
  const ClientEvents events;
  const Clock& clock;
  const Logger log;
  const FileDescriptor wake;  ///< ends a rest between two attempts, and an attempt
  std::atomic<bool> stopping{false};
  std::atomic<std::uint64_t> received{0};

  // Held while writing, so that the descriptor is not closed under a sender.
  mutable std::mutex mutex;
  Link link;
  short to_write_events = POLLOUT;  ///< For what the writer waits.
  std::deque<Frame> queue;
  std::size_t queued_bytes = 0;
  std::size_t first_done = 0;
  std::uint32_t peer_max_frame_bytes = hello_max_frame_bytes;
  std::uint64_t client_id = 0;
  ClockOffset offset;

  Backoff backoff;                ///< the client's thread only
  std::uint64_t connections = 0;  ///< made so far
  std::condition_variable to_write;

  std::thread thread;
  std::thread writer{[this] { write_all(); }};

  ~Implementation() { stop(); }

  void stop() {
    stopping = true;
    const std::uint64_t one = 1;
    static_cast<void>(!::write(wake.get(), &one, sizeof(one)));
    {
      const std::lock_guard lock(mutex);
      if (link.fd.valid()) ::shutdown(link.fd.get(), SHUT_RDWR);  // ends a blocking read
    }
    to_write.notify_all();
    if (thread.joinable()) thread.join();
    if (writer.joinable()) writer.join();
  }

  // ---- any thread ----

  Status send(const v1::Envelope& envelope) {
    std::unique_lock lock(mutex);
    if (!link.fd.valid()) return make_error(ErrorCode::failed_precondition, "not connected", "connection");
    const std::uint32_t limit = peer_max_frame_bytes;
    lock.unlock();
    Result<Frame> frame = encode_frame(envelope, limit);
    if (!frame) return frame.error();
    lock.lock();
    if (!link.fd.valid()) return make_error(ErrorCode::failed_precondition, "not connected", "connection");
    if (queued_bytes + (*frame)->size() > options.max_queued_bytes) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("{} bytes wait to be sent already", queued_bytes), "connection");
    }
    const bool idle = queue.empty();
    queued_bytes += (*frame)->size();
    queue.push_back(std::move(*frame));
    if (!idle) return {};  // the thread is at it
    write_queue();
    if (!queue.empty()) to_write.notify_one();
    return {};
  }

  // The writer's thread: what the kernel had no room for.
  void write_all() {
    std::unique_lock lock(mutex);
    for (;;) {
      to_write.wait(lock, [this] { return stopping || !queue.empty(); });
      if (stopping) return;
      pollfd writable{link.fd.get(), to_write_events, 0};
      const std::uint64_t which = connections;
      lock.unlock();
      poll(&writable, 1, writer_patience_ms);
      lock.lock();
      if (which == connections && link.fd.valid()) write_queue();
    }
  }

  // With the mutex held. Errors show on the reading side.
  void write_queue() {
    while (!queue.empty()) {
      const std::string& bytes = *queue.front();
      const StreamOutcome outcome = link.stream->write(
          {reinterpret_cast<const std::uint8_t*>(bytes.data()) + first_done, bytes.size() - first_done});
      if (outcome.state != StreamOutcome::State::moved) {
        if (outcome.state == StreamOutcome::State::failed) drop_queue();
        to_write_events = poll_events(outcome);
        return;
      }
      first_done += outcome.bytes;
      if (first_done < bytes.size()) continue;
      queued_bytes -= bytes.size();
      queue.pop_front();
      first_done = 0;
    }
  }

  void drop_queue() {
    queue.clear();
    queued_bytes = 0;
    first_done = 0;
  }

  // ---- the client's thread ----

  void adopt(Handshake& handshake) {
    {
      const std::lock_guard lock(mutex);
      link = std::move(handshake.link);
      to_write_events = POLLOUT;
      ++connections;
      drop_queue();
      peer_max_frame_bytes = handshake.welcome.max_frame_bytes() == 0 ? default_max_frame_bytes
                                                                      : handshake.welcome.max_frame_bytes();
      client_id = handshake.welcome.client_id();
      offset = handshake.offset;
    }
    if (events.on_connected) events.on_connected(handshake.welcome, handshake.offset);
  }

  /// Reads what there is, waiting for it as long as the socket's own patience. Without TLS one blocking
  /// system call: polling first would cost every hop a microsecond.
  StreamOutcome read_waiting(std::span<std::uint8_t> room) {
    using State = StreamOutcome::State;
    const int socket = link.fd.get();
    if (!link.secured) {
      const ssize_t count = ::recv(socket, room.data(), room.size(), 0);
      if (count > 0) return {State::moved, static_cast<std::size_t>(count)};
      if (count == 0) return {State::ended};
      if (errno == EINTR || errno == EAGAIN || errno == EWOULDBLOCK)
        return {errno == EINTR ? State::moved : State::wants_read};
      return {State::failed, 0, std::strerror(errno)};
    }
    for (;;) {
      StreamOutcome outcome = link.stream->read(room);
      if (outcome.state != State::wants_read && outcome.state != State::wants_write) return outcome;
      const int patience_ms = options.silence_timeout.count() == 0
                                  ? -1
                                  : static_cast<int>(options.silence_timeout.count() / signs_of_life);
      pollfd ready{socket, poll_events(outcome), 0};
      if (poll(&ready, 1, patience_ms) == 0) return {State::wants_read};
    }
  }

  /// Until the connection ends; says why.
  Error receive_all(FrameDecoder& decoder) {
    std::vector<char> block(arena_bytes);
    google::protobuf::ArenaOptions arena_options;
    arena_options.initial_block = block.data();
    arena_options.initial_block_size = block.size();
    google::protobuf::Arena arena(arena_options);
    limit_silence(link.fd.get());  // closed by this thread only
    int silences = 0;
    while (!stopping) {
      for (;;) {
        const auto payload = decoder.next();
        if (!payload) return payload.error();
        if (!payload.value()) break;
        if (const Status modest = check_parts(*payload.value()); !modest) return modest.error();
        auto* envelope = google::protobuf::Arena::CreateMessage<v1::Envelope>(&arena);
        if (const Status status = parse_envelope(*payload.value(), *envelope); !status) return status.error();
        received.fetch_add(1, std::memory_order_relaxed);
        if (const std::optional<Error> end = deliver(*envelope)) return *end;
        arena.Reset();
        if (stopping) break;
      }
      const StreamOutcome outcome = read_waiting(decoder.prepare());
      switch (outcome.state) {
        case StreamOutcome::State::moved:
          decoder.commit(outcome.bytes);
          silences = 0;
          break;
        case StreamOutcome::State::ended:
          return make_error(ErrorCode::io, "the server closed the connection", "connection");
        case StreamOutcome::State::failed:
          return make_error(ErrorCode::io, outcome.problem, "connection");
        case StreamOutcome::State::wants_read:
        case StreamOutcome::State::wants_write:
          if (++silences >= signs_of_life) {
            return make_error(ErrorCode::timeout,
                              fmt::format("heard nothing for {} ms", options.silence_timeout.count()),
                              "connection");
          }
          ask_for_a_sign();
          break;
      }
    }
    return make_error(ErrorCode::cancelled, "stopped by us", "connection");
  }

  /// Lets recv() return now and then, at no cost while messages come.
  void limit_silence(int socket) const {
    const std::int64_t us = std::chrono::microseconds(options.silence_timeout).count() / signs_of_life;
    const timeval patience{us / 1'000'000, us % 1'000'000};
    if (us > 0) setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  }

  void ask_for_a_sign() {
    v1::Envelope envelope;
    envelope.mutable_ping()->set_sent_ns(to_ns(clock.now()));
    static_cast<void>(send(envelope));
  }

  Status check_parts(std::span<const std::uint8_t> payload) const {
    if (options.max_message_parts == 0 || payload.size() <= harmless_bytes) return {};
    const Result<std::size_t> parts = count_message_parts(payload, options.max_message_parts);
    return parts ? Status() : Status(parts.error());
  }

  std::optional<Error> deliver(v1::Envelope& envelope) {
    if (envelope.has_ping()) {
      const std::int64_t now = to_ns(clock.now());
      v1::Envelope answer;
      v1::Pong& pong = *answer.mutable_pong();
      pong.set_id(envelope.ping().id());
      pong.set_sent_ns(envelope.ping().sent_ns());
      pong.set_received_ns(now);
      pong.set_replied_ns(now);
      static_cast<void>(send(answer));
      return std::nullopt;
    }
    if (envelope.has_pong()) return std::nullopt;
    if (envelope.has_failure() && envelope.failure().closing()) return error_of(envelope.failure());
    if (events.on_message) events.on_message(envelope);
    return std::nullopt;
  }

  void end_connection(const Error& error) {
    {
      const std::lock_guard lock(mutex);
      link = {};
      drop_queue();
    }
    if (stopping) return;  // Our own end tells nobody anything.
    log.info("{}: {}", endpoint.to_string(), error.describe());
    if (events.on_disconnected) events.on_disconnected(error);
  }

  /// Sleeps unless told to stop.
  void rest(std::chrono::milliseconds duration) const {
    pollfd waiting{wake.get(), POLLIN, 0};
    poll(&waiting, 1, static_cast<int>(duration.count()));
    if (stopping) return;
    std::uint64_t count = 0;
    static_cast<void>(!::read(wake.get(), &count, sizeof(count)));
  }

  std::optional<Handshake> reconnect() {
    std::string last_reason;
    while (!stopping) {
      Result<Handshake> handshake =
          shake_hands(endpoint, options, clock, options.handshake_timeout, wake.get());
      if (handshake) return std::move(*handshake);
      if (stopping) break;
      const std::string reason = handshake.error().describe();
      if (reason != last_reason) {
        log.info("waiting for {}: {}", endpoint.to_string(), reason);
        if (events.on_attempt_failed) events.on_attempt_failed(handshake.error());
      }
      last_reason = reason;
      rest(backoff.next());
    }
    return std::nullopt;
  }

  void run(std::optional<Handshake> handshake, Reconnect reconnecting) {
    bool adopted = handshake.has_value();
    for (;;) {
      if (!handshake) handshake = reconnect();
      if (!handshake) return;
      const SteadyTime begun = std::chrono::steady_clock::now();
      if (!adopted) adopt(*handshake);
      adopted = false;
      end_connection(receive_all(handshake->decoder));
      handshake.reset();
      if (stopping || reconnecting == Reconnect::never) return;
      if (std::chrono::steady_clock::now() - begun >= worth_keeping) backoff.reset();
      rest(backoff.next());
    }
  }
};

MessageClient::MessageClient(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

MessageClient::~MessageClient() = default;

Result<std::unique_ptr<MessageClient>> MessageClient::connect(const Endpoint& endpoint, ClientOptions options,
                                                              ClientEvents events, const Clock& clock,
                                                              Logger log) {
  auto client = std::make_unique<Implementation>(endpoint, std::move(options), std::move(events), clock,
                                                 std::move(log));
  const SteadyTime deadline = std::chrono::steady_clock::now() + client->options.connect_timeout;
  for (;;) {
    Result<Handshake> handshake =
        shake_hands(endpoint, client->options, clock, client->options.handshake_timeout);
    if (handshake) {
      // On this thread, so that connect() returns after it; the other thread starts with it done.
      client->adopt(*handshake);
      Implementation& running = *client;
      const Reconnect again = running.options.reconnect;
      running.thread = std::thread(
          [&running, again, first = std::make_shared<Handshake>(std::move(*handshake))]() mutable {
            std::optional<Handshake> taken(std::move(*first));
            first.reset();
            running.run(std::move(taken), again);
          });
      return std::unique_ptr<MessageClient>(new MessageClient(std::move(client)));
    }
    const bool in_time = std::chrono::steady_clock::now() + client->options.retry_interval < deadline;
    if (!worth_retrying(handshake.error()) || !in_time) return handshake.error();
    client->rest(client->options.retry_interval);
  }
}

std::unique_ptr<MessageClient> MessageClient::start(const Endpoint& endpoint, ClientOptions options,
                                                    ClientEvents events, const Clock& clock, Logger log) {
  auto client = std::make_unique<Implementation>(endpoint, std::move(options), std::move(events), clock,
                                                 std::move(log));
  Implementation& running = *client;
  running.thread = std::thread([&running] { running.run(std::nullopt, Reconnect::always); });
  return std::unique_ptr<MessageClient>(new MessageClient(std::move(client)));
}

Status MessageClient::send(const v1::Envelope& envelope) {
  return implementation_->send(envelope);
}

bool MessageClient::connected() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->link.fd.valid();
}

std::uint64_t MessageClient::client_id() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->client_id;
}

ClockOffset MessageClient::clock_offset() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->offset;
}

std::uint64_t MessageClient::frames_received() const {
  return implementation_->received;
}

}  // namespace handloft::net
