#pragma once
// Sums of many long columns, each with a vector as its factor, and a shape moved by them: what one frame of a
// drag costs.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server-model/geometry/propagation.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

struct WeightedColumn {
  const double* values = nullptr;
  Vec3 factor = Vec3::Zero();
};
/// sums[axis * count + i] += sum_c columns[c].values[first + i] * columns[c].factor[axis], in the order given
/// whatever i is.
void add_columns(std::span<const WeightedColumn> columns, Eigen::Index first, Eigen::Index count,
                 double* sums);

struct MovedPoints {
  bool finite = true;     ///< Displacements are; else the points are of no use.
  bool any = false;       ///< Some point has other bits than at rest.
  double farthest_m = 0;  ///< Largest |coordinate|.
};
/// control: rest, with `moving` points (ascending) displaced by row i of `start` (none where it is empty) and
/// the columns' sum. One pass over memory, which is what a million points take their time for; the same bits
/// however it is parallel. `displacement`: not written where null, else by moving point.
MovedPoints move_points(std::span<const Vec3> rest, std::span<const std::uint32_t> moving,
                        const Eigen::MatrixX3d& start, std::span<const WeightedColumn> columns,
                        const ParallelFor& parallel, std::vector<Vec3>& control,
                        Eigen::MatrixX3d* displacement);

}  // namespace handloft::geometry
