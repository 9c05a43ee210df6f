#pragma once
// The figures of a running server (issue 7, part 6), counted where things happen and written as Prometheus
// reads them: operations and refusals by kind, how long answers take, who is connected, what waits for them,
// and how the models' files are. Thread-safe.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/base/histogram.h"
#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "proto/session.pb.h"
#include "server-model/stream/pack_cache.h"

namespace handloft::session {

/// What is asked for when somebody looks.
struct ClientFigures {
  std::string role;  ///< "editor"
  std::size_t outbox_bytes = 0;
  std::uint64_t overflows = 0;
};
struct ModelFigures {
  std::string name;
  std::size_t clients = 0;
  double silence_s = 0.0;  ///< Since its thread has answered last.
  std::uint64_t sequence = 0;
  bool kept = false;  ///< The following are of a model with a file.
  std::uint64_t durable_sequence = 0;
  std::uint64_t file_bytes = 0;  ///< With its write-ahead log.
  bool writable = true;
  double recovery_s = 0.0;  ///< Of its opening.
};
struct PresentFigures {
  std::vector<ClientFigures> clients;
  std::vector<ModelFigures> models;
  std::uint64_t clients_served = 0;
  stream::PackCacheStatistics packs;  ///< What viewers share.
};

/// What may be refused.
enum class Asked : std::uint8_t {
  connection,
  tls,
  hello,
  pairing,
  join,
  operation,
  command,
  query,
  lease,
  hand
};

class SessionMetrics {
 public:
  /// An operation was applied to that model, so long after it came.
  void applied(const std::string& model, v1::Operation::BodyCase kind, Duration after);
  /// So many operations were made of what hands did, in the air or on the palette.
  void applied_by_hand(const std::string& model, std::size_t count);
  /// Was answered as durable, so long after it came.
  void durable(Duration after) { durable_.add(after); }
  /// `model`: empty before there is one.
  void refused(Asked what, ErrorCode why, const std::string& model = {});
  /// A viewer was given what a tracking frame had shaped, so long after its capture.
  void shown(Duration after) { shown_.add(after); }
  /// A commit took so long: for ModelStore::time_commits().
  std::shared_ptr<Histogram> commits() const { return commits_; }

  std::string text(const PresentFigures& present) const;

 private:
  Histogram applied_, durable_, shown_;
  std::shared_ptr<Histogram> commits_ = std::make_shared<Histogram>();
  mutable std::mutex mutex_;
  std::map<std::string, std::uint64_t> operations_;
  std::map<std::pair<std::string, std::string>, std::uint64_t> refusals_;  ///< By what and why.
  /// Of models that were open since the start. Those beyond the first ones are counted together, so that
  /// whoever makes many fills nobody's memory.
  struct OfModel {
    std::uint64_t operations = 0;
    std::uint64_t refusals = 0;
  };
  OfModel& of_model(const std::string& name);
  std::map<std::string, OfModel> models_;
};

/// Counts what is refused to those who work on a model. A value that holds neither model nor peers, for
/// callbacks.
struct RefusalCounter {
  std::shared_ptr<SessionMetrics> metrics;  ///< Null: nobody asks.
  std::string model;                        ///< Empty: none yet.
  void add(Asked what, const Error& error) const {
    if (metrics && error.code != ErrorCode::cancelled) metrics->refused(what, error.code, model);
  }
};

/// "editor" of ROLE_EDITOR.
std::string role_word(v1::Role role);
/// Of a model's file and what belongs to it; 0 for what is not there.
std::uint64_t file_bytes(const std::string& file);

}  // namespace handloft::session
