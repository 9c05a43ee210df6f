#pragma once
// The inner loops of the iterative stiffness solver, compiled for several widths of registers; the widest
// that the machine has is taken. All add in the same order, so all give the same bits.

#include <cstddef>

namespace handloft::geometry {

inline constexpr std::size_t panel_lanes = 8;     ///< Rows of a matrix that are held together.
inline constexpr std::size_t block_columns = 24;  ///< Columns that are multiplied together.

struct StiffnessLoops {
  /// c[col * 8 + lane] += sum_k a[k * 8 + lane] * b[k * 24 + col], in the order of k.
  void (*multiply)(const double* a, const double* b, std::size_t depth, double* c);
  /// out[j] = sum_r weights[r] * rows[r][j], in the order of r. count >= 1.
  void (*combine)(const double* const* rows, const double* weights, std::size_t count, std::size_t length,
                  double* out);
  /// out[j] += sum_d bands[d][j] * in[j + d], in the order of d; `in` reaches count - 1 past its end.
  void (*add_band)(const double* const* bands, std::size_t count, const double* in, std::size_t length,
                   double* out);
};

const StiffnessLoops& stiffness_loops();

}  // namespace handloft::geometry
