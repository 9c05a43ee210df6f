#include "client-hmd/view/lens_mesh.h"

#include <algorithm>

namespace handloft::client {
namespace {

constexpr int fewest_cells = 8;

/// Edge of cell `i` of `cells` in pixels; the area begins half a pixel before the centre of its first one.
double edge_px(int i, int cells, int side_px) {
  return static_cast<double>(i) / cells * side_px - 0.5;
}

/// How many screen pixels a difference of tangents is near `pixel`.
double pixels_of(const EyeCalibration& eye, Channel channel, const glm::dvec2& pixel,
                 const glm::dvec2& tangent_difference) {
  const glm::dvec2 here = view_tangent(eye, channel, pixel);
  const double by_x = glm::length(view_tangent(eye, channel, pixel + glm::dvec2(1.0, 0.0)) - here);
  const double by_y = glm::length(view_tangent(eye, channel, pixel + glm::dvec2(0.0, 1.0)) - here);
  return glm::length(tangent_difference) / std::max(std::min(by_x, by_y), 1e-12);
}

/// At a cell's middle, on the diagonal that its triangles share, and at the middles of its sides.
double error_px(const EyeCalibration& eye, int cells) {
  double worst = 0.0;
  const int width = eye.area.width_px;
  const int height = eye.area.height_px;
  const auto compare = [&](const glm::dvec2& a, const glm::dvec2& b) {
    const glm::dvec2 middle = 0.5 * (a + b);
    for (const Channel channel : {Channel::red, Channel::green, Channel::blue}) {
      const glm::dvec2 chord = 0.5 * (view_tangent(eye, channel, a) + view_tangent(eye, channel, b));
      worst = std::max(worst, pixels_of(eye, channel, middle, chord - view_tangent(eye, channel, middle)));
    }
  };
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      const glm::dvec2 near{edge_px(x, cells, width), edge_px(y, cells, height)};
      const glm::dvec2 far{edge_px(x + 1, cells, width), edge_px(y + 1, cells, height)};
      compare(near, far);
      compare(near, {far.x, near.y});
      compare(near, {near.x, far.y});
    }
  }
  return worst;
}

}  // namespace

LensMesh lens_mesh(const EyeCalibration& eye, const LensMeshOptions& options) {
  int cells = fewest_cells;
  double error = error_px(eye, cells);
  // Linear interpolation errs with the square of the cell's side: doubling quarters it.
  while (error >= options.tolerance_px && 2 * cells <= options.most_cells) {
    cells *= 2;
    error = error_px(eye, cells);
  }
  LensMesh mesh;
  mesh.largest_error_px = error;
  for (int y = 0; y <= cells; ++y) {
    for (int x = 0; x <= cells; ++x) {
      const glm::dvec2 pixel{edge_px(x, cells, eye.area.width_px), edge_px(y, cells, eye.area.height_px)};
      LensVertex vertex;
      vertex.position = glm::vec2(x, y) / static_cast<float>(cells);
      vertex.red = glm::vec2(view_tangent(eye, Channel::red, pixel));
      vertex.green = glm::vec2(view_tangent(eye, Channel::green, pixel));
      vertex.blue = glm::vec2(view_tangent(eye, Channel::blue, pixel));
      mesh.vertices.push_back(vertex);
    }
  }
  const auto row = static_cast<std::uint32_t>(cells + 1);
  for (std::uint32_t y = 0; y + 1 < row; ++y) {
    for (std::uint32_t x = 0; x + 1 < row; ++x) {
      const std::uint32_t a = y * row + x;
      const std::uint32_t b = a + 1;
      const std::uint32_t c = a + row;
      const std::uint32_t d = c + 1;
      mesh.indices.insert(mesh.indices.end(), {a, c, d, a, d, b});
    }
  }
  return mesh;
}

}  // namespace handloft::client
