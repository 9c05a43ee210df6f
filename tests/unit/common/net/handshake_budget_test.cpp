// How many TLS handshakes are begun in a second (A1), as the clock says.

#include "common/net/handshake_budget.h"

#include <gtest/gtest.h>

#include <string>

namespace handloft::net {
namespace {

using namespace std::chrono_literals;
using Time = HandshakeBudget::Time;

int taken(HandshakeBudget& budget, const std::string& address, Time now, int wanted) {
  int count = 0;
  for (int i = 0; i < wanted; ++i) count += budget.take(address, now) ? 1 : 0;
  return count;
}

TEST(HandshakeBudget, AnAddressHasTwoSecondsWorthAtOnceAndThenItsRate_A1) {
  HandshakeBudget budget({.per_s = 1000, .per_s_per_address = 30});
  Time now{};
  EXPECT_EQ(taken(budget, "192.0.2.1", now, 1000), 60);
  for (int second = 0; second < 3; ++second) {
    now += 1s;
    EXPECT_EQ(taken(budget, "192.0.2.1", now, 1000), 30);
  }
  EXPECT_EQ(taken(budget, "192.0.2.2", now, 1000), 60) << "another address has its own";
  now += 1h;
  EXPECT_EQ(taken(budget, "192.0.2.1", now, 1000), 60) << "no more for having been quiet long";
}

TEST(HandshakeBudget, ManyAddressesTogetherHaveTheCommonRate_A1) {
  HandshakeBudget budget({.per_s = 100, .per_s_per_address = 30});
  Time now{};
  // They are never quiet: each comes whenever it may.
  const auto all = [&] {
    int count = 0;
    for (int host = 0; host < 50; ++host) count += taken(budget, std::to_string(host), now, 100);
    return count;
  };
  const int at_once = all();
  EXPECT_LE(at_once, 200);
  int in_ten_seconds = 0;
  for (int step = 0; step < 100; ++step) {
    now += 100ms;
    in_ten_seconds += all();
  }
  EXPECT_LE(at_once + in_ten_seconds, 200 + 10 * 100);
  EXPECT_GE(in_ten_seconds, 500);
}

// The attackers leave a quarter of the common budget, whoever they are, to those who were quiet.
TEST(HandshakeBudget, ANewcomerComesInBesideACrowd_A1) {
  HandshakeBudget budget({.per_s = 100, .per_s_per_address = 30});
  Time now{};
  int came_in = 0;
  for (int step = 0; step < 1000; ++step) {
    now += 10ms;
    for (int host = 0; host < 20; ++host) taken(budget, std::to_string(host), now, 10);
    if (step % 50 == 49) came_in += budget.take("newcomer", now) ? 1 : 0;  // Twice a second.
  }
  EXPECT_EQ(came_in, 20);
}

TEST(HandshakeBudget, ForgetsWhoIsQuietAndIsBounded) {
  HandshakeBudget budget({.per_s = 0, .per_s_per_address = 1});
  Time now{};
  for (int host = 0; host < 10'000; ++host) budget.take(std::to_string(host), now);
  EXPECT_LE(budget.remembered(), 4097U);
  now += 10s;
  EXPECT_TRUE(budget.take("newcomer", now));
  EXPECT_LE(budget.remembered(), 2U);
}

TEST(HandshakeBudget, ZeroIsAnyNumberAndRatesChange) {
  HandshakeBudget budget({.per_s = 0, .per_s_per_address = 0});
  Time now{};
  EXPECT_EQ(taken(budget, "192.0.2.1", now, 5000), 5000);
  budget.set_rates({.per_s = 0, .per_s_per_address = 2});
  EXPECT_EQ(taken(budget, "192.0.2.1", now, 100), 4);
}

}  // namespace
}  // namespace handloft::net
