#include "server-model/model/history.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace handloft::model {

std::string who(std::string_view author, std::uint64_t client_id) {
  if (!author.empty()) return std::string(author);
  return client_id == 0 ? std::string("a script") : fmt::format("client {}", client_id);
}

namespace {

/// Who made `other`, as those are told who made `own`.
std::string who_else(const StepInfo& other, const StepInfo& own) {
  if (other.author.empty() || other.author != own.author || other.client_id == own.client_id)
    return who(other.author, other.client_id);
  return "another program of yours";
}

History::Highest highest(const History::Highest& a, const History::Highest& b) {
  return {std::max(a.shape, b.shape), std::max(a.comment, b.comment)};
}

History::Highest given_by(const StepDelta& delta) {
  return {delta.next_shape_before != delta.next_shape_after ? delta.next_shape_after : 0,
          delta.next_comment_before != delta.next_comment_after ? delta.next_comment_after : 0};
}

/// Brings one of the sets up to date that lines are ordered by; who has nothing is not in it.
template <typename Value>
void settle_in(std::set<std::pair<Value, std::uint64_t>>& set, std::uint64_t client, Value& known,
               Value now) {
  if (known == now) return;
  if (known != 0) set.erase({known, client});
  if (now != 0) set.emplace(now, client);
  known = now;
}

}  // namespace

History::History(Document initial, std::size_t max_steps)
    : current_(std::move(initial)), max_steps_(std::max<std::size_t>(1, max_steps)) {}

History::History(Document current, std::vector<Entry> entries, std::size_t max_steps)
    : current_(std::move(current)), max_steps_(std::max<std::size_t>(1, max_steps)) {
  for (Entry& entry : entries) add(++last_step_, std::move(entry));
  find_pushers();
  begin_early();
  make_room(0, Going::dropped);
}

History::Line& History::add(std::uint64_t number, Entry entry) {
  const StepDelta& delta = entry.step->delta;
  Line& line = lines_[entry.step->info.client_id];
  line.places.push_back({number, highest(line.before(line.places.size()), given_by(delta))});
  if (!entry.undone) ++line.standing;
  std::set<std::uint64_t>& numbers = entry.undone ? undone_ : standing_;
  numbers.emplace_hint(numbers.end(), number);
  index_.add(number, delta, entry.undone);
  entries_.emplace_hint(entries_.end(), number, std::move(entry));
  return line;
}

void History::settle(Lines::iterator at) {
  const std::uint64_t client = at->first;
  Line& line = at->second;
  const bool over = line.places.empty() && line.older + line.newer == 0;
  const std::size_t count = over ? 0 : line.count();
  const Highest stands = over ? Highest() : line.before(line.standing);
  counted_ = counted_ - line.counted + count;
  settle_in(by_count_, client, line.counted, count);
  settle_in(by_shape_, client, line.counted_highest.shape, stands.shape);
  settle_in(by_comment_, client, line.counted_highest.comment, stands.comment);
  if (!over) return;
  forgotten_highest_ = highest(forgotten_highest_, line.forgotten);
  lines_.erase(at);
}

void History::remove_first(Line& line, Going going) {
  const Line::Place place = line.places.front();
  const bool undone = line.standing == 0;
  const auto entry = entries_.find(place.number);
  const Step& step = *entry->second.step;
  const bool stands_for_ever = going == Going::forgotten && !undone;
  if (going == Going::forgotten) {
    index_.forget(place.number, step.delta, undone);
  } else {
    index_.drop(place.number, step.delta);
  }
  if (stands_for_ever) {
    line.forgotten = place.highest;
    forgotten_sequence_ = std::max(forgotten_sequence_, step.info.sequence);
  }
  (undone ? undone_ : standing_).erase(place.number);
  entries_.erase(entry);
  line.places.pop_front();
  if (!undone) --line.standing;
  if (line.early > 0) {
    --line.early;
    --early_;
  }
  if (stands_for_ever) return;
  // Those behind it have counted it; as a rule the first one has given out higher numbers by itself.
  Highest before = line.forgotten;
  for (Line::Place& each : line.places) {
    before = highest(before, given_by(step_at(each.number).delta));
    if (before.shape == each.highest.shape && before.comment == each.highest.comment) break;
    each.highest = before;
  }
}

void History::remove_last(Line& line, Going going) {
  const std::uint64_t number = line.places.back().number;
  const auto entry = entries_.find(number);
  const bool undone = entry->second.undone;
  if (going == Going::forgotten) {
    index_.forget(number, entry->second.step->delta, undone);
  } else {
    index_.drop(number, entry->second.step->delta);
  }
  (undone ? undone_ : standing_).erase(number);
  entries_.erase(entry);
  line.places.pop_back();
  line.standing = std::min(line.standing, line.places.size());
  if (line.early > line.places.size()) {
    --line.early;
    --early_;
  }
}

void History::forget_redo(Line& line) {
  while (line.places.size() > line.standing) remove_last(line, Going::dropped);
  line.newer = 0;
}

void History::forget_all_redo() {
  if (undone_.empty()) return;
  for (auto at = lines_.begin(); at != lines_.end();) {
    const auto line = at++;
    forget_redo(line->second);
    settle(line);
  }
  find_pushers();
}

void History::find_pushers() {
  newest_ = before_ = {};
  for (auto each = entries_.rbegin(); each != entries_.rend() && before_.number == 0; ++each) {
    const Pusher pusher{each->second.step->info.client_id, each->first};
    if (newest_.number == 0) {
      newest_ = pusher;
    } else if (pusher.client_id != newest_.client_id) {
      before_ = pusher;
    }
  }
}

void History::begin_early() {
  if (early_ == entries_.size() && counted_ == 0) return;
  early_ = entries_.size();
  for (auto at = lines_.begin(); at != lines_.end();) {
    const auto line = at++;
    line->second.older = line->second.newer = 0;
    line->second.early = line->second.places.size();
    settle(line);
  }
}

void History::push(const Document& after, StepInfo info, UndoRule rule) {
  const std::uint64_t client = info.client_id;
  const bool early = rule != UndoRule::per_user;
  if (early) begin_early();
  if (rule == UndoRule::shared) forget_all_redo();
  if (const auto own = lines_.find(client); own != lines_.end()) forget_redo(own->second);
  const std::uint64_t number = ++last_step_;
  Line& line = add(
      number, {std::make_shared<const Step>(Step{delta_between(current_, after), std::move(info)}), false});
  if (early) {
    ++line.early;
    ++early_;
  }
  if (newest_.client_id != client) before_ = newest_;
  newest_ = {client, number};
  current_ = after;
  ++changes_;
  settle(lines_.find(client));
  make_room(client, early ? Going::dropped : Going::forgotten);
}

// Those of an earlier rule give way first, the oldest first: a history that has kept fewer of them then has
// none that this one has not.
void History::make_room(std::uint64_t pusher, Going going) {
  while (early_ + counted_ > max_steps_) {
    if (early_ == 0) {
      forget_of_who_has_most(pusher);
      continue;
    }
    const auto line = lines_.find(entries_.begin()->second.step->info.client_id);
    remove_first(line->second, going);
    settle(line);
  }
}

// By numbers of steps alone, which a history that has forgotten more knows as well.
void History::forget_of_who_has_most(std::uint64_t pusher) {
  const std::size_t most = by_count_.rbegin()->first;
  auto found = by_count_.lower_bound({most, 0});
  if (most > 1 && by_count_.contains({most, pusher})) {
    found = by_count_.find({most, pusher});
  } else if (found->second == pusher && std::next(found) != by_count_.end()) {
    ++found;  // Not the one step that was just made.
  }
  const auto at = lines_.find(found->second);
  Line& line = at->second;
  if (line.older > 0) {
    --line.older;
  } else if (line.standing > 0) {
    remove_first(line, Going::forgotten);
  } else if (line.newer > 0) {
    --line.newer;
  } else {
    remove_last(line, Going::forgotten);
  }
  settle(at);
}

const History::Line* History::line(std::uint64_t client_id) const {
  const auto found = lines_.find(client_id);
  return found == lines_.end() ? nullptr : &found->second;
}

std::uint64_t History::undoable(std::uint64_t client_id) const {
  const Line* const own = line(client_id);
  return own == nullptr || own->standing == 0 ? 0 : own->places[own->standing - 1].number;
}

std::uint64_t History::redoable(std::uint64_t client_id) const {
  const Line* const own = line(client_id);
  return own == nullptr || own->standing == own->places.size() ? 0 : own->places[own->standing].number;
}

std::size_t History::undo_steps(std::uint64_t client_id) const {
  const Line* const own = line(client_id);
  return own == nullptr ? 0 : own->standing;
}

std::size_t History::redo_steps(std::uint64_t client_id) const {
  const Line* const own = line(client_id);
  return own == nullptr ? 0 : own->places.size() - own->standing;
}

std::string History::next_undo(std::uint64_t client_id) const {
  const std::uint64_t next = undoable(client_id);
  return next == 0 ? std::string() : step_at(next).info.words;
}

std::string History::next_redo(std::uint64_t client_id) const {
  const std::uint64_t next = redoable(client_id);
  return next == 0 ? std::string() : step_at(next).info.words;
}

std::string History::undo_refused(std::uint64_t client_id) const {
  const std::uint64_t next = undoable(client_id);
  return next == 0 ? std::string() : refusal(next, Direction::back);
}

std::string History::redo_refused(std::uint64_t client_id) const {
  const std::uint64_t next = redoable(client_id);
  return next == 0 ? std::string() : refusal(next, Direction::forth);
}

std::string History::next_undo() const {
  return standing_.empty() ? std::string() : step_at(*standing_.rbegin()).info.words;
}

std::string History::next_redo() const {
  return undone_.empty() ? std::string() : step_at(*undone_.begin()).info.words;
}

Result<std::string> History::undo(std::uint64_t client_id, const Limits& limits) {
  return step(client_id, Direction::back, limits);
}

Result<std::string> History::redo(std::uint64_t client_id, const Limits& limits) {
  return step(client_id, Direction::forth, limits);
}

Result<std::string> History::step(std::uint64_t client_id, Direction direction, const Limits& limits) {
  const bool back = direction == Direction::back;
  const char* const name = back ? "undo" : "redo";
  const std::uint64_t next = back ? undoable(client_id) : redoable(client_id);
  if (next == 0)
    return make_error(ErrorCode::failed_precondition, fmt::format("there is nothing to {}", name), name);
  if (std::string refused = refusal(next, direction); !refused.empty())
    return make_error(ErrorCode::failed_precondition, std::move(refused), name);
  return step_to(
      stepped(current_, step_at(next).delta, direction, may_free(next) ? Given::freed : Given::kept), next,
      direction, limits);
}

Result<std::string> History::undo_newest(const Limits& limits) {
  return step_shared(Direction::back, limits);
}

Result<std::string> History::redo_oldest(const Limits& limits) {
  return step_shared(Direction::forth, limits);
}

// The newest step that stands is the newest of its client's that stands, and likewise the oldest undone one.
Result<std::string> History::step_shared(Direction direction, const Limits& limits) {
  const bool back = direction == Direction::back;
  if (back ? standing_.empty() : undone_.empty()) {
    const char* const name = back ? "undo" : "redo";
    return make_error(ErrorCode::failed_precondition, fmt::format("there is nothing to {}", name), name);
  }
  const std::uint64_t number = back ? *standing_.rbegin() : *undone_.begin();
  const StepDelta& delta = step_at(number).delta;
  if (const auto found = conflict(current_, delta, direction))
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("{} has changed since", describe(*found, delta)));
  return step_to(stepped(current_, delta, direction, Given::freed), number, direction, limits);
}

Result<std::string> History::step_to(const Document& result, std::uint64_t number, Direction direction,
                                     const Limits& limits) {
  const bool back = direction == Direction::back;
  const char* const name = back ? "undo" : "redo";
  // Others may have filled what this step had made room for.
  const auto too_many = [&](std::size_t before, std::size_t after, std::size_t most, const char* what) {
    return after > most && after > before
               ? Status(make_error(
                     ErrorCode::resource_exhausted,
                     fmt::format("there would be {} {}, expected at most {}", after, what, most), name))
               : Status();
  };
  for (const Status& status :
       {too_many(current_.entities.size(), result.entities.size(), limits.max_entities, "entities"),
        too_many(current_.alternatives->size(), result.alternatives->size(), limits.max_alternatives,
                 "alternatives"),
        too_many(current_.versions->size(), result.versions->size(), limits.max_versions, "versions"),
        too_many(current_.comments->size(), result.comments->size(), limits.max_comments, "comments")}) {
    if (!status) return status.error();
  }
  Entry& entry = entries_.at(number);
  if (auto moved = placed(current_, entry.step->delta, direction))
    entry.step = std::make_shared<const Step>(Step{*std::move(moved), StepInfo(entry.step->info)});
  current_ = result;
  ++changes_;
  entry.undone = back;
  index_.set_undone(number, entry.step->delta, back);
  (back ? standing_ : undone_).erase(number);
  (back ? undone_ : standing_).insert(number);
  const auto own = lines_.find(entry.step->info.client_id);
  own->second.standing = back ? own->second.standing - 1 : own->second.standing + 1;
  settle(own);
  return entry.step->info.words;
}

bool History::may_free(std::uint64_t number) const {
  const StepDelta& delta = step_at(number).delta;
  const std::uint64_t client = step_at(number).info.client_id;
  if ((newest_.client_id == client ? before_ : newest_).number > number) return false;
  // Numbers from here on may have been given to steps before this one, too, which had been taken back when it
  // was made: they have been done again since, and may have been taken back once more.
  const auto given_by_others = [&](const auto& by_number, std::uint64_t forgotten) {
    auto each = by_number.rbegin();
    if (each != by_number.rend() && each->second == client) ++each;
    return each == by_number.rend() ? forgotten : std::max(forgotten, each->first);
  };
  if (delta.next_shape_before != delta.next_shape_after &&
      (current_.next_shape != delta.next_shape_after ||
       given_by_others(by_shape_, forgotten_highest_.shape) > delta.next_shape_before))
    return false;
  return delta.next_comment_before == delta.next_comment_after ||
         (current_.next_comment == delta.next_comment_after &&
          given_by_others(by_comment_, forgotten_highest_.comment) <= delta.next_comment_before);
}

std::string History::refusal(std::uint64_t number, Direction direction) const {
  const Step& step = step_at(number);
  std::string why;
  if (const auto found = conflict(current_, step.delta, direction)) {
    why = blame(number, *found);
  } else if (const auto later = index_.later(number, step.delta)) {
    // A value may be again as the step left it because somebody else has brought it back: that is their work
    // too. Of one's own steps none behind this one stands.
    const std::string what = describe(later->what, step.delta);
    if (later->forgotten) {
      why = fmt::format("somebody has changed {} since", what);
    } else {
      const StepInfo& other = step_at(later->number).info;
      why = fmt::format("{} has changed {} since ({})", who_else(other, step.info), what, other.words);
    }
  } else {
    return {};
  }
  return fmt::format("\"{}\" is not {}: {}", step.info.words,
                     direction == Direction::back ? "taken back" : "done again", why);
}

// The newest step of somebody else behind this one that stands explains what there is now; without one, the
// newest of all that was taken back.
std::string History::blame(std::uint64_t number, const Conflict& conflict) const {
  const Step& step = step_at(number);
  const std::string what = describe(conflict, step.delta);
  const std::uint64_t stands = index_.newest_standing(number, conflict, step.delta.alternative);
  const std::uint64_t explains =
      stands != 0 ? stands : index_.newest_undone(conflict, step.delta.alternative, [&](std::uint64_t other) {
        return step_at(other).info.client_id != step.info.client_id;
      });
  if (explains == 0) return fmt::format("{} has changed since", what);
  const StepInfo& info = step_at(explains).info;
  return fmt::format("{} has {} {} since ({})", who_else(info, step.info),
                     stands == 0 ? "taken back a change of" : "changed", what, info.words);
}

}  // namespace handloft::model
