// Invariants of association, debouncing and prediction (T7 to T9).

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "common/base/motion_prediction.h"
#include "daemon-tracking/fusion/assignment.h"
#include "daemon-tracking/fusion/contact_debouncer.h"

namespace handloft::tracking {
namespace {

double cheapest(const Eigen::MatrixXd& cost, double miss, int row, std::set<int>& taken) {
  if (row == cost.rows()) return 0.0;
  double best = miss + cheapest(cost, miss, row + 1, taken);
  for (int column = 0; column < cost.cols(); ++column) {
    if (taken.count(column) != 0 || cost(row, column) >= miss) continue;
    taken.insert(column);
    best = std::min(best, cost(row, column) + cheapest(cost, miss, row + 1, taken));
    taken.erase(column);
  }
  return best;
}

TEST(FusionProperty, AssignmentIsTheCheapestOfAll) {
  EXPECT_TRUE(rc::check([] {
    const int rows = *rc::gen::inRange(1, 6), columns = *rc::gen::inRange(0, 6);
    Eigen::MatrixXd cost(rows, columns);
    for (int i = 0; i < cost.size(); ++i) cost.data()[i] = *rc::gen::inRange(0, 200) * 0.1;
    constexpr double miss = 12.0;
    const auto found = assign(cost, miss);
    double total = 0.0;
    std::set<int> taken;
    for (int row = 0; row < rows; ++row) {
      const int column = found[static_cast<std::size_t>(row)];
      RC_ASSERT(column < columns);
      RC_ASSERT(column < 0 || taken.insert(column).second);
      total += column < 0 ? miss : cost(row, column);
    }
    std::set<int> none;
    RC_ASSERT(std::abs(total - cheapest(cost, miss, 0, none)) < 1e-9);
  }));
}

TEST(FusionProperty, DebouncedStateChangesOnlyAfterRestAndIsDatedInThePast) {
  EXPECT_TRUE(rc::check([] {
    const DebounceOptions options;
    ContactDebouncer pads(options);
    const auto edges = *rc::gen::container<std::vector<std::pair<int, bool>>>(
        rc::gen::pair(rc::gen::inRange(1, 40), rc::gen::arbitrary<bool>()));
    TimePoint now = from_ns(1'000'000'000);
    pads.feed(now, 0);
    TimePoint last_raw_change = now;
    bool raw = false;
    std::uint8_t before = 0;
    for (const auto& [gap_ms, closed] : edges) {
      now += std::chrono::milliseconds(gap_ms);
      pads.feed(now, closed ? 1 : 0);
      if (pads.bits() != before) {
        // It had rested for long enough before this report, and the date is not later than when that rest
        // began.
        RC_ASSERT(now - last_raw_change >= ((pads.bits() & 1) != 0 ? options.press : options.release));
        RC_ASSERT(pads.changed(0) <= last_raw_change);
        RC_ASSERT((pads.bits() & 1) == (raw ? 1 : 0));
        before = pads.bits();
      }
      if (closed != raw) last_raw_change = now;
      raw = closed;
    }
    pads.advance(now + std::chrono::milliseconds(100));
    RC_ASSERT((pads.bits() & 1) == (raw ? 1 : 0));
  }));
}

TEST(FusionProperty, PredictionNeverRunsAheadOfTheHorizon) {
  EXPECT_TRUE(rc::check([] {
    const double ahead = *rc::gen::inRange(-1000, 3000) * 1e-3;
    const double more = ahead + *rc::gen::inRange(0, 1000) * 1e-3;
    const PredictionLimits limits;
    RC_ASSERT(motion_time(ahead) >= 0.0);
    RC_ASSERT(motion_time(more) >= motion_time(ahead));
    RC_ASSERT(motion_time(ahead) <= std::max(ahead, 0.0) + 1e-12);
    RC_ASSERT(motion_time(ahead) <= limits.horizon_s + limits.ease_s);
    RC_ASSERT(remaining_speed(more) <= remaining_speed(ahead));
  }));
}

}  // namespace
}  // namespace handloft::tracking
