// The palette's one table: every command has a name of its own and a cell (A25).

#include "common/base/table_palette.h"

#include <gtest/gtest.h>

#include <set>
#include <string_view>

namespace handloft {
namespace {

TEST(TablePalette, A25_every_command_has_one_cell_and_a_name_that_leads_back) {
  constexpr int commands = static_cast<int>(PaletteCommand::delete_icon) + 1;
  static_assert(commands == static_cast<int>(table_palette.size()));
  std::set<std::string_view> names;
  for (int i = 0; i < commands; ++i) {
    const auto command = static_cast<PaletteCommand>(i);
    EXPECT_EQ(palette_cell_of(command).command, command);
    const std::string_view name = palette_command_name(command);
    EXPECT_FALSE(name.empty()) << i;
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_EQ(palette_command_named(name), command) << name;
  }
}

TEST(TablePalette, names_are_the_enumerators_and_nothing_else_is_one) {
  EXPECT_EQ(palette_command_name(PaletteCommand::fit), "fit");
  EXPECT_EQ(palette_command_name(PaletteCommand::erase), "erase");
  EXPECT_EQ(palette_command_named("icon_pen"), PaletteCommand::icon_pen);
  for (const std::string_view none : {"", "Fit", "fit ", "icon", "delete"}) {
    EXPECT_EQ(palette_command_named(none), std::nullopt) << none;
  }
  EXPECT_EQ(palette_command_named(std::string_view("fit\0", 4)), std::nullopt);
}

}  // namespace
}  // namespace handloft
