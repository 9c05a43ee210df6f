#pragma once
// Sums of many long columns, each with a vector as its factor: what one frame of a drag costs.

#include <Eigen/Core>
#include <vector>

#include "server-model/geometry/types.h"

namespace handloft::geometry {

struct WeightedColumn {
  const double* values = nullptr;
  Vec3 factor = Vec3::Zero();
};
/// sums.row(i) += sum_c columns[c].values[i] * columns[c].factor^T, in the order given whatever i is.
void add_columns(const std::vector<WeightedColumn>& columns, Eigen::MatrixX3d& sums);

}  // namespace handloft::geometry
