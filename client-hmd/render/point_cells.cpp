#include "client-hmd/render/point_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace handloft::client {
namespace {

constexpr std::size_t points_a_cell = 2048;  ///< Enough for a share to be fine, few enough to be left out.
constexpr int most_cells_a_side = 48;
constexpr float steps = 65535.0F;
constexpr std::uint32_t fewest_of_a_cell = 16;
constexpr float pi = 3.14159265F;

glm::vec3 vec(const Vec3f& v) {
  return {v.x, v.y, v.z};
}

/// About the golden ratio of `count` and coprime to it: its multiples visit every index, evenly.
std::size_t even_stride(std::size_t count) {
  auto stride = static_cast<std::size_t>(0.618033988749895 * static_cast<double>(count)) | 1U;
  while (std::gcd(stride, count) != 1) ++stride;
  return stride;
}

struct Grid {
  glm::vec3 low{0.0F};
  float edge_m = 1.0F;
  glm::ivec3 cells{1};

  std::size_t cell_of(const glm::vec3& place) const {
    const glm::ivec3 at = glm::clamp(glm::ivec3((place - low) / edge_m), glm::ivec3(0), cells - 1);
    return static_cast<std::size_t>(at.x) +
           static_cast<std::size_t>(cells.x) *
               (static_cast<std::size_t>(at.y) +
                static_cast<std::size_t>(cells.y) * static_cast<std::size_t>(at.z));
  }
  std::size_t count() const {
    return static_cast<std::size_t>(cells.x) * static_cast<std::size_t>(cells.y) *
           static_cast<std::size_t>(cells.z);
  }
};

Grid grid_about(const PointSet& set, std::size_t count) {
  glm::vec3 low = vec(set.points.front().position), high = low;
  for (std::size_t i = 0; i < count; ++i) {
    low = glm::min(low, vec(set.points[i].position));
    high = glm::max(high, vec(set.points[i].position));
  }
  const glm::vec3 extent = high - low;
  const float longest = std::max({extent.x, extent.y, extent.z, 1e-6F});
  // Clouds are mostly skins: the root of the number, not its cube root.
  const int side = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(count) / points_a_cell)), 1,
                              most_cells_a_side);
  Grid grid;
  grid.low = low;
  grid.edge_m = longest / static_cast<float>(side);
  grid.cells = glm::clamp(glm::ivec3(extent / grid.edge_m) + 1, glm::ivec3(1), glm::ivec3(side));
  return grid;
}

}  // namespace

std::optional<PointCells> into_cells(const PointSet& set, std::size_t count) {
  count = std::min(count, set.points.size());
  if (count == 0 || set.styles.size() > max_packed_styles) return std::nullopt;
  const Grid grid = grid_about(set, count);
  std::vector<std::uint32_t> ends(grid.count(), 0);
  for (std::size_t i = 0; i < count; ++i) ++ends[grid.cell_of(vec(set.points[i].position))];

  PointCells made;
  std::vector<std::uint32_t> cell_index(grid.count(), 0);
  std::uint32_t first = 0;
  for (std::size_t c = 0; c < ends.size(); ++c) {
    const std::uint32_t here = ends[c];
    ends[c] = first;  // From now on: where its next point goes.
    if (here == 0) continue;
    cell_index[c] = static_cast<std::uint32_t>(made.cells.size());
    PointCell cell;
    cell.first = first;
    cell.count = here;
    made.cells.push_back(cell);
    first += here;
  }
  std::vector<std::uint32_t> order(count);
  const std::size_t stride = even_stride(count);
  for (std::size_t i = 0, at = 0; i < count; ++i, at = (at + stride) % count) {
    order[ends[grid.cell_of(vec(set.points[at].position))]++] = static_cast<std::uint32_t>(at);
  }

  made.points.resize(count);
  for (PointCell& cell : made.cells) {
    const auto begin = order.begin() + cell.first, end = begin + cell.count;
    glm::vec3 low = vec(set.points[*begin].position), high = low;
    for (auto at = begin; at != end; ++at) {
      const FuzzyPoint& point = set.points[*at];
      low = glm::min(low, vec(point.position));
      high = glm::max(high, vec(point.position));
      const float radius = set.styles[point.style].radius_m;
      cell.disc_area_m2 += pi * radius * radius;
      cell.largest_radius_m = std::max(cell.largest_radius_m, radius);
    }
    cell.low = low;
    cell.size = high - low;
    const glm::vec3 scale = steps / glm::max(cell.size, glm::vec3(1e-9F));
    for (auto at = begin; at != end; ++at) {
      const FuzzyPoint& point = set.points[*at];
      const glm::vec3 share =
          glm::clamp((vec(point.position) - low) * scale + 0.5F, glm::vec3(0.0F), glm::vec3(steps));
      made.points[static_cast<std::size_t>(at - order.begin())] = {
          static_cast<std::uint16_t>(share.x), static_cast<std::uint16_t>(share.y),
          static_cast<std::uint16_t>(share.z), static_cast<std::uint16_t>(point.style)};
    }
  }
  return made;
}

CellShare share_of(const PointCell& cell, const CellView& view) {
  const glm::vec3 half = 0.5F * cell.size + cell.largest_radius_m;
  const glm::vec3 middle = cell.low + 0.5F * cell.size;
  // Out of sight when all corners are beyond the same side of the view (Gribb and Hartmann 2001).
  const glm::mat4 rows = glm::transpose(view.clip_from_world);
  for (const glm::vec4& side :
       {rows[3] + rows[0], rows[3] - rows[0], rows[3] + rows[1], rows[3] - rows[1], rows[3] + rows[2]}) {
    const glm::vec3 normal(side);
    if (glm::dot(normal, middle) + side.w + glm::dot(glm::abs(normal), half) < 0.0F) return {};
  }
  const glm::vec3 to_eye = view.eye - middle;
  const float distance = glm::length(to_eye);
  const float reach = glm::length(half);
  if (distance <= 1.5F * reach)
    return {cell.count, 1.0F};  // The eye is in it, or nearly: every point counts.
  const glm::vec3 along = glm::abs(to_eye) / distance;
  const glm::vec3 side = 2.0F * half;
  const float shadow_m2 = along.x * side.y * side.z + along.y * side.x * side.z + along.z * side.x * side.y;
  const float px_per_m = view.focal_px / distance;
  // Discs are drawn about a pixel large at least, and with soft edges.
  const float drawn_m2 = cell.disc_area_m2 + static_cast<float>(cell.count) * pi / (px_per_m * px_per_m);
  const float layers = drawn_m2 / std::max(shadow_m2, 1e-12F);
  if (layers <= view.most_layers) return {cell.count, 1.0F};
  const auto wanted = static_cast<std::uint32_t>(
      std::ceil(static_cast<double>(cell.count) * static_cast<double>(view.most_layers / layers)));
  const std::uint32_t count = std::min(cell.count, std::max(wanted, fewest_of_a_cell));
  return {count, static_cast<float>(cell.count) / static_cast<float>(count)};
}

CellShare thinned(const CellShare& of_cell, double share) {
  if (share >= 1.0 || of_cell.count == 0) return of_cell;
  CellShare fewer;
  fewer.count = std::clamp(static_cast<std::uint32_t>(std::ceil(share * static_cast<double>(of_cell.count))),
                           1U, of_cell.count);
  fewer.boost = of_cell.boost * static_cast<float>(of_cell.count) / static_cast<float>(fewer.count);
  return fewer;
}

float mean_disc_cost_px(const PointCell& cell, const PointCells& of, std::span<const ShellStyle> styles,
                        const DiscView& view) {
  // Any beginning of a cell is spread over it.
  const std::uint32_t looked_at = std::min(cell.count, 4U);
  if (looked_at == 0) return 0.0F;
  float sum = 0.0F;
  for (std::uint32_t i = cell.first; i < cell.first + looked_at; ++i) {
    const PackedPoint& point = of.points[i];
    const glm::vec3 place = cell.low + cell.size * glm::vec3(point.x, point.y, point.z) / steps;
    sum += disc_cost_px(place, styles[point.style].radius_m, view);
  }
  return sum / static_cast<float>(looked_at);
}

}  // namespace handloft::client
