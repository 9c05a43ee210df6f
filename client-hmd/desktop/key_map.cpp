#include "client-hmd/desktop/key_map.h"

#include <array>

namespace handloft::client {
namespace {

using Action = DesktopAction;
using Command = PaletteCommand;

constexpr KeyBinding on(std::string_view key, Action action) {
  return {key, false, false, action, Command::fit};
}
constexpr KeyBinding with_shift(std::string_view key, Action action) {
  return {key, true, false, action, Command::fit};
}
constexpr KeyBinding with_control(std::string_view key, Action action) {
  return {key, false, true, action, Command::fit};
}
constexpr KeyBinding on(std::string_view key, Command command) {
  return {key, false, false, Action::command, command};
}
constexpr KeyBinding with_shift(std::string_view key, Command command) {
  return {key, true, false, Action::command, command};
}
constexpr KeyBinding with_control(std::string_view key, Command command) {
  return {key, false, true, Action::command, command};
}

constexpr std::array bindings{
    on("1", Action::tool_lay),
    on("2", Action::tool_push),
    on("3", Action::tool_draw),
    on("4", Action::tool_trim),
    on("5", Action::tool_move),
    on("6", Action::tool_region),

    on(".", Action::pressure_up),
    on(",", Action::pressure_down),
    on("]", Action::range_up),
    on("[", Action::range_down),
    on("Q", Action::turn_left),
    on("E", Action::turn_right),
    on("Left", Action::lean_left),
    on("Right", Action::lean_right),
    on("Up", Action::lean_up),
    on("Down", Action::lean_down),
    on("T", Action::tap_thumb),
    on("Escape", Action::cancel),

    on("P", Action::next_plane),
    on("C", Action::plane_here),
    on("PageUp", Action::plane_nearer),
    on("PageDown", Action::plane_farther),
    on("G", Action::toggle_stick),
    on("V", Action::toggle_snap),
    on("L", Action::toggle_along),

    on("7", Action::view_designer),
    on("8", Action::view_front),
    on("9", Action::view_top),
    on("0", Action::view_side),
    on("F", Action::frame_all),
    with_shift("F", Action::frame_selected),
    on("H", Action::toggle_head),
    on("D", Action::toggle_distances),
    on("Z", Action::toggle_zebra),
    with_shift("Z", Action::next_light),
    with_shift("L", Action::next_lines),
    on("S", Action::save_picture),
    on("F1", Action::toggle_help),
    with_control("Q", Action::close),

    with_control("Z", Command::undo),
    KeyBinding{"Z", true, true, Action::command, Command::redo},
    with_control("Y", Command::redo),
    on("Enter", Command::fit),
    on("Tab", Command::representation),
    on("B", Command::both),
    on("N", Command::new_shape),
    on("Y", Command::symmetry),
    on("J", Command::select_next),
    on("U", Command::select_nearest),
    with_control("D", Command::duplicate),
    on("Delete", Command::erase),
    on("O", Command::exponent),
    with_shift("O", Command::degree),
    on("K", Command::keep_curve),
    on("M", Command::falloff),
    with_shift("P", Command::refit_plane),
    on("X", Command::export_file),
    on("W", Command::sculpt),
    with_control("Enter", Command::commit_sculpting),
    with_control("Backspace", Command::recover_sculpting),
    on("I", Command::icon_property),
    with_shift("I", Command::icon_role),
    with_control("I", Command::icon_state),
    with_shift("M", Command::icon_stiffness),
    with_shift("Delete", Command::delete_icon),
    with_shift("N", Command::new_alternative),
    with_shift("J", Command::next_alternative),
};

constexpr std::array<KeyHelp, 28> help{{
    {"1 2 3", "lay points · push and drag · draw profiles and icons"},
    {"4 5 6", "trim by a closed curve · move whole shapes · region icon"},
    {"left button", "works with the tool; Escape takes back what is in the air"},
    {"Shift, Ctrl held", "press firmly, faintly;  , .  or Shift + wheel set the pressure"},
    {"[ ]  Ctrl + wheel", "range of a push, reach of a bend, size while moving"},
    {"right button", "turns the view about what is under the pointer; Space + left, too"},
    {"middle button", "moves the view; Shift + right, Space + Shift + left, too"},
    {"wheel", "nearer to what is under the pointer"},
    {"7 8 9 0", "view from the designer's place, front, top, side"},
    {"F  Shift + F", "all of the scene, the selected shape"},
    {"P  C", "next direction of the work plane · plane through what is under the pointer"},
    {"PageUp PageDown", "work plane nearer, farther; Alt + wheel, too"},
    {"G  V  L", "cursor lies on shapes · catches points · drags go along the normal"},
    {"Q E  arrows", "turn what the hand holds; R held: the pointer turns it"},
    {"T", "tap of the thumb: divides the stroke being drawn"},
    {"A held", "several strokes are one change"},
    {"Enter  Tab  B", "fit a surface · points or surface · both"},
    {"Ctrl + Z  Ctrl + Y", "undo · redo"},
    {"N  Y  J  U", "new shape · symmetry · select next · nearest again"},
    {"Ctrl + D  Delete", "duplicate · delete"},
    {"O  Shift + O", "exponent of the outline · degree of the surface"},
    {"K  M  Shift + P", "profiles leave points · falloff · refit the plane"},
    {"W  Ctrl + Enter", "sculpt the shape, or a flat sheet · commit; Ctrl + Backspace recovers"},
    {"I  Shift + I  Ctrl + I", "icon's property · hold or load · state; Shift + M stiffness, Shift + Delete"},
    {"Shift + N  Shift + J", "new alternative · next alternative"},
    {"X  S  D  Z  H", "export STEP · picture · distances · stripes · follow the head"},
    {"Shift + Z  Shift + L", "next light: studio, clay, paint, silver, curvature · next lines over surfaces"},
    {"F1  Ctrl + Q", "these lines · end"},
}};

}  // namespace

std::optional<DesktopCommand> command_of(std::string_view key, const Modifiers& modifiers) {
  const KeyBinding* without_shift = nullptr;
  for (const KeyBinding& binding : bindings) {
    if (binding.key != key || binding.control != modifiers.control) continue;
    if (binding.shift == modifiers.shift) return DesktopCommand{binding.action, binding.command, {}};
    if (!binding.shift) without_shift = &binding;
  }
  if (without_shift != nullptr && without_shift->action != Action::command) {
    return DesktopCommand{without_shift->action, without_shift->command, {}};
  }
  return std::nullopt;
}

bool repeats(DesktopAction action) {
  switch (action) {
    case Action::pressure_up:
    case Action::pressure_down:
    case Action::range_up:
    case Action::range_down:
    case Action::turn_left:
    case Action::turn_right:
    case Action::lean_left:
    case Action::lean_right:
    case Action::lean_up:
    case Action::lean_down:
    case Action::plane_nearer:
    case Action::plane_farther:
      return true;
    default:
      return false;
  }
}

std::span<const KeyHelp> key_help() {
  return help;
}

}  // namespace handloft::client
