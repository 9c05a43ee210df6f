#pragma once
// Measurements come in order of arrival, filters want order of capture. This keeps the last states with the
// measurements that led to them; a late one is put in its place and those after it are applied again (an
// exact treatment of out-of-sequence measurements, affordable as histories are a fraction of a second).
// Bounded memory.

#include <algorithm>
#include <cstddef>
#include <deque>
#include <utility>

#include "common/base/clock.h"

namespace handloft::tracking {

/// How a measurement went in.
enum class Insertion { in_order, replayed, too_late };

/// State and Measurement are copyable values; Measurement has a member `time`.
template <typename State, typename Measurement>
class ReplayHistory {
 public:
  struct Entry {
    Measurement measurement;
    State after;
  };

  /// Applies `measurement` by `apply(State&, const Measurement&)`; states in order of capture, equal times in
  /// order of arrival. Keeps entries younger than `keep`, at most `max_entries`; refuses a measurement more
  /// than `latest` older than the newest, or older than all that is kept.
  template <typename Apply>
  Insertion insert(Measurement measurement, const State& initial, Duration keep, Duration latest,
                   const Apply& apply) {
    auto position = entries_.end();
    while (position != entries_.begin() && std::prev(position)->measurement.time > measurement.time)
      --position;
    const bool late = position != entries_.end();
    if (late &&
        (position == entries_.begin() || entries_.back().measurement.time - measurement.time > latest))
      return Insertion::too_late;
    State state = position == entries_.begin() ? initial : std::prev(position)->after;
    apply(state, measurement);
    auto entry = entries_.insert(position, Entry{std::move(measurement), std::move(state)});
    for (auto next = std::next(entry); next != entries_.end(); ++next) {
      next->after = std::prev(next)->after;
      apply(next->after, next->measurement);
    }
    const TimePoint newest = entries_.back().measurement.time;
    while (entries_.size() > 1 &&
           (entries_.size() > max_entries || newest - entries_.front().measurement.time > keep))
      entries_.pop_front();
    return late ? Insertion::replayed : Insertion::in_order;
  }

  static constexpr std::size_t max_entries = 256;

  bool empty() const { return entries_.empty(); }
  const State& newest() const { return entries_.back().after; }
  const std::deque<Entry>& entries() const { return entries_; }
  void clear() { entries_.clear(); }

 private:
  std::deque<Entry> entries_;  ///< Oldest first
};

}  // namespace handloft::tracking
