#include "client-hmd/hud/shortcuts.h"

#include <array>
#include <functional>
#include <string_view>

#include "client-hmd/desktop/key_map.h"

namespace handloft::client {
namespace {

constexpr std::array named_keys{
    std::string_view("Enter"),    std::string_view("Tab"),       std::string_view("Space"),
    std::string_view("Delete"),   std::string_view("Backspace"), std::string_view("PageUp"),
    std::string_view("PageDown"), std::string_view("Home"),      std::string_view("End")};

std::string key_that(const std::function<bool(const DesktopCommand&)>& is_it) {
  // From what is easiest to press.
  constexpr std::array modifiers{Modifiers{false, false, false}, Modifiers{false, true, false},
                                 Modifiers{true, false, false}, Modifiers{true, true, false}};
  for (const Modifiers& held : modifiers) {
    const auto written = [&held](std::string_view key) {
      return std::string(held.control ? "Ctrl+" : "") + (held.shift ? "⇧" : "") + std::string(key);
    };
    const auto means_it = [&](std::string_view key) {
      const std::optional<DesktopCommand> meant = command_of(key, held);
      return meant && is_it(*meant);
    };
    for (char key = '!'; key <= '_'; ++key) {
      if (means_it(std::string_view(&key, 1))) return written(std::string_view(&key, 1));
    }
    for (const std::string_view key : named_keys) {
      if (means_it(key)) return written(key);
    }
  }
  return {};
}

}  // namespace

std::string shortcut_of(PaletteCommand command) {
  return key_that([command](const DesktopCommand& meant) {
    return meant.action == DesktopAction::command && meant.command == command;
  });
}

std::string shortcut_of(DesktopAction action) {
  return key_that([action](const DesktopCommand& meant) { return meant.action == action; });
}

}  // namespace handloft::client
