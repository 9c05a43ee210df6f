#include "server-model/geometry/bernstein_field.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace handloft::geometry::detail {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
/// Of the largest coefficient: slopes below may be rounding.
constexpr double slope_margin = 1e-13;

}  // namespace

FieldShape shape_of(std::span<const double> field, int nu, int nv) {
  const auto rows = static_cast<std::size_t>(nu) + 1, columns = static_cast<std::size_t>(nv) + 1;
  double uu = infinity, vv = infinity, uv = 0, size = 0;
  std::array<double, 2> least_rise = {infinity, infinity}, most_rise = {-infinity, -infinity};
  const auto see = [&](std::size_t axis, double rise) {
    least_rise[axis] = std::min(least_rise[axis], rise);
    most_rise[axis] = std::max(most_rise[axis], rise);
  };
  for (std::size_t a = 0; a < rows; ++a) {
    const double* f = field.data() + a * columns;
    for (std::size_t b = 0; b < columns; ++b) {
      size = std::max(size, std::abs(f[b]));
      if (a + 1 < rows) see(0, f[b + columns] - f[b]);
      if (b + 1 < columns) see(1, f[b + 1] - f[b]);
      if (a + 2 < rows) uu = std::min(uu, f[b] - 2 * f[b + columns] + f[b + 2 * columns]);
      if (b + 2 < columns) vv = std::min(vv, f[b] - 2 * f[b + 1] + f[b + 2]);
      if (a + 1 < rows && b + 1 < columns) {
        uv = std::max(uv, std::abs(f[b] - f[b + 1] - f[b + columns] + f[b + columns + 1]));
      }
    }
  }
  uu *= nu * (nu - 1);
  if (nv > 0) vv *= nv * (nv - 1);
  uv *= nu * nv;
  FieldShape shape;
  shape.bends_up = {uu > 0, vv > 0};
  shape.convex = uu > 0 && vv > 0 && (nv == 0 || uu * vv > uv * uv);
  for (std::size_t axis = 0; axis < (nv > 0 ? 2U : 1U); ++axis) {
    if (least_rise[axis] > slope_margin * size) shape.slope[axis] = 1;
    if (most_rise[axis] < -slope_margin * size) shape.slope[axis] = -1;
  }
  return shape;
}

void split_field(const double* in, int nu, int nv, const Vec2& at, double* out) {
  const auto rows = static_cast<std::size_t>(nu) + 1, columns = static_cast<std::size_t>(nv) + 1;
  const std::size_t size = rows * columns;
  // In u: into the first and the last place of the children.
  double* low = out;
  double* high = out + (nv > 0 ? 2 * size : size);
  std::copy_n(in, size, high);
  for (std::size_t step = 0; step < rows; ++step) {
    std::copy_n(high, columns, low + step * columns);
    for (std::size_t k = 0; k + columns < (rows - step) * columns; ++k) {
      high[k] = (1 - at.x()) * high[k] + at.x() * high[k + columns];
    }
  }
  if (nv == 0) return;
  for (double* half : {low, high}) {
    double* upper = half + size;
    for (std::size_t a = 0; a < rows; ++a) {
      double* f = upper + a * columns;
      std::copy_n(half + a * columns, columns, f);
      for (std::size_t step = 0; step < columns; ++step) {
        half[a * columns + step] = f[0];
        for (std::size_t k = 0; k + 1 < columns - step; ++k) f[k] = (1 - at.y()) * f[k] + at.y() * f[k + 1];
      }
    }
  }
}

}  // namespace handloft::geometry::detail
