// Files of a sequence: whole or not at all, and nothing that was there before is lost.

#include "client-hmd/shots/picture_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/test_data.h"

namespace handloft::client {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

Image grey(int side) {
  return {side, side, std::vector<std::uint8_t>(static_cast<std::size_t>(4 * side * side), 99)};
}

TEST(PictureFiles, AreNumberedInAFolderThatIsMade_V8) {
  const handloft::test::TemporaryDirectory folder;
  const auto files = PictureFiles::prepare(folder.path() / "a" / "b", 3, ExistingFiles::keep);
  ASSERT_TRUE(files.ok()) << files.error().describe();
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(files->write(i, grey(8)).ok());
  EXPECT_TRUE(fs::exists(folder.path() / "a" / "b" / "frame-0001.png"));
  EXPECT_TRUE(fs::exists(folder.path() / "a" / "b" / "frame-0003.png"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path() / "a" / "b"), {}), 3)
      << "nothing unfinished stays";
  EXPECT_EQ(PictureFiles::prepare(folder.path() / "c", 20'000, ExistingFiles::keep)->path(0).filename(),
            "frame-00001.png");
}

TEST(PictureFiles, DoNotOverwriteUnlessTold_V8) {
  const handloft::test::TemporaryDirectory folder;
  std::ofstream(folder.path() / "frame-0002.png") << "mine";
  const auto refused = PictureFiles::prepare(folder.path(), 3, ExistingFiles::keep);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::already_exists);
  EXPECT_THAT(refused.error().message, HasSubstr("frame-0002.png exists already"));
  EXPECT_TRUE(PictureFiles::prepare(folder.path(), 1, ExistingFiles::keep).ok())
      << "it stands in nobody's way";
  const auto told = PictureFiles::prepare(folder.path(), 3, ExistingFiles::overwrite);
  ASSERT_TRUE(told.ok());
  ASSERT_TRUE(told->write(1, grey(8)).ok());
  EXPECT_EQ(read_png(folder.path() / "frame-0002.png")->width_px, 8);

  const auto late = PictureFiles::prepare(folder.path() / "late", 2, ExistingFiles::keep);
  std::ofstream(folder.path() / "late" / "frame-0001.png") << "somebody else's";
  EXPECT_EQ(late->write(0, grey(8)).error().code, ErrorCode::already_exists);
}

TEST(PictureFiles, TellWhyAFolderCannotBe) {
  const handloft::test::TemporaryDirectory folder;
  std::ofstream(folder.path() / "file") << "no folder";
  const auto refused = PictureFiles::prepare(folder.path() / "file" / "x", 1, ExistingFiles::keep);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::io);
}

/// /dev/full is a disk without room: what is written to it fails as on one.
TEST(PictureFiles, TellOfAFullDisk) {
  const Status full = write_png("/dev/full/x.png", grey(8));
  ASSERT_FALSE(full.ok());
  EXPECT_EQ(full.error().code, ErrorCode::io);
}

TEST(PictureFiles, SayHowToMakeAVideo) {
  const handloft::test::TemporaryDirectory folder;
  const auto files = PictureFiles::prepare(folder.path() / "it's mine", 2, ExistingFiles::keep);
  ASSERT_TRUE(files.ok());
  const std::string words = files->how_to_make_a_video(25.0);
  EXPECT_THAT(words, HasSubstr("wrote 2 pictures to "));
  EXPECT_THAT(words, HasSubstr("ffmpeg -framerate 25 -i '"));
  EXPECT_THAT(words, HasSubstr("it'\\''s mine/frame-%04d.png'"));
  EXPECT_THAT(words, HasSubstr("it'\\''s mine.mp4'"));
}

}  // namespace
}  // namespace handloft::client
