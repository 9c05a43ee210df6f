#pragma once
// The innermost loop of the propagation (propagation.h): sums of the falloff over pairs of points and
// contacts, where the range has to be tested pair by pair.

#include <cstddef>
#include <span>

#include "server-model/geometry/falloff.h"
#include "server-model/geometry/types.h"
#include "server-model/geometry/wide.h"

namespace handloft::geometry {

/// Contacts as the loop reads them: rest positions and displacements, arrays of equal length.
struct ContactArrays {
  const double *x, *y, *z, *vx, *vy, *vz;
  std::size_t count;
};

/// Bounds of d^2 / R^2 over the pairs, as far as they are within range: the closer together, the cheaper.
struct SquareSpan {
  double least, largest;
};

/// Adds to `sums[j]`, over the contacts i with squared_distance < squared_range:
///   literal  (sum eta v, number);   smooth  (sum eta^2 v, sum eta).
/// eta is within 1e-9 of falloff().
void add_pair_sums(std::span<const Vec3> points, const ContactArrays& contacts, double squared_range,
                   const SquareSpan& squares, Falloff falloff, std::span<Quad> sums);

}  // namespace handloft::geometry
