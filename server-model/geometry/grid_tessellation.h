#pragma once
// The mesh of a B-spline surface that is dragged: its parameters and triangles stay, and a frame evaluates
// again only the vertices that depend on control points that moved. The basis functions are tabulated once;
// the sums along v are kept by rows of control points, so a vertex costs p + 1 products in each direction.
// What an update gives has the same bits as evaluating everything.

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/propagation.h"
#include "server-model/geometry/tessellate.h"

namespace handloft::geometry {

/// Parameters of a grid of at least so many equal parts a span, or in total spread by the spans' chord
/// bounds.
struct GridParameters {
  std::vector<double> us, vs;  ///< Ascending, both ends of the domain with them.
};
GridParameters even_grid(const BSplineSurface& surface, int parts_per_span);
/// Each direction's spans get as many parts as the chord tolerance asks of the span that needs most. Errors:
/// invalid_argument for a tolerance that is not above 0; resource_exhausted for above `max_vertices`.
Result<GridParameters> grid_within(const BSplineSurface& surface, double chord_tolerance_m,
                                   std::size_t max_vertices = 1'000'000);

class GridTessellation {
 public:
  static constexpr std::size_t max_vertices = 16'000'000;

  /// Periodic directions are closed: their last parameter becomes the first vertex. Errors: as check(surface)
  /// says; invalid_argument for parameters that are not ascending or outside of the domain, or fewer than two
  /// (three around a periodic direction); resource_exhausted for too many.
  static Result<GridTessellation> create(const BSplineSurface& surface, const GridParameters& parameters);

  /// Opacity 1. Vertex r * columns() + c is at (us[r], vs[c]).
  const TriangleMesh& mesh() const { return mesh_; }
  std::size_t rows() const { return row_count_; }
  std::size_t columns() const { return column_count_; }

  /// Other control points, for the same knots and weights: finds those that differ and evaluates what depends
  /// on them. Errors: invalid_argument for another count or numbers that are not finite; the mesh is not
  /// changed then. The same bits however it is parallel.
  Status update(std::span<const Vec3> control, const ParallelFor& parallel = run_in_turn);
  /// The same at control points + displacements.
  Status update(std::span<const Vec3> rest, std::span<const Vec3> displacements);
  /// Vertices that the last update evaluated, ascending; all after create().
  std::span<const std::uint32_t> changed() const { return changed_; }

 private:
  GridTessellation(const BSplineSurface& surface, BasisTable u, BasisTable v);

  /// Two doubles in one register: wider ones would be taken apart again on the machines we build for.
  using Pair = double __attribute__((vector_size(2 * sizeof(double))));
  struct Sum {
    Pair xy, zw, slope_xy, slope_zw;
  };

  /// Takes a row of control points and sums it up where it moved. False for numbers that are not finite.
  bool take_row(std::size_t row, const Vec3* control);
  void evaluate_rows(const ParallelFor& parallel);
  void sum_along_v(std::size_t control_row, std::size_t column);
  void sum_along_u(std::size_t row, std::size_t column, std::span<const std::size_t> rows);
  std::size_t control_row(std::size_t row, std::size_t a) const;
  std::size_t control_column(std::size_t column, std::size_t b) const;
  void make_triangles();

  BSplineSurface surface_;
  BasisTable u_, v_;
  std::vector<double> us_, vs_;
  std::size_t row_count_ = 0, column_count_ = 0;
  std::vector<std::uint8_t> row_moved_, sum_moved_;
  /// All is to be evaluated: at first, and when an update was given up halfway.
  bool is_stale_ = true;
  /// By control row and column: x, y, z and weight (times the weight), and their derivatives along v.
  std::vector<Sum> sums_;
  TriangleMesh mesh_;
  std::vector<std::uint32_t> changed_;
};

}  // namespace handloft::geometry
