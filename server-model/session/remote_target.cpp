#include "server-model/session/remote_target.h"

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

RemoteTarget::RemoteTarget(net::SyncClient client, RemoteTargetOptions options)
    : client_(std::move(client)), options_(std::move(options)) {}

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
  client_options.connect_timeout = options.connect_timeout;
  auto client = net::SyncClient::connect(endpoint, client_options, clock);
  if (!client) return client.error();
  RemoteTarget target(*std::move(client), std::move(options));
  if (target.options_.model.empty()) return target;
  v1::Envelope join;
  join.mutable_join()->set_model(target.options_.model);
  auto joined = target.exchange(join, [](const v1::Envelope& e) { return e.has_joined(); });
  if (!joined) return joined.error();
  return target;
}

template <typename IsAnswer>
Result<v1::Envelope> RemoteTarget::exchange(const v1::Envelope& question, const IsAnswer& is_answer) {
  if (const Status sent = client_.send(question); !sent) return sent.error();
  const auto deadline = std::chrono::steady_clock::now() + options_.answer_timeout;
  while (true) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return make_error(ErrorCode::timeout, "the server has not answered");
    auto envelope = client_.receive(left);
    if (!envelope) return envelope.error();
    if (is_answer(*envelope)) return envelope;
    if (envelope->has_failure()) return to_error(envelope->failure());
  }
}

Result<model::ScriptTarget::Outcome> RemoteTarget::submit(const v1::Operation& operation) {
  const std::uint64_t request = next_request_++;
  v1::Envelope question;
  question.mutable_submit()->set_request(request);
  *question.mutable_submit()->mutable_operation() = operation;
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
