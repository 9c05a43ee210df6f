#include "server-model/geometry/column_sum.h"

#include <algorithm>
#include <cstring>

#include "server-model/geometry/wide.h"

namespace handloft::geometry {

namespace {

/// So many rows at a time: their sums stay in the first cache while all columns pass.
constexpr Eigen::Index block = 512;
/// So many columns at a time, so that sums are loaded and stored once for all of them.
constexpr std::size_t group = 4;

#define HANDLOFT_TARGET
#define HANDLOFT_WIDTH on_any
#include "server-model/geometry/column_sum_loop.inc"
#undef HANDLOFT_WIDTH
#undef HANDLOFT_TARGET

#if defined(__x86_64__)
#define HANDLOFT_TARGET __attribute__((target("avx2")))
#define HANDLOFT_WIDTH on_avx2
#include "server-model/geometry/column_sum_loop.inc"
#undef HANDLOFT_WIDTH
#undef HANDLOFT_TARGET
#endif

using Add = void (*)(const std::vector<WeightedColumn>&, Eigen::MatrixX3d&);

Add widest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return on_avx2::add;
#endif
  return on_any::add;
}

}  // namespace

// The same bits by any width.
void add_columns(const std::vector<WeightedColumn>& columns, Eigen::MatrixX3d& sums) {
  static const Add add = widest();
  add(columns, sums);
}

}  // namespace handloft::geometry
