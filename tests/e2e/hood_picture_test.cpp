// Issue 4's picture: a hood before and after it is sculpted, with icons and with stripes, by the server and
// the viewer as real processes. The pictures stay in the folder that the test names, to be looked at.

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "client-hmd/render/image.h"
#include "tests/support/process.h"

namespace handloft::e2e {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using client::Image;

class HoodPicture : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("handloft-hood-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    std::ifstream script("tests/data/scripts/hood_icons.jsonl");
    ASSERT_TRUE(script) << "run from the repository";
    std::ofstream before(folder_ / "before.jsonl");
    std::ofstream after(folder_ / "after.jsonl");
    bool committed = false;
    for (std::string line; std::getline(script, line);) {
      after << line << "\n";
      if (!committed) before << line << "\n";
      committed = committed || line.find("commitSculpting") != std::string::npos;
    }
    ASSERT_TRUE(committed);
  }

  Image picture(const std::string& script, const std::string& name, const std::vector<std::string>& options) {
    const std::string model = "unix:" + (folder_ / (name + ".sock")).string();
    test::Process modeld({test::program("handloft-modeld"), "serve", "--listen", model, "--script",
                          folder_ / (script + ".jsonl")},
                         folder_ / (name + "-modeld.log"));
    EXPECT_TRUE(modeld.read_line(60s)) << modeld.error_output();
    std::vector<std::string> words = {test::program("handloft-hmd"),
                                      "--model",
                                      model,
                                      "--once",
                                      "--view",
                                      "fit",
                                      "--size",
                                      "960x540",
                                      "--screenshot",
                                      folder_ / (name + ".png")};
    words.insert(words.end(), options.begin(), options.end());
    test::Process hmd(words, folder_ / (name + "-hmd.log"));
    EXPECT_EQ(hmd.wait(60s), 0) << hmd.error_output();
    modeld.signal(SIGTERM);
    EXPECT_EQ(modeld.wait(30s), 0) << modeld.error_output();
    const Result<Image> image = client::read_png(folder_ / (name + ".png"));
    EXPECT_TRUE(image.ok()) << image.error().describe();
    return image.ok() ? *image : Image{};
  }

  static int count(const Image& image, const std::function<bool(int, int, int)>& counts) {
    int sum = 0;
    for (std::size_t i = 0; i + 3 < image.rgba.size(); i += 4)
      sum += counts(image.rgba[i], image.rgba[i + 1], image.rgba[i + 2]) ? 1 : 0;
    return sum;
  }
  static bool is_red(int r, int g, int b) { return r > 150 && g < 90 && b < 90; }
  static bool is_green(int r, int g, int b) { return g > 120 && r < 90 && b < 110; }
  static bool is_yellow(int r, int g, int b) { return r > 180 && g > 140 && b < 90; }
  static bool is_dark(int r, int g, int b) { return r < 50 && g < 55 && b < 60; }

  fs::path folder_;
};

TEST_F(HoodPicture, shows_the_hood_before_and_after_with_icons_and_stripes) {
  const Image before = picture("before", "before", {});
  const Image after = picture("after", "after", {});
  const Image striped = picture("after", "zebra", {"--shading", "zebra"});
  EXPECT_GT(count(before, is_red), 20) << "the icon that made the crown";
  EXPECT_EQ(count(before, is_yellow), 0);
  EXPECT_GT(count(after, is_red), 300);
  EXPECT_GT(count(after, is_green), 100);
  EXPECT_GT(count(after, is_yellow), 300);
  EXPECT_GT(count(striped, is_red), 300) << "icons stay icons";
  EXPECT_GT(count(striped, is_dark), 20 * (count(after, is_dark) + 1000));
  RecordProperty("pictures", folder_.string());
}

}  // namespace
}  // namespace handloft::e2e
