#pragma once
// Where input events become things: what a window reports once a frame changes the view here, and whatever
// else follows keys and pointer (a hand on the desktop) is moved from here.

#include "client-hmd/desktop/window.h"
#include "client-hmd/main/view_state.h"

namespace handloft::client {

/// What the frame loop itself has to do about the input.
struct InputWishes {
  bool end = false;
  bool screenshot = false;
  bool film = false;  ///< The camera follows the head from now on.
};

InputWishes apply_input(const WindowInput& input, ViewState& view);

}  // namespace handloft::client
