#include "server-model/geometry/grid_loops.h"

#include "server-model/geometry/gauss_grid.h"

namespace handloft::geometry {

namespace {

constexpr std::size_t octet = 8;
using Octet = double __attribute__((vector_size(octet * sizeof(double))));

constexpr int exp_degree = 12;
constexpr double inverse_factorial[exp_degree + 1] = {  // NOLINT(modernize-avoid-c-arrays)
    1.0,        1.0,         1.0 / 2,      1.0 / 6,       1.0 / 24,       1.0 / 120,      1.0 / 720,
    1.0 / 5040, 1.0 / 40320, 1.0 / 362880, 1.0 / 3628800, 1.0 / 39916800, 1.0 / 479001600};

#define HANDLOFT_TARGET
#define HANDLOFT_WIDTH on_any
#include "server-model/geometry/grid_loops.inc"
#undef HANDLOFT_WIDTH
#undef HANDLOFT_TARGET

#if defined(__x86_64__)
#define HANDLOFT_TARGET __attribute__((target("avx2")))
#define HANDLOFT_WIDTH on_avx2
#include "server-model/geometry/grid_loops.inc"
#undef HANDLOFT_WIDTH
#undef HANDLOFT_TARGET

#define HANDLOFT_TARGET __attribute__((target("avx512f,avx512dq")))
#define HANDLOFT_WIDTH on_avx512
#include "server-model/geometry/grid_loops.inc"
#undef HANDLOFT_WIDTH
#undef HANDLOFT_TARGET
#endif

GridLoops widest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return on_avx512::loops;
  if (__builtin_cpu_supports("avx2")) return on_avx2::loops;
#endif
  return on_any::loops;
}

}  // namespace

const GridLoops& grid_loops() {
  static const GridLoops loops = widest();
  return loops;
}

}  // namespace handloft::geometry
