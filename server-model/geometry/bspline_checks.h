#pragma once
// Checks of control points and weights that curves and surfaces share. Not for others.

#include <cstddef>
#include <span>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry::detail {

/// Errors: invalid_argument ("control", "control[7]", "weights", "weights[7]") for counts other than
/// `expected`, coordinates that are not finite or beyond any length, weights outside 1e-60..1e60.
Status check_control(std::size_t expected, std::span<const Vec3> control, std::span<const double> weights);

}  // namespace handloft::geometry::detail
