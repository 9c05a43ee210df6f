// What a snapshot keeps of a history, and a history from it. What was left out still counts where somebody
// has to forget a step, so that the same are forgotten as where nothing was left out.

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server-model/model/history.h"

namespace handloft::model {

namespace {

/// What one line has of a sort, and how many of them it may keep.
struct Share {
  std::size_t has = 0;
  std::uint64_t latest = 0;  ///< The number of the one that goes last.
  std::size_t keeps = 0;
};

/// All together keep at most `most`: each as many as the others, or all. What cannot be shared out equally
/// goes one each to those who were at it last, so that more lines than steps do not keep none.
void share_out(std::vector<Share>& shares, std::size_t most) {
  std::vector<Share*> by_count;
  by_count.reserve(shares.size());
  for (Share& share : shares) by_count.push_back(&share);
  std::sort(by_count.begin(), by_count.end(), [](const Share* a, const Share* b) { return a->has < b->has; });
  std::size_t left = most;
  auto from = by_count.begin();
  for (; from != by_count.end(); ++from) {
    if ((*from)->has > left / static_cast<std::size_t>(by_count.end() - from)) break;
    left -= (*from)->keeps = (*from)->has;
  }
  if (from == by_count.end()) return;
  const std::size_t sharers = static_cast<std::size_t>(by_count.end() - from);
  std::sort(from, by_count.end(), [](const Share* a, const Share* b) { return a->latest > b->latest; });
  std::size_t rest = left % sharers;
  for (; from != by_count.end(); ++from) {
    (*from)->keeps = left / sharers + (rest > 0 ? 1 : 0);
    if (rest > 0) --rest;
  }
}

bool keeps_all(const std::vector<Share>& shares) {
  return std::all_of(shares.begin(), shares.end(),
                     [](const Share& share) { return share.keeps == share.has; });
}

Error damaged(std::string message, const char* field) {
  return make_error(ErrorCode::data_corrupt, std::move(message), field);
}

}  // namespace

History::Kept History::kept(std::size_t max_steps) const {
  Kept out;
  out.current = current_;
  out.last_step = last_step_;
  out.newest = newest_;
  out.before = before_;
  out.forgotten_highest = forgotten_highest_;
  out.forgotten_sequence = forgotten_sequence_;

  std::vector<Share> standing, undone;
  for (const auto& [client, line] : lines_) {
    const std::size_t first_undone = std::max(line.standing, line.early);
    standing.push_back({.has = line.standing - std::min(line.standing, line.early),
                        .latest = line.standing > 0 ? line.places[line.standing - 1].number : 0});
    undone.push_back({.has = line.places.size() - first_undone,
                      .latest = first_undone < line.places.size() ? line.places[first_undone].number : 0});
  }
  share_out(standing, max_steps);
  share_out(undone, max_steps);
  // Of those of an earlier rule the newest where all others are kept; none rather than a redo without the
  // steps that come before it.
  std::uint64_t first = last_step_ + 1;
  if (keeps_all(standing) && keeps_all(undone)) {
    std::size_t stand = 0, back = 0;
    for (auto each = entries_.rbegin(); each != entries_.rend(); ++each) {
      if (++(each->second.undone ? back : stand) > max_steps) break;
      first = each->first;
    }
    if (!undone_.empty() && *undone_.begin() < first) first = last_step_ + 1;
  }

  std::vector<std::uint64_t> numbers;
  std::size_t i = 0;
  for (const auto& [client, line] : lines_) {
    std::size_t early_left = 0;
    while (early_left < line.early && line.places[line.early - 1 - early_left].number >= first) ++early_left;
    const std::size_t early_gone = line.early - early_left;
    const std::size_t older = standing[i].has - standing[i].keeps;
    // No redo without the steps that come before it.
    const bool redo = early_gone <= line.standing;
    const std::size_t newer = undone[i].has - (redo ? undone[i].keeps : 0);
    ++i;
    const std::size_t begin = early_gone + older;
    const std::size_t end = line.places.size() - newer;
    for (std::size_t place = begin; place < end; ++place) numbers.push_back(line.places[place].number);
    out.early += early_left;
    const std::size_t stood = std::min(begin, line.standing);
    if (stood > 0)
      out.forgotten_sequence =
          std::max(out.forgotten_sequence, step_at(line.places[stood - 1].number).info.sequence);
    const Kept::Gone gone{client, line.older + older, line.newer + newer, line.before(stood)};
    if (begin == end && gone.older + gone.newer == 0) {
      out.forgotten_highest.shape = std::max(out.forgotten_highest.shape, gone.highest.shape);
      out.forgotten_highest.comment = std::max(out.forgotten_highest.comment, gone.highest.comment);
    } else if (gone.older + gone.newer + gone.highest.shape + gone.highest.comment > 0) {
      out.gone.push_back(gone);
    }
  }
  std::sort(numbers.begin(), numbers.end());
  std::vector<StepIndex::Kept> steps;
  for (const std::uint64_t number : numbers) {
    const Entry& entry = entries_.at(number);
    out.steps.push_back({number, entry});
    steps.push_back({number, &entry.step->delta});
  }
  out.forgotten = index_.forgotten_but(steps);
  return out;
}

Result<History> History::restored(Kept kept, std::size_t max_steps) {
  History history(std::move(kept.current), max_steps);
  const std::size_t steps = kept.steps.size();
  if (kept.early > steps)
    return damaged(fmt::format("found {} steps of an earlier rule among {}", kept.early, steps), "early");
  std::uint64_t counted = steps;
  for (const Kept::Gone& gone : kept.gone) {
    counted = gone.older > most_counted || gone.newer > most_counted ? most_counted + 1
                                                                     : counted + gone.older + gone.newer;
    if (counted > most_counted) return damaged(fmt::format("found more than {} steps", most_counted), "gone");
    const auto [at, is_new] = history.lines_.try_emplace(gone.client_id);
    if (!is_new) return damaged(fmt::format("found client {} twice", gone.client_id), "gone");
    at->second.older = static_cast<std::size_t>(gone.older);
    at->second.newer = static_cast<std::size_t>(gone.newer);
    at->second.forgotten = gone.highest;
  }
  for (std::size_t i = 0; i < steps; ++i) {
    const std::uint64_t number = kept.steps[i].number;
    if (number <= history.last_step_ || number > kept.last_step) {
      return damaged(fmt::format("found step {} after {}, expected more and at most {}", number,
                                 history.last_step_, kept.last_step),
                     "steps");
    }
    history.last_step_ = number;
    Entry& entry = kept.steps[i].entry;
    const bool undone = entry.undone;
    Line& line = history.add(number, std::move(entry));
    if (!undone && line.standing != line.places.size())
      return damaged(fmt::format("found step {} behind one of its client that is taken back", i), "steps");
    if (i >= kept.early) continue;
    if (line.older > 0) return damaged(fmt::format("found step {} before those that are gone", i), "early");
    ++line.early;
    ++history.early_;
  }
  if (kept.newest.number > kept.last_step || kept.before.number > kept.last_step ||
      (kept.before.number != 0 &&
       (kept.before.number >= kept.newest.number || kept.before.client_id == kept.newest.client_id))) {
    return damaged(fmt::format("found step {} of client {} before step {} of client {}", kept.before.number,
                               kept.before.client_id, kept.newest.number, kept.newest.client_id),
                   "newest");
  }
  history.last_step_ = kept.last_step;
  history.newest_ = kept.newest;
  history.before_ = kept.before;
  history.forgotten_highest_ = kept.forgotten_highest;
  history.forgotten_sequence_ = kept.forgotten_sequence;
  history.index_.remember(kept.forgotten);
  for (auto at = history.lines_.begin(); at != history.lines_.end();) history.settle(at++);
  history.make_room(0, Going::forgotten);
  return history;
}

}  // namespace handloft::model
