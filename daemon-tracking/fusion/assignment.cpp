#include "daemon-tracking/fusion/assignment.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace handloft::tracking {

std::vector<int> assign(const Eigen::MatrixXd& cost, double miss_cost) {
  // Every row gets a column of its own for missing, so that a full assignment always exists; the others may
  // not take it (a cost beyond every sum of allowed ones).
  const int rows = static_cast<int>(cost.rows());
  const int real_columns = static_cast<int>(cost.cols());
  const int columns = real_columns + rows;
  const double forbidden = (std::abs(miss_cost) + 1.0) * (rows + 1) * 4.0;
  const auto at = [&](int row, int column) {
    if (column >= real_columns) return column - real_columns == row ? miss_cost : forbidden;
    const double value = cost(row, column);
    return std::isfinite(value) && value < miss_cost ? std::max(value, -forbidden) : forbidden;
  };

  // Shortest augmenting paths with potentials; index 0 stands for "none".
  const double infinity = std::numeric_limits<double>::infinity();
  std::vector<double> row_potential(static_cast<std::size_t>(rows) + 1, 0.0);
  std::vector<double> column_potential(static_cast<std::size_t>(columns) + 1, 0.0);
  std::vector<int> row_of(static_cast<std::size_t>(columns) + 1, 0);
  std::vector<int> came_from(static_cast<std::size_t>(columns) + 1, 0);
  for (int row = 1; row <= rows; ++row) {
    row_of[0] = row;
    int column = 0;
    std::vector<double> shortest(static_cast<std::size_t>(columns) + 1, infinity);
    std::vector<char> done(static_cast<std::size_t>(columns) + 1, 0);
    do {
      done[static_cast<std::size_t>(column)] = 1;
      const int current = row_of[static_cast<std::size_t>(column)];
      double delta = infinity;
      int next = 0;
      for (int j = 1; j <= columns; ++j) {
        const auto jj = static_cast<std::size_t>(j);
        if (done[jj]) continue;
        const double reduced =
            at(current - 1, j - 1) - row_potential[static_cast<std::size_t>(current)] - column_potential[jj];
        if (reduced < shortest[jj]) {
          shortest[jj] = reduced;
          came_from[jj] = column;
        }
        if (shortest[jj] < delta) {
          delta = shortest[jj];
          next = j;
        }
      }
      for (int j = 0; j <= columns; ++j) {
        const auto jj = static_cast<std::size_t>(j);
        if (done[jj]) {
          row_potential[static_cast<std::size_t>(row_of[jj])] += delta;
          column_potential[jj] -= delta;
        } else {
          shortest[jj] -= delta;
        }
      }
      column = next;
    } while (row_of[static_cast<std::size_t>(column)] != 0);
    do {
      const int before = came_from[static_cast<std::size_t>(column)];
      row_of[static_cast<std::size_t>(column)] = row_of[static_cast<std::size_t>(before)];
      column = before;
    } while (column != 0);
  }
  std::vector<int> out(static_cast<std::size_t>(rows), -1);
  for (int j = 1; j <= real_columns; ++j) {
    const int row = row_of[static_cast<std::size_t>(j)];
    if (row > 0 && at(row - 1, j - 1) < miss_cost) out[static_cast<std::size_t>(row - 1)] = j - 1;
  }
  return out;
}

}  // namespace handloft::tracking
