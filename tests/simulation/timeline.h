#pragma once
// Virtual time of a simulation: what happens, in one order that the seed decides. No thread, no real clock;
// a minute of the simulated world takes as long as its events take to compute.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <utility>

#include "common/base/clock.h"
#include "common/base/work_queue.h"

namespace handloft::simulation {

/// splitmix64 (Steele, Lea and Flood 2014): the same numbers with every compiler, unlike std's distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31U);
  }
  std::uint64_t below(std::uint64_t n) { return n == 0 ? 0 : next() % n; }
  double unit() { return static_cast<double>(next() >> 11U) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  bool chance(double probability) { return unit() < probability; }

 private:
  std::uint64_t state_;
};

class Timeline {
 public:
  explicit Timeline(std::uint64_t seed) : random_(seed) {}

  const ManualClock& clock() const { return clock_; }
  TimePoint now() const { return clock_.now(); }
  double seconds() const { return to_seconds(now() - begin()); }
  Random& random() { return random_; }

  /// Of the same moment: in the order of the calls.
  void at(TimePoint time, std::function<void()> what) {
    events_.emplace(std::pair(std::max(time, now()), ++count_), std::move(what));
  }
  void after(double delay_s, std::function<void()> what) {
    at(now() + from_seconds(delay_s), std::move(what));
  }
  /// The next event, if it is before `end`.
  bool step(TimePoint end) {
    const auto first = events_.begin();
    if (first == events_.end() || first->first.first > end) return false;
    clock_.set(first->first.first);
    const auto what = std::move(first->second);
    events_.erase(first);
    what();
    return true;
  }
  static TimePoint begin() { return from_ns(1'000'000'000'000); }

 private:
  ManualClock clock_{begin()};
  Random random_;
  std::uint64_t count_ = 0;
  std::map<std::pair<TimePoint, std::uint64_t>, std::function<void()>> events_;
};

/// A thread of the simulated server: its work is done in order, each piece after a while that the seed
/// decides.
class SimulatedThread final : public WorkQueue, public std::enable_shared_from_this<SimulatedThread> {
 public:
  /// A piece of work takes up to `longest_s`. `around` is given each piece, to do it or not.
  SimulatedThread(Timeline& timeline, double longest_s,
                  std::function<void(const std::function<void()>&)> around = {})
      : timeline_(timeline), longest_s_(longest_s), around_(std::move(around)) {}

  void post(std::function<void()> work) override {
    if (stopped_) return;
    ++waiting_;
    most_waiting_ = std::max(most_waiting_, waiting_);
    // Busy until what came before is done.
    free_at_ = std::max(free_at_, timeline_.now()) + from_seconds(timeline_.random().unit() * longest_s_);
    timeline_.at(free_at_, [self = weak_from_this(), work = std::move(work)] {
      const auto alive = self.lock();
      if (!alive || alive->stopped_) return;
      --alive->waiting_;
      if (alive->around_) {
        alive->around_(work);
      } else {
        work();
      }
    });
  }
  /// Only before anything waits, and when nothing does: nothing is done out of turn.
  void run_and_wait(const std::function<void()>& work) override { work(); }
  void stop() override {
    stopped_ = true;
    around_ = {};
  }
  std::size_t waiting() const { return waiting_; }
  std::size_t most_waiting() const { return most_waiting_; }

 private:
  Timeline& timeline_;
  const double longest_s_;
  std::function<void(const std::function<void()>&)> around_;
  TimePoint free_at_ = Timeline::begin();
  std::size_t waiting_ = 0;
  std::size_t most_waiting_ = 0;
  bool stopped_ = false;
};

}  // namespace handloft::simulation
