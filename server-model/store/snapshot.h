#pragma once
// Snapshots: a model as it was after an operation, kept beside the operations so that a restart replays only
// those after it (U3, D7). Made on any thread from a value, written aside in small steps between commits,
// read back and hashed, and only then switched to; the one before is kept.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "server-model/model/document_codec.h"
#include "server-model/store/operation_log.h"

namespace handloft::store {

struct PreparedSnapshot {
  std::uint64_t sequence = 0;
  std::string document_hash;
  std::string manifest;
  Digest manifest_hash{};
  std::vector<std::pair<Digest, std::string>> parts;
};

/// Encodes the state and decodes it again: what does not give the same hash is refused (internal). O(model).
Result<PreparedSnapshot> prepare_snapshot(const model::KeptState& state,
                                          const model::EncodeOptions& options = {});
Result<PreparedSnapshot> prepare_snapshot(const model::StoredState& state,
                                          const model::EncodeOptions& options = {});

/// Writes one into a log, a step at a time, so that operations need not wait for it. The log must outlive it.
class SnapshotWriter {
 public:
  SnapshotWriter(OperationLog& log, PreparedSnapshot snapshot, std::int64_t now_ns)
      : log_(log), snapshot_(std::move(snapshot)), now_ns_(now_ns) {}

  /// True: done, and the log restores from it. Errors: io, resource_exhausted (which end the log's writing
  /// too); data_corrupt when what was read back is not what was written: then the snapshot before stays.
  Result<bool> step();

 private:
  Status write_parts();
  Status write_manifest();
  Status read_back();
  Status switch_over();

  static constexpr std::size_t bytes_per_step = 1U << 20U;  ///< Some ms of an operation's wait.
  static constexpr int kept_snapshots = 2;

  enum class Phase { parts, manifest, read_back, switch_over, done };
  OperationLog& log_;
  PreparedSnapshot snapshot_;
  std::int64_t now_ns_;
  Phase phase_ = Phase::parts;
  std::size_t next_part_ = 0;
  std::int64_t id_ = 0;
};

/// All steps at once.
Status write_snapshot(OperationLog& log, PreparedSnapshot snapshot, std::int64_t now_ns);

}  // namespace handloft::store
