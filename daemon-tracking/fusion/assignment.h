#pragma once
// The assignment problem: rows to columns at the least total cost (H. W. Kuhn 1955; the shortest augmenting
// path form of Jonker and Volgenant 1987), rows may stay unassigned at a cost.

#include <Eigen/Core>
#include <vector>

namespace handloft::tracking {

/// The column of each row, -1 where missing it costs less. `cost` is rows x columns; entries that are not
/// finite or at least `miss_cost` are never taken. Each column goes to one row at most. O((rows)^2 (rows +
/// columns)).
std::vector<int> assign(const Eigen::MatrixXd& cost, double miss_cost);

}  // namespace handloft::tracking
