#include "server-model/geometry/column_sum.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "server-model/geometry/wide.h"

namespace handloft::geometry {

namespace {

/// So many rows at a time: their sums stay in the first cache while all columns pass.
constexpr Eigen::Index block = 512;
/// So many columns at a time, so that sums are loaded and stored once for all of them.
constexpr std::size_t group = 4;

// One coordinate of rows [first, first + count).
template <std::size_t columns>
void add_group(const WeightedColumn* from, Eigen::Index axis, Eigen::Index first, Eigen::Index count,
               double* sums) {
  std::array<double, columns> factor;
  std::array<const double*, columns> values;
  for (std::size_t c = 0; c < columns; ++c) {
    factor[c] = from[c].factor[axis];
    values[c] = from[c].values + first;
  }
  Eigen::Index i = 0;
  for (; i + lanes <= count; i += lanes) {
    Wide sum;
    std::memcpy(&sum, sums + i, sizeof sum);
    for (std::size_t c = 0; c < columns; ++c) {
      Wide value;
      std::memcpy(&value, values[c] + i, sizeof value);
      sum += factor[c] * value;
    }
    std::memcpy(sums + i, &sum, sizeof sum);
  }
  for (; i < count; ++i)
    for (std::size_t c = 0; c < columns; ++c) sums[i] += factor[c] * values[c][i];
}

}  // namespace

void add_columns(const std::vector<WeightedColumn>& columns, Eigen::MatrixX3d& sums) {
  for (Eigen::Index first = 0; first < sums.rows(); first += block) {
    const Eigen::Index count = std::min(block, sums.rows() - first);
    std::size_t c = 0;
    for (; c + group <= columns.size(); c += group)
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        add_group<group>(&columns[c], axis, first, count, sums.col(axis).data() + first);
    for (; c < columns.size(); ++c)
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        add_group<1>(&columns[c], axis, first, count, sums.col(axis).data() + first);
  }
}

}  // namespace handloft::geometry
