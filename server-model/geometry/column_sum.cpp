#include "server-model/geometry/column_sum.h"

#include <algorithm>
#include <array>
#include <cmath>
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

using Add = void (*)(std::span<const WeightedColumn>, Eigen::Index, Eigen::Index, double*);

Add widest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return on_avx2::add;
#endif
  return on_any::add;
}

/// A task's moving points; a shape of fewer is one task.
constexpr std::size_t task_points = 1U << 16U;

}  // namespace

// The same bits by any width.
void add_columns(std::span<const WeightedColumn> columns, Eigen::Index first, Eigen::Index count,
                 double* sums) {
  static const Add add = widest();
  add(columns, first, count, sums);
}

MovedPoints move_points(std::span<const Vec3> rest, std::span<const std::uint32_t> moving,
                        const Eigen::MatrixX3d& start, std::span<const WeightedColumn> columns,
                        const ParallelFor& parallel, std::vector<Vec3>& control,
                        Eigen::MatrixX3d* displacement) {
  control.resize(rest.size());
  if (displacement != nullptr) displacement->resize(static_cast<Eigen::Index>(moving.size()), 3);
  const std::size_t tasks = std::max<std::size_t>(1, (moving.size() + task_points - 1) / task_points);
  std::vector<MovedPoints> parts(tasks);
  const auto move = [&](std::size_t task) {
    MovedPoints& part = parts[task];
    const std::size_t end = std::min(moving.size(), (task + 1) * task_points);
    std::size_t point = task == 0 ? 0 : moving[task * task_points];
    const auto stay = [&](std::size_t until) {
      for (; point < until; ++point) {
        control[point] = rest[point];
        part.farthest_m = std::max(part.farthest_m, rest[point].cwiseAbs().maxCoeff());
      }
    };
    std::array<double, 3 * block> sums;
    for (std::size_t first = task * task_points; first < end; first += block) {
      const auto at = static_cast<Eigen::Index>(first);
      const auto count = static_cast<Eigen::Index>(std::min<std::size_t>(block, end - first));
      Eigen::Map<Eigen::MatrixX3d> moved(sums.data(), count, 3);
      if (start.rows() > 0) {
        moved = start.middleRows(at, count);
      } else {
        moved.setZero();
      }
      add_columns(columns, at, count, sums.data());
      part.finite = part.finite && moved.allFinite();
      if (displacement != nullptr) displacement->middleRows(at, count) = moved;
      for (Eigen::Index i = 0; i < count; ++i) {
        stay(moving[first + static_cast<std::size_t>(i)]);
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
          const double before = rest[point][axis];
          const double now = before + sums[static_cast<std::size_t>(axis * count + i)];
          control[point][axis] = now;
          part.any = part.any || now != before;
          part.farthest_m = std::max(part.farthest_m, std::abs(now));
        }
        ++point;
      }
    }
    stay(task + 1 < tasks ? moving[end] : rest.size());
  };
  if (tasks == 1) {
    move(0);
  } else {
    parallel(tasks, move);
  }
  MovedPoints all;
  for (const MovedPoints& part : parts) {
    all.finite = all.finite && part.finite;
    all.any = all.any || part.any;
    all.farthest_m = std::max(all.farthest_m, part.farthest_m);
  }
  return all;
}

}  // namespace handloft::geometry
