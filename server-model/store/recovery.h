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
  std::uint64_t until =
      ~std::uint64_t{0};  ///< The last operation that is replayed: a version, or the good prefix.
  enum class Snapshots { used, ignored };
  Snapshots snapshots = Snapshots::used;  ///< Ignored: every operation is replayed, for a check of snapshots.
};

/// A snapshot that is damaged, or whose history does not reach as deep as an operation after it undoes, gives
/// way to the one before, and the last to the empty document. Of a file of format 1 it is not written by
/// which rule undo went; the answers in it tell: that of one history for all, or, of files that several
/// clients wrote shortly before format 2, per user. From LogRules::per_user_from on, and for what is done to
/// the model that comes out, it is per user. Steps that the history has no room for are forgotten by the rule
/// that was in force (LogRules::fair_from), so that the same can be undone as where the log was written; what
/// a snapshot has left out counts as if it were there (model::History::Kept). Errors: data_corrupt naming the
/// operation that cannot be read or applied.
Result<Recovered> recover(const OperationLog& log, const model::ApplyContext& context = {},
                          const RecoveryOptions& options = {});

/// The record of what was submitted. Precondition: it has a sequence.
LogRecord make_record(const model::Submitted& submitted, std::uint64_t epoch, std::int64_t now_ns);
/// What was answered.
model::Submitted answer_of(const LogRecord& record);

}  // namespace handloft::store
