#pragma once
// Which keys ask for what: the one table behind the keyboard, the help on the screen and the README.

#include <optional>
#include <span>
#include <string_view>

#include "client-hmd/desktop/desktop_state.h"
#include "client-hmd/desktop/input.h"

namespace handloft::client {

struct KeyBinding {
  std::string_view key;  ///< As KeyChanged::key.
  bool shift = false;
  bool control = false;
  DesktopAction action = DesktopAction::command;
  PaletteCommand command = PaletteCommand::fit;  ///< With DesktopAction::command.
};

/// What a press of that key asks for, if anything. Shift and Control must be as in the table, except that a
/// key that is there without Shift means the same with it where nothing else is meant: Shift also makes a
/// hand press firmly.
std::optional<DesktopCommand> command_of(std::string_view key, const Modifiers& modifiers);

/// Whether holding the key repeats it.
bool repeats(DesktopAction action);

/// The help, in the order in which one learns it.
std::span<const KeyHelp> key_help();

}  // namespace handloft::client
