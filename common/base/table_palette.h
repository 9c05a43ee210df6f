#pragma once
// The palette that lies on the table (A25: the hand on the table switches modes): where each command's cell
// is, in the world frame. The server decides by it which command an on-table gesture means, the client draws
// it, the simulated hand touches it. One table for all three, so that they cannot disagree.

#include <array>
#include <optional>
#include <string_view>

namespace handloft {

enum class PaletteCommand {
  fit,
  representation,
  new_shape,
  symmetry,
  undo,
  redo,
  select_next,
  select_nearest,
  move,
  duplicate,
  erase,
  both,
  refit_plane,
  degree,
  exponent,
  trim_mode,
  keep_curve,
  new_alternative,
  next_alternative,
  export_file,
};

/// A rectangle on the table, z = 0: centre and full extents in metres.
struct PaletteCell {
  PaletteCommand command;
  std::string_view label;
  double centre_x_m, centre_y_m;
  double width_m, height_m;
  std::string_view sign;  ///< One character that stands above the label; DejaVu Sans has them all.
};

/// Cells of 50 mm at a pitch of 60 mm: large enough for a palm's worth of uncertainty. Three blocks around
/// the work, none over a tag of the board (daemon-tracking/source/rig.cpp): what every shape needs to the
/// right of it, what is done with whole shapes to the left, and what is set now and then in a row between the
/// work and the designer.
inline constexpr std::array<PaletteCell, 20> table_palette{{
    {PaletteCommand::fit, "Fit", 0.17, 0.06, 0.05, 0.05, "◠"},
    {PaletteCommand::representation, "Points / surface", 0.23, 0.06, 0.05, 0.05, "∴"},
    {PaletteCommand::new_shape, "New shape", 0.17, 0.0, 0.05, 0.05, "✚"},
    {PaletteCommand::symmetry, "Symmetry", 0.23, 0.0, 0.05, 0.05, "◐"},
    {PaletteCommand::undo, "Undo", 0.17, -0.06, 0.05, 0.05, "↶"},
    {PaletteCommand::redo, "Redo", 0.23, -0.06, 0.05, 0.05, "↷"},

    {PaletteCommand::select_next, "Select next", -0.145, 0.06, 0.05, 0.05, "☞"},
    {PaletteCommand::select_nearest, "Nearest", -0.085, 0.06, 0.05, 0.05, "◎"},
    {PaletteCommand::move, "Move / sculpt", -0.145, 0.0, 0.05, 0.05, "✥"},
    {PaletteCommand::duplicate, "Duplicate", -0.085, 0.0, 0.05, 0.05, "❐"},
    {PaletteCommand::erase, "Delete", -0.145, -0.06, 0.05, 0.05, "✖"},
    {PaletteCommand::both, "Points + surface", -0.085, -0.06, 0.05, 0.05, "◉"},

    {PaletteCommand::refit_plane, "Refit plane", -0.18, -0.205, 0.05, 0.05, "▱"},
    {PaletteCommand::degree, "Degree", -0.12, -0.205, 0.05, 0.05, "ⁿ"},
    {PaletteCommand::exponent, "Exponent", -0.06, -0.205, 0.05, 0.05, "◇"},
    {PaletteCommand::trim_mode, "Profile / boundary", 0.0, -0.205, 0.05, 0.05, "✂"},
    {PaletteCommand::keep_curve, "Keep curve", 0.06, -0.205, 0.05, 0.05, "∿"},
    {PaletteCommand::new_alternative, "New alternative", 0.12, -0.205, 0.05, 0.05, "⎇"},
    {PaletteCommand::next_alternative, "Next alternative", 0.18, -0.205, 0.05, 0.05, "⇄"},
    {PaletteCommand::export_file, "Export", 0.24, -0.205, 0.05, 0.05, "⇪"},
}};

/// The cell that holds (x, y), in metres; null between and beside the cells, and for what is no number.
constexpr const PaletteCell* palette_cell_at(double x_m, double y_m) {
  for (const PaletteCell& cell : table_palette) {
    const double dx = x_m - cell.centre_x_m;
    const double dy = y_m - cell.centre_y_m;
    if (dx >= -cell.width_m / 2 && dx <= cell.width_m / 2 && dy >= -cell.height_m / 2 &&
        dy <= cell.height_m / 2) {
      return &cell;
    }
  }
  return nullptr;
}

/// The command of that cell.
constexpr std::optional<PaletteCommand> palette_command_at(double x_m, double y_m) {
  const PaletteCell* cell = palette_cell_at(x_m, y_m);
  return cell ? std::optional(cell->command) : std::nullopt;
}

/// The cell of a command. Every command has one.
constexpr const PaletteCell& palette_cell_of(PaletteCommand command) {
  for (const PaletteCell& cell : table_palette) {
    if (cell.command == command) return cell;
  }
  return table_palette.front();
}

}  // namespace handloft
