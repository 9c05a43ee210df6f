#pragma once
// Sums of Gaussians  g(p) = sum_i exp(-rate |p - q_i|^2) v_i  on Chebyshev grids over boxes: the smooth part
// of the propagation of a push (propagation.h, where the error bound stands). Values have four components.

#include <array>
#include <span>
#include <vector>

#include "server-model/geometry/point_tree.h"
#include "server-model/geometry/types.h"
#include "server-model/geometry/wide.h"

namespace handloft::geometry {

inline constexpr int max_axis_nodes = 14;
inline constexpr std::size_t max_grid_nodes = 700;  ///< Larger grids never pay; the box is divided instead.

/// Chebyshev nodes (of the first kind) in centre +- half.
struct GridAxis {
  double centre = 0, half = 0;
  int nodes = 1;
  double node(int i) const;
};

struct GaussGrid {
  std::array<GridAxis, 3> axes;
  std::size_t size() const {
    std::size_t product = 1;
    for (const GridAxis& axis : axes) product *= static_cast<std::size_t>(axis.nodes);
    return product;
  }
};

/// The grid over a box on which Gaussians of `rate` are interpolated to within about `tolerance`; size() is 0
/// when that would take too many nodes.
GaussGrid gauss_grid(const PointTree::Node& box, double rate, double tolerance);

/// A grid of one node.
GaussGrid grid_of_point(const Vec3& point);

/// Memory for the steps below, reused from call to call.
struct GridScratch {
  std::vector<Quad> a, b;
  std::array<std::array<double, max_axis_nodes * max_axis_nodes + 4>, 3> matrices{};  // Whole eights.
  std::array<std::vector<double>, 3> double_matrices;
  GridScratch();
};

/// Adds the source to values at nodes such that the grid's Gaussian sum is the source's: anterpolation.
void anterpolate(const GaussGrid& grid, const Vec3& point, const Quad& value, std::span<Quad> values);

/// Adds to the values at `to` the Gaussians of all nodes of another grid. Precondition: both boxes together
/// are no longer along an axis than 2 / sqrt(rate).
void add_gaussians(const GaussGrid& to, const GaussGrid& from, std::span<const Quad> sources, double rate,
                   std::span<Quad> values, GridScratch& scratch);
/// The same for Gaussians and their squares, two values a node: of `rate` and of twice the rate.
void add_gaussians_and_squares(const GaussGrid& to, const GaussGrid& from, std::span<const Quad> sources,
                               double rate, std::span<Quad> values, GridScratch& scratch);

/// Turns values at nodes into Chebyshev coefficients, in place.
void to_coefficients(const GaussGrid& grid, std::span<Quad> values, GridScratch& scratch);

/// Adds the interpolant of coefficients at the nodes of a grid within the box.
void hand_down(const GaussGrid& from, std::span<const Quad> coefficients, const GaussGrid& to,
               std::span<Quad> values, GridScratch& scratch);

/// Adds the interpolant at the points to `sums`.
void evaluate(const GaussGrid& grid, std::span<const Quad> coefficients, std::span<const Vec3> points,
              std::span<Quad> sums);

}  // namespace handloft::geometry
