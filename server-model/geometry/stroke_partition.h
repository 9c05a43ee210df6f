#pragma once
// One stroke over several surfaces (A21): which part of it draws whose profile. The paper lets the user
// divide a stroke; here it also divides itself where it passes from one shape's footprint to the next.
//
// Every place of the stroke costs, for each shape, its distance from the visible part of that shape's surface
// (height above the surface and distance outside of the trim), and `reach_m` for belonging to nobody. The
// division is the one of least total cost, where each change of owner costs a little more: that is the
// hysteresis, by which a hand that wavers along a border doesn't shred the stroke. Found exactly, by dynamic
// programming, so it doesn't depend on the stroke's direction.

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/superellipse.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// A surface that a stroke may belong to.
struct ProfileCandidate {
  Frame frame;
  PolynomialSurface surface;
  /// How far a place of the frame's base plane lies outside of what is seen of the surface, metres; 0 inside.
  std::function<double(const Vec2&)> outside_m;
};

/// Distance outside of the contour of half opacity (A23), along the ray from the centre; 0 inside.
double distance_outside(const Superellipse& superellipse, const Vec2& xy);

struct PartitionOptions {
  /// Farther than this from all surfaces a stroke is nobody's: a hand's span away, something else is meant.
  double reach_m = 0.1;
  /// A change of owner must pay: over this length at 45 degrees to the border, or twice of it for a visit and
  /// return. A hand wavers by millimetres.
  double hysteresis_m = 0.01;
  /// Places looked at along the stroke; the cuts between them are interpolated.
  std::size_t samples = 256;
};

inline constexpr std::size_t nobody = std::numeric_limits<std::size_t>::max();

struct StrokeDivision {
  std::vector<double> split_at;     ///< Fractions of the stroke's length, rising, within 0..1.
  std::vector<std::size_t> owners;  ///< One more: the candidate of each part, or `nobody`. Neighbours differ.
  /// The smallest distance of any place of the stroke from any candidate; infinity without candidates.
  double nearest_m = std::numeric_limits<double>::infinity();
};

/// Divides a stroke of world points. O(samples * candidates). Where two candidates cost the same, the former
/// in the list is the owner. Errors: invalid_argument for no points, a coordinate that is not finite
/// ("points[3]") or options that are not above 0.
Result<StrokeDivision> divide_stroke(std::span<const Vec3> points,
                                     std::span<const ProfileCandidate> candidates,
                                     const PartitionOptions& options = {});

}  // namespace handloft::geometry
