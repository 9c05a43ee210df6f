#pragma once
// What a STEP or IGES file may hold: fitted shapes (surface_export.h), faces on B-spline surfaces, and models
// as cad_import.h read them, with some of their faces changed. Plain values, written by write_step() and
// write_iges().

#include <cstddef>
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

/// A model with changed faces. All others are written as they were read, with their names and colours. Where
/// two neighbours moved alike along an edge that they share, or not at all, they share it still, so that
/// closed shells stay closed: to the bit where neither moved, and otherwise with places that differ by no
/// more than `border_tolerance_m`. Where they came apart by more, each has edges of its own there: shells are
/// open or fall apart, and a solid that is no longer closed becomes its shells. BorderGap tells of those.
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

/// Two neighbours in an exported model that no longer share their edge.
struct BorderGap {
  std::size_t model = 0;  ///< Of CadContent::models.
  std::uint32_t face = 0,
                neighbour = 0;  ///< As ImportedFace::number; equal where a face opened its own seam.
  std::string face_name, neighbour_name;  ///< As the model's file has them; often empty.
  double gap_m = 0;                       ///< How far their movements along it differ at the most.
};

struct CadContent {
  std::span<const SurfaceExport> surfaces;
  std::span<const CadFace> faces;
  std::span<const ModelExport> models;
};

}  // namespace handloft::exchange
