#pragma once
// The key that a button's command has, as it is written on buttons: from the keyboard's own table
// (desktop/key_map.h), so that the two cannot disagree.

#include <string>

#include "client-hmd/desktop/desktop_state.h"

namespace handloft::client {

/// "Ctrl+Z", "N", "⇧P"; empty: none.
std::string shortcut_of(PaletteCommand command);
/// The same for DesktopAction::tool_lay and its like.
std::string shortcut_of(DesktopAction action);

}  // namespace handloft::client
