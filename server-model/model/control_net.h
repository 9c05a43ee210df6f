#pragma once
// The net of control points behind a surface, for viewers to draw over it: of a fitted surface that of the
// exact Bezier patch over the box that an export would write (A26, geometry/bezier_patch.h), of a sculpted
// one its own B-spline's.

#include <cstddef>

#include "common/base/result.h"
#include "proto/query.pb.h"
#include "server-model/model/document.h"

namespace handloft::model {

/// Of a net when the question names no limit: more lines than these are a grey area on any screen.
inline constexpr std::size_t default_net_points = 10'000;

/// All but `sequence`, which the document does not know. Errors: not_found (entity), invalid_argument
/// (neither a dual shape nor a sculpted surface), failed_precondition (not fitted), resource_exhausted (more
/// points than `max_points`).
Result<handloft::v1::QueryResult> control_net(const handloft::v1::ControlNetQuery& query,
                                              const Document& document);

}  // namespace handloft::model
