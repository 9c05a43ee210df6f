#pragma once
// A chessboard's size, for whoever finds one, prints one or asks for one (T11).

#include <cstddef>

namespace handloft::tracking {

struct ChessboardShape {
  int columns = 9;  ///< Inner corners along x.
  int rows = 6;     ///< Along y.
  double square_m = 0.025;
};

/// Where the corner at (column, row) stands in a list of them row by row.
constexpr std::size_t corner_index(int columns, int column, int row) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
}

/// Of inner corners each way.
inline constexpr int fewest_board_corners = 3, most_board_corners = 30;

}  // namespace handloft::tracking
