// The whole source on its own thread (T1, T3, T4, T12): it never ends by itself, whatever the device does.

#include "daemon-tracking/source/camera/v4l2_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <spdlog/sinks/ostream_sink.h>

#include <cerrno>
#include <condition_variable>
#include <sstream>

#include "tests/support/camera_inbox.h"
#include "tests/support/fake_v4l2_system.h"

namespace handloft::tracking {
namespace {

using std::chrono::milliseconds;
using testing::fake_jpeg;
using testing::FakeCamera;
using testing::FakeV4l2System;
using testing::good_stamp_flags;
using ::testing::HasSubstr;

constexpr const char* node = "/dev/video0";
constexpr const char* other_node = "/dev/video1";
// Far longer than anything takes: only a failing test waits so long.
constexpr auto patience = std::chrono::seconds(20);

FakeCamera webcam(const char* device = node) {
  FakeCamera camera;
  camera.node.node = device;
  camera.node.path = "usb-1";
  camera.node.serial = "AAA";
  camera.controls = {{V4L2_CID_EXPOSURE_AUTO, {0, 3, 1, V4L2_EXPOSURE_APERTURE_PRIORITY}},
                     {V4L2_CID_EXPOSURE_ABSOLUTE, {3, 2047, 1, 250}},
                     {V4L2_CID_GAIN, {0, 255, 1, 64}}};
  return camera;
}

struct CameraT3 : ::testing::Test {
  CameraT3() { options.selector.path = "usb-1"; }
  ~CameraT3() override {
    if (camera) camera->stop();
  }

  void start(const Clock& clock) {
    camera = make_v4l2_camera(2, "camera/left", options, clock, Logger("camera", LogLevel::debug, log_sink),
                              system);
    ASSERT_TRUE(camera->start(inbox.sink()).ok());
  }
  // The camera is streaming once it says so: from then on it has buffers queued.
  void deliver(const Clock& clock, std::uint32_t sequence, const char* device = node) {
    ASSERT_TRUE(system->deliver(
        device, {fake_jpeg(), sequence, to_ns(clock.now()) - 20'000'000, good_stamp_flags, {}}));
  }
  // Delivers and waits until it has come through.
  void pass_one(const Clock& clock, std::uint32_t sequence, const char* device = node) {
    const std::size_t before = inbox.frames().size();
    deliver(clock, sequence, device);
    ASSERT_TRUE(inbox.wait_frames(before + 1));
  }
  template <typename Holds>
  bool wait_health(Holds holds) {
    const auto until = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < until) {
      if (holds(camera->health())) return true;
      std::this_thread::yield();
    }
    return false;
  }

  std::ostringstream log;
  spdlog::sink_ptr log_sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(log);
  std::shared_ptr<FakeV4l2System> system = std::make_shared<FakeV4l2System>();
  SystemClock real;
  ManualHotplug hotplug;
  V4l2CameraOptions options;
  test::CameraInbox inbox{patience};
  std::unique_ptr<V4l2Camera> camera;
};

TEST_F(CameraT3, FramesCarryTheMiddleOfTheirExposure) {
  system->plug(webcam());
  ManualClock clock(from_ns(9'000'000'000));
  options.time_offset = milliseconds(1);
  start(clock);
  ASSERT_TRUE(inbox.wait_presences(1));
  EXPECT_TRUE(inbox.presences()[0].present);
  EXPECT_EQ(inbox.presences()[0].device, "camera/left");
  pass_one(clock, 0);
  const CameraFrame frame = inbox.frames()[0];
  EXPECT_EQ(frame.camera, 2u);
  EXPECT_EQ(frame.arrival_time, clock.now());
  // T4: stamped 20 ms ago at the start of 5 ms of exposure, and 1 ms of calibrated offset.
  EXPECT_EQ(frame.capture_time,
            clock.now() - milliseconds(20) + std::chrono::microseconds(2500) + milliseconds(1));
  EXPECT_EQ(frame.width_px, 640);
  EXPECT_EQ(frame.format, PixelFormat::mjpeg);
  EXPECT_EQ(*frame.bytes, fake_jpeg());
  const CameraHealth health = camera->health();
  EXPECT_TRUE(health.present);
  EXPECT_EQ(health.exposure, ExposureState::locked);
  EXPECT_EQ(health.exposure_time, milliseconds(5));
  EXPECT_EQ(health.timestamps, TimestampState::start_of_exposure);
  EXPECT_EQ(health.frames, 1u);
  EXPECT_EQ(health.identity, "serial AAA at usb-1");
  EXPECT_EQ(health.problem, "");
}

TEST_F(CameraT3, ACameraThatIsNotThereYetIsOpenedWhenItComes) {
  options.hotplug = &hotplug;
  options.retry_interval = std::chrono::minutes(1);  // Only the monitor's word can wake it in time.
  start(real);
  ASSERT_TRUE(inbox.wait_presences(1));
  EXPECT_FALSE(inbox.presences()[0].present);
  EXPECT_FALSE(camera->finished());
  EXPECT_THAT(camera->health().problem, HasSubstr("found no camera, expected 'path=usb-1'"));
  system->plug(webcam());
  PluggedDevice device;
  device.subsystem = "video4linux";
  device.devnode = node;
  hotplug.plug(device);
  ASSERT_TRUE(inbox.wait_presences(2));
  EXPECT_TRUE(inbox.presences()[1].present);
  pass_one(real, 0);
}

TEST_F(CameraT3, WithoutAMonitorItLooksForItself) {
  options.retry_interval = milliseconds(5);
  start(real);
  ASSERT_TRUE(inbox.wait_presences(1));
  system->plug(webcam());
  ASSERT_TRUE(inbox.wait_presences(2));
  pass_one(real, 0);
}

// T3: unplugged under streaming twenty times, every second time under another number.
TEST_F(CameraT3, TwentyUnplugsAreToldAndSurvived) {
  options.retry_interval = milliseconds(2);
  system->plug(webcam());
  start(real);
  ASSERT_TRUE(inbox.wait_presences(1));
  constexpr std::size_t times = 20;
  for (std::size_t i = 0; i < times; ++i) {
    const char* here = i % 2 == 0 ? node : other_node;
    const char* next = i % 2 == 0 ? other_node : node;
    pass_one(real, 0, here);
    pass_one(real, 1, here);
    system->unplug(here);
    ASSERT_TRUE(inbox.wait_presences(2 * i + 2));
    EXPECT_FALSE(inbox.presences().back().present);
    system->plug(webcam(next));
    ASSERT_TRUE(inbox.wait_presences(2 * i + 3));
    EXPECT_TRUE(inbox.presences().back().present);
  }
  pass_one(real, 0, node);
  EXPECT_EQ(camera->health().times_lost, times);
  // The driver counted anew each time, the source did not.
  const std::vector<CameraFrame> frames = inbox.frames();
  ASSERT_EQ(frames.size(), 2 * times + 1);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].sequence, frames[i - 1].sequence + 1);
    EXPECT_GT(frames[i].capture_time, frames[i - 1].capture_time);
  }
  camera->stop();
  EXPECT_EQ(system->mapped_count(), 0);
}

TEST_F(CameraT3, TheMonitorsWordIsLookedIntoWhereTheDriverSaysNothing) {
  options.hotplug = &hotplug;
  system->plug(webcam());
  PluggedDevice device;
  device.subsystem = "video4linux";
  device.devnode = node;
  hotplug.plug(device);
  start(real);
  ASSERT_TRUE(inbox.wait_presences(1));
  pass_one(real, 0);
  // Late word of the camera that had this number before: ours is still there.
  hotplug.unplug("video4linux", node);
  pass_one(real, 1);
  hotplug.plug(device);
  pass_one(real, 2);
  EXPECT_EQ(inbox.presences().size(), 1u);
  system->fail(VIDIOC_QUERYCAP, ENODEV);
  hotplug.unplug("video4linux", node);
  ASSERT_TRUE(inbox.wait_presences(2));
  EXPECT_FALSE(inbox.presences()[1].present);
}

TEST_F(CameraT3, ABreakdownIsReopenedByItself) {
  options.retry_interval = milliseconds(2);
  system->plug(webcam());
  start(real);
  ASSERT_TRUE(inbox.wait_presences(1));
  pass_one(real, 0);
  system->fail(VIDIOC_DQBUF, EIO);
  deliver(real, 1);
  ASSERT_TRUE(inbox.wait_presences(3));
  EXPECT_FALSE(inbox.presences()[1].present);
  EXPECT_TRUE(inbox.presences()[2].present);
  pass_one(real, 0);
  // And an error of which the driver gives no reason.
  system->poll_error(node);
  ASSERT_TRUE(inbox.wait_presences(5));
  pass_one(real, 0);
  EXPECT_EQ(camera->health().times_lost, 2u);
}

TEST_F(CameraT3, ARefusalIsToldWithItsRemedyAndTriedAgain) {
  options.retry_interval = milliseconds(2);
  system->plug(webcam());
  system->fail_open(node, EACCES);
  start(real);
  ASSERT_TRUE(wait_health([](const CameraHealth& health) { return !health.problem.empty(); }));
  EXPECT_THAT(camera->health().problem, HasSubstr("group 'video'"));
  system->fail_open(node, EBUSY);
  ASSERT_TRUE(wait_health([](const CameraHealth& health) {
    return health.problem.find("another program") != std::string::npos;
  }));
  system->fail_open(node, 0);
  ASSERT_TRUE(inbox.wait_presences(2));
  EXPECT_TRUE(inbox.presences()[1].present);
  pass_one(real, 0);
}

TEST_F(CameraT3, AFullBusIsToldWhileASmallerModeRuns) {
  FakeCamera camera_on_bus = webcam();
  camera_on_bus.sizes = {{PixelFormat::yuyv, 640, 480, {30}}, {PixelFormat::mjpeg, 640, 480, {30}}};
  system->plug(camera_on_bus);
  system->fail(VIDIOC_STREAMON, ENOSPC);
  start(real);
  ASSERT_TRUE(inbox.wait_presences(1));
  pass_one(real, 0);
  EXPECT_THAT(camera->health().problem, HasSubstr("USB bus has no bandwidth left"));
  EXPECT_EQ(camera->health().mode.format, PixelFormat::mjpeg);
}

TEST_F(CameraT3, TheMetadataNodeOfACameraIsPassedOver) {
  FakeCamera metadata = webcam(node);
  metadata.device_caps = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  system->plug(metadata);
  system->plug(webcam(other_node));
  start(real);
  ASSERT_TRUE(inbox.wait_presences(1));
  pass_one(real, 0, other_node);
  EXPECT_EQ(camera->health().node, other_node);
}

TEST_F(CameraT3, ASlowCameraIsAnAlarmThatGoesAway) {
  system->plug(webcam());
  ManualClock clock(from_ns(9'000'000'000));
  start(clock);
  ASSERT_TRUE(inbox.wait_presences(1));
  std::uint32_t sequence = 0;
  const auto run = [&](int frames, Duration interval) {
    for (int i = 0; i < frames; ++i) {
      clock.advance(interval);
      pass_one(clock, sequence++);
    }
  };
  run(45, milliseconds(100));
  EXPECT_TRUE(wait_health([](const CameraHealth& health) {
    return health.problem.find("it delivers 10.0 of 30.0 frames a second") != std::string::npos;
  })) << camera->health().problem;
  EXPECT_NEAR(camera->health().measured_rate_hz, 10.0, 0.5);
  run(90, milliseconds(33));
  EXPECT_TRUE(wait_health([](const CameraHealth& health) { return health.problem.empty(); }));
  EXPECT_NEAR(camera->health().measured_rate_hz, 30.0, 1.0);
  camera->stop();
  EXPECT_THAT(log.str(), HasSubstr("it delivers 10.0 of 30.0"));
  EXPECT_THAT(log.str(), HasSubstr("all is well again"));
}

TEST_F(CameraT3, ASilentCameraIsOpenedAgain) {
  system->plug(webcam());
  ManualClock clock(from_ns(9'000'000'000));
  start(clock);
  ASSERT_TRUE(inbox.wait_presences(1));
  pass_one(clock, 0);
  clock.advance(std::chrono::seconds(4));
  ASSERT_TRUE(inbox.wait_presences(3));
  EXPECT_FALSE(inbox.presences()[1].present);
  EXPECT_TRUE(inbox.presences()[2].present);
  EXPECT_EQ(system->open_count(), 2);
}

TEST_F(CameraT3, ASettingThatSomebodyChangedIsSetAgainWithinASecond) {
  system->plug(webcam());
  ManualClock clock(from_ns(9'000'000'000));
  start(clock);
  ASSERT_TRUE(inbox.wait_presences(1));
  pass_one(clock, 0);
  system->set_control(node, V4L2_CID_GAIN, 200);
  clock.advance(milliseconds(1001));
  EXPECT_TRUE(wait_health([](const CameraHealth& health) { return health.control_drifts == 1; }));
  EXPECT_EQ(system->control(node, V4L2_CID_GAIN), 64);
  clock.advance(milliseconds(1001));
  EXPECT_TRUE(
      wait_health([](const CameraHealth& health) { return health.exposure == ExposureState::locked; }));
  camera->stop();
  EXPECT_THAT(log.str(), HasSubstr("gain was 200, is set to 64 again"));
}

TEST_F(CameraT3, UselessTimestampsAndBrokenFramesAreToldInWords) {
  system->plug(webcam());
  ManualClock clock(from_ns(9'000'000'000));
  start(clock);
  ASSERT_TRUE(inbox.wait_presences(1));
  for (std::uint32_t i = 0; i < 70; ++i) {
    clock.advance(milliseconds(33));
    const std::size_t before = inbox.frames().size();
    const std::uint64_t refused = camera->health().refused;
    const bool broken = i % 5 == 0;
    ASSERT_TRUE(
        system->deliver(node, {fake_jpeg(), i, 12345, broken ? V4L2_BUF_FLAG_ERROR : good_stamp_flags, {}}));
    if (broken) {
      ASSERT_TRUE(wait_health([&](const CameraHealth& health) { return health.refused > refused; }));
    } else {
      ASSERT_TRUE(inbox.wait_frames(before + 1));
    }
  }
  EXPECT_TRUE(wait_health([](const CameraHealth& health) {
    return health.problem.find("timestamps are of no use") != std::string::npos &&
           health.problem.find("% of its frames arrive broken") != std::string::npos;
  })) << camera->health().problem;
  EXPECT_EQ(camera->health().timestamps, TimestampState::estimated);
  EXPECT_GT(camera->health().bad_timestamps, 50u);
}

TEST_F(CameraT3, StopEndsDeliveryWhetherItStreamsOrWaits) {
  start(real);
  ASSERT_TRUE(inbox.wait_presences(1));
  camera->stop();
  EXPECT_TRUE(camera->finished());
  EXPECT_FALSE(camera->start(inbox.sink()).ok());

  system->plug(webcam());
  std::unique_ptr<V4l2Camera> second =
      make_v4l2_camera(0, "camera/right", options, real, Logger("camera", LogLevel::off, log_sink), system);
  test::CameraInbox second_inbox{patience};
  ASSERT_TRUE(second->start(second_inbox.sink()).ok());
  EXPECT_EQ(second->start(second_inbox.sink()).error().code, ErrorCode::failed_precondition);
  ASSERT_TRUE(second_inbox.wait_presences(1));
  second->stop();
  second->stop();
  EXPECT_FALSE(system->streaming(node));
  EXPECT_EQ(system->mapped_count(), 0);
}

TEST_F(CameraT3, ACameraThatIsNeverStartedIsFree) {
  camera =
      make_v4l2_camera(0, "camera/left", options, real, Logger("camera", LogLevel::off, log_sink), system);
  EXPECT_EQ(camera->health().frames, 0u);
  EXPECT_FALSE(camera->health().present);
}

}  // namespace
}  // namespace handloft::tracking
