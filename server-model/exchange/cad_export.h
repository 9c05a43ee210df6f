#pragma once
// What a STEP or IGES file may hold: fitted shapes (surface_export.h), faces on B-spline surfaces, and models
// as cad_import.h read them, with some of their faces changed. Plain values, written by write_step() and
// write_iges().

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server-model/exchange/cad_face.h"
#include "server-model/exchange/surface_export.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/types.h"

namespace handloft::exchange {

/// A face of a model with another shape. Its trim stays what it is in the parameters; a domain of other
/// bounds is stretched to the former one's.
struct ReplacedFace {
  std::uint32_t number = 0;  ///< As ImportedFace.
  geometry::BSplineSurface surface;
};

/// A model with changed faces. All others are written as they were read. A changed face whose border moved by
/// no more than `border_tolerance_m` keeps its edges, so that closed shells stay closed; another gets edges
/// of its own, and a solid that is no longer closed by that becomes its shells.
struct ModelExport {
  std::string name;
  std::shared_ptr<const std::string> boundary_representation;
  double metres_per_unit = 0.001;
  geometry::Vec3 translation =
      geometry::Vec3::Zero();  ///< From the representation into the world, after scaling.
  std::vector<ReplacedFace> replaced;
  std::vector<std::uint32_t> removed;  ///< Faces that are left out.
  double border_tolerance_m = 1e-7;    ///< What STEP readers take for the same place.
};

struct CadContent {
  std::span<const SurfaceExport> surfaces;
  std::span<const CadFace> faces;
  std::span<const ModelExport> models;
};

}  // namespace handloft::exchange
