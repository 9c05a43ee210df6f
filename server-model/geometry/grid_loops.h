#pragma once
// The inner loops of gauss_grid.cpp, compiled for several widths of registers; the widest that the machine
// has is taken. All give the same bits. Arrays of four doubles a value, nodes with the last axis running
// fastest.

#include <cstddef>

namespace handloft::geometry {

struct GridLoops {
  /// out[a'][b'][c'] += sum_abc X[a'][a] Y[b'][b] Z[c'][c] in[a][b][c], an axis at a time; X is to[0] by
  /// from[0]. `first` and `second` hold the intermediate values.
  void (*contract)(const double* in, const int* from, const int* to, const double* x, const double* y,
                   const double* z, double* first, double* second, double* out);
  /// The same with two matrices for each axis: entries are eights, four of the one and four of the other, and
  /// so are the values of `out`, `first` and `second`.
  void (*contract_twice)(const double* in, const int* from, const int* to, const double* x, const double* y,
                         const double* z, double* first, double* second, double* out);
  /// out[a][b][c] += x[a] y[b] z[c] value.
  void (*add_product)(const double* x, const double* y, const double* z, const int* nodes,
                      const double* value, double* out);
  /// sums[i] += sum_abc T_a(x_i) T_b(y_i) T_c(z_i) in[a][b][c], T the Chebyshev polynomials, for points
  /// (three doubles each) brought to -1..1 by  (p - centre) * inverse_half.
  void (*evaluate)(const double* in, const int* nodes, const double* centre, const double* inverse_half,
                   const double* points, std::size_t count, double* sums);
  /// values[i] = exp(-values[i]^2 * rate), for arguments of exp in -4..0, within 1e-12. `count` is rounded up
  /// to eights: the array must reach that far.
  void (*gaussians)(double* values, std::size_t count, double rate);
};

const GridLoops& grid_loops();

}  // namespace handloft::geometry
