#pragma once
// The palette that lies on the table: where each command's cell is, in the world frame. The server decides by
// it which command an on-table gesture means, the client draws it, the simulated hand touches it.

#include <array>
#include <optional>
#include <string_view>

namespace handloft {

enum class PaletteCommand { fit, representation, new_shape, symmetry, undo, redo };

/// A rectangle on the table, z = 0: centre and full extents in metres.
struct PaletteCell {
  PaletteCommand command;
  std::string_view label;
  double centre_x_m, centre_y_m;
  double width_m, height_m;
};

/// Cells of 50 mm at a pitch of 60 mm: large enough for a palm's worth of uncertainty, and within reach
/// beside the work.
inline constexpr std::array<PaletteCell, 6> table_palette{{
    {PaletteCommand::fit, "Fit", 0.17, 0.06, 0.05, 0.05},
    {PaletteCommand::representation, "Points / surface", 0.23, 0.06, 0.05, 0.05},
    {PaletteCommand::new_shape, "New shape", 0.17, 0.0, 0.05, 0.05},
    {PaletteCommand::symmetry, "Symmetry", 0.23, 0.0, 0.05, 0.05},
    {PaletteCommand::undo, "Undo", 0.17, -0.06, 0.05, 0.05},
    {PaletteCommand::redo, "Redo", 0.23, -0.06, 0.05, 0.05},
}};

/// The command whose cell holds (x, y), in metres; nullopt between and beside the cells.
constexpr std::optional<PaletteCommand> palette_command_at(double x_m, double y_m) {
  for (const PaletteCell& cell : table_palette) {
    const double dx = x_m - cell.centre_x_m;
    const double dy = y_m - cell.centre_y_m;
    if (dx >= -cell.width_m / 2 && dx <= cell.width_m / 2 && dy >= -cell.height_m / 2 &&
        dy <= cell.height_m / 2) {
      return cell.command;
    }
  }
  return std::nullopt;
}

}  // namespace handloft
