#pragma once
// Where places in the world and rays meet a sculpted surface, within its trim.

#include <optional>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_projection.h"
#include "server-model/geometry/trim_region.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// The trim's loops as polylines whose chords are within `tolerance` (in parameters, metres) of the curves.
std::vector<geometry::TrimLoop> trim_loops(const FaceTrim& trim, double tolerance);
/// The same, to a ten-thousandth of the surface's parameter rectangle; empty: the whole of it. Places that
/// stand out of it by no more than a thousandth, as files let them, are brought onto its border.
std::vector<geometry::TrimLoop> trim_loops(const SculptShape& shape);

/// Of the present surface within its trim, prepared for many questions. Errors: those of
/// SurfaceProjector::create().
Result<geometry::SurfaceProjector> make_projector(const SculptShape& shape);

/// The first place that a ray meets.
Result<std::optional<geometry::SurfaceHit>> pick_sculpt(const SculptShape& shape,
                                                        const geometry::Vec3& origin,
                                                        const geometry::Vec3& direction);

}  // namespace handloft::model
