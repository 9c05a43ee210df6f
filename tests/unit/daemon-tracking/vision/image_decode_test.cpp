#include "daemon-tracking/vision/image_decode.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cstdlib>

namespace handloft::tracking {
namespace {

constexpr int width = 64, height = 48;

/// A JPEG whose left half has other colours than its right half, 4:2:0.
std::vector<std::uint8_t> jpeg(int subsampling = TJSAMP_420, bool colour = true) {
  std::vector<std::uint8_t> rgb(width * height * 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>((y * width + x) * 3);
      rgb[i] = x < width / 2 ? 200 : 30;
      rgb[i + 1] = 60;
      rgb[i + 2] = x < width / 2 ? 40 : 210;
    }
  tjhandle handle = tjInitCompress();
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(tjCompress2(handle, rgb.data(), width, 0, height, TJPF_RGB, &buffer, &size,
                        colour ? subsampling : TJSAMP_GRAY, 95, TJFLAG_ACCURATEDCT),
            0);
  std::vector<std::uint8_t> out(buffer, buffer + size);
  tjFree(buffer);
  tjDestroy(handle);
  return out;
}

CameraFrame frame_of(std::vector<std::uint8_t> bytes, PixelFormat format = PixelFormat::mjpeg) {
  CameraFrame frame;
  frame.format = format;
  frame.width_px = width;
  frame.height_px = height;
  frame.bytes = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  return frame;
}

TEST(FrameDecoder, JpegKeepsChromaAsStored) {
  FrameDecoder decoder;
  const auto image = decoder.decode(frame_of(jpeg()), DecodePlanes::luma_and_chroma);
  ASSERT_TRUE(image.ok()) << image.error().describe();
  const PlanarImage& planes = **image;
  EXPECT_EQ(planes.y.width_px, width);
  EXPECT_EQ(planes.cb.width_px, width / 2);
  EXPECT_EQ(planes.cb.height_px, height / 2);
  EXPECT_EQ(planes.chroma_step_x, 2);
  // BT.601 of (200, 60, 40): Y 99.6, Cb 94.4, Cr 199.6.
  EXPECT_NEAR(planes.y.at(8, 8), 100, 3);
  EXPECT_NEAR(planes.cb.at(4, 4), 94, 3);
  EXPECT_NEAR(planes.cr.at(4, 4), 200, 3);
  EXPECT_GT(planes.cb.at(28, 4), 180);
}

TEST(FrameDecoder, OtherSubsamplingsAndGrey) {
  FrameDecoder decoder;
  const auto fine = decoder.decode(frame_of(jpeg(TJSAMP_444)), DecodePlanes::luma_and_chroma);
  ASSERT_TRUE(fine.ok());
  EXPECT_EQ((*fine)->cb.width_px, width);
  const auto half = decoder.decode(frame_of(jpeg(TJSAMP_422)), DecodePlanes::luma_and_chroma);
  ASSERT_TRUE(half.ok());
  EXPECT_EQ((*half)->cb.height_px, height);
  EXPECT_EQ((*half)->chroma_step_y, 1);
  const auto grey = decoder.decode(frame_of(jpeg(0, false)), DecodePlanes::luma_and_chroma);
  ASSERT_TRUE(grey.ok());
  EXPECT_TRUE((*grey)->cb.empty());
  const auto luma = decoder.decode(frame_of(jpeg()), DecodePlanes::luma);
  ASSERT_TRUE(luma.ok());
  EXPECT_TRUE((*luma)->cb.empty());
  EXPECT_NEAR((*luma)->y.at(8, 8), 100, 3);
}

TEST(FrameDecoder, EveryTruncationIsAnError) {
  const auto whole = jpeg();
  FrameDecoder decoder;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto cut =
        decoder.decode(frame_of({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}),
                       DecodePlanes::luma_and_chroma);
    ASSERT_FALSE(cut.ok()) << size;
    EXPECT_EQ(cut.error().code, ErrorCode::data_corrupt);
  }
  EXPECT_TRUE(decoder.decode(frame_of(whole), DecodePlanes::luma_and_chroma).ok());  // And goes on
}

TEST(FrameDecoder, FlippedBytesNeverCrash) {
  const auto whole = jpeg();
  FrameDecoder decoder;
  std::srand(3);
  int decoded = 0;
  for (int round = 0; round < 2000; ++round) {
    auto bytes = whole;
    for (int flips = 0; flips < 2; ++flips)
      bytes[static_cast<std::size_t>(std::rand()) % bytes.size()] = static_cast<std::uint8_t>(std::rand());
    const auto image = decoder.decode(frame_of(bytes), DecodePlanes::luma_and_chroma);
    if (image.ok()) {
      ++decoded;
      ASSERT_EQ((*image)->y.samples.size(), static_cast<std::size_t>(width * height));
    }
  }
  EXPECT_GT(decoded, 100);
  EXPECT_LT(decoded, 2000);
  // A broken header must not spoil the decoder for the frames after it.
  EXPECT_TRUE(decoder.decode(frame_of(whole), DecodePlanes::luma_and_chroma).ok());
}

TEST(FrameDecoder, RefusesWrongAndAbsurdSizes) {
  FrameDecoder decoder;
  CameraFrame wrong = frame_of(jpeg());
  wrong.width_px = 128;
  EXPECT_EQ(decoder.decode(wrong, DecodePlanes::luma).error().code, ErrorCode::data_corrupt);
  wrong.width_px = 1 << 30;
  EXPECT_EQ(decoder.decode(wrong, DecodePlanes::luma).error().code, ErrorCode::invalid_argument);
  wrong.width_px = -1;
  EXPECT_FALSE(decoder.decode(wrong, DecodePlanes::luma).ok());
  CameraFrame none = frame_of({});
  none.bytes = nullptr;
  EXPECT_FALSE(decoder.decode(none, DecodePlanes::luma).ok());
}

/// Without its DHT segments, as many webcams leave them out of MJPEG.
std::vector<std::uint8_t> without_huffman_tables(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> out(bytes.begin(), bytes.begin() + 2);
  std::size_t at = 2;
  while (at + 4 <= bytes.size() && bytes[at] == 0xFF && bytes[at + 1] != 0xDA) {
    const std::size_t length = 2 + (static_cast<std::size_t>(bytes[at + 2]) << 8 | bytes[at + 3]);
    if (bytes[at + 1] != 0xC4)
      out.insert(out.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                 bytes.begin() + static_cast<std::ptrdiff_t>(at + length));
    at += length;
  }
  out.insert(out.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end());
  return out;
}

// T1: the standard's tables stand in for those left out.
TEST(FrameDecoder, MjpegWithoutHuffmanTables) {
  const std::vector<std::uint8_t> whole = jpeg();
  const std::vector<std::uint8_t> bare = without_huffman_tables(whole);
  ASSERT_LT(bare.size(), whole.size());
  FrameDecoder first, second;
  const auto expected = first.decode(frame_of(whole), DecodePlanes::luma_and_chroma);
  ASSERT_TRUE(expected.ok());
  for (const DecodePlanes planes : {DecodePlanes::luma, DecodePlanes::luma_and_chroma}) {
    const auto image = second.decode(frame_of(bare), planes);
    ASSERT_TRUE(image.ok()) << image.error().describe();
    EXPECT_EQ((*image)->y.samples, (*expected)->y.samples);
  }
}

TEST(FrameDecoder, YuyvAndGreyAreCopied) {
  std::vector<std::uint8_t> yuyv(width * height * 2);
  for (std::size_t i = 0; i < yuyv.size(); i += 4) {
    yuyv[i] = 10;
    yuyv[i + 1] = 20;
    yuyv[i + 2] = 30;
    yuyv[i + 3] = 40;
  }
  FrameDecoder decoder;
  const auto image = decoder.decode(frame_of(yuyv, PixelFormat::yuyv), DecodePlanes::luma_and_chroma);
  ASSERT_TRUE(image.ok());
  EXPECT_EQ((*image)->y.at(0, 0), 10);
  EXPECT_EQ((*image)->y.at(1, 0), 30);
  EXPECT_EQ((*image)->cb.at(0, 0), 20);
  EXPECT_EQ((*image)->cr.at(0, 0), 40);
  yuyv.pop_back();
  EXPECT_EQ(decoder.decode(frame_of(yuyv, PixelFormat::yuyv), DecodePlanes::luma).error().code,
            ErrorCode::data_corrupt);
  const auto grey = decoder.decode(frame_of(std::vector<std::uint8_t>(width * height, 7), PixelFormat::grey),
                                   DecodePlanes::luma_and_chroma);
  ASSERT_TRUE(grey.ok());
  EXPECT_EQ((*grey)->y.at(5, 5), 7);
  EXPECT_FALSE(decoder.decode(frame_of({1, 2, 3}, PixelFormat::grey), DecodePlanes::luma).ok());
}

}  // namespace
}  // namespace handloft::tracking
