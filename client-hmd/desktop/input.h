#pragma once
// What mouse, keyboard and pen did, as values with times (V6): a window makes them, tests make them too. They
// are handled one after another, and not once a frame: a pointer that goes round a corner between two slow
// frames has gone round it.

#include <glm/glm.hpp>
#include <string>
#include <variant>

#include "common/base/clock.h"

namespace handloft::client {

enum class PointerButton { left, middle, right };

struct Modifiers {
  bool shift = false;
  bool control = false;
  bool alt = false;
};

/// Pixels of the framebuffer, the origin at its top left corner.
struct PointerMoved {
  glm::dvec2 at_px{0.0};
};

struct ButtonChanged {
  PointerButton button = PointerButton::left;
  bool down = false;
  glm::dvec2 at_px{0.0};
};

/// Steps of the wheel: up, and away from the person, is positive.
struct WheelTurned {
  double steps = 0.0;
};

/// `key` is what stands on the key in the person's own layout, a capital ("Q", "[", "1"), or its name:
/// "Enter", "Tab", "Space", "Escape", "Backspace", "Delete", "Left", "Right", "Up", "Down", "PageUp",
/// "PageDown", "Home", "End", "F1" to "F12". Modifiers are told by `Modifiers` alone.
struct KeyChanged {
  std::string key;
  bool down = false;
  bool repeat = false;  ///< Held for so long that the keyboard repeats it.
};

/// A pressure pen's tip, by whatever reports one; 0: it has left the tablet, and the keys decide again.
struct PenPressed {
  double pressure = 0.0;  ///< 0..1
};

/// The pointer is elsewhere; where a button is held it still tells where it goes.
struct PointerLeft {};

/// The window no longer has the keyboard: whatever was held is let go.
struct FocusLost {};

struct InputEvent {
  TimePoint time;
  Modifiers modifiers;  ///< As they are with this event.
  std::variant<PointerMoved, ButtonChanged, WheelTurned, KeyChanged, PenPressed, PointerLeft, FocusLost> what;
};

}  // namespace handloft::client
