#include "server-model/geometry/stiffness_loops.h"

namespace handloft::geometry {

namespace {

#define HANDLOFT_TARGET
#define HANDLOFT_WIDTH on_any
#define HANDLOFT_LANES 2
#define HANDLOFT_TILE_ROWS 2
#define HANDLOFT_TILE_COLUMNS 6
#include "server-model/geometry/stiffness_loops.inc"
#undef HANDLOFT_TILE_COLUMNS
#undef HANDLOFT_TILE_ROWS
#undef HANDLOFT_LANES
#undef HANDLOFT_WIDTH
#undef HANDLOFT_TARGET

#if defined(__x86_64__)
#define HANDLOFT_TARGET __attribute__((target("avx2")))
#define HANDLOFT_WIDTH on_avx2
#define HANDLOFT_LANES 4
#define HANDLOFT_TILE_ROWS 2
#define HANDLOFT_TILE_COLUMNS 6
#include "server-model/geometry/stiffness_loops.inc"
#undef HANDLOFT_TILE_COLUMNS
#undef HANDLOFT_TILE_ROWS
#undef HANDLOFT_LANES
#undef HANDLOFT_WIDTH
#undef HANDLOFT_TARGET

#define HANDLOFT_TARGET __attribute__((target("avx512f,avx512dq")))
#define HANDLOFT_WIDTH on_avx512
#define HANDLOFT_LANES 8
#define HANDLOFT_TILE_ROWS 1
#define HANDLOFT_TILE_COLUMNS 24
#include "server-model/geometry/stiffness_loops.inc"
#undef HANDLOFT_TILE_COLUMNS
#undef HANDLOFT_TILE_ROWS
#undef HANDLOFT_LANES
#undef HANDLOFT_WIDTH
#undef HANDLOFT_TARGET
#endif

StiffnessLoops widest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return on_avx512::loops;
  if (__builtin_cpu_supports("avx2")) return on_avx2::loops;
#endif
  return on_any::loops;
}

}  // namespace

const StiffnessLoops& stiffness_loops() {
  static const StiffnessLoops loops = widest();
  return loops;
}

}  // namespace handloft::geometry
