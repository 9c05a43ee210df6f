// Which cameras there are and which is meant (T1, T2).

#include "daemon-tracking/source/camera/v4l2_enumerate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>

#include "tests/support/fake_v4l2_system.h"

namespace handloft::tracking {
namespace {

using testing::FakeCamera;
using testing::FakeV4l2System;
using ::testing::HasSubstr;

V4l2Node webcam(const char* device, const char* path, const char* serial, const char* usb_id = "046d:082d") {
  V4l2Node node;
  node.node = device;
  node.name = "HD Pro Webcam C920";
  node.path = path;
  node.serial = serial;
  node.usb_id = usb_id;
  node.bus = "usb1";
  node.bus_speed_mbit_s = 480;
  return node;
}

// Two cameras of one kind with a metadata node each.
std::vector<V4l2Node> two_webcams() {
  return {webcam("/dev/video0", "usb-1", "AAA"), webcam("/dev/video1", "usb-1", "AAA"),
          webcam("/dev/video2", "usb-2", "BBB"), webcam("/dev/video3", "usb-2", "BBB")};
}

TEST(ListCamerasT1, MetadataNodesAreLeftOutAndUnusableOnesNamed) {
  FakeV4l2System system;
  FakeCamera camera;
  camera.node = webcam("/dev/video0", "usb-1", "AAA");
  camera.sizes = {{PixelFormat::mjpeg, 640, 480, {60, 30}}, {PixelFormat::yuyv, 640, 480, {30}}};
  system.plug(camera);
  camera.node.node = "/dev/video1";
  camera.device_caps = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  system.plug(camera);
  camera.node = webcam("/dev/video2", "platform-csi", "", "");
  camera.device_caps = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  system.plug(camera);
  camera.node = webcam("/dev/video3", "usb-3", "CCC");
  camera.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE;
  system.plug(camera);
  camera.node = webcam("/dev/video4", "usb-4", "DDD");
  system.plug(camera);
  system.fail_open("/dev/video4", EACCES);
  camera.node = webcam("/dev/video5", "usb-5", "EEE");
  camera.device_caps = V4L2_CAP_VIDEO_M2M | V4L2_CAP_STREAMING;
  system.plug(camera);

  const std::vector<V4l2CameraInfo> cameras = list_v4l2_cameras(system);
  ASSERT_EQ(cameras.size(), 4u);
  EXPECT_EQ(cameras[0].node.node, "/dev/video0");
  EXPECT_EQ(cameras[0].unusable, "");
  EXPECT_EQ(cameras[0].identity, "046d:082d serial AAA at usb-1");
  EXPECT_EQ(cameras[0].model, "Fake camera");
  ASSERT_EQ(cameras[0].sizes.size(), 2u);
  EXPECT_THAT(cameras[0].sizes[0].rates_hz, ::testing::ElementsAre(60, 30));
  EXPECT_THAT(cameras[1].unusable, HasSubstr("multi-planar"));
  EXPECT_THAT(cameras[2].unusable, HasSubstr("read()"));
  EXPECT_THAT(cameras[3].unusable, HasSubstr("group 'video'"));
}

TEST(CameraSelectorT2, IsReadAndWritten) {
  const Result<CameraSelector> selector = parse_camera_selector("path=usb-1,serial=AAA");
  ASSERT_TRUE(selector.ok());
  EXPECT_EQ(selector->path, "usb-1");
  EXPECT_EQ(selector->serial, "AAA");
  EXPECT_EQ(to_string(*selector), "path=usb-1,serial=AAA");
  EXPECT_EQ(parse_camera_selector("/dev/video3")->node, "/dev/video3");
  EXPECT_EQ(parse_camera_selector("model=HD Pro Webcam C920")->model, "HD Pro Webcam C920");
  EXPECT_EQ(parse_camera_selector("usb=046d:082d")->usb_id, "046d:082d");
  for (const char* bad : {"", "serial=", "colour=red", "usb-1", "path=a,,serial=b"}) {
    const Result<CameraSelector> refused = parse_camera_selector(bad);
    ASSERT_FALSE(refused.ok()) << bad;
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
  }
}

TEST(MatchCameraT2, ByPathAndSerialWhateverTheNumberOfTheNode) {
  const Result<NodeMatch> match =
      match_camera(two_webcams(), *parse_camera_selector("path=usb-2,serial=BBB"), IdentityMismatch::refuse);
  ASSERT_TRUE(match.ok());
  ASSERT_EQ(match->nodes.size(), 2u);
  EXPECT_EQ(match->nodes[0].node, "/dev/video2");
  EXPECT_EQ(match->note, "");
}

TEST(MatchCameraT2, AMovedCameraIsFoundAndToldOrRefused) {
  const CameraSelector selector = *parse_camera_selector("path=usb-7,serial=BBB");
  const Result<NodeMatch> moved = match_camera(two_webcams(), selector, IdentityMismatch::accept_moved);
  ASSERT_TRUE(moved.ok());
  EXPECT_EQ(moved->nodes[0].node, "/dev/video2");
  EXPECT_THAT(moved->note, HasSubstr("moved from usb-7 to usb-2"));
  const Result<NodeMatch> refused = match_camera(two_webcams(), selector, IdentityMismatch::refuse);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::failed_precondition);
}

TEST(MatchCameraT2, AnotherCameraInItsPlaceIsRefused) {
  for (const IdentityMismatch mismatch : {IdentityMismatch::refuse, IdentityMismatch::accept_moved}) {
    const Result<NodeMatch> match =
        match_camera(two_webcams(), *parse_camera_selector("path=usb-1,serial=ZZZ"), mismatch);
    ASSERT_FALSE(match.ok());
    EXPECT_EQ(match.error().code, ErrorCode::failed_precondition);
    EXPECT_THAT(match.error().message, HasSubstr("another camera is plugged in where serial ZZZ was"));
  }
}

TEST(MatchCameraT2, TwoThatFitAreRefusedAndNoneSaysWhatThereIs) {
  const Result<NodeMatch> both =
      match_camera(two_webcams(), *parse_camera_selector("usb=046d:082d"), IdentityMismatch::accept_moved);
  ASSERT_FALSE(both.ok());
  EXPECT_EQ(both.error().code, ErrorCode::failed_precondition);
  EXPECT_THAT(both.error().message, HasSubstr("usb-1"));
  EXPECT_THAT(both.error().message, HasSubstr("usb-2"));
  const Result<NodeMatch> none =
      match_camera(two_webcams(), *parse_camera_selector("serial=CCC"), IdentityMismatch::accept_moved);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::not_found);
  EXPECT_THAT(none.error().message, HasSubstr("046d:082d serial AAA at usb-1 (/dev/video0)"));
  EXPECT_FALSE(match_camera({}, *parse_camera_selector("serial=CCC"), IdentityMismatch::accept_moved).ok());
}

TEST(MatchCameraT2, TheModelIsWhatTheCameraOrItsDriverCallsIt) {
  std::vector<V4l2Node> nodes{webcam("/dev/video0", "usb-1", "")};
  nodes[0].name = "uvc-video-0";
  EXPECT_TRUE(
      match_camera(nodes, *parse_camera_selector("model=uvc-video-0"), IdentityMismatch::refuse).ok());
  EXPECT_FALSE(match_camera(nodes, *parse_camera_selector("model=Brio"), IdentityMismatch::refuse).ok());
  nodes[0].product = "Brio";
  EXPECT_TRUE(match_camera(nodes, *parse_camera_selector("model=Brio"), IdentityMismatch::refuse).ok());
}

// Two of one kind with the same serial number, as cheap ones have: only the path tells them apart.
TEST(MatchCameraT2, TheSameSerialTwiceNeedsThePath) {
  const std::vector<V4l2Node> twins{webcam("/dev/video0", "usb-1", "SN0001"),
                                    webcam("/dev/video2", "usb-2", "SN0001")};
  EXPECT_FALSE(
      match_camera(twins, *parse_camera_selector("serial=SN0001"), IdentityMismatch::accept_moved).ok());
  const Result<NodeMatch> match =
      match_camera(twins, *parse_camera_selector("path=usb-2,serial=SN0001"), IdentityMismatch::accept_moved);
  ASSERT_TRUE(match.ok());
  EXPECT_EQ(match->nodes[0].node, "/dev/video2");
}

}  // namespace
}  // namespace handloft::tracking
