#pragma once
// Curves that belong to a shape and are drawn with it.

#include "proto/scene.pb.h"
#include "server-model/model/dual_shape.h"

namespace handloft::stream {

/// Whether the curves of two versions of a shape may differ; `before` may be null.
bool curves_differ(const model::DualShape* before, const model::DualShape& after);

/// Writes the whole set into `state` and says so (curves_shown): the boundary (A24), on the surface where its
/// opacity is a half, when it is what trims the shape. Long curves are sent with at most 2,000 places.
void write_curves(const model::DualShape& shape, v1::EntityState& state);

}  // namespace handloft::stream
