// Which mode is chosen (T1): frame rate first, then resolution, MJPEG where YUYV does not fit.

#include "daemon-tracking/source/camera/v4l2_modes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace handloft::tracking {
namespace {

using ::testing::HasSubstr;

// What a common webcam lists on USB 2.
std::vector<VideoSize> webcam() {
  return {{PixelFormat::yuyv, 640, 480, {30, 15}},    {PixelFormat::yuyv, 1280, 720, {10, 5}},
          {PixelFormat::mjpeg, 640, 480, {60, 30}},   {PixelFormat::mjpeg, 1280, 720, {30}},
          {PixelFormat::mjpeg, 1920, 1080, {30, 15}}, {PixelFormat::grey, 640, 480, {60, 30}}};
}

VideoMode chosen(const std::vector<VideoSize>& sizes, const ModeWish& wish) {
  const Result<VideoMode> mode = choose_mode(sizes, wish);
  EXPECT_TRUE(mode.ok());
  return mode.ok() ? *mode : VideoMode{};
}

TEST(VideoModesT1, TheWishedModeIsTakenRawWhereItFits) {
  EXPECT_EQ(to_string(chosen(webcam(), {})), "640x480 at 30 Hz YUYV");
}

TEST(VideoModesT1, TheRateComesBeforeTheSize) {
  ModeWish wish;
  wish.rate_hz = 60;
  wish.width_px = 1280;
  wish.height_px = 720;
  EXPECT_EQ(to_string(chosen(webcam(), wish)), "640x480 at 60 Hz MJPEG");
}

TEST(VideoModesT1, MjpegWhereYuyvDoesNotFitTheBus) {
  std::vector<VideoSize> sizes = webcam();
  sizes[1].rates_hz = {30};  // A driver that promises raw 720p at 30 Hz: 55 MB/s.
  ModeWish wish;
  wish.width_px = 1280;
  wish.height_px = 720;
  EXPECT_EQ(to_string(chosen(sizes, wish)), "1280x720 at 30 Hz MJPEG");
  wish.bandwidth_bytes_per_s = 400e6;
  EXPECT_EQ(to_string(chosen(sizes, wish)), "1280x720 at 30 Hz YUYV");
}

TEST(VideoModesT1, GreyOnlyWhereAskedForOrNothingElseIsThere) {
  ModeWish wish;
  wish.format = PixelFormat::grey;
  EXPECT_EQ(to_string(chosen(webcam(), wish)), "640x480 at 30 Hz GREY");
  EXPECT_EQ(chosen({{PixelFormat::grey, 640, 480, {30}}}, {}).format, PixelFormat::grey);
  ModeWish fast;
  fast.rate_hz = 120;
  EXPECT_EQ(chosen(webcam(), fast).format, PixelFormat::mjpeg);
}

TEST(VideoModesT1, AFewPercentLessCountAsReached) {
  const std::vector<VideoSize> ntsc{{PixelFormat::mjpeg, 640, 480, {29.97}},
                                    {PixelFormat::mjpeg, 320, 240, {30}}};
  EXPECT_EQ(chosen(ntsc, {}).width_px, 640);
}

TEST(VideoModesT1, AbsurdListsAreLeftOutAndNothingUsableIsSaid) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<VideoSize> absurd{{PixelFormat::mjpeg, 0, 480, {30}},
                                      {PixelFormat::mjpeg, 640, 480, {nan, 0, -30, INFINITY}}};
  EXPECT_TRUE(rank_modes(absurd, {}).empty());
  const Result<VideoMode> none = choose_mode(absurd, {});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::not_found);
  ModeWish wish;
  wish.format = PixelFormat::grey;
  const Result<VideoMode> other = choose_mode({{PixelFormat::mjpeg, 640, 480, {30}}}, wish);
  ASSERT_FALSE(other.ok());
  EXPECT_THAT(other.error().message, HasSubstr("found 640x480 MJPEG, expected GREY"));
}

TEST(VideoModesT1, ASmallerModeKeepsTheSizeAsLongAsItCan) {
  const std::vector<VideoMode> ranked = rank_modes(webcam(), {});
  std::optional<VideoMode> mode = ranked.front();
  std::vector<std::string> tried;
  while (mode) {
    tried.push_back(to_string(*mode));
    const double before = bandwidth_bytes_per_s(*mode);
    mode = smaller_mode(ranked, *mode);
    if (mode) {
      EXPECT_LT(bandwidth_bytes_per_s(*mode), before);
    }
  }
  ASSERT_GE(tried.size(), 2u);
  EXPECT_EQ(tried[0], "640x480 at 30 Hz YUYV");
  EXPECT_EQ(tried[1], "640x480 at 30 Hz MJPEG");
}

TEST(VideoModesT1, SeveralCamerasOnOneBusAreToldWhenTheyDoNotFit) {
  const VideoMode raw{PixelFormat::yuyv, 640, 480, 30};
  const VideoMode small{PixelFormat::mjpeg, 640, 480, 30};
  EXPECT_EQ(bus_problem({"usb1", 480, {raw, raw}}), "");
  EXPECT_EQ(bus_problem({"usb1", 480, {small, small, small, small}}), "");
  EXPECT_THAT(bus_problem({"usb1", 480, {raw, raw, raw}}), HasSubstr("3 cameras on usb1 ask for 55 MB/s"));
  EXPECT_THAT(bus_problem({"usb1", 480, {raw, raw, raw}}), HasSubstr("choose MJPEG"));
  const VideoMode huge{PixelFormat::mjpeg, 3840, 2160, 30};
  EXPECT_THAT(bus_problem({"usb1", 480, {huge, huge}}), HasSubstr("lower their rates to 33 %"));
  EXPECT_EQ(bus_problem({"usb1", 480, {}}), "");
}

}  // namespace
}  // namespace handloft::tracking
