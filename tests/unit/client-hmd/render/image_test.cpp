#include "client-hmd/render/image.h"

#include <gtest/gtest.h>

#include <fstream>

#include "client-hmd/render/font_atlas.h"
#include "tests/support/test_data.h"

namespace handloft::client {
namespace {

Image gradient(int offset = 0) {
  Image image{32, 16, {}};
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 32; ++x) {
      const auto value = static_cast<std::uint8_t>(4 * x + 5 * y + offset);
      image.rgba.insert(image.rgba.end(), {value, static_cast<std::uint8_t>(255 - value), 40, 255});
    }
  }
  return image;
}

TEST(Image, SurvivesAPng) {
  const handloft::test::TemporaryDirectory folder;
  const auto path = folder.path() / "picture.png";
  ASSERT_TRUE(write_png(path, gradient()).ok());
  const Result<Image> read = read_png(path);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->rgba, gradient().rgba);
}

TEST(Image, KeepsTheOldFileWhenTheNewOneCannotBeWritten) {
  const handloft::test::TemporaryDirectory folder;
  EXPECT_EQ(write_png(folder.path() / "missing" / "p.png", gradient()).error().code, ErrorCode::io);
  EXPECT_EQ(write_png(folder.path() / "p.png", Image{}).error().code, ErrorCode::invalid_argument);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Image, RefusesFilesThatAreNoPng) {
  const handloft::test::TemporaryDirectory folder;
  EXPECT_EQ(read_png(folder.path() / "none.png").error().code, ErrorCode::not_found);
  const auto path = folder.path() / "bad.png";
  std::ofstream(path) << "not a picture";
  EXPECT_EQ(read_png(path).error().code, ErrorCode::data_corrupt);
}

TEST(Image, MeasuresDifferences) {
  EXPECT_EQ(*mean_absolute_difference(gradient(), gradient()), 0.0);
  EXPECT_NEAR(*structural_similarity(gradient(), gradient()), 1.0, 1e-12);
  // Red and green change by 3, blue does not.
  EXPECT_NEAR(*mean_absolute_difference(gradient(), gradient(3)), 2.0, 1e-12);
  Image flat = gradient();
  std::fill(flat.rgba.begin(), flat.rgba.end(), std::uint8_t{128});
  EXPECT_LT(*structural_similarity(gradient(), flat), 0.8);
  EXPECT_FALSE(mean_absolute_difference(gradient(), Image{1, 1, {0, 0, 0, 0}}).ok());
}

TEST(Utf8, DecodesAndNeverTrips) {
  EXPECT_EQ(decode_utf8("a·↶"), U"a·↶");
  EXPECT_EQ(decode_utf8("\xE2\x86"), U"\uFFFD\uFFFD") << "cut off";
  EXPECT_EQ(decode_utf8("\x80x"), U"\uFFFDx") << "a stray continuation";
  EXPECT_EQ(decode_utf8("\xFF"), U"\uFFFD");
}

}  // namespace
}  // namespace handloft::client
