#pragma once
// What is printed on a tag: AprilTag 36h11 as libapriltag draws it, 10 x 10 cells with the white margin
// around the black border square of 8 x 8.

#include <array>
#include <optional>

namespace handloft::tracking {

struct TagBitmap {
  static constexpr int cells = 10;                     ///< With the white margin.
  static constexpr int border_cells = 8;               ///< Across the black square: TagPlacement::edge_m.
  std::array<std::array<bool, cells>, cells> white{};  ///< [row from the top][column from the left]

  /// Edge of the whole sheet for a black square of `edge_m`.
  static double sheet_edge_m(double edge_m) { return edge_m * cells / border_cells; }
  /// Whether the sheet is white at (x, y) of the tag's frame (x right, y up, origin in the middle); nullopt
  /// beside it.
  std::optional<bool> white_at(double x_m, double y_m, double edge_m) const;
};

/// nullopt when the family has no such tag (0..586).
std::optional<TagBitmap> tag_bitmap(int id);

}  // namespace handloft::tracking
