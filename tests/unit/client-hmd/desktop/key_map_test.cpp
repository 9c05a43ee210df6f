// Keys, and that the page for people tells of the same ones.

#include "client-hmd/desktop/key_map.h"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

namespace handloft::client {
namespace {

TEST(KeyMap, ModifiersTellKeysApart) {
  EXPECT_EQ(command_of("Z", {})->action, DesktopAction::toggle_zebra);
  EXPECT_EQ(command_of("Z", {true, false, false})->action, DesktopAction::next_light);
  const auto undo = command_of("Z", {false, true, false});
  ASSERT_TRUE(undo);
  EXPECT_EQ(undo->command, PaletteCommand::undo);
  EXPECT_EQ(command_of("Z", {true, true, false})->command, PaletteCommand::redo);
  EXPECT_FALSE(command_of("Enter", {true, false, false})) << "Shift presses firmly, it fits nothing";
  EXPECT_EQ(command_of("Q", {true, false, false})->action, DesktopAction::turn_left) << "firmly, too";
  EXPECT_FALSE(command_of("", {}));
  EXPECT_FALSE(command_of("F11", {}));
}

TEST(KeyMap, ThePageForPeopleHasEveryLineOfTheHelp) {
  std::ifstream file("client-hmd/desktop/README.md");
  ASSERT_TRUE(file) << "run from the repository's root";
  std::stringstream text;
  text << file.rdbuf();
  for (const KeyHelp& line : key_help()) {
    EXPECT_THAT(text.str(), ::testing::HasSubstr(fmt::format("| {} | {} |", line.keys, line.words)));
  }
}

}  // namespace
}  // namespace handloft::client
