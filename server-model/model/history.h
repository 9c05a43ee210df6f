#pragma once
// What was done to a document, by whom, and undo per user (U1). Every client has its own line of steps: undo
// takes back the newest of them that is not taken back, redo does the one again that was taken back last, and
// a new step forgets what that client could redo. Neither ever reverts anybody else's work: where somebody
// else has changed since what the step changed, it is refused and says who did what. For one client alone
// this is the linear history: every document comes back to the bit (A28). Memory is bounded by sharing and by
// Limits::max_history_steps.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/model/document.h"
#include "server-model/model/step_delta.h"

namespace handloft::model {

/// What is known of a step besides what it changed.
struct StepInfo {
  std::string words;            ///< "Add 120 points to Top"
  std::uint64_t client_id = 0;  ///< 0: scripts, a user like any other.
  std::uint64_t client_op_id = 0;
  std::string author{};        ///< The user's name; empty: unknown.
  std::int64_t made_ns = 0;    ///< ns since 1970, UTC; 0: unknown.
  std::uint64_t sequence = 0;  ///< Place in the order of all operations; 0: unknown.
};

class History {
 public:
  struct Step {
    StepDelta delta;
    StepInfo info;
  };
  using StepPtr = std::shared_ptr<const Step>;
  struct Entry {
    StepPtr step;
    bool undone = false;
    std::uint64_t signature = 0;  ///< signature() of its delta; set by History.
  };

  explicit History(Document initial = {}, std::size_t max_steps = Limits{}.max_history_steps);
  /// As it was, entries oldest first. Of more than max_steps the oldest are forgotten. Precondition: of each
  /// client's steps those taken back are the newest.
  History(Document current, std::vector<Entry> entries, std::size_t max_steps = Limits{}.max_history_steps);

  const Document& current() const { return current_; }
  /// Forgets what this client could redo. The oldest step is forgotten beyond max_steps.
  void push(const Document& after, StepInfo info);
  /// failed_precondition when there is nothing to undo (redo), or somebody else has changed since what the
  /// step changed; the message says who and what. resource_exhausted when the document would get too large.
  /// Then nothing is changed.
  Result<std::string> undo(std::uint64_t client_id = 0, const Limits& limits = {});  ///< The step's words.
  Result<std::string> redo(std::uint64_t client_id = 0, const Limits& limits = {});

  // --- of one client: what HistoryState (scene.proto) tells each viewer
  std::size_t undo_steps(std::uint64_t client_id) const;
  std::size_t redo_steps(std::uint64_t client_id) const;
  std::string next_undo(std::uint64_t client_id) const;  ///< In words; empty: nothing.
  std::string next_redo(std::uint64_t client_id) const;
  /// Why undo() (redo()) would be refused now, in words; empty: it would not, or there is nothing to undo.
  std::string undo_refused(std::uint64_t client_id) const;
  std::string redo_refused(std::uint64_t client_id) const;

  // --- of everybody together
  std::size_t undo_steps() const { return entries_.size() - undone_; }
  std::size_t redo_steps() const { return undone_; }
  std::string next_undo() const;                                 ///< Of the newest step that stands.
  std::string next_redo() const;                                 ///< Of the oldest step that is taken back.
  const std::deque<Entry>& entries() const { return entries_; }  ///< Oldest first.
  /// Grows by one with every push, undo and redo: to know that nothing has changed.
  std::uint64_t changes() const { return changes_; }

 private:
  /// Of one client: numbers of its steps (the first of entries_ has number first_), of which the first
  /// `standing` are not taken back.
  struct Line {
    std::deque<std::uint64_t> numbers;
    std::size_t standing = 0;
  };

  void forget_oldest();
  void forget_redo(Line& line);
  const Line* line(std::uint64_t client_id) const;
  Entry& entry(std::uint64_t number);
  const Entry& entry(std::uint64_t number) const;
  const Entry* undoable(std::uint64_t client_id) const;  ///< Null: none.
  const Entry* redoable(std::uint64_t client_id) const;
  Result<std::string> step(std::uint64_t client_id, Direction direction, const Limits& limits);
  std::string refusal(const Entry& entry, Direction direction) const;
  std::string blame(const Entry& entry, const Conflict& conflict) const;
  /// The first step of somebody else behind this one that stands and changed the same; null: none.
  const Step* gone_on(const Entry& entry) const;
  /// Nobody else has a step behind this one, taken back or not.
  bool last_of_all(const Entry& entry) const;

  Document current_;
  std::deque<Entry> entries_;            ///< Shared steps, so that a copy of the history costs pointers.
  std::deque<std::uint64_t> numbers_;    ///< Of entries_, ascending.
  std::map<std::uint64_t, Line> lines_;  ///< By client.
  std::uint64_t next_number_ = 0;
  std::uint64_t changes_ = 0;
  std::size_t undone_ = 0;
  std::size_t max_steps_;
};

/// For people: the author's name, "a script" or "client 7".
std::string who(std::string_view author, std::uint64_t client_id);

}  // namespace handloft::model
