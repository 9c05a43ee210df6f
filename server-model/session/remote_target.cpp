#include "server-model/session/remote_target.h"

#include <random>
#include <thread>
#include <utility>

#include "common/net/paired_server.h"

namespace handloft::session {

void set_failure(v1::Failure& failure, const Error& error) {
  failure.set_code(std::string(to_string(error.code)));
  failure.set_message(error.message);
  failure.set_field(error.field);
}

Error to_error(const v1::Failure& failure) {
  for (int code = 0; code <= static_cast<int>(ErrorCode::internal); ++code) {
    if (to_string(static_cast<ErrorCode>(code)) == failure.code()) {
      return make_error(static_cast<ErrorCode>(code), failure.message(), failure.field());
    }
  }
  return make_error(ErrorCode::internal, failure.code() + ": " + failure.message(), failure.field());
}

namespace {

/// Since this minor version a client is the same one when it comes again, and what it sends again is applied
/// once.
constexpr std::uint32_t retries_since_minor = 2;

/// Far from where any other run of ours counts, whose key this one may have; a double holds all of them.
std::uint64_t first_operation() {
  constexpr unsigned bits = 52, word_bits = 32;
  std::random_device device;
  const std::uint64_t random = (std::uint64_t{device()} << word_bits) | device();
  return (random >> (2 * word_bits - bits)) + 1;
}

}  // namespace

RemoteTarget::RemoteTarget(net::Endpoint endpoint, const Clock& clock, net::ClientOptions client_options,
                           net::SyncClient client, RemoteTargetOptions options)
    : endpoint_(std::move(endpoint)),
      clock_(&clock),
      client_options_(std::move(client_options)),
      client_(std::move(client)),
      options_(std::move(options)),
      next_operation_(first_operation()) {}

Result<RemoteTarget> RemoteTarget::connect(const net::Endpoint& endpoint, const Clock& clock,
                                           RemoteTargetOptions options) {
  net::ClientOptions client_options;
  client_options.role = options.role;
  auto tls = net::tls_to(endpoint);
  if (!tls) return tls.error();
  client_options.tls = *std::move(tls);
  client_options.program = "handloft-modeld run";
  client_options.name = options.name;
  client_options.client_key = options.client_key;
  if (client_options.client_key.empty() && options.come_again_within.count() > 0)
    client_options.client_key = net::random_client_key();
  client_options.connect_timeout = options.connect_timeout;
  auto client = net::SyncClient::connect(endpoint, client_options, clock);
  if (!client) return client.error();
  RemoteTarget target(endpoint, clock, std::move(client_options), *std::move(client), std::move(options));
  if (const Status joined = target.join(); !joined) return joined.error();
  return target;
}

Status RemoteTarget::join() {
  if (options_.model.empty()) return {};
  v1::Envelope join;
  join.mutable_join()->set_model(options_.model);
  const auto joined = exchange_once(join, [](const v1::Envelope& e) { return e.has_joined(); });
  return joined ? Status() : joined.error();
}

template <typename IsAnswer>
Result<v1::Envelope> RemoteTarget::exchange_once(const v1::Envelope& question, const IsAnswer& is_answer) {
  lost_ = true;
  if (const Status sent = client_.send(question); !sent) {
    lost_ = sent.error().code == ErrorCode::io;
    return sent.error();
  }
  const auto deadline = std::chrono::steady_clock::now() + options_.answer_timeout;
  while (true) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) {
      lost_ = false;
      return make_error(ErrorCode::timeout, "the server has not answered");
    }
    auto envelope = client_.receive(left);
    if (!envelope) {
      lost_ = envelope.error().code == ErrorCode::io;
      return envelope.error();
    }
    if (is_answer(*envelope)) {
      lost_ = false;
      return envelope;
    }
    if (envelope->has_failure()) {
      // "cancelled": the server stops. Of any other reason to close another connection would end as well.
      const Error error = to_error(envelope->failure());
      lost_ = envelope->failure().closing() && error.code == ErrorCode::cancelled && error.field.empty();
      return error;
    }
  }
}

bool RemoteTarget::may_come_again(const Error& error) const {
  return lost_ && options_.come_again_within.count() > 0 && all_durable_ &&
         (error.code == ErrorCode::io || error.code == ErrorCode::cancelled) &&
         client_.welcome().protocol_minor() >= retries_since_minor;
}

Status RemoteTarget::come_again() {
  const auto until = std::chrono::steady_clock::now() + options_.come_again_within;
  for (;;) {
    net::ClientOptions client_options = client_options_;
    client_options.connect_timeout =
        std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    auto client = net::SyncClient::connect(endpoint_, client_options, *clock_);
    Error why = make_error(ErrorCode::io, "the connection is gone");
    if (client) {
      client_ = *std::move(client);
      const Status joined = join();
      if (joined) return joined;
      why = joined.error();
      if (!lost_) return why;
    } else if (client.error().code != ErrorCode::cancelled) {
      return client.error();
    } else {
      why = client.error();  // It is still stopping.
    }
    if (std::chrono::steady_clock::now() + client_options_.retry_interval >= until) return why;
    std::this_thread::sleep_for(client_options_.retry_interval);
  }
}

template <typename IsAnswer>
Result<v1::Envelope> RemoteTarget::exchange(const v1::Envelope& question, const IsAnswer& is_answer) {
  for (;;) {
    auto answer = exchange_once(question, is_answer);
    if (answer || !may_come_again(answer.error())) return answer;
    if (const Status again = come_again(); !again) return again.error();
  }
}

Result<model::ScriptTarget::Outcome> RemoteTarget::submit(const v1::Operation& operation) {
  const std::uint64_t request = next_request_++;
  v1::Envelope question;
  question.mutable_submit()->set_request(request);
  *question.mutable_submit()->mutable_operation() = operation;
  if (operation.client_op_id() == 0)
    question.mutable_submit()->mutable_operation()->set_client_op_id(next_operation_++);
  question.mutable_submit()->set_answer_when(options_.answer_when);
  auto envelope =
      exchange(question, [&](const v1::Envelope& e) { return e.has_ack() && e.ack().request() == request; });
  if (!envelope) return envelope.error();
  const v1::Ack& ack = envelope->ack();
  if (ack.has_failure()) return to_error(ack.failure());
  Outcome outcome;
  outcome.sequence = ack.sequence();
  outcome.entities.assign(ack.entities().begin(), ack.entities().end());
  outcome.notes.assign(ack.notes().begin(), ack.notes().end());
  outcome.durable = ack.level() == v1::SAVE_LEVEL_DURABLE;
  if (outcome.sequence != 0 && !outcome.durable) all_durable_ = false;
  return outcome;
}

Result<v1::QueryResult> RemoteTarget::query(const v1::Query& query) {
  const std::uint64_t request = next_request_++;
  v1::Envelope question;
  question.mutable_ask()->set_request(request);
  *question.mutable_ask()->mutable_query() = query;
  auto envelope = exchange(
      question, [&](const v1::Envelope& e) { return e.has_answer() && e.answer().request() == request; });
  if (!envelope) return envelope.error();
  if (envelope->answer().has_failure()) return to_error(envelope->answer().failure());
  return std::move(*envelope->mutable_answer()->mutable_result());
}

}  // namespace handloft::session
