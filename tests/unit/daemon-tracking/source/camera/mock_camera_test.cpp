// The whole camera source over real system calls on a mock node (T1, T2, T3): sysfs by libudev, ioctls, poll,
// mapped buffers and plug events. Runs under umockdev's preload library and ours; without them it is skipped.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <condition_variable>

#include "daemon-tracking/source/camera/v4l2_camera.h"
#include "tests/support/mock_video_node.h"

namespace handloft::tracking {
namespace {

using testing::FakeCamera;
using testing::good_stamp_flags;
using testing::MockVideoNode;

constexpr auto patience = std::chrono::seconds(20);

FakeCamera mock() {
  FakeCamera camera;
  camera.sizes = {{PixelFormat::yuyv, 640, 480, {30}}};
  camera.controls = {{V4L2_CID_EXPOSURE_AUTO, {0, 3, 1, V4L2_EXPOSURE_APERTURE_PRIORITY}},
                     {V4L2_CID_EXPOSURE_ABSOLUTE, {3, 2047, 1, 250}}};
  return camera;
}

struct MockCameraT3 : ::testing::Test {
  void SetUp() override {
    if (!MockVideoNode::possible())
      GTEST_SKIP() << "umockdev's preload library is missing (ctest sets LD_PRELOAD where it is installed)";
    node = std::make_unique<MockVideoNode>();
    Result<std::unique_ptr<HotplugMonitor>> opened =
        open_system_hotplug({}, Logger("hotplug", LogLevel::off));
    ASSERT_TRUE(opened.ok()) << opened.error().describe();
    hotplug = std::move(*opened);
    options.hotplug = hotplug.get();
    options.selector.serial = "MOCK1";
  }
  void TearDown() override {
    if (camera) camera->stop();
  }
  void start() {
    camera = make_v4l2_camera(0, "camera/left", options, clock, Logger("camera", LogLevel::off));
    ASSERT_TRUE(camera
                    ->start([this](Sample sample) {
                      const std::lock_guard lock(mutex);
                      samples.push_back(std::move(sample));
                      changed.notify_all();
                    })
                    .ok());
  }
  // The count-th sample (from 1), waited for.
  Sample sample(std::size_t count) {
    std::unique_lock lock(mutex);
    if (!changed.wait_for(lock, patience, [&] { return samples.size() >= count; })) return Truth{};
    return samples[count - 1];
  }
  void expect_presence(std::size_t count, bool present) {
    const Sample got = sample(count);
    const auto* presence = std::get_if<DevicePresence>(&got);
    ASSERT_NE(presence, nullptr) << count;
    EXPECT_EQ(presence->present, present) << count;
  }
  void pass_frame(std::size_t count, std::uint32_t sequence, std::uint8_t fill) {
    const std::vector<std::uint8_t> bytes(640 * 480 * 2, fill);
    ASSERT_TRUE(node->deliver({bytes, sequence, to_ns(clock.now()) - 20'000'000, good_stamp_flags, {}}));
    const Sample got = sample(count);
    const auto* frame = std::get_if<CameraFrame>(&got);
    ASSERT_NE(frame, nullptr) << count;
    EXPECT_EQ(*frame->bytes, bytes);
    EXPECT_LT(frame->capture_time, frame->arrival_time);
  }

  SystemClock clock;
  std::unique_ptr<MockVideoNode> node;
  std::unique_ptr<HotplugMonitor> hotplug;
  V4l2CameraOptions options;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Sample> samples;
  std::unique_ptr<V4l2Camera> camera;
};

TEST_F(MockCameraT3, IsListedWithItsIdentity) {
  node->plug(mock());
  const std::vector<V4l2CameraInfo> cameras = list_v4l2_cameras();
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_EQ(cameras[0].identity, "046d:082d serial MOCK1 at pci-0000:00:14.0-usb-0:3:1.0");
  EXPECT_EQ(cameras[0].node.node, "/dev/video0");
  EXPECT_EQ(cameras[0].node.name, "Mock camera");
  EXPECT_EQ(cameras[0].node.bus, "usb1");
  EXPECT_EQ(cameras[0].node.bus_speed_mbit_s, 480);
  EXPECT_EQ(cameras[0].unusable, "");
  ASSERT_EQ(cameras[0].sizes.size(), 1u);
}

TEST_F(MockCameraT3, StreamsThroughMappedBuffers) {
  node->plug(mock());
  start();
  expect_presence(1, true);
  for (std::uint32_t i = 0; i < 12; ++i) pass_frame(i + 2, i, static_cast<std::uint8_t>(i + 1));
  EXPECT_EQ(camera->health().exposure, ExposureState::locked);
  EXPECT_EQ(camera->health().frames, 12u);
  EXPECT_EQ(camera->health().problem, "");
}

TEST_F(MockCameraT3, ComesAndGoesByPlugEvents) {
  options.retry_interval = std::chrono::minutes(1);
  start();
  expect_presence(1, false);
  std::size_t seen = 1;
  for (int round = 0; round < 5; ++round) {
    node->plug(mock());
    expect_presence(++seen, true);
    pass_frame(++seen, 0, 0x40);
    node->unplug();
    expect_presence(++seen, false);
  }
  EXPECT_EQ(camera->health().times_lost, 5u);
}

TEST_F(MockCameraT3, ABreakdownIsSurvived) {
  node->plug(mock());
  start();
  expect_presence(1, true);
  pass_frame(2, 0, 0x11);
  node->driver().fail(VIDIOC_DQBUF, EIO);
  ASSERT_TRUE(node->deliver({std::vector<std::uint8_t>(640 * 480 * 2), 1, 1, good_stamp_flags, {}}));
  expect_presence(3, false);
  expect_presence(4, true);
  pass_frame(5, 0, 0x22);
}

}  // namespace
}  // namespace handloft::tracking
