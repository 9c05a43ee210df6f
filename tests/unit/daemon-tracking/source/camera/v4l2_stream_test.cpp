// One streaming camera (T1): negotiation, draining to the newest, and what drivers do wrong.

#include "daemon-tracking/source/camera/v4l2_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>
#include <random>

#include "daemon-tracking/source/camera/v4l2_controls.h"
#include "tests/support/fake_v4l2_system.h"

namespace handloft::tracking {
namespace {

using testing::fake_jpeg;
using testing::FakeCamera;
using testing::FakeFrame;
using testing::FakeV4l2System;
using testing::good_stamp_flags;
using ::testing::HasSubstr;

constexpr const char* node = "/dev/video0";
using Opened = Result<std::unique_ptr<V4l2Stream>>;

struct StreamT1 : ::testing::Test {
  StreamT1() { camera.node.node = node; }
  Opened open(const ModeWish& wish = {}) {
    system->plug(camera);
    return V4l2Stream::open(system, node, wish, clock, pool);
  }
  bool deliver(std::uint32_t sequence, std::vector<std::uint8_t> bytes = fake_jpeg()) {
    return system->deliver(node, {std::move(bytes), sequence, 1'000'000, good_stamp_flags, std::nullopt});
  }
  std::shared_ptr<FakeV4l2System> system = std::make_shared<FakeV4l2System>();
  ManualClock clock{from_ns(5'000'000'000)};
  FramePool pool;
  FakeCamera camera;
};

TEST_F(StreamT1, DeliversTheBytesWithSequenceStampAndTime) {
  const Opened stream = open();
  ASSERT_TRUE(stream.ok()) << stream.error().describe();
  EXPECT_EQ(to_string((*stream)->mode()), "640x480 at 30 Hz MJPEG");
  EXPECT_EQ((*stream)->model(), "Fake camera");
  EXPECT_EQ((*stream)->compromise(), "");
  ASSERT_TRUE(deliver(7));
  const auto frame = (*stream)->newest();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_EQ((*frame)->sequence, 7u);
  EXPECT_EQ(*(*frame)->bytes, fake_jpeg());
  EXPECT_EQ((*frame)->stamp.ns, 1'000'000);
  EXPECT_TRUE((*frame)->stamp.monotonic);
  EXPECT_EQ((*frame)->stamp.point, StampPoint::start_of_exposure);
  EXPECT_EQ((*frame)->dequeued, clock.now());
  const auto nothing = (*stream)->newest();
  ASSERT_TRUE(nothing.ok());
  EXPECT_FALSE(nothing->has_value());
}

TEST_F(StreamT1, DrainsToTheNewestAndCountsTheOthers) {
  const Opened stream = open();
  ASSERT_TRUE(stream.ok());
  for (std::uint32_t i = 0; i < 3; ++i) ASSERT_TRUE(deliver(i));
  const auto frame = (*stream)->newest();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_EQ((*frame)->sequence, 2u);
  EXPECT_EQ((*stream)->counters().drained, 2u);
  EXPECT_EQ((*stream)->counters().filled, 3u);
  // All buffers went back to the driver.
  for (std::uint32_t i = 3; i < 7; ++i) EXPECT_TRUE(deliver(i));
  EXPECT_FALSE(deliver(7));
}

TEST_F(StreamT1, GapsInTheSequenceAreDroppedFramesAndACounterMayWrap) {
  const Opened stream = open();
  ASSERT_TRUE(stream.ok());
  for (const std::uint32_t sequence : {0xFFFFFFFEu, 0xFFFFFFFFu, 0u, 5u, 5u, 2u}) {
    ASSERT_TRUE(deliver(sequence));
    ASSERT_TRUE((*stream)->newest().ok());
  }
  EXPECT_EQ((*stream)->counters().dropped, 4u);
}

TEST_F(StreamT1, TheCountOfBuffersThatTheDriverGivesIsRespected) {
  for (const std::uint32_t given : {2u, 3u, 8u}) {
    camera.buffers_given = given;
    const Opened stream = open();
    ASSERT_TRUE(stream.ok()) << given;
    std::uint32_t taken = 0;
    while (deliver(taken)) ++taken;
    EXPECT_EQ(taken, given);
    const auto frame = (*stream)->newest();
    ASSERT_TRUE(frame.ok() && frame->has_value());
    EXPECT_EQ((*frame)->sequence, given - 1);
  }
  EXPECT_EQ(system->mapped_count(), 0);
  for (const std::uint32_t given : {0u, 1u, 1000u}) {
    camera.buffers_given = given;
    const Opened stream = open();
    ASSERT_FALSE(stream.ok()) << given;
    EXPECT_EQ(stream.error().code, ErrorCode::io);
  }
}

TEST_F(StreamT1, BrokenEmptyAndCutOffFramesAreRefusedAndGoBack) {
  const Opened stream = open();
  ASSERT_TRUE(stream.ok());
  std::vector<std::uint8_t> cut = fake_jpeg();
  cut.resize(150);
  std::vector<std::uint8_t> headless = fake_jpeg();
  headless[0] = 0;
  const std::vector<FakeFrame> bad{
      {fake_jpeg(), 0, 1, good_stamp_flags | V4L2_BUF_FLAG_ERROR, std::nullopt},
      {fake_jpeg(), 1, 2, good_stamp_flags, 0},              // empty
      {fake_jpeg(), 2, 3, good_stamp_flags, 640 * 480 + 1},  // more than the buffer holds
      {fake_jpeg(), 3, 4, good_stamp_flags, 0xFFFFFFFF},     //
      {cut, 4, 5, good_stamp_flags, std::nullopt},           // truncated
      {fake_jpeg(), 5, 6, good_stamp_flags, 100},            // bytesused is authoritative
      {headless, 6, 7, good_stamp_flags, std::nullopt},      //
      {{0, 0, 0, 0}, 7, 8, good_stamp_flags, std::nullopt},  //
      {{0xFF}, 8, 9, good_stamp_flags, std::nullopt}};
  for (int round = 0; round < 3; ++round) {
    for (const FakeFrame& frame : bad) {
      ASSERT_TRUE(system->deliver(node, frame));
      const auto got = (*stream)->newest();
      ASSERT_TRUE(got.ok());
      EXPECT_FALSE(got->has_value()) << frame.sequence;
    }
  }
  EXPECT_EQ((*stream)->counters().refused, 3 * bad.size());
  ASSERT_TRUE(deliver(99));
  EXPECT_TRUE((*stream)->newest()->has_value());
}

TEST_F(StreamT1, ZerosAfterThePictureAreCutOff) {
  const Opened stream = open();
  ASSERT_TRUE(stream.ok());
  std::vector<std::uint8_t> padded = fake_jpeg();
  padded.resize(512);
  ASSERT_TRUE(deliver(0, padded));
  const auto frame = (*stream)->newest();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_EQ(*(*frame)->bytes, fake_jpeg());
}

TEST_F(StreamT1, RawRowsArePackedWhereTheDriverPadsThem) {
  for (const PixelFormat format : {PixelFormat::yuyv, PixelFormat::grey}) {
    const std::size_t row = format == PixelFormat::yuyv ? 8 : 4;
    camera.sizes = {{format, 4, 3, {30}}};
    for (const std::uint32_t padding : {0u, 5u}) {
      camera.row_padding = padding;
      const Opened stream = open();
      ASSERT_TRUE(stream.ok()) << stream.error().describe();
      std::vector<std::uint8_t> filled, expected;
      for (std::size_t y = 0; y < 3; ++y) {
        for (std::size_t x = 0; x < row; ++x) {
          filled.push_back(static_cast<std::uint8_t>(16 * y + x));
          expected.push_back(filled.back());
        }
        filled.insert(filled.end(), padding, 0xEE);
      }
      ASSERT_TRUE(deliver(0, filled));
      const auto frame = (*stream)->newest();
      ASSERT_TRUE(frame.ok() && frame->has_value());
      EXPECT_EQ(*(*frame)->bytes, expected);
      // One byte too few is half a picture.
      ASSERT_TRUE(system->deliver(
          node, {filled, 1, 5, good_stamp_flags, static_cast<std::uint32_t>(filled.size() - padding - 1)}));
      EXPECT_FALSE((*stream)->newest()->has_value());
    }
  }
}

TEST_F(StreamT1, AFullBusIsToldAndASmallerModeTaken) {
  camera.sizes = {{PixelFormat::yuyv, 640, 480, {30}}, {PixelFormat::mjpeg, 640, 480, {30}}};
  system->fail(VIDIOC_STREAMON, ENOSPC);
  const Opened stream = open();
  ASSERT_TRUE(stream.ok()) << stream.error().describe();
  EXPECT_EQ(to_string((*stream)->mode()), "640x480 at 30 Hz MJPEG");
  EXPECT_THAT((*stream)->compromise(), HasSubstr("no bandwidth left for 640x480 at 30 Hz YUYV"));
  EXPECT_THAT((*stream)->compromise(), HasSubstr("runs at 640x480 at 30 Hz MJPEG"));
  ASSERT_TRUE(deliver(0));
  EXPECT_TRUE((*stream)->newest()->has_value());
}

TEST_F(StreamT1, ABusThatStaysFullIsAnErrorInWords) {
  camera.sizes = {{PixelFormat::yuyv, 640, 480, {30}}, {PixelFormat::mjpeg, 640, 480, {30, 15}}};
  system->fail(VIDIOC_STREAMON, ENOSPC, 20);
  const Opened stream = open();
  ASSERT_FALSE(stream.ok());
  EXPECT_EQ(stream.error().code, ErrorCode::resource_exhausted);
  EXPECT_THAT(stream.error().message, HasSubstr("USB bus has not enough bandwidth"));
  EXPECT_EQ(system->mapped_count(), 0);
}

TEST_F(StreamT1, EachRefusalNamesItsRemedy) {
  struct Case {
    unsigned long request;
    int error;
    ErrorCode code;
    const char* words;
  };
  const Case cases[] = {{VIDIOC_S_FMT, EBUSY, ErrorCode::failed_precondition, "in use by another program"},
                        {VIDIOC_REQBUFS, EBUSY, ErrorCode::failed_precondition, "fuser -v /dev/video0"},
                        {VIDIOC_QUERYCAP, ENOTTY, ErrorCode::io, "asking what it is"},
                        {VIDIOC_QBUF, EIO, ErrorCode::io, "cable, hub and power"},
                        {VIDIOC_STREAMON, ENODEV, ErrorCode::not_found, "unplugged"},
                        {VIDIOC_STREAMON, EPROTO, ErrorCode::io, "cable, hub and power"}};
  for (const Case& each : cases) {
    system->fail(each.request, each.error);
    const Opened stream = open();
    ASSERT_FALSE(stream.ok()) << each.words;
    EXPECT_EQ(stream.error().code, each.code) << each.words;
    EXPECT_THAT(stream.error().message, HasSubstr(each.words));
    EXPECT_EQ(system->mapped_count(), 0);
  }
  system->fail_open(node, EACCES);
  const Opened refused = open();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::permission_denied);
  EXPECT_THAT(refused.error().message, HasSubstr("group 'video'"));
}

TEST_F(StreamT1, WhatEndsAStreamIsAnError) {
  for (const auto& [error, code] : {std::pair{ENODEV, ErrorCode::not_found}, std::pair{EIO, ErrorCode::io},
                                    std::pair{EINVAL, ErrorCode::io}, std::pair{EPIPE, ErrorCode::io}}) {
    const Opened stream = open();
    ASSERT_TRUE(stream.ok());
    ASSERT_TRUE(deliver(0));
    system->fail(VIDIOC_DQBUF, error);
    const auto frame = (*stream)->newest();
    ASSERT_FALSE(frame.ok());
    EXPECT_EQ(frame.error().code, code);
  }
}

TEST_F(StreamT1, AFormatThatTheDriverChangedIsWhatIsDelivered) {
  system->set_liar([](unsigned long request, void* argument) {
    if (request != VIDIOC_S_FMT) return;
    v4l2_pix_format& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
    pix.width = 320;
    pix.height = 240;
  });
  const Opened stream = open();
  ASSERT_TRUE(stream.ok());
  EXPECT_EQ((*stream)->mode().width_px, 320);
  EXPECT_THAT((*stream)->compromise(), HasSubstr("asked for 640x480"));
}

TEST_F(StreamT1, AFormatThatNobodyReadsAndAbsurdAnswersAreRefused) {
  const std::vector<std::function<void(unsigned long, void*)>> liars{
      [](unsigned long request, void* argument) {
        if (request == VIDIOC_S_FMT)
          static_cast<v4l2_format*>(argument)->fmt.pix.pixelformat = V4L2_PIX_FMT_H264;
      },
      [](unsigned long request, void* argument) {
        if (request == VIDIOC_S_FMT) static_cast<v4l2_format*>(argument)->fmt.pix.width = 0;
      },
      [](unsigned long request, void* argument) {
        if (request == VIDIOC_S_FMT) static_cast<v4l2_format*>(argument)->fmt.pix.height = 1u << 31;
      },
      [](unsigned long request, void* argument) {
        if (request == VIDIOC_QUERYBUF) static_cast<v4l2_buffer*>(argument)->length = 0xFFFFFFFF;
      },
      [](unsigned long request, void* argument) {
        if (request == VIDIOC_QUERYBUF) static_cast<v4l2_buffer*>(argument)->m.offset = 77;
      }};
  for (const auto& liar : liars) {
    system->set_liar(liar);
    EXPECT_FALSE(open().ok());
    EXPECT_EQ(system->mapped_count(), 0);
  }
  system->set_liar(nullptr);
  const Opened stream = open();
  ASSERT_TRUE(stream.ok());
  system->set_liar([](unsigned long request, void* argument) {
    if (request == VIDIOC_DQBUF) static_cast<v4l2_buffer*>(argument)->index = 40;
  });
  ASSERT_TRUE(deliver(0));
  EXPECT_FALSE((*stream)->newest().ok());
}

// Words of any answer may be anything: an error or a frame, never a crash, never a wait for ever.
TEST_F(StreamT1, ADriverThatLiesAnywhereIsSurvived) {
  camera.sizes = {{PixelFormat::mjpeg, 64, 48, {30}}, {PixelFormat::yuyv, 64, 48, {30}}};
  camera.controls = {{V4L2_CID_EXPOSURE_AUTO, {0, 3, 1, 3}},
                     {V4L2_CID_EXPOSURE_ABSOLUTE, {3, 2047, 1, 250}},
                     {V4L2_CID_GAIN, {0, 255, 5, 64}}};
  std::mt19937 random(1);
  int opened = 0, frames = 0;
  for (int round = 0; round < 2000; ++round) {
    const auto rarity = 1 + random() % 60;
    system->set_liar([&](unsigned long request, void* argument) {
      if (random() % rarity != 0) return;
      constexpr std::uint32_t telling[] = {0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF};
      const std::uint32_t word =
          random() % 2 == 0 ? telling[random() % 5] : static_cast<std::uint32_t>(random());
      const std::size_t words = _IOC_SIZE(request) / sizeof word;
      if (words == 0) return;
      std::memcpy(static_cast<char*>(argument) + random() % words * sizeof word, &word, sizeof word);
    });
    const Opened stream = open();
    if (!stream) continue;
    ++opened;
    ControlKeeper keeper({});
    keeper.apply(*system, (*stream)->fd());
    keeper.check(*system, (*stream)->fd());
    FrameStamper stamper({});
    for (std::uint32_t i = 0; i < 4; ++i) {
      deliver(i, i % 2 == 0 ? fake_jpeg() : std::vector<std::uint8_t>(64 * 48 * 2));
      const auto frame = (*stream)->newest();
      if (!frame) break;
      if (!*frame) continue;
      ++frames;
      EXPECT_LE((*frame)->bytes->size(), 64u * 48u * 2u);
      stamper.stamp((*frame)->stamp, (*frame)->dequeued, std::chrono::milliseconds(5));
    }
  }
  EXPECT_EQ(system->mapped_count(), 0);
  EXPECT_GT(opened, 100);
  EXPECT_GT(frames, 100);
}

TEST_F(StreamT1, AGrantedRateThatIsLowerIsTold) {
  system->set_liar([](unsigned long request, void* argument) {
    if (request == VIDIOC_G_PARM)
      static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {1, 15};
  });
  const Opened stream = open();
  ASSERT_TRUE(stream.ok());
  EXPECT_EQ((*stream)->mode().rate_hz, 15);
  EXPECT_THAT((*stream)->compromise(), HasSubstr("asked for 30 Hz"));
}

TEST_F(StreamT1, FramesMayOutliveTheStreamAndThePoolIsUsedAgain) {
  std::shared_ptr<const std::vector<std::uint8_t>> kept;
  const std::uint8_t* memory = nullptr;
  {
    const Opened stream = open();
    ASSERT_TRUE(stream.ok());
    ASSERT_TRUE(deliver(0));
    memory = (**(*stream)->newest()).bytes->data();
    ASSERT_TRUE(deliver(1, fake_jpeg(200, 0x11)));
    kept = (**(*stream)->newest()).bytes;
    EXPECT_EQ(kept->data(), memory);
  }
  EXPECT_EQ(*kept, fake_jpeg(200, 0x11));
}

}  // namespace
}  // namespace handloft::tracking
