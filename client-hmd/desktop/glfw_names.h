#pragma once
// GLFW's numbers in the words of input.h.

#include <string>

namespace handloft::client {

/// Of a key by its number and scan code; empty for what has no name there.
std::string key_name(int key, int scancode);

/// Shift, Control, Alt and the like, which Modifiers tells of.
bool is_modifier(int key);

}  // namespace handloft::client
