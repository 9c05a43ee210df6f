#pragma once
// A script target in another process: operations and queries go to a running server as an editor's (U7).

#include <chrono>
#include <cstdint>

#include "common/net/endpoint.h"
#include "common/net/message_client.h"
#include "server-model/session/script_target.h"

namespace handloft::session {

struct RemoteTargetOptions {
  std::string name = "script";  ///< Shown to others.
  v1::Role role = v1::ROLE_EDITOR;
  /// How safe an operation is to be when it is answered; unspecified: as the server is configured.
  v1::SaveLevel answer_when = v1::SAVE_LEVEL_UNSPECIFIED;
  /// net::ClientOptions::client_key: the same client when it comes again, whose steps undo takes back.
  std::string client_key = {};
  std::string model = {};  ///< Of a server that has several; empty: its first.
  /// Tries again so long while nobody listens; 0: once, so that a wrong path is told at once.
  std::chrono::milliseconds connect_timeout{0};
  std::chrono::milliseconds answer_timeout{
      120'000};  ///< An export of a large model takes seconds, not minutes.
  /// After a lost connection, as when the server is restarted: comes again within so long, and sends again
  /// what was not answered, which is applied once (H3). Only while all that was answered is on the server's
  /// disk, since else the model that is met again may lack it. 0: a lost connection is an error.
  std::chrono::milliseconds come_again_within{0};
};

class RemoteTarget final : public model::ScriptTarget {
 public:
  /// `clock` must outlive it. Errors: those of net::SyncClient::connect().
  static Result<RemoteTarget> connect(const net::Endpoint& endpoint, const Clock& clock,
                                      RemoteTargetOptions options = {});

  /// The server's refusals come back as they are; io or timeout when the connection fails.
  Result<Outcome> submit(const v1::Operation& operation) override;
  Result<v1::QueryResult> query(const v1::Query& query) override;

 private:
  RemoteTarget(net::Endpoint endpoint, const Clock& clock, net::ClientOptions client_options,
               net::SyncClient client, RemoteTargetOptions options);
  Status join();
  /// The message for which `is_answer` holds; others (presence, scenes) are passed over.
  template <typename IsAnswer>
  Result<v1::Envelope> exchange_once(const v1::Envelope& question, const IsAnswer& is_answer);
  /// The same over as many connections as it takes.
  template <typename IsAnswer>
  Result<v1::Envelope> exchange(const v1::Envelope& question, const IsAnswer& is_answer);
  /// Whether a connection that ended so may be made anew.
  bool may_come_again(const Error& error) const;
  Status come_again();

  net::Endpoint endpoint_;
  const Clock* clock_;
  net::ClientOptions client_options_;
  net::SyncClient client_;
  RemoteTargetOptions options_;
  std::uint64_t next_request_ = 1;
  std::uint64_t next_operation_;
  bool lost_ = false;        ///< The last exchange found the connection's end.
  bool all_durable_ = true;  ///< Of what was answered.
};

/// A refusal on the wire and back. An unknown code becomes `internal`.
void set_failure(v1::Failure& failure, const Error& error);
Error to_error(const v1::Failure& failure);

}  // namespace handloft::session
