// A shape moved by sums of columns (D21), against the sums written out; by tasks as in turn.

#include "server-model/geometry/column_sum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/server-model/geometry/stiffness_problems.h"

namespace handloft::geometry {
namespace {

TEST(MovePoints, D21_AddsColumnsToWhatMovesAndLeavesTheRest) {
  constexpr std::size_t count = 200'003;  // Some tasks, the last one short.
  std::vector<Vec3> rest;
  std::vector<std::uint32_t> moving;
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = static_cast<double>(i);
    rest.emplace_back(std::sin(x), std::cos(x), 1e-3 * std::sin(3 * x));
    if (i % 5 != 0) moving.push_back(static_cast<std::uint32_t>(i));
  }
  Eigen::MatrixXd values(static_cast<Eigen::Index>(moving.size()), 5);
  for (Eigen::Index i = 0; i < values.rows(); ++i)
    for (Eigen::Index c = 0; c < 5; ++c) values(i, c) = std::sin(static_cast<double>(7 * i + c));
  std::vector<WeightedColumn> columns;
  for (Eigen::Index c = 0; c < 5; ++c)
    columns.push_back({values.col(c).data(), Vec3(0.1, -0.2, 0.3) * static_cast<double>(c + 1)});
  std::vector<Vec3> in_turn(3, Vec3::Ones()), in_tasks(count, Vec3::Constant(7));
  Eigen::MatrixX3d displacement;
  const MovedPoints moved = move_points(rest, moving, {}, columns, run_in_turn, in_turn, &displacement);
  const MovedPoints again = move_points(rest, moving, {}, columns, on_two_threads, in_tasks, nullptr);
  EXPECT_EQ(in_turn, in_tasks);
  EXPECT_TRUE(moved.finite && moved.any && again.any);
  EXPECT_EQ(moved.farthest_m, again.farthest_m);
  double farthest = 0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Vec3 expected = rest[i];
    if (next < moving.size() && moving[next] == i) {
      const auto row = static_cast<Eigen::Index>(next++);
      Vec3 sum = Vec3::Zero();
      for (std::size_t c = 0; c < 5; ++c)
        sum += values(row, static_cast<Eigen::Index>(c)) * columns[c].factor;
      ASSERT_EQ(Vec3(displacement.row(row).transpose()), sum) << i;
      expected += sum;
    }
    ASSERT_EQ(in_turn[i], expected) << i;
    farthest = std::max(farthest, expected.cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(moved.farthest_m, farthest);

  for (WeightedColumn& column : columns) column.factor.setZero();
  EXPECT_FALSE(move_points(rest, moving, {}, columns, run_in_turn, in_turn, nullptr).any);
  EXPECT_EQ(in_turn, rest);
  values(70'000, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(move_points(rest, moving, {}, columns, run_in_turn, in_turn, nullptr).finite);
}

}  // namespace
}  // namespace handloft::geometry
