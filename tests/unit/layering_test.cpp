// The house's rule (architecture: "The house"): a room includes only what stands below it. Programs never
// include each other; common includes none of them; whatever is generated from proto/ may be used by all.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/support/test_data.h"

namespace {

namespace fs = std::filesystem;

// For each room the rooms of its own program that it may include, besides itself, common/ and proto/.
const std::map<std::string, std::set<std::string>>& allowed_rooms() {
  static const std::map<std::string, std::set<std::string>> rooms = {
      {"common/base", {}},
      {"common/net", {"common/base"}},
      {"common/codec", {"common/base"}},
      {"common/record", {"common/base"}},
      {"daemon-tracking/source", {}},
      {"daemon-tracking/vision", {"daemon-tracking/source"}},
      {"daemon-tracking/fusion", {"daemon-tracking/source", "daemon-tracking/vision"}},
      {"daemon-tracking/publish",
       {"daemon-tracking/source", "daemon-tracking/vision", "daemon-tracking/fusion"}},
      {"daemon-tracking/calibration", {"daemon-tracking/source", "daemon-tracking/vision"}},
      {"daemon-tracking/calibrate",
       {"daemon-tracking/source", "daemon-tracking/vision", "daemon-tracking/calibration"}},
      {"daemon-tracking/main",
       {"daemon-tracking/source", "daemon-tracking/vision", "daemon-tracking/fusion",
        "daemon-tracking/publish"}},
      {"server-model/geometry", {}},
      {"server-model/model", {"server-model/geometry"}},
      {"server-model/interaction", {"server-model/geometry", "server-model/model"}},
      {"server-model/stream", {"server-model/geometry", "server-model/model"}},
      {"server-model/store", {"server-model/geometry", "server-model/model"}},
      {"server-model/access", {"server-model/store"}},
      {"server-model/exchange", {"server-model/geometry", "server-model/model"}},
      {"server-model/session",
       {"server-model/geometry", "server-model/model", "server-model/interaction", "server-model/stream",
        "server-model/store", "server-model/access", "server-model/exchange"}},
      {"server-model/main",
       {"server-model/geometry", "server-model/model", "server-model/interaction", "server-model/stream",
        "server-model/store", "server-model/access", "server-model/exchange", "server-model/session"}},
      {"client-hmd/mirror", {}},
      {"client-hmd/view", {"client-hmd/mirror"}},
      {"client-hmd/render", {"client-hmd/mirror", "client-hmd/view"}},
      {"client-hmd/desktop", {"client-hmd/mirror", "client-hmd/view"}},
      {"client-hmd/hud", {"client-hmd/mirror", "client-hmd/view", "client-hmd/render", "client-hmd/desktop"}},
      {"client-hmd/display",
       {"client-hmd/mirror", "client-hmd/view", "client-hmd/render", "client-hmd/desktop"}},
      {"client-hmd/shots", {"client-hmd/mirror", "client-hmd/view", "client-hmd/render"}},
      {"client-hmd/main",
       {"client-hmd/mirror", "client-hmd/view", "client-hmd/render", "client-hmd/desktop",
        "client-hmd/display", "client-hmd/hud", "client-hmd/shots"}},
  };
  return rooms;
}

const std::set<std::string> programs = {"common", "daemon-tracking", "server-model", "client-hmd"};

// "server-model/geometry/pca_frame.h" -> "server-model/geometry"; nullopt for what is not in a room of ours.
std::optional<std::string> room_of(const std::string& path) {
  const std::size_t first = path.find('/');
  if (first == std::string::npos || !programs.contains(path.substr(0, first))) return std::nullopt;
  const std::size_t second = path.find('/', first + 1);
  return path.substr(0, second);
}

std::optional<std::string> complaint(const std::string& including_file, const std::string& included) {
  const auto from = room_of(including_file);
  if (!from) return std::nullopt;
  if (!allowed_rooms().contains(*from)) return including_file + ": its room is not in the table of rooms";
  if (included.starts_with("tests/"))
    return including_file + " includes " + included + ": programs don't use tests";
  const auto to = room_of(included);
  if (!to || *to == *from) return std::nullopt;
  const bool is_common = to->starts_with("common/") && !from->starts_with("common/");
  if (is_common || allowed_rooms().at(*from).contains(*to)) return std::nullopt;
  return including_file + " includes " + included + ": " + *from + " may not use " + *to;
}

std::vector<std::string> includes_of(const fs::path& file) {
  std::vector<std::string> found;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    const std::string start = "#include \"";
    if (!line.starts_with(start)) continue;
    found.push_back(line.substr(start.size(), line.find('"', start.size()) - start.size()));
  }
  return found;
}

TEST(Layering, RoomsIncludeOnlyWhatStandsBelowThem) {
  std::vector<std::string> complaints;
  std::size_t files = 0;
  for (const std::string& program : programs) {
    ASSERT_TRUE(fs::is_directory(program)) << "run from the repository's root";
    for (const auto& entry : fs::recursive_directory_iterator(program)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      ++files;
      for (const std::string& included : includes_of(entry.path())) {
        if (auto text = complaint(entry.path().generic_string(), included)) complaints.push_back(*text);
      }
    }
  }
  EXPECT_GT(files, 20U);
  for (const std::string& text : complaints) ADD_FAILURE() << text;
}

TEST(Layering, TheCheckItselfFindsEveryKindOfBreak) {
  EXPECT_TRUE(complaint("common/net/a.cpp", "server-model/model/document.h"));
  EXPECT_TRUE(complaint("client-hmd/view/a.cpp", "server-model/geometry/frame.h"));
  EXPECT_TRUE(complaint("server-model/geometry/a.cpp", "server-model/model/document.h"));
  EXPECT_TRUE(complaint("server-model/stream/a.cpp", "server-model/interaction/gesture.h"));
  EXPECT_TRUE(complaint("common/base/a.cpp", "common/net/endpoint.h"));
  EXPECT_TRUE(complaint("server-model/attic/a.cpp", "common/base/clock.h"));
  EXPECT_TRUE(complaint("server-model/model/a.cpp", "tests/support/test_data.h"));
  EXPECT_FALSE(complaint("server-model/model/a.cpp", "server-model/geometry/frame.h"));
  EXPECT_FALSE(complaint("client-hmd/mirror/a.cpp", "common/codec/mesh_codec.h"));
  EXPECT_FALSE(complaint("server-model/model/a.cpp", "proto/operation.pb.h"));
}

}  // namespace
