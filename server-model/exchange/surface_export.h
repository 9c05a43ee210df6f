#pragma once
// What an exporter needs to know of a surface: plain values, so that no exporter knows the model. Metres,
// world.

#include <string>
#include <vector>

#include "server-model/geometry/planar_faces.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/superellipse.h"
#include "server-model/geometry/tessellate.h"
#include "server-model/geometry/types.h"

namespace handloft::exchange {

enum class Trim {
  contour,  ///< At the half-opaque contour of the superellipse, f = 1.381 (A26), less tips of stars thinner
            ///< than 10 um.
  box,      ///< Untrimmed: the box around that contour, or around `region` where there is one.
  region,   ///< At the borders of `region` (A24): what a drawn curve encloses, or one of several such faces.
};

struct SurfaceExport {
  std::string name;  ///< UTF-8; kept in the file.
  geometry::PolynomialSurface surface;
  geometry::Frame frame;
  geometry::Superellipse superellipse;
  Trim trim = Trim::contour;
  geometry::PlanarFace region = {};  ///< In the frame, metres; empty: the superellipse trims.
};

/// A mesh ready for a mesh format.
struct MeshExport {
  std::string name;
  geometry::TriangleMesh mesh;
  float red = 0.75F, green = 0.78F, blue = 0.82F;  ///< Linear 0..1; alpha comes from the mesh's opacity.
};

/// Points as points; the weight (0..1) becomes alpha.
struct PointCloudExport {
  std::string name;
  std::vector<geometry::WeightedPoint> points;
  float red = 0.2F, green = 0.4F, blue = 0.9F;
};

}  // namespace handloft::exchange
