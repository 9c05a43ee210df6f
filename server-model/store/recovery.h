#pragma once
// A model from its log: the newest snapshot that is good, then the operations after it (U3, D6, D7). What
// comes out has the hash of the model that wrote the log, can undo as deep as the snapshot's history and the
// replayed operations reach, and answers retries as they were answered (H3).

#include <cstdint>

#include "common/base/result.h"
#include "server-model/model/model.h"
#include "server-model/store/operation_log.h"

namespace handloft::store {

struct Recovered {
  model::Model model;
  std::uint64_t snapshot_sequence = 0;  ///< 0: from the first operation.
  std::uint64_t replayed = 0;
};

struct RecoveryOptions {
  BranchId branch = main_branch;
  std::uint64_t until =
      ~std::uint64_t{0};  ///< The last operation that is replayed: a version, or the good prefix.
  enum class Snapshots { used, ignored };
  Snapshots snapshots = Snapshots::used;  ///< Ignored: every operation is replayed, for a check of snapshots.
};

/// A snapshot that is damaged, or whose history does not reach as deep as an operation after it undoes, gives
/// way to the one before, and the last to the empty document. Errors: data_corrupt naming the operation that
/// cannot be read or applied.
Result<Recovered> recover(const OperationLog& log, const model::ApplyContext& context = {},
                          const RecoveryOptions& options = {});

/// The record of what was submitted. Precondition: it has a sequence.
LogRecord make_record(const model::Submitted& submitted, std::uint64_t epoch, std::int64_t now_ns);
/// What was answered.
model::Submitted answer_of(const LogRecord& record);

}  // namespace handloft::store
