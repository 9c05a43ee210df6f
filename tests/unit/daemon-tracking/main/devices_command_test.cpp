// What `devices` and `status` print.

#include "daemon-tracking/main/devices_command.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon-tracking/main/status_command.h"
#include "daemon-tracking/source/glove_report.h"

namespace handloft::tracking {
namespace {

PluggedDevice hidraw(std::uint16_t vendor, std::uint16_t product) {
  PluggedDevice device;
  device.subsystem = "hidraw";
  device.devnode = "/dev/hidraw3";
  device.vendor_id = vendor;
  device.product_id = product;
  device.serial = "12";
  device.path_id = "pci-0000:00:14.0-usb-0:2:1.0";
  device.name = "evil\x1b[2Jname";
  return device;
}

FoundDevices some_devices() {
  FoundDevices found;
  V4l2CameraInfo camera;
  camera.node.node = "/dev/video0";
  camera.node.serial = "3F2A";
  camera.model = "HD Pro Webcam";
  camera.identity = "046d:082d serial 3F2A at pci-1";
  camera.sizes = {{PixelFormat::mjpeg, 640, 480, {30.0, 15.0}}};
  found.cameras.push_back(camera);
  PluggedDevice tablet;
  tablet.subsystem = "input";
  tablet.devnode = "/dev/input/event7";
  tablet.tablet = true;
  PluggedDevice keyboard = tablet;
  keyboard.tablet = false;
  found.inputs = input_devices({hidraw(glove_usb_vendor, glove_usb_product), hidraw(0x046D, 0xC626),
                                hidraw(0x1234, 0x5678), tablet, keyboard});
  return found;
}

TEST(DevicesCommand, KnowsWhatIsWhat) {
  const FoundDevices found = some_devices();
  ASSERT_EQ(found.inputs.size(), 3u) << "no foreign HID device, no keyboard";
  EXPECT_EQ(found.inputs[0].kind, InputKind::glove);
  EXPECT_EQ(found.inputs[1].kind, InputKind::space_mouse);
  EXPECT_EQ(found.inputs[2].kind, InputKind::pen);
}

TEST(DevicesCommand, TextNamesModesAndIdentitiesAndIsSafeForTerminals) {
  const std::string text = devices_text(some_devices());
  for (const char* words : {"/dev/video0", "046d:082d serial 3F2A", "640x480", "30, 15 Hz", "3D mouse"})
    EXPECT_NE(text.find(words), std::string::npos) << words << " in " << text;
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_NE(devices_text({}).find("doctor"), std::string::npos) << "what to do when there is nothing";
}

TEST(DevicesCommand, JsonHasTheSame) {
  const nlohmann::json document = nlohmann::json::parse(devices_json(some_devices()), nullptr, false);
  ASSERT_TRUE(document.is_object());
  EXPECT_EQ(document["cameras"][0]["modes"][0]["rates_hz"][1], 15.0);
  EXPECT_EQ(document["cameras"][0]["serial"], "3F2A");
  EXPECT_EQ(document["inputs"][0]["kind"], "glove");
  EXPECT_EQ(document["inputs"][0]["usb_id"], "1209:0001");
}

TEST(DevicesCommand, NamesThatAreNoTextStayJson) {
  FoundDevices found = some_devices();
  found.cameras[0].model = "\xff\xfe";
  EXPECT_TRUE(nlohmann::json::parse(devices_json(found), nullptr, false).is_object());
}

TEST(StatusCommand, TellsDevicesLatencyAndAlarms) {
  v1::TrackingFrame frame;
  frame.set_sequence(7);
  v1::DeviceHealth& camera = *frame.add_devices();
  camera.set_device("camera/left");
  camera.set_present(true);
  camera.set_rate_hz(29.97);
  camera.set_asked_rate_hz(30);
  camera.set_problem("the camera was moved");
  frame.mutable_latency()->set_frames(300);
  frame.mutable_latency()->set_p95_ms(31.5);
  const std::string text = status_text(frame, 0.02);
  for (const char* words :
       {"camera/left", "there", "30.0", "p95 31.5 ms", "ALARM camera/left: the camera was moved"})
    EXPECT_NE(text.find(words), std::string::npos) << words << " in " << text;
  const nlohmann::json document = nlohmann::json::parse(status_json(frame, 0.02), nullptr, false);
  EXPECT_EQ(document["devices"][0]["problem"], "the camera was moved");
  EXPECT_EQ(document["latency_ms"]["p95"], 31.5);
}

}  // namespace
}  // namespace handloft::tracking
