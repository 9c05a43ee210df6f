// Waits between attempts: they grow to a limit, and two clients do not wait alike.

#include "common/net/backoff.h"

#include <gtest/gtest.h>

#include <set>

namespace handloft::net {
namespace {

using std::chrono::milliseconds;

TEST(Backoff, DoublesUpToItsLimitWithinHalfAWait) {
  Backoff backoff(milliseconds(100), milliseconds(1000), 7);
  for (const int full : {100, 200, 400, 800, 1000, 1000, 1000}) {
    const milliseconds wait = backoff.next();
    EXPECT_GE(wait.count(), full / 2);
    EXPECT_LE(wait.count(), full);
  }
  backoff.reset();
  EXPECT_LE(backoff.next().count(), 100);
}

TEST(Backoff, SpreadsClientsOverTheWait) {
  std::set<std::int64_t> waits;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Backoff backoff(milliseconds(1000), milliseconds(1000), seed);
    waits.insert(backoff.next().count() / 50);
  }
  EXPECT_GE(waits.size(), 10U) << "all ten slots of 50 ms between 500 and 1000";
  Backoff one(milliseconds(1000), milliseconds(1000), 1), again(milliseconds(1000), milliseconds(1000), 1);
  EXPECT_EQ(one.next(), again.next()) << "but the same seed waits alike";
}

TEST(Backoff, OfNothingIsNothing) {
  Backoff backoff(milliseconds(0), milliseconds(0), 3);
  EXPECT_EQ(backoff.next().count(), 0);
}

}  // namespace
}  // namespace handloft::net
