#pragma once
// A chessboard's size, for whoever finds one, prints one or asks for one (T11).

namespace handloft::tracking {

struct ChessboardShape {
  int columns = 9;  ///< Inner corners along x.
  int rows = 6;     ///< Along y.
  double square_m = 0.025;
};

/// Of inner corners each way.
inline constexpr int fewest_board_corners = 3, most_board_corners = 30;

}  // namespace handloft::tracking
