#include "daemon-tracking/main/bounded_queue.h"

#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

namespace handloft::tracking {
namespace {

TEST(BoundedQueue, KeepsOrderAndBound) {
  BoundedQueue<int> queue(2);
  EXPECT_TRUE(queue.push(1));
  EXPECT_TRUE(queue.push(2));
  EXPECT_FALSE(queue.push(3)) << "full: told so, never blocked";
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_TRUE(queue.push(4));
  EXPECT_EQ(queue.pop(), 2);
  EXPECT_EQ(queue.pop(), 4);
}

TEST(BoundedQueue, GivesOutWhatWaitsAfterClosing) {
  BoundedQueue<std::unique_ptr<int>> queue(4);
  EXPECT_TRUE(queue.push(std::make_unique<int>(5)));
  queue.close();
  EXPECT_FALSE(queue.push(std::make_unique<int>(6)));
  const auto left = queue.pop();
  ASSERT_TRUE(left.has_value());
  EXPECT_EQ(**left, 5);
  EXPECT_FALSE(queue.pop().has_value());
}

TEST(BoundedQueue, ClosingWakesWhoWaits) {
  BoundedQueue<int> queue(1);
  std::vector<int> got;
  std::thread reader([&] {
    while (const auto value = queue.pop()) got.push_back(*value);
  });
  EXPECT_TRUE(queue.push(9));
  queue.close();
  reader.join();
  EXPECT_EQ(got, std::vector<int>{9});
}

}  // namespace
}  // namespace handloft::tracking
