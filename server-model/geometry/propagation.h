#pragma once
// The propagation of a push to the points around it (A15-A17, eq. 4 and 5): every point j moves by a mean of
// the displacements v_i of the contacts i within range, weighted by the falloff of the rest distance d_ij.
//
// All pairs cost 10^8 exponentials for 100,000 points and 1,000 contacts. The fast way: both sets lie in
// trees of boxes, and pairs of boxes are met from the top down.
//   - Boxes farther apart than the range: nothing.
//   - Boxes wholly within the range: the number of contacts and the sum of their v_i are added as they are
//     (exact moments); the Gaussian sum  sum_i exp(-c d_ij^2 / R^2) v_i  is smooth over the box of points and
//     is interpolated there on a Chebyshev grid of k nodes an axis, from the contacts, or, where a box holds
//     many, from their anterpolation on such a grid. The Gaussian is a product over the axes, so grid meets
//     grid axis by axis. The smooth falloff also needs the Gaussian's square: both powers share the grids,
//     and what they give is put together there. Coarse grids are handed down to finer ones.
//   - Boxes that straddle the range are divided; at last point meets contact, with a Chebyshev polynomial for
//     exp, of as low a degree as the boxes' distances allow, several points at a time. Which contacts are in
//     range is thus decided exactly as by all pairs.
// Error: with half extent h, Cramer's bound on Hermite functions gives  2.18 (sqrt(c/2) h/R)^k / sqrt(k!)  an
// axis; k is the least for which that is below t = 1e-8 (literal) or 4e-9 (smooth, c of the square). The
// Gaussian being a product of three factors in 0..1, a kernel between two grids is within 3 (1 + L) t, L < 3
// the Lebesgue constant: 1.2e-7 and 5e-8. At the far end of the grids of the smooth falloff, which divides by
// sum eta, the bound on Hermite functions is smaller by exp(-c d^2 / 2 R^2) = 0.15. So the result differs
// from all pairs by at most
//     propagation_error_bound * max |v_i|
// for both falloffs (for the smooth one grids are used only where eta > 0.013). The tests hold it to that;
// 1e-8 is usual. A contact is not its own neighbour: it is taken out of its sums again, and where then less
// than a tenth of a contact remains, which would magnify its error, the others in range are added up one by
// one. Small problems are computed by all pairs, exactly.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "server-model/geometry/falloff.h"
#include "server-model/geometry/point_tree.h"

namespace handloft::geometry {

/// A point that was pushed, and how far.
struct Contact {
  std::uint32_t index = 0;
  Vec3 displacement = Vec3::Zero();
};

/// Runs task(0) .. task(count - 1), in any order and at the same time or not, and returns when all are done.
/// This room has no threads of its own: who has some passes them in. The result does not depend on it.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& task)>;
void run_in_turn(std::size_t count, const std::function<void(std::size_t)>& task);

/// See above: of the largest |v_i|, so 60 nm for a push of 60 mm.
inline constexpr double propagation_error_bound = 1e-6;
/// Up to this many pairs of points and contacts, all pairs are as fast and exact.
inline constexpr std::size_t all_pairs_limit = 16384;

/// The reference: eq. 5 as it stands, for all points. `squared_range_m2` is d_range^2; 0: nothing propagates.
/// A contact is not its own neighbour: what stands at its index is the mean over the others.
std::vector<Vec3> propagate_all_pairs(std::span<const Vec3> rest, std::span<const Contact> contacts,
                                      double squared_range_m2, Falloff falloff);

/// The same within the bound above. `points` must be made of the rest positions with propagation_leaf_size.
/// Result by index. Precondition: finite displacements, indices below points.size(), each at most once.
inline constexpr std::size_t propagation_leaf_size = 16;
std::vector<Vec3> propagate(const PointTree& points, std::span<const Contact> contacts,
                            double squared_range_m2, Falloff falloff,
                            const ParallelFor& parallel = run_in_turn);

}  // namespace handloft::geometry
