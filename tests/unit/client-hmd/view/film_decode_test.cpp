#include <gtest/gtest.h>
#include <turbojpeg.h>

#include "client-hmd/view/film_feed.h"

namespace handloft::client {
namespace {

net::VideoFrame jpeg(int width, int height) {
  std::vector<std::uint8_t> rgb(static_cast<std::size_t>(3 * width * height), 128);
  for (std::size_t i = 0; i < rgb.size(); i += 3) rgb[i] = 200;
  const std::unique_ptr<void, decltype(&tjDestroy)> coder(tjInitCompress(), tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(
      tjCompress2(coder.get(), rgb.data(), width, 0, height, TJPF_RGB, &bytes, &size, TJSAMP_420, 95, 0), 0);
  net::VideoFrame frame;
  frame.bytes.assign(bytes, bytes + size);
  tjFree(bytes);
  frame.info.width_px = static_cast<std::uint32_t>(width);
  frame.info.height_px = static_cast<std::uint32_t>(height);
  return frame;
}

TEST(DecodePicture, ReadsAJpeg) {
  const auto rgba = decode_picture(jpeg(64, 48));
  ASSERT_TRUE(rgba.ok());
  ASSERT_EQ(rgba->size(), 4U * 64 * 48);
  EXPECT_NEAR((*rgba)[0], 200, 4);
  EXPECT_NEAR((*rgba)[1], 128, 4);
  EXPECT_EQ((*rgba)[3], 255);
}

TEST(DecodePicture, RefusesEveryWayToBreakAJpeg) {
  net::VideoFrame other_size = jpeg(64, 48);
  other_size.info.width_px = 65;
  EXPECT_FALSE(decode_picture(other_size).ok());
  net::VideoFrame cut = jpeg(64, 48);
  cut.bytes.resize(20);
  EXPECT_FALSE(decode_picture(cut).ok());
  net::VideoFrame empty = jpeg(64, 48);
  empty.bytes.clear();
  EXPECT_FALSE(decode_picture(empty).ok());
  net::VideoFrame huge = jpeg(64, 48);
  huge.info.width_px = 100'000;
  EXPECT_EQ(decode_picture(huge).error().code, ErrorCode::resource_exhausted);
}

/// What a broken daemon can make the frame loop do is bounded by the picture's size.
TEST(DecodePicture, RefusesPicturesThatWouldHoldUpTheFrameLoop_V5) {
  for (const net::VideoFormat format :
       {net::VideoFormat::jpeg, net::VideoFormat::grey, net::VideoFormat::rgb, net::VideoFormat::yuyv}) {
    net::VideoFrame large = jpeg(64, 48);
    large.info.format = format;
    large.info.width_px = 8000;
    large.info.height_px = 8000;
    EXPECT_EQ(decode_picture(large).error().code, ErrorCode::resource_exhausted);
    large.info.width_px = 4096;
    large.info.height_px = 2304;
    EXPECT_EQ(decode_picture(large).error().code, ErrorCode::data_corrupt) << "allowed, but another picture";
  }
}

TEST(DecodePicture, ReadsPlainFormatsAndChecksTheirSize) {
  net::VideoFrame grey;
  grey.info.format = net::VideoFormat::grey;
  grey.info.width_px = 2;
  grey.info.height_px = 1;
  grey.bytes = {10, 250};
  EXPECT_EQ(*decode_picture(grey), (std::vector<std::uint8_t>{10, 10, 10, 255, 250, 250, 250, 255}));
  grey.bytes.push_back(0);
  EXPECT_FALSE(decode_picture(grey).ok());

  net::VideoFrame yuyv;
  yuyv.info.format = net::VideoFormat::yuyv;
  yuyv.info.width_px = 2;
  yuyv.info.height_px = 1;
  yuyv.bytes = {100, 128, 50, 128};  // Colourless: red, green and blue are the luma.
  EXPECT_EQ(*decode_picture(yuyv), (std::vector<std::uint8_t>{100, 100, 100, 255, 50, 50, 50, 255}));
}

}  // namespace
}  // namespace handloft::client
