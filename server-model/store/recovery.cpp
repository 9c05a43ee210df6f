#include "server-model/store/recovery.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/storage.pb.h"
#include "server-model/model/canonical.h"
#include "server-model/model/document_codec.h"

namespace handloft::store {

namespace v1 = handloft::v1;

namespace {

Result<model::FormerModel> restore(const OperationLog& log, const SnapshotRow& snapshot,
                                   std::size_t max_history_steps) {
  auto manifest = log.manifest(snapshot);
  if (!manifest) return manifest.error();
  auto state = model::decode_state(
      *manifest, [&](std::string_view sha256) { return log.part(sha256); }, max_history_steps);
  if (!state) return state.error();
  if (const std::string hash = model::document_hash(state->history.current());
      hash != snapshot.document_hash || state->sequence != snapshot.sequence) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("the snapshot at {} restores {:.16} at {}, expected {:.16}",
                                  snapshot.sequence, hash, state->sequence, snapshot.document_hash));
  }
  model::FormerModel former{std::move(state->history), state->sequence, {}};
  // Answers of a while before, for clients that ask again.
  const std::uint64_t window = model::Model::remembered_answers;
  const std::uint64_t from = snapshot.sequence > window ? snapshot.sequence - window + 1 : 1;
  auto status = log.read(from, [&](const LogEntry& entry) -> Status {
    if (entry.record.sequence > snapshot.sequence) return make_error(ErrorCode::cancelled, "enough");
    if (entry.record.client_op_id != 0)
      former.answers.push_back({entry.record.client_id, entry.record.client_op_id, answer_of(entry.record)});
    return {};
  });
  if (!status && status.error().code != ErrorCode::cancelled) return status.error();
  return former;
}

bool same_change(const model::Changes& a, const model::Changes& b) {
  return a.created == b.created && a.changed == b.changed && a.removed == b.removed;
}

/// How the operations before LogRules::per_user_from are replayed.
struct EarlyUndo {
  model::UndoRule rule = model::UndoRule::shared;
  enum class Answers { compared, ignored };
  /// Compared: an undo that changes other entities than it was answered to have is data_corrupt.
  Answers answers = Answers::compared;
};

Result<Recovered> replay(const OperationLog& log, model::Model start, const RecoveryOptions& options,
                         const EarlyUndo& early) {
  Recovered recovered{std::move(start), 0, 0};
  recovered.snapshot_sequence = recovered.model.sequence();
  v1::Operation operation;
  auto status = log.read(recovered.model.sequence() + 1, [&](const LogEntry& entry) -> Status {
    const LogRecord& record = entry.record;
    if (record.sequence > options.until) return make_error(ErrorCode::cancelled, "enough");
    if (!operation.ParseFromString(record.operation)) {
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("operation {} is none that can be read", record.sequence));
    }
    const bool is_early = record.sequence < log.rules().per_user_from;
    recovered.model.set_undo_rule(is_early ? early.rule
                                  : record.sequence < log.rules().fair_from
                                      ? model::UndoRule::per_user_oldest_first
                                      : model::UndoRule::per_user);
    auto submitted = recovered.model.submit(operation);
    if (!submitted) {
      return make_error(ErrorCode::data_corrupt, fmt::format("operation {} does not apply: {}",
                                                             record.sequence, submitted.error().describe()));
    }
    if (submitted->sequence != record.sequence) {
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("operation {} became the {}th", record.sequence, submitted->sequence));
    }
    if (is_early && early.answers == EarlyUndo::Answers::compared &&
        (operation.has_undo() || operation.has_redo()) &&
        !same_change(submitted->changes, answer_of(record).changes)) {
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("operation {} changes other entities than it did", record.sequence));
    }
    ++recovered.replayed;
    return {};
  });
  if (!status && status.error().code != ErrorCode::cancelled) return status.error();
  recovered.model.set_undo_rule(model::UndoRule::per_user);
  return recovered;
}

Result<Recovered> recover_by(const OperationLog& log, const model::ApplyContext& context,
                             const RecoveryOptions& options, const EarlyUndo& early) {
  if (options.snapshots == RecoveryOptions::Snapshots::used) {
    // Damaged rows of snapshots are no reason to give up: all is in the operations.
    auto snapshots = log.snapshots();
    for (const SnapshotRow& snapshot : snapshots ? *snapshots : std::vector<SnapshotRow>()) {
      if (snapshot.sequence > options.until) continue;
      auto former = restore(log, snapshot, context.limits.max_history_steps);
      if (!former) continue;
      auto recovered = replay(log, model::Model::restored(*std::move(former), context), options, early);
      if (recovered) return recovered;
    }
  }
  return replay(log, model::Model(model::Document(), context), options, early);
}

}  // namespace

Result<Recovered> recover(const OperationLog& log, const model::ApplyContext& context,
                          const RecoveryOptions& options) {
  auto shared = recover_by(log, context, options, {});
  if (shared || log.rules().per_user_from <= 1) return shared;
  auto per_user = recover_by(log, context, options, {.rule = model::UndoRule::per_user_oldest_first});
  if (per_user) return per_user;
  // What entities an operation changes is told by this program as it was by that one, unless one of them
  // erred.
  auto at_all = recover_by(log, context, options, {.answers = EarlyUndo::Answers::ignored});
  return at_all ? std::move(at_all) : std::move(shared);
}

LogRecord make_record(const model::Submitted& submitted, std::uint64_t epoch, std::int64_t now_ns) {
  LogRecord record;
  record.epoch = epoch;
  record.sequence = submitted.sequence;
  record.client_id = submitted.effective.client_id();
  record.client_op_id = submitted.effective.client_op_id();
  record.time_ns = now_ns;
  record.operation = submitted.effective.SerializeAsString();
  v1::StoredAnswer answer;
  for (const std::string& id : submitted.changes.created) answer.add_created(id);
  for (const std::string& id : submitted.changes.changed) answer.add_changed(id);
  for (const std::string& id : submitted.changes.removed) answer.add_removed(id);
  answer.set_alternatives(submitted.changes.alternatives);
  answer.set_versions(submitted.changes.versions);
  answer.set_comments(submitted.changes.comments);
  answer.set_words(submitted.words);
  for (const std::string& note : submitted.notes) answer.add_notes(note);
  for (const std::string& gesture : submitted.cancelled_gestures) answer.add_cancelled_gestures(gesture);
  record.answer = answer.SerializeAsString();
  return record;
}

model::Submitted answer_of(const LogRecord& record) {
  v1::StoredAnswer answer;
  answer.ParseFromString(record.answer);
  model::Submitted submitted;
  submitted.sequence = record.sequence;
  submitted.changes.created.assign(answer.created().begin(), answer.created().end());
  submitted.changes.changed.assign(answer.changed().begin(), answer.changed().end());
  submitted.changes.removed.assign(answer.removed().begin(), answer.removed().end());
  submitted.changes.alternatives = answer.alternatives();
  submitted.changes.versions = answer.versions();
  submitted.changes.comments = answer.comments();
  submitted.words = answer.words();
  submitted.notes.assign(answer.notes().begin(), answer.notes().end());
  submitted.cancelled_gestures.assign(answer.cancelled_gestures().begin(), answer.cancelled_gestures().end());
  return submitted;
}

}  // namespace handloft::store
