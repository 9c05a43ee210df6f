#include "daemon-tracking/fusion/assignment.h"

#include <gtest/gtest.h>

#include <limits>

namespace handloft::tracking {
namespace {

TEST(Assignment, TheCheapestTotalWinsNotTheCheapestPair) {
  Eigen::MatrixXd cost(2, 2);
  cost << 1, 2, 1.5, 9;  // Greedy takes (0, 0) and pays 10; the best is 3.5
  EXPECT_EQ(assign(cost, 20), (std::vector<int>{1, 0}));
}

TEST(Assignment, MissesCostLess) {
  Eigen::MatrixXd cost(3, 2);
  cost << 1, 8, 2, 8, 3, 8;
  EXPECT_EQ(assign(cost, 5), (std::vector<int>{0, -1, -1}));  // Two tips never take one blob
}

TEST(Assignment, NoColumnsNaNAndInfinity) {
  EXPECT_EQ(assign(Eigen::MatrixXd(3, 0), 5), (std::vector<int>{-1, -1, -1}));
  EXPECT_TRUE(assign(Eigen::MatrixXd(0, 3), 5).empty());
  Eigen::MatrixXd cost(2, 2);
  cost << std::numeric_limits<double>::quiet_NaN(), 1, std::numeric_limits<double>::infinity(), 2;
  EXPECT_EQ(assign(cost, 5), (std::vector<int>{1, -1}));
}

}  // namespace
}  // namespace handloft::tracking
