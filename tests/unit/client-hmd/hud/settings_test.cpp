// Settings are kept, and a file that cannot be read is told and never lost (V7, accessibility).

#include "client-hmd/hud/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/support/test_data.h"

namespace handloft::client {
namespace {

using testing::HasSubstr;

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

HudSettings unlike_defaults() {
  HudSettings settings;
  settings.text_percent = 170;
  settings.colours = ColourScheme::high_contrast;
  settings.left_open = false;
  settings.right_open = false;
  settings.tour_done = true;
  settings.tour_step = 3;
  return settings;
}

TEST(Settings, ComeBackFromTheirFile) {
  const handloft::test::TemporaryDirectory folder;
  const auto path = folder.path() / "new" / "handloft" / "hmd.toml";
  ASSERT_TRUE(SettingsFile(path).save(unlike_defaults()).ok());
  SettingsFile file(path);
  const SettingsFile::Loaded loaded = file.load();
  EXPECT_EQ(loaded.settings, unlike_defaults());
  EXPECT_EQ(loaded.warning, "");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(path.parent_path()), {}), 1) << "no leftovers";
}

TEST(Settings, AreAsAtFirstWithoutAFile) {
  const handloft::test::TemporaryDirectory folder;
  SettingsFile missing(folder.path() / "hmd.toml");
  EXPECT_EQ(missing.load().settings, HudSettings{});
  EXPECT_EQ(missing.load().warning, "");
  SettingsFile nowhere({});
  EXPECT_EQ(nowhere.load().settings, HudSettings{});
  EXPECT_TRUE(nowhere.save(unlike_defaults()).ok()) << "nothing is kept, and that is no fault";
}

TEST(Settings, ThatCannotBeReadAreToldAndKeptAside) {
  for (const std::string damage :
       {"text_percent = [", "text_percent = \"large\"", "text_percent = 79", "text_percent = 251",
        "tempo = 3", "colours = \"sepia\"", "[tour]\nstep = 5", "text_percent = nan", "\x01\x02\xff"}) {
    const handloft::test::TemporaryDirectory folder;
    const auto path = folder.path() / "hmd.toml";
    std::ofstream(path) << damage;
    SettingsFile file(path);
    const SettingsFile::Loaded loaded = file.load();
    EXPECT_EQ(loaded.settings, HudSettings{}) << damage;
    EXPECT_THAT(loaded.warning, HasSubstr("could not be read")) << damage;
    EXPECT_THAT(loaded.warning, HasSubstr("hmd.toml")) << damage;
    EXPECT_EQ(content(path), damage) << "reading changes nothing";
    ASSERT_TRUE(file.save(unlike_defaults()).ok());
    EXPECT_EQ(content(folder.path() / "hmd.toml.damaged"), damage);
    EXPECT_EQ(file.load().settings, unlike_defaults());
  }
}

TEST(Settings, OfAbsurdSizeAreRefusedWithoutBeingHeld) {
  const handloft::test::TemporaryDirectory folder;
  const auto path = folder.path() / "hmd.toml";
  std::ofstream(path) << std::string(1'000'000, '#');
  EXPECT_THAT(SettingsFile(path).load().warning, HasSubstr("larger than"));
}

TEST(Settings, ThatCannotBeWrittenLeaveTheOldOnes) {
  const handloft::test::TemporaryDirectory folder;
  std::ofstream(folder.path() / "file") << "x";
  SettingsFile below_a_file(folder.path() / "file" / "hmd.toml");
  EXPECT_EQ(below_a_file.save(HudSettings{}).error().code, ErrorCode::io);
}

TEST(Settings, AreWhereTheBaseDirectorySpecificationSays) {
  EXPECT_EQ(settings_path("/etc/me", "/home/me"), "/etc/me/handloft/hmd.toml");
  EXPECT_EQ(settings_path(nullptr, "/home/me"), "/home/me/.config/handloft/hmd.toml");
  EXPECT_EQ(settings_path("", "/home/me"), "/home/me/.config/handloft/hmd.toml");
  EXPECT_EQ(settings_path("relative", "/home/me"), "/home/me/.config/handloft/hmd.toml");
  EXPECT_EQ(settings_path(nullptr, nullptr), "");
  EXPECT_EQ(settings_path(nullptr, "relative"), "");
}

}  // namespace
}  // namespace handloft::client
