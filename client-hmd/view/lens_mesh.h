#pragma once
// The lens model of hmd_calibration.h as a grid of triangles over an eye's area: at every corner the
// tangents at which red, green and blue are seen there, so that the graphics card need only interpolate. The
// grid is refined until the interpolation errs by less than the asked part of a pixel.

#include <cstdint>
#include <vector>

#include "client-hmd/view/hmd_calibration.h"

namespace handloft::client {

/// As the graphics card reads it: 32 bytes.
struct LensVertex {
  glm::vec2 position{0.0F};  ///< In the area, 0..1, y down.
  glm::vec2 red{0.0F};       ///< Tangents right and down.
  glm::vec2 green{0.0F};
  glm::vec2 blue{0.0F};
};

struct LensMesh {
  std::vector<LensVertex> vertices;
  std::vector<std::uint32_t> indices;  ///< Three a triangle.
  double largest_error_px = 0.0;       ///< Of screen pixels, as measured between the corners.
};

struct LensMeshOptions {
  double tolerance_px = 0.1;  ///< Invisible, and below what lens figures are good for.
  int most_cells = 256;       ///< A side; the mesh is what it is then, and says its error.
};

LensMesh lens_mesh(const EyeCalibration& eye, const LensMeshOptions& options = {});

}  // namespace handloft::client
