// Settings are locked, read back and held (T1, tracking.md 5.4).

#include "daemon-tracking/source/camera/v4l2_controls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "tests/support/fake_v4l2_system.h"

namespace handloft::tracking {
namespace {

using ::testing::ElementsAre;
using testing::FakeCamera;
using testing::FakeControl;
using testing::FakeV4l2System;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* node = "/dev/video0";

// All automatic, as a webcam comes out of its box.
std::map<std::uint32_t, FakeControl> webcam_controls() {
  return {{V4L2_CID_EXPOSURE_AUTO, {0, 3, 1, V4L2_EXPOSURE_APERTURE_PRIORITY}},
          {V4L2_CID_EXPOSURE_AUTO_PRIORITY, {0, 1, 1, 1}},
          {V4L2_CID_EXPOSURE_ABSOLUTE, {3, 2047, 1, 250}},
          {V4L2_CID_AUTO_WHITE_BALANCE, {0, 1, 1, 1}},
          {V4L2_CID_WHITE_BALANCE_TEMPERATURE, {2000, 6500, 10, 4120}},
          {V4L2_CID_FOCUS_AUTO, {0, 1, 1, 1}},
          {V4L2_CID_FOCUS_ABSOLUTE, {0, 250, 5, 35}},
          {V4L2_CID_GAIN, {0, 255, 1, 64}},
          {V4L2_CID_POWER_LINE_FREQUENCY, {0, 2, 1, 2}},
          {V4L2_CID_BACKLIGHT_COMPENSATION, {0, 1, 1, 1}},
          {V4L2_CID_BRIGHTNESS, {0, 255, 1, 128}}};
}

struct ControlsT1 : ::testing::Test {
  void plug(std::map<std::uint32_t, FakeControl> controls) {
    FakeCamera camera;
    camera.node.node = node;
    camera.controls = std::move(controls);
    system.plug(std::move(camera));
    fd = system.open(node);
    ASSERT_GE(fd, 0);
  }
  FakeV4l2System system;
  int fd = -1;
};

TEST_F(ControlsT1, EveryAutomaticIsSwitchedOff) {
  plug(webcam_controls());
  ControlKeeper keeper({});
  const ControlReport report = keeper.apply(system, fd);
  EXPECT_EQ(report.exposure, ExposureState::locked);
  EXPECT_EQ(report.exposure_time, std::chrono::milliseconds(5));
  EXPECT_EQ(report.problem, "");
  EXPECT_EQ(system.control(node, V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(system.control(node, V4L2_CID_EXPOSURE_ABSOLUTE), 50);
  constexpr std::uint32_t off[] = {V4L2_CID_EXPOSURE_AUTO_PRIORITY, V4L2_CID_AUTO_WHITE_BALANCE,
                                   V4L2_CID_FOCUS_AUTO, V4L2_CID_POWER_LINE_FREQUENCY,
                                   V4L2_CID_BACKLIGHT_COMPENSATION};
  for (const std::uint32_t id : off) {
    EXPECT_EQ(system.control(node, id), 0) << id;
  }
  // What nobody asked for stays as it was found.
  EXPECT_EQ(system.control(node, V4L2_CID_GAIN), 64);
  EXPECT_EQ(system.control(node, V4L2_CID_WHITE_BALANCE_TEMPERATURE), 4120);
  EXPECT_EQ(system.control(node, V4L2_CID_FOCUS_ABSOLUTE), 35);
}

TEST_F(ControlsT1, WhatIsAskedForIsSetWithinTheCamerasRangeAndSaidWhereItIsNot) {
  plug(webcam_controls());
  CameraSettings settings;
  settings.exposure = std::chrono::milliseconds(1000);
  settings.gain = 20;
  settings.white_balance_kelvin = 4604;
  settings.focus = 300;
  settings.power_line = PowerLine::hz50;
  ControlKeeper keeper(settings);
  const ControlReport report = keeper.apply(system, fd);
  EXPECT_EQ(system.control(node, V4L2_CID_GAIN), 20);
  EXPECT_EQ(system.control(node, V4L2_CID_WHITE_BALANCE_TEMPERATURE), 4600);
  EXPECT_EQ(system.control(node, V4L2_CID_POWER_LINE_FREQUENCY), 1);
  EXPECT_EQ(report.exposure_time, std::chrono::microseconds(204700));
  EXPECT_THAT(report.problem,
              HasSubstr("exposure was asked to be 10000, the camera set 2047 (it has 3..2047)"));
}

TEST_F(ControlsT1, ADriftIsToldAndSetAgain) {
  plug(webcam_controls());
  ControlKeeper keeper({});
  keeper.apply(system, fd);
  EXPECT_THAT(keeper.check(system, fd).drifted, IsEmpty());
  system.set_control(node, V4L2_CID_GAIN, 200);
  system.set_control(node, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY);
  const ControlReport report = keeper.check(system, fd);
  EXPECT_THAT(report.drifted,
              ElementsAre("automatic exposure was 3, is set to 1 again", "gain was 200, is set to 64 again"));
  EXPECT_EQ(report.exposure, ExposureState::drifted);
  EXPECT_EQ(system.control(node, V4L2_CID_GAIN), 64);
  EXPECT_EQ(system.control(node, V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  const ControlReport after = keeper.check(system, fd);
  EXPECT_THAT(after.drifted, IsEmpty());
  EXPECT_EQ(after.exposure, ExposureState::locked);
}

TEST_F(ControlsT1, ACameraThatCannotBeManualIsSaidToBeAutomatic) {
  auto controls = webcam_controls();
  controls[V4L2_CID_EXPOSURE_AUTO].stubborn = true;
  plug(std::move(controls));
  ControlKeeper keeper({});
  const ControlReport report = keeper.apply(system, fd);
  EXPECT_EQ(report.exposure, ExposureState::automatic);
  EXPECT_THAT(report.problem, HasSubstr("automatic exposure"));
}

TEST_F(ControlsT1, AControlThatNeverStaysIsSetAtALowRateOnly) {
  plug(webcam_controls());
  ControlKeeper keeper({});
  keeper.apply(system, fd);
  int set = 0;
  ControlReport report;
  constexpr int looks = 60;
  for (int i = 0; i < looks; ++i) {
    system.set_control(node, V4L2_CID_GAIN, 99);
    report = keeper.check(system, fd);
    set += system.control(node, V4L2_CID_GAIN) == 64 ? 1 : 0;
  }
  EXPECT_GE(set, 3);
  EXPECT_LE(set, 12);
  EXPECT_THAT(report.problem, HasSubstr("gain doesn't stay at 64"));
}

TEST_F(ControlsT1, WhatWasFoundAtFirstComesBackAfterUnplugging) {
  plug(webcam_controls());
  ControlKeeper keeper({});
  keeper.apply(system, fd);
  system.unplug(node);
  auto forgotten = webcam_controls();
  forgotten[V4L2_CID_GAIN].value = 10;
  plug(std::move(forgotten));
  keeper.apply(system, fd);
  EXPECT_EQ(system.control(node, V4L2_CID_GAIN), 64);
}

TEST_F(ControlsT1, ACameraWithoutSettingsIsNoError) {
  plug({});
  ControlKeeper keeper({});
  const ControlReport report = keeper.apply(system, fd);
  EXPECT_EQ(report.exposure, ExposureState::unknown);
  EXPECT_EQ(report.exposure_time, Duration{});
  EXPECT_EQ(report.problem, "");
  EXPECT_THAT(keeper.check(system, fd).drifted, IsEmpty());
}

TEST_F(ControlsT1, InactiveAndReadOnlyOnesAreLeftAlone) {
  auto controls = webcam_controls();
  controls[V4L2_CID_GAIN].flags = V4L2_CTRL_FLAG_INACTIVE;
  controls[V4L2_CID_FOCUS_ABSOLUTE].flags = V4L2_CTRL_FLAG_READ_ONLY;
  plug(std::move(controls));
  CameraSettings settings;
  settings.gain = 1;
  settings.focus = 100;
  ControlKeeper keeper(settings);
  keeper.apply(system, fd);
  EXPECT_EQ(system.control(node, V4L2_CID_GAIN), 64);
  EXPECT_EQ(system.control(node, V4L2_CID_FOCUS_ABSOLUTE), 35);
}

}  // namespace
}  // namespace handloft::tracking
