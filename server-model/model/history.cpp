#include "server-model/model/history.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace handloft::model {

std::string who(std::string_view author, std::uint64_t client_id) {
  if (!author.empty()) return std::string(author);
  return client_id == 0 ? std::string("a script") : fmt::format("client {}", client_id);
}

History::History(Document initial, std::size_t max_steps)
    : current_(std::move(initial)), max_steps_(std::max<std::size_t>(1, max_steps)) {}

History::History(Document current, std::vector<Entry> entries, std::size_t max_steps)
    : current_(std::move(current)), max_steps_(std::max<std::size_t>(1, max_steps)) {
  for (Entry& entry : entries) {
    Line& line = lines_[entry.step->info.client_id];
    line.numbers.push_back(next_number_);
    if (entry.undone) {
      ++undone_;
    } else {
      ++line.standing;
    }
    numbers_.push_back(next_number_++);
    entry.signature = signature(entry.step->delta);
    entries_.push_back(std::move(entry));
  }
  while (entries_.size() > max_steps_) forget_oldest();
}

void History::forget_oldest() {
  const auto found = lines_.find(entries_.front().step->info.client_id);
  Line& line = found->second;  // Its oldest step is the oldest of all.
  line.numbers.pop_front();
  if (entries_.front().undone) {
    --undone_;
  } else {
    --line.standing;
  }
  if (line.numbers.empty()) lines_.erase(found);
  entries_.pop_front();
  numbers_.pop_front();
}

void History::forget_redo(Line& line) {
  while (line.numbers.size() > line.standing) {
    const auto at =
        std::lower_bound(numbers_.begin(), numbers_.end(), line.numbers.back()) - numbers_.begin();
    numbers_.erase(numbers_.begin() + at);
    entries_.erase(entries_.begin() + at);
    line.numbers.pop_back();
    --undone_;
  }
}

void History::push(const Document& after, StepInfo info) {
  Line& line = lines_[info.client_id];
  forget_redo(line);
  line.numbers.push_back(next_number_);
  ++line.standing;
  numbers_.push_back(next_number_++);
  auto step = std::make_shared<const Step>(Step{delta_between(current_, after), std::move(info)});
  const std::uint64_t bits = signature(step->delta);
  entries_.push_back({std::move(step), false, bits});
  current_ = after;
  ++changes_;
  if (entries_.size() > max_steps_) forget_oldest();
}

const History::Line* History::line(std::uint64_t client_id) const {
  const auto found = lines_.find(client_id);
  return found == lines_.end() ? nullptr : &found->second;
}

const History::Entry& History::entry(std::uint64_t number) const {
  return entries_[static_cast<std::size_t>(std::lower_bound(numbers_.begin(), numbers_.end(), number) -
                                           numbers_.begin())];
}

History::Entry& History::entry(std::uint64_t number) {
  return const_cast<Entry&>(std::as_const(*this).entry(number));
}

const History::Entry* History::undoable(std::uint64_t client_id) const {
  const Line* const own = line(client_id);
  return own == nullptr || own->standing == 0 ? nullptr : &entry(own->numbers[own->standing - 1]);
}

const History::Entry* History::redoable(std::uint64_t client_id) const {
  const Line* const own = line(client_id);
  return own == nullptr || own->standing == own->numbers.size() ? nullptr
                                                                : &entry(own->numbers[own->standing]);
}

std::size_t History::undo_steps(std::uint64_t client_id) const {
  const Line* const own = line(client_id);
  return own == nullptr ? 0 : own->standing;
}

std::size_t History::redo_steps(std::uint64_t client_id) const {
  const Line* const own = line(client_id);
  return own == nullptr ? 0 : own->numbers.size() - own->standing;
}

std::string History::next_undo(std::uint64_t client_id) const {
  const Entry* const next = undoable(client_id);
  return next == nullptr ? std::string() : next->step->info.words;
}

std::string History::next_redo(std::uint64_t client_id) const {
  const Entry* const next = redoable(client_id);
  return next == nullptr ? std::string() : next->step->info.words;
}

std::string History::undo_refused(std::uint64_t client_id) const {
  const Entry* const next = undoable(client_id);
  return next == nullptr ? std::string() : refusal(*next, Direction::back);
}

std::string History::redo_refused(std::uint64_t client_id) const {
  const Entry* const next = redoable(client_id);
  return next == nullptr ? std::string() : refusal(*next, Direction::forth);
}

std::string History::next_undo() const {
  const auto found =
      std::find_if(entries_.rbegin(), entries_.rend(), [](const Entry& each) { return !each.undone; });
  return found == entries_.rend() ? std::string() : found->step->info.words;
}

std::string History::next_redo() const {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [](const Entry& each) { return each.undone; });
  return found == entries_.end() ? std::string() : found->step->info.words;
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
  const Entry* const next = back ? undoable(client_id) : redoable(client_id);
  if (next == nullptr)
    return make_error(ErrorCode::failed_precondition, fmt::format("there is nothing to {}", name), name);
  if (std::string refused = refusal(*next, direction); !refused.empty())
    return make_error(ErrorCode::failed_precondition, std::move(refused), name);
  Document result =
      stepped(current_, next->step->delta, direction, last_of_all(*next) ? Given::freed : Given::kept);
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
  current_ = std::move(result);
  ++changes_;
  Line& own = lines_.at(client_id);
  const std::uint64_t number = own.numbers[back ? own.standing - 1 : own.standing];
  entry(number).undone = back;
  own.standing = back ? own.standing - 1 : own.standing + 1;
  undone_ = back ? undone_ + 1 : undone_ - 1;
  return entry(number).step->info.words;
}

// A value may be again as the step left it because somebody else has brought it back: that is their work too.
const History::Step* History::gone_on(const Entry& entry) const {
  const Step& own = *entry.step;
  for (auto each = entries_.rbegin(); each != entries_.rend() && each->step != entry.step; ++each) {
    if (each->undone || (each->signature & entry.signature) == 0) continue;
    const Step& other = *each->step;
    if (other.info.client_id != own.info.client_id && in_common(own.delta, other.delta)) return &other;
  }
  return nullptr;
}

bool History::last_of_all(const Entry& entry) const {
  for (auto each = entries_.rbegin(); each != entries_.rend() && each->step != entry.step; ++each) {
    if (each->step->info.client_id != entry.step->info.client_id) return false;
  }
  return true;
}

std::string History::refusal(const Entry& entry, Direction direction) const {
  const Step& step = *entry.step;
  std::string why;
  if (const auto found = conflict(current_, step.delta, direction)) {
    why = blame(entry, *found);
  } else if (const Step* const other = gone_on(entry)) {
    why = fmt::format("{} has changed {} since ({})", who(other->info.author, other->info.client_id),
                      describe(*in_common(step.delta, other->delta), step.delta), other->info.words);
  } else {
    return {};
  }
  return fmt::format("\"{}\" is not {}: {}", step.info.words,
                     direction == Direction::back ? "taken back" : "done again", why);
}

// The newest step of somebody else behind this one that stands explains what there is now; without one, the
// newest of all that was taken back.
std::string History::blame(const Entry& entry, const Conflict& conflict) const {
  const Step& step = *entry.step;
  const std::string what = describe(conflict, step.delta);
  for (const bool undone : {false, true}) {
    for (auto each = entries_.rbegin(); each != entries_.rend(); ++each) {
      if (!undone && each->step == entry.step) break;
      const StepInfo& info = each->step->info;
      if (each->undone != undone || info.client_id == step.info.client_id ||
          !touches(each->step->delta, conflict))
        continue;
      return fmt::format("{} has {} {} since ({})", who(info.author, info.client_id),
                         undone ? "taken back a change of" : "changed", what, info.words);
    }
  }
  return fmt::format("{} has changed since", what);
}

}  // namespace handloft::model
