#include "server-model/geometry/gauss_grid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "server-model/geometry/grid_loops.h"

namespace handloft::geometry {

namespace {

// A contraction's middle steps mix the sizes of two grids.
constexpr std::size_t most_mixed_nodes = std::size_t{max_axis_nodes} * max_axis_nodes * max_axis_nodes;
constexpr std::size_t scratch_size = 2 * most_mixed_nodes;  // Two values a node.
constexpr std::size_t octet = 8;

// T_0..T_(n-1) at x in -1..1.
void chebyshev(double x, int n, double* out) {
  out[0] = 1;
  if (n > 1) out[1] = x;
  for (int i = 2; i < n; ++i) out[i] = 2 * x * out[i - 1] - out[i - 2];
}

double reference(const GridAxis& axis, double x) {
  return axis.half > 0 ? (x - axis.centre) / axis.half : 0;
}

// For k nodes: the nodes in -1..1, and the matrix that turns values at them into coefficients, whose row n,
// column i is (2 - [n = 0]) / k T_n(x_i).
struct ChebyshevTable {
  std::array<double, max_axis_nodes> node{};
  std::array<double, std::size_t{max_axis_nodes} * max_axis_nodes> coefficient{};
};

const ChebyshevTable& table(int k) {
  static const auto tables = [] {
    std::array<ChebyshevTable, max_axis_nodes + 1> all;
    for (int nodes = 1; nodes <= max_axis_nodes; ++nodes) {
      ChebyshevTable& one = all[static_cast<std::size_t>(nodes)];
      for (int i = 0; i < nodes; ++i) {
        const double angle = (2 * i + 1) * std::numbers::pi / (2 * nodes);
        one.node[static_cast<std::size_t>(i)] = std::cos(angle);
        for (int n = 0; n < nodes; ++n) {
          one.coefficient[static_cast<std::size_t>(n) * static_cast<std::size_t>(nodes) +
                          static_cast<std::size_t>(i)] = (n == 0 ? 1.0 : 2.0) / nodes * std::cos(n * angle);
        }
      }
    }
    return all;
  }();
  return tables[static_cast<std::size_t>(k)];
}

std::array<int, 3> counts(const GaussGrid& grid) {
  return {grid.axes[0].nodes, grid.axes[1].nodes, grid.axes[2].nodes};
}

double* doubles(Quad* quads) {
  return reinterpret_cast<double*>(quads);
}
const double* doubles(const Quad* quads) {
  return reinterpret_cast<const double*>(quads);
}

void contract(const Quad* in, const GaussGrid& from, const GaussGrid& to, const double* x, const double* y,
              const double* z, GridScratch& scratch, std::span<Quad> out) {
  grid_loops().contract(doubles(in), counts(from).data(), counts(to).data(), x, y, z,
                        doubles(scratch.a.data()), doubles(scratch.b.data()), doubles(out.data()));
}

// scratch.matrices[axis] = exp(-rate (x_i - x_j)^2) for the nodes of `to` by those of `from`.
void gaussian_matrices(const GaussGrid& to, const GaussGrid& from, double rate, GridScratch& scratch) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const GridAxis &rows = to.axes[axis], &columns = from.axes[axis];
    std::array<double, max_axis_nodes> column{};
    for (int j = 0; j < columns.nodes; ++j) column[static_cast<std::size_t>(j)] = columns.node(j);
    double* entry = scratch.matrices[axis].data();
    for (int i = 0; i < rows.nodes; ++i) {
      const double row = rows.node(i);
      for (std::size_t j = 0; j < static_cast<std::size_t>(columns.nodes); ++j) *entry++ = row - column[j];
    }
    grid_loops().gaussians(scratch.matrices[axis].data(),
                           static_cast<std::size_t>(entry - scratch.matrices[axis].data()), rate);
  }
}

using AxisValues = std::array<std::array<double, 16>, 3>;
static_assert(max_axis_nodes <= 16);

int nodes_needed(double half, double rate, double tolerance) {
  // 2.18 (sqrt(rate / 2) h)^k / sqrt(k!): the interpolation error by Cramer's bound, see propagation.h.
  constexpr double cramer = 2.18;
  const double step = std::sqrt(0.5 * rate) * half;
  double error = cramer;
  for (int k = 1; k <= max_axis_nodes; ++k) {
    error *= step / std::sqrt(static_cast<double>(k));
    if (error <= tolerance) return k;
  }
  return 0;
}

}  // namespace

GridScratch::GridScratch() : a(scratch_size), b(scratch_size) {
  for (std::vector<double>& matrix : double_matrices) matrix.resize(octet * max_axis_nodes * max_axis_nodes);
}

double GridAxis::node(int i) const {
  return centre + half * table(nodes).node[static_cast<std::size_t>(i)];
}

GaussGrid gauss_grid(const PointTree::Node& box, double rate, double tolerance) {
  GaussGrid grid;
  for (int axis = 0; axis < 3; ++axis) {
    GridAxis& one = grid.axes[static_cast<std::size_t>(axis)];
    one = {box.centre[axis], box.half[axis], nodes_needed(box.half[axis], rate, tolerance)};
  }
  if (grid.size() > max_grid_nodes) grid.axes[0].nodes = 0;
  return grid;
}

GaussGrid grid_of_point(const Vec3& point) {
  GaussGrid grid;
  for (int axis = 0; axis < 3; ++axis) grid.axes[static_cast<std::size_t>(axis)] = {point[axis], 0, 1};
  return grid;
}

void anterpolate(const GaussGrid& grid, const Vec3& point, const Quad& value, std::span<Quad> values) {
  AxisValues weights;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const GridAxis& one = grid.axes[axis];
    const auto k = static_cast<std::size_t>(one.nodes);
    std::array<double, max_axis_nodes> at_point;
    chebyshev(reference(one, point[static_cast<int>(axis)]), one.nodes, at_point.data());
    // The Lagrange polynomial of node i is the interpolant of its unit value.
    for (std::size_t i = 0; i < k; ++i) {
      double sum = 0;
      for (std::size_t n = 0; n < k; ++n) sum += at_point[n] * table(one.nodes).coefficient[n * k + i];
      weights[axis][i] = sum;
    }
  }
  grid_loops().add_product(weights[0].data(), weights[1].data(), weights[2].data(), counts(grid).data(),
                           reinterpret_cast<const double*>(&value), doubles(values.data()));
}

void add_gaussians(const GaussGrid& to, const GaussGrid& from, std::span<const Quad> sources, double rate,
                   std::span<Quad> values, GridScratch& scratch) {
  gaussian_matrices(to, from, rate, scratch);
  contract(sources.data(), from, to, scratch.matrices[0].data(), scratch.matrices[1].data(),
           scratch.matrices[2].data(), scratch, values);
}

void add_gaussians_and_squares(const GaussGrid& to, const GaussGrid& from, std::span<const Quad> sources,
                               double rate, std::span<Quad> values, GridScratch& scratch) {
  gaussian_matrices(to, from, rate, scratch);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto entries =
        static_cast<std::size_t>(to.axes[axis].nodes) * static_cast<std::size_t>(from.axes[axis].nodes);
    double* entry = scratch.double_matrices[axis].data();
    for (std::size_t i = 0; i < entries; ++i, entry += octet) {
      const double e = scratch.matrices[axis][i];
      std::fill_n(entry, octet / 2, e);
      std::fill_n(entry + octet / 2, octet / 2, e * e);
    }
  }
  grid_loops().contract_twice(doubles(sources.data()), counts(from).data(), counts(to).data(),
                              scratch.double_matrices[0].data(), scratch.double_matrices[1].data(),
                              scratch.double_matrices[2].data(), doubles(scratch.a.data()),
                              doubles(scratch.b.data()), doubles(values.data()));
}

void to_coefficients(const GaussGrid& grid, std::span<Quad> values, GridScratch& scratch) {
  const auto n = counts(grid);
  std::vector<Quad>& copy = scratch.a;
  // `contract` writes no more than the grid's size at the beginning of `a`: the copy stands at the far end.
  static_assert(scratch_size >= 2 * max_grid_nodes);
  Quad* const input = copy.data() + (scratch_size - grid.size());
  std::copy_n(values.begin(), grid.size(), input);
  std::fill_n(values.begin(), grid.size(), Quad{});
  contract(input, grid, grid, table(n[0]).coefficient.data(), table(n[1]).coefficient.data(),
           table(n[2]).coefficient.data(), scratch, values);
}

void hand_down(const GaussGrid& from, std::span<const Quad> coefficients, const GaussGrid& to,
               std::span<Quad> values, GridScratch& scratch) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const GridAxis &rows = to.axes[axis], &columns = from.axes[axis];
    for (int i = 0; i < rows.nodes; ++i) {
      chebyshev(reference(columns, rows.node(i)), columns.nodes,
                scratch.matrices[axis].data() + static_cast<std::ptrdiff_t>(i) * columns.nodes);
    }
  }
  contract(coefficients.data(), from, to, scratch.matrices[0].data(), scratch.matrices[1].data(),
           scratch.matrices[2].data(), scratch, values);
}

void evaluate(const GaussGrid& grid, std::span<const Quad> coefficients, std::span<const Vec3> points,
              std::span<Quad> sums) {
  if (points.empty()) return;
  Vec3 centre, inverse_half;
  for (int axis = 0; axis < 3; ++axis) {
    const GridAxis& one = grid.axes[static_cast<std::size_t>(axis)];
    centre[axis] = one.centre;
    inverse_half[axis] = one.half > 0 ? 1 / one.half : 0;
  }
  grid_loops().evaluate(reinterpret_cast<const double*>(coefficients.data()), counts(grid).data(),
                        centre.data(), inverse_half.data(), points.front().data(), points.size(),
                        reinterpret_cast<double*>(sums.data()));
}

}  // namespace handloft::geometry
