#pragma once
// What was done to a document, by whom, and undo per user (U1). Every client has its own line of steps: undo
// takes back the newest of them that is not taken back, redo does the one again that was taken back last, and
// a new step forgets what that client could redo. Neither ever reverts anybody else's work: where somebody
// else has changed since what the step changed, it is refused and says who did what. For one client alone
// this is the linear history: every document comes back to the bit (A28).
//
// Memory is bounded by sharing and by Limits::max_history_steps, fairly: beyond it a step is forgotten of
// whoever has most of them, so that a busy script forgets its own. While k clients have steps, each keeps its
// newest max_steps / k (rounded down), or all that it has. A step that is forgotten can be taken back no
// more, and that is all: what undo and redo of the others do, and what they refuse, is as if every step were
// still known. So a history that has forgotten more (that of a snapshot) refuses more, and else does the
// same.
//
// Undo, redo and new steps cost O(what the step changed * log n) of n steps and clients.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "server-model/model/document.h"
#include "server-model/model/step_delta.h"
#include "server-model/model/step_index.h"

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

/// Whose steps undo takes back, and which are forgotten beyond max_steps.
enum class UndoRule : std::uint8_t {
  per_user,               ///< Those of who asks; of who has most. The present rule.
  per_user_oldest_first,  ///< Those of who asks; the oldest of all. Logs of format 2.
  shared,                 ///< The newest of all; the oldest of all. Logs from before protocol 1.2.
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
  };
  /// The highest numbers that steps have given out: next_shape and next_comment behind them; 0: none.
  struct Highest {
    std::uint64_t shape = 0, comment = 0;
  };
  struct Pusher {
    std::uint64_t client_id = 0;
    std::uint64_t number = 0;  ///< Of its newest step; 0: there is none.
  };

  /// What a snapshot keeps of a history (document_codec.h). Steps are numbered from 1 as they were made.
  struct Kept {
    struct Numbered {
      std::uint64_t number = 0;  ///< Ascending.
      Entry entry;
    };
    /// Steps of a client that count where somebody has to forget one, and are not here.
    struct Gone {
      std::uint64_t client_id = 0;
      std::uint64_t older = 0, newer = 0;  ///< Than those here: to be taken back after them; to be redone.
      Highest highest;                     ///< By all that are older and stand.
    };
    Document current;
    std::vector<Numbered> steps;
    std::size_t early = 0;  ///< The first so many were made by an earlier rule.
    std::vector<Gone> gone;
    StepIndex::Forgotten forgotten;
    Highest forgotten_highest;    ///< By steps of clients that have none left.
    std::uint64_t last_step = 0;  ///< The newest number that was ever given.
    Pusher newest, before;        ///< Whose the newest step of all is; the newest of anybody else.
    std::uint64_t forgotten_sequence = 0;
  };
  /// No history has more steps, forgotten ones that still count among them.
  static constexpr std::uint64_t most_counted = 1'000'000;

  explicit History(Document initial = {}, std::size_t max_steps = Limits{}.max_history_steps);
  /// As it was, entries oldest first, made by an earlier rule. Of more than max_steps the oldest are
  /// forgotten. Precondition: of each client's steps those taken back are the newest.
  History(Document current, std::vector<Entry> entries, std::size_t max_steps = Limits{}.max_history_steps);
  /// As it was. Errors: data_corrupt, naming what does not fit.
  static Result<History> restored(Kept kept, std::size_t max_steps = Limits{}.max_history_steps);
  /// What it takes to go on later with at most so many steps to undo, and as many to redo, in O(those). Of k
  /// clients each keeps its newest max_steps / k to undo and its next max_steps / k to redo, or all. Steps of
  /// an earlier rule are kept where there is room besides.
  Kept kept(std::size_t max_steps) const;

  const Document& current() const { return current_; }
  /// Forgets what this client (with the shared rule, anybody) could redo, and a step beyond max_steps.
  void push(const Document& after, StepInfo info, UndoRule rule = UndoRule::per_user);
  /// failed_precondition when there is nothing to undo (redo), or somebody else has changed since what the
  /// step changed; the message says who and what. resource_exhausted when the document would get too large.
  /// Then nothing is changed.
  Result<std::string> undo(std::uint64_t client_id = 0, const Limits& limits = {});  ///< The step's words.
  Result<std::string> redo(std::uint64_t client_id = 0, const Limits& limits = {});

  /// By the shared rule, which knows no refusal, and whose numbers are always free again: only to replay what
  /// was done by it.
  Result<std::string> undo_newest(const Limits& limits = {});
  Result<std::string> redo_oldest(const Limits& limits = {});

  // --- of one client: what HistoryState (scene.proto) tells each viewer
  std::size_t undo_steps(std::uint64_t client_id) const;
  std::size_t redo_steps(std::uint64_t client_id) const;
  std::string next_undo(std::uint64_t client_id) const;  ///< In words; empty: nothing.
  std::string next_redo(std::uint64_t client_id) const;
  /// Why undo() (redo()) would be refused now, in words; empty: it would not, or there is nothing to undo.
  std::string undo_refused(std::uint64_t client_id) const;
  std::string redo_refused(std::uint64_t client_id) const;

  // --- of everybody together
  std::size_t undo_steps() const { return standing_.size(); }
  std::size_t redo_steps() const { return undone_.size(); }
  std::string next_undo() const;  ///< Of the newest step that stands.
  std::string next_redo() const;  ///< Of the oldest step that is taken back.

  /// A view of those that are known, oldest first.
  class Entries {
   public:
    using Map = std::map<std::uint64_t, Entry>;
    class Iterator {
     public:
      using iterator_category = std::bidirectional_iterator_tag;
      using value_type = Entry;
      using difference_type = std::ptrdiff_t;
      using pointer = const Entry*;
      using reference = const Entry&;
      Iterator() = default;
      explicit Iterator(Map::const_iterator at) : at_(at) {}
      reference operator*() const { return at_->second; }
      pointer operator->() const { return &at_->second; }
      Iterator& operator++() { return ++at_, *this; }
      Iterator& operator--() { return --at_, *this; }
      Iterator operator++(int) { return Iterator(at_++); }
      Iterator operator--(int) { return Iterator(at_--); }
      bool operator==(const Iterator& other) const { return at_ == other.at_; }

     private:
      Map::const_iterator at_;
    };
    explicit Entries(const Map& map) : map_(&map) {}
    Iterator begin() const { return Iterator(map_->begin()); }
    Iterator end() const { return Iterator(map_->end()); }
    std::reverse_iterator<Iterator> rbegin() const { return std::reverse_iterator(end()); }
    std::reverse_iterator<Iterator> rend() const { return std::reverse_iterator(begin()); }
    bool empty() const { return map_->empty(); }
    std::size_t size() const { return map_->size(); }
    const Entry& front() const { return map_->begin()->second; }
    const Entry& back() const { return map_->rbegin()->second; }

   private:
    const Map* map_;
  };
  Entries entries() const { return Entries(entries_); }
  /// StepInfo::sequence of the newest step that was forgotten while older ones are known; 0: none was.
  std::uint64_t forgotten_sequence() const { return forgotten_sequence_; }
  /// Grows by one with every push, undo and redo: to know that nothing has changed.
  std::uint64_t changes() const { return changes_; }

 private:
  /// Of one client.
  struct Line {
    struct Place {
      std::uint64_t number = 0;
      Highest highest;  ///< By this step and all of the client's before it.
    };
    std::deque<Place> places;  ///< The first `standing` are not taken back.
    std::size_t standing = 0;
    std::size_t early = 0;             ///< The first so many were made by an earlier rule.
    std::size_t older = 0, newer = 0;  ///< As in Kept::Gone.
    Highest forgotten;                 ///< By the older ones.
    // What the sets below know of it.
    std::size_t counted = 0;
    Highest counted_highest;

    std::size_t count() const { return older + places.size() - early + newer; }
    const Highest& before(std::size_t place) const {
      return place == 0 ? forgotten : places[place - 1].highest;
    }
  };
  using Lines = std::map<std::uint64_t, Line>;

  Line& add(std::uint64_t number, Entry entry);
  /// Brings the sets up to date after a change of a line; without anything in it, it goes.
  void settle(Lines::iterator line);
  /// The first or last step of a line goes. Dropped: as if it had never been.
  enum class Going : std::uint8_t { dropped, forgotten };
  void remove_first(Line& line, Going going);
  void remove_last(Line& line, Going going);
  void forget_redo(Line& line);
  void forget_all_redo();
  void find_pushers();
  /// All that there is was made by an earlier rule.
  void begin_early();
  void make_room(std::uint64_t pusher, Going going);
  void forget_of_who_has_most(std::uint64_t pusher);
  const Line* line(std::uint64_t client_id) const;
  std::uint64_t undoable(std::uint64_t client_id) const;  ///< 0: none.
  std::uint64_t redoable(std::uint64_t client_id) const;
  const Step& step_at(std::uint64_t number) const { return *entries_.at(number).step; }
  Result<std::string> step(std::uint64_t client_id, Direction direction, const Limits& limits);
  Result<std::string> step_to(const Document& result, std::uint64_t number, Direction direction,
                              const Limits& limits);
  Result<std::string> step_shared(Direction direction, const Limits& limits);
  std::string refusal(std::uint64_t number, Direction direction) const;
  std::string blame(std::uint64_t number, const Conflict& conflict) const;
  /// The ids and numbers that this step has given out are its own: nobody else has made a step behind it, and
  /// none before it has been given the same numbers.
  bool may_free(std::uint64_t number) const;

  Document current_;
  std::map<std::uint64_t, Entry> entries_;  ///< By number.
  std::set<std::uint64_t> standing_, undone_;
  StepIndex index_;
  Lines lines_;                                                 ///< By client.
  std::set<std::pair<std::size_t, std::uint64_t>> by_count_;    ///< Steps that count, client.
  std::set<std::pair<std::uint64_t, std::uint64_t>> by_shape_;  ///< Line::before(standing).shape, client.
  std::set<std::pair<std::uint64_t, std::uint64_t>> by_comment_;
  Highest forgotten_highest_;
  Pusher newest_, before_;
  std::size_t early_ = 0;    ///< The first so many entries were made by an earlier rule.
  std::size_t counted_ = 0;  ///< Of all clients.
  std::uint64_t last_step_ = 0;
  std::uint64_t changes_ = 0;
  std::uint64_t forgotten_sequence_ = 0;
  std::size_t max_steps_;
};

/// For people: the author's name, "a script" or "client 7".
std::string who(std::string_view author, std::uint64_t client_id);

}  // namespace handloft::model
