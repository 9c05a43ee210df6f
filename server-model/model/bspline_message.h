#pragma once
// B-splines as messages hold them (proto/geometry.proto), checked.

#include <string>

#include "common/base/result.h"
#include "proto/geometry.pb.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/model/limits.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// Errors, below `field`: invalid_argument for what KnotVector and check() refuse, counts that do not fit,
/// and coordinates outside the workspace; resource_exhausted beyond max_control_points.
Result<geometry::BSplineSurface> read_surface(const handloft::v1::BSplineSurface& message,
                                              const std::string& field, const Limits& limits);
void write_surface(const geometry::BSplineSurface& surface, handloft::v1::BSplineSurface& message);

/// Loops whose curves follow one another; gaps in the parameter plane stay as small as the file has them.
/// Errors, below `field`: invalid_argument, resource_exhausted beyond max_trim_curves.
Result<FaceTrim> read_trim(const google::protobuf::RepeatedPtrField<handloft::v1::TrimLoop>& loops,
                           const std::string& field, const Limits& limits);
void write_trim(const FaceTrim& trim, google::protobuf::RepeatedPtrField<handloft::v1::TrimLoop>& loops);

}  // namespace handloft::model
