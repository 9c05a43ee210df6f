#pragma once
// Shapes moved by similarities: points, fit, symmetry plane and trim alike, so that nothing needs a fit.

#include <cstdint>
#include <memory>
#include <string_view>

#include "common/base/result.h"
#include "server-model/geometry/types.h"
#include "server-model/model/document.h"
#include "server-model/model/similarity.h"

namespace handloft::model {

/// Whether the plane in which a shape is mirrored moves with it.
enum class SymmetryPlane : std::uint8_t { stays, goes_along };

/// What has moved an entity (Entity::motion) once it is moved on. Null when the numbers have left what double
/// holds: then what is pinned to it stays where it is.
std::shared_ptr<const Similarity> moved_on(const std::shared_ptr<const Similarity>& motion,
                                           const Similarity& similarity);

/// The shape moved by it, exactly but for rounding: coefficients in the scaled variables keep their bits
/// under rigid motion, and are multiplied by the scale otherwise. Errors: invalid_argument when something
/// would leave the workspace, or the numbers of the surface would leave what double holds.
Result<DualShape> moved(const DualShape& shape, const Similarity& similarity, SymmetryPlane plane,
                        std::string_view field, const Limits& limits);

}  // namespace handloft::model
