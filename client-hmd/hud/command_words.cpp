// The palette's commands for panels: where each one's button is and what it does, in one sentence.

#include <array>

#include "client-hmd/hud/panel_contents.h"

namespace handloft::client {
namespace {

struct CommandWords {
  PaletteCommand command;
  std::string_view section;
  std::string_view help;
};

constexpr std::array<CommandWords, table_palette.size()> all_words{{
    {PaletteCommand::fit, "Shape", "Fits a smooth surface to the points of the shape."},
    {PaletteCommand::representation, "Shape", "Shows the points or the surface."},
    {PaletteCommand::both, "Shape", "Shows the points together with the surface."},
    {PaletteCommand::new_shape, "Shape", "What is laid next begins a shape of its own."},
    {PaletteCommand::symmetry, "Shape", "Mirrors new strokes: off, in the same shape, or as a partner."},
    {PaletteCommand::degree, "Shape", "How much a surface may bend: 1 to 6, or by itself."},
    {PaletteCommand::exponent, "Shape", "Trims between an ellipse and a box."},
    {PaletteCommand::refit_plane, "Shape", "Fits anew, with the base plane that the points have now."},
    {PaletteCommand::falloff, "Shape", "How a push fades: literal, or smooth."},

    {PaletteCommand::undo, "Edit", "Takes the last step back."},
    {PaletteCommand::redo, "Edit", "Takes the step again that was taken back."},
    {PaletteCommand::move, "Edit", "A closed hand moves whole shapes, or sculpts again."},
    {PaletteCommand::duplicate, "Edit", "Makes a copy of the shape beside it."},
    {PaletteCommand::erase, "Edit", "Deletes the shape. Undo brings it back."},

    {PaletteCommand::select_next, "Select", "Selects the next shape, and after the last one none."},
    {PaletteCommand::select_nearest, "Select", "Gestures act on whatever is nearest to the hand."},

    {PaletteCommand::trim_mode, "Curves", "What a pointing hand draws: a profile, or a boundary."},
    {PaletteCommand::keep_curve, "Curves", "Keeps a drawn profile as points of the shape."},

    {PaletteCommand::new_alternative, "Design",
     "Goes on with a copy of the design; this one stays as it is."},
    {PaletteCommand::next_alternative, "Design", "Shows the next alternative of the design."},
    {PaletteCommand::export_file, "Design", "Writes the design as files for CAD programs."},

    {PaletteCommand::sculpt, "Sculpt", "Makes a surface that icons shape."},
    {PaletteCommand::commit_sculpting, "Sculpt", "Takes the shape as the new beginning, without icons."},
    {PaletteCommand::recover_sculpting, "Sculpt", "Brings the initial shape back."},

    {PaletteCommand::icon_pen, "Icons", "What a pointing hand lays: a point, a curve, a region."},
    {PaletteCommand::icon_property, "Icons", "What the icon holds: position, direction or normal."},
    {PaletteCommand::icon_role, "Icons", "Whether the icon holds or pulls."},
    {PaletteCommand::icon_state, "Icons", "Whether the icon drives, waits or sleeps."},
    {PaletteCommand::icon_stiffness, "Icons", "How hard a load pulls."},
    {PaletteCommand::delete_icon, "Icons", "Deletes the icon."},

    {PaletteCommand::next_page, "", "Turns the page of the palette on the table."},
}};

const CommandWords& words_of(PaletteCommand command) {
  for (const CommandWords& words : all_words) {
    if (words.command == command) return words;
  }
  return all_words.back();
}

}  // namespace

std::string_view section_of(PaletteCommand command) {
  return words_of(command).section;
}

std::string_view command_help(PaletteCommand command) {
  return words_of(command).help;
}

}  // namespace handloft::client
