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
#include <vector>

#include "common/base/clock.h"
#include "common/base/histogram.h"
#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "proto/session.pb.h"

namespace handloft::session {

/// What is asked for when somebody looks.
struct ClientFigures {
  std::string role;  ///< "editor"
  std::size_t outbox_bytes = 0;
  std::uint64_t overflows = 0;
};
struct ModelFigures {
  std::string name;
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
};

class SessionMetrics {
 public:
  /// An operation was applied, so long after it came.
  void applied(v1::Operation::BodyCase kind, Duration after);
  /// Was answered as durable, so long after it came.
  void durable(Duration after) { durable_.add(after); }
  void refused(ErrorCode why);
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
  std::map<std::string, std::uint64_t> refusals_;
};

/// "editor" of ROLE_EDITOR.
std::string role_word(v1::Role role);
/// Of a model's file and what belongs to it; 0 for what is not there.
std::uint64_t file_bytes(const std::string& file);

}  // namespace handloft::session
