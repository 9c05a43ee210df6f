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
  next_page,
  falloff,
  sculpt,
  commit_sculpting,
  recover_sculpting,
  icon_pen,
  icon_property,
  icon_role,
  icon_state,
  icon_stiffness,
  delete_icon,
};

/// What programs call a command (HandCommand.command): the enumerator's name, never changed.
constexpr std::string_view palette_command_name(PaletteCommand command) {
  switch (command) {
    case PaletteCommand::fit:
      return "fit";
    case PaletteCommand::representation:
      return "representation";
    case PaletteCommand::new_shape:
      return "new_shape";
    case PaletteCommand::symmetry:
      return "symmetry";
    case PaletteCommand::undo:
      return "undo";
    case PaletteCommand::redo:
      return "redo";
    case PaletteCommand::select_next:
      return "select_next";
    case PaletteCommand::select_nearest:
      return "select_nearest";
    case PaletteCommand::move:
      return "move";
    case PaletteCommand::duplicate:
      return "duplicate";
    case PaletteCommand::erase:
      return "erase";
    case PaletteCommand::both:
      return "both";
    case PaletteCommand::refit_plane:
      return "refit_plane";
    case PaletteCommand::degree:
      return "degree";
    case PaletteCommand::exponent:
      return "exponent";
    case PaletteCommand::trim_mode:
      return "trim_mode";
    case PaletteCommand::keep_curve:
      return "keep_curve";
    case PaletteCommand::new_alternative:
      return "new_alternative";
    case PaletteCommand::next_alternative:
      return "next_alternative";
    case PaletteCommand::export_file:
      return "export_file";
    case PaletteCommand::next_page:
      return "next_page";
    case PaletteCommand::falloff:
      return "falloff";
    case PaletteCommand::sculpt:
      return "sculpt";
    case PaletteCommand::commit_sculpting:
      return "commit_sculpting";
    case PaletteCommand::recover_sculpting:
      return "recover_sculpting";
    case PaletteCommand::icon_pen:
      return "icon_pen";
    case PaletteCommand::icon_property:
      return "icon_property";
    case PaletteCommand::icon_role:
      return "icon_role";
    case PaletteCommand::icon_state:
      return "icon_state";
    case PaletteCommand::icon_stiffness:
      return "icon_stiffness";
    case PaletteCommand::delete_icon:
      return "delete_icon";
  }
  return {};
}

/// A rectangle on the table, z = 0: centre and full extents in metres.
struct PaletteCell {
  PaletteCommand command;
  std::string_view label;
  double centre_x_m, centre_y_m;
  double width_m, height_m;
  std::string_view sign;  ///< One character that stands above the label; DejaVu Sans has them all.
  int page = 0;           ///< Which page it is on, from first_palette_page; 0: on every page.
};

inline constexpr int first_palette_page = 1;

/// Cells of 50 mm at a pitch of 60 mm: large enough for a palm's worth of uncertainty. Three blocks around
/// the work, none over a tag of the board (daemon-tracking/source/rig.cpp): what every shape needs to the
/// right of it, what is done with whole shapes to the left, and what is set now and then in a row between the
/// work and the designer. That row has pages, which "More" turns; a new command takes a free place of the
/// last page's row (x from -0.18 to 0.18), or of a page of its own, and nothing else changes: server, client
/// and simulated hand know the pages from here.
inline constexpr std::array<PaletteCell, 31> table_palette{{
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

    {PaletteCommand::export_file, "Export", -0.18, -0.205, 0.05, 0.05, "⇪", 1},
    {PaletteCommand::degree, "Degree", -0.12, -0.205, 0.05, 0.05, "ⁿ", 1},
    {PaletteCommand::exponent, "Exponent", -0.06, -0.205, 0.05, 0.05, "◇", 1},
    {PaletteCommand::trim_mode, "Profile / boundary", 0.0, -0.205, 0.05, 0.05, "✂", 1},
    {PaletteCommand::keep_curve, "Keep curve", 0.06, -0.205, 0.05, 0.05, "∿", 1},
    {PaletteCommand::new_alternative, "New alternative", 0.12, -0.205, 0.05, 0.05, "⎇", 1},
    {PaletteCommand::next_alternative, "Next alternative", 0.18, -0.205, 0.05, 0.05, "⇄", 1},

    {PaletteCommand::sculpt, "Sculpt", -0.18, -0.205, 0.05, 0.05, "▦", 2},
    {PaletteCommand::commit_sculpting, "Commit", -0.12, -0.205, 0.05, 0.05, "✓", 2},
    {PaletteCommand::recover_sculpting, "Recover", -0.06, -0.205, 0.05, 0.05, "⟲", 2},
    {PaletteCommand::falloff, "Falloff", 0.0, -0.205, 0.05, 0.05, "∩", 2},
    {PaletteCommand::refit_plane, "Refit plane", 0.06, -0.205, 0.05, 0.05, "▱", 2},

    {PaletteCommand::icon_pen, "Icon pen", -0.18, -0.205, 0.05, 0.05, "✎", 3},
    {PaletteCommand::icon_property, "Icon property", -0.12, -0.205, 0.05, 0.05, "➹", 3},
    {PaletteCommand::icon_role, "Hold / load", -0.06, -0.205, 0.05, 0.05, "⚓", 3},
    {PaletteCommand::icon_state, "Icon state", 0.0, -0.205, 0.05, 0.05, "☀", 3},
    {PaletteCommand::icon_stiffness, "Load stiffness", 0.06, -0.205, 0.05, 0.05, "⚖", 3},
    {PaletteCommand::delete_icon, "Delete icon", 0.12, -0.205, 0.05, 0.05, "✘", 3},

    {PaletteCommand::next_page, "More", 0.24, -0.205, 0.05, 0.05, "⋯"},
}};

/// How many pages there are.
inline constexpr int palette_pages = [] {
  int pages = first_palette_page;
  for (const PaletteCell& cell : table_palette) pages = cell.page > pages ? cell.page : pages;
  return pages;
}();

/// The page that "More" turns to; after the last one the first again.
constexpr int palette_page_after(int page) {
  return page >= first_palette_page && page < palette_pages ? page + 1 : first_palette_page;
}

/// Whether the table shows a cell while it shows `page`.
constexpr bool is_on_page(const PaletteCell& cell, int page) {
  return cell.page == 0 || cell.page == page;
}

/// The cell of `page` that holds (x, y), in metres; null between and beside the cells, and for what is no
/// number.
constexpr const PaletteCell* palette_cell_at(double x_m, double y_m, int page) {
  for (const PaletteCell& cell : table_palette) {
    if (!is_on_page(cell, page)) continue;
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
constexpr std::optional<PaletteCommand> palette_command_at(double x_m, double y_m, int page) {
  const PaletteCell* cell = palette_cell_at(x_m, y_m, page);
  return cell ? std::optional(cell->command) : std::nullopt;
}

/// The cell of a command. Every command has one, on one page.
constexpr const PaletteCell& palette_cell_of(PaletteCommand command) {
  for (const PaletteCell& cell : table_palette) {
    if (cell.command == command) return cell;
  }
  return table_palette.front();
}

/// The command of that name; nullopt: none has it.
constexpr std::optional<PaletteCommand> palette_command_named(std::string_view name) {
  for (const PaletteCell& cell : table_palette) {
    if (palette_command_name(cell.command) == name) return cell.command;
  }
  return std::nullopt;
}

}  // namespace handloft
