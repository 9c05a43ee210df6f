#pragma once
// A model: one document, its history, and the gestures in the air. The one thing that the script runner and
// the server both drive. Not thread-safe: one thread (or strand) owns a model; queries cost reading, so copy
// `document()` (cheap) to look at it elsewhere.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "proto/query.pb.h"
#include "server-model/model/document.h"
#include "server-model/model/history.h"
#include "server-model/model/provisional.h"

namespace handloft::model {

/// What came of an operation.
struct Submitted {
  std::uint64_t sequence = 0;  ///< Place in the total order; 0: accepted, but nothing changed.
  Changes changes;             ///< Of the document.
  handloft::v1::Operation
      effective;  ///< For the log; replaying the effective operations gives the same hash.
  std::string words;
  std::vector<std::string> notes;
  std::vector<std::string> cancelled_gestures;  ///< In words: gestures that could not live on the new base.
};

using ProvisionalId = std::uint64_t;

/// A model that was: what a restart restores (store/recovery.h).
struct FormerModel {
  /// What was answered to an operation with a client_op_id; its `effective` is not needed.
  struct Answer {
    std::uint64_t client_id = 0;
    std::uint64_t client_op_id = 0;
    Submitted submitted;
  };
  History history;
  std::uint64_t sequence = 0;
  std::vector<Answer> answers;  ///< Oldest first; the last Model::remembered_answers are kept.
};

class Model;

/// Who keeps what is applied (store/model_store.h). Called on the model's thread; must not wait for a disk.
struct Journal {
  /// What was answered to an operation that the model itself no longer remembers; nullopt: nothing.
  std::function<std::optional<Submitted>(std::uint64_t client_id, std::uint64_t client_op_id)> answered;
  /// An error refuses every operation: what cannot be kept is not applied.
  std::function<Status()> accepting;
  /// In the order of the sequence, each once; the model is as it is afterwards.
  std::function<void(const Submitted& submitted, const Model& model)> applied;
};

class Model {
 public:
  /// A client that lost an acknowledgement retries within seconds; this many operations of all clients are
  /// hours of work.
  static constexpr std::size_t remembered_answers = 1024;

  explicit Model(Document initial = {}, ApplyContext context = {});
  /// As it was.
  static Model restored(FormerModel former, ApplyContext context = {});
  /// From now on. All three must be there.
  void keep_in(Journal journal) { journal_ = std::move(journal); }

  /// Applies one operation, undo and redo among them: of the steps of the operation's client (history.h). An
  /// operation with the client_id and a client_op_id (not 0) of an earlier one is answered as that one was
  /// and applied no second time (the last 1024 are remembered). Export, and imports whose file is not read
  /// yet, are for the session: failed_precondition.
  Result<Submitted> submit(const handloft::v1::Operation& operation);
  /// By which rule undo goes from now on; per user unless told. For replaying logs (store/recovery.h).
  void set_undo_rule(UndoRule rule) { undo_rule_ = rule; }
  /// What was answered to an operation that this one retries (H3): for who refuses before submit() is asked.
  /// nullopt: it is a new one, or was refused.
  std::optional<Submitted> answered_before(const handloft::v1::Operation& operation) const;

  /// As this client sees it: its own undo and redo. PeopleQuery and ModelsQuery are for the session: a model
  /// by itself has nobody, and knows no other.
  Result<handloft::v1::QueryResult> query(const handloft::v1::Query& query,
                                          std::uint64_t client_id = 0) const;

  // --- gestures
  // -----------------------------------------------------------------------------------------------
  /// Ids count from 1. resource_exhausted beyond Limits::max_provisional.
  Result<ProvisionalId> begin_provisional(const handloft::v1::Operation& operation);
  Status append_provisional(ProvisionalId id, std::span<const handloft::v1::Point> points);
  /// Of a push: see Provisional::append_disk().
  Status append_disk(ProvisionalId id, std::span<const handloft::v1::DiskPose> poses, double range);
  Status update_provisional(ProvisionalId id, const handloft::v1::Operation& operation);
  /// Applies the gesture as one operation, as submit() does. Its client_id and client_op_id are used. The
  /// gesture is gone afterwards, refused or not.
  Result<Submitted> commit_provisional(ProvisionalId id);
  /// The base was never touched, so this only forgets. False: no such gesture (it may have been cancelled).
  bool cancel_provisional(ProvisionalId id);
  /// Null: no such gesture.
  const Provisional* provisional(ProvisionalId id) const;
  bool has_provisional() const { return !provisional_.empty(); }

  // --- what there is
  // ------------------------------------------------------------------------------------------
  const Document& document() const { return history_.current(); }
  /// The document with the gestures in the air on top. On an entity that several of them change, points that
  /// are laid come on top of what others do; of two others the later gesture wins.
  Document preview() const;
  /// Whose gesture in the air has changed (or made) this entity: its operation's client_id, of the latest of
  /// several; nullopt: nobody's.
  std::optional<std::uint64_t> provisional_by(std::string_view entity) const;
  bool is_provisional(std::string_view entity) const { return provisional_by(entity).has_value(); }
  const History& history() const { return history_; }
  std::uint64_t sequence() const { return sequence_; }
  /// Grows with every change of the entity, provisional ones, cancelled ones, undo and redo too; 0: never
  /// seen.
  std::uint64_t revision(std::string_view entity) const;
  const Limits& limits() const { return context_.limits; }

 private:
  Result<Submitted> submit_new(const handloft::v1::Operation& operation);
  Result<Submitted> step_history(const handloft::v1::Operation& operation);
  void touch(const Changes& changes);
  void touch_all();
  void remember(std::uint64_t client_id, std::uint64_t client_op_id, const Submitted& submitted);
  std::vector<std::string> rebase_provisional();

  ApplyContext context_;
  std::optional<Journal> journal_;
  History history_;
  UndoRule undo_rule_ = UndoRule::per_user;
  std::map<ProvisionalId, Provisional> provisional_;
  ProvisionalId next_provisional_ = 1;
  std::uint64_t sequence_ = 0;
  std::uint64_t revision_counter_ = 0;
  std::map<std::string, std::uint64_t, std::less<>> revisions_;
  std::map<std::pair<std::uint64_t, std::uint64_t>, Submitted> answered_;
  std::deque<std::pair<std::uint64_t, std::uint64_t>> answered_order_;
};

}  // namespace handloft::model
