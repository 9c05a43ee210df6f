// What `doctor` finds on made-up computers: every fault has words and a remedy, and a sound computer none.

#include "daemon-tracking/main/doctor_checks.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon-tracking/main/device_sources.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

using Level = Finding::Level;

Calibration one_camera_calibration() {
  Calibration calibration = calibration_of(default_rig());
  calibration.date = "2026-11-22T12:20:00Z";
  calibration.rig.cameras.resize(1);
  calibration.cameras.resize(1);
  calibration.cameras[0].device = {"HD Webcam", "3F2A", "pci-1"};
  calibration.cameras[0].frames_per_s = 30.0;
  return calibration;
}

V4l2CameraInfo webcam(const std::string& serial) {
  V4l2CameraInfo camera;
  camera.node.node = "/dev/video0";
  camera.node.name = camera.model = "HD Webcam";
  camera.node.serial = serial;
  camera.node.path = "pci-1";
  camera.node.usb_id = "046d:082d";
  camera.node.bus = "usb1";
  camera.node.bus_speed_mbit_s = 480;
  camera.identity = identity_of(camera.node);
  camera.sizes = {{PixelFormat::mjpeg, 640, 480, {30.0}}};
  return camera;
}

TEST(Doctor, ASoundCameraIsFine) {
  const std::vector<Finding> findings = check_calibrated_cameras(one_camera_calibration(), {webcam("3F2A")});
  ASSERT_EQ(findings.size(), 2u) << findings_text(findings);
  EXPECT_EQ(findings[0].level, Level::ok);
  EXPECT_EQ(findings[1].level, Level::ok) << findings[1].words;
}

TEST(Doctor, NoCalibrationTellsHowToMakeOne) {
  const auto missing = make_error(ErrorCode::invalid_argument, "there is no calibration at x", "calibration");
  const std::vector<Finding> findings = check_calibrated_cameras(missing, {webcam("3F2A")});
  EXPECT_EQ(findings[0].level, Level::fail);
  EXPECT_NE(findings[0].remedy.find("handloft-calibrate"), std::string::npos);
  EXPECT_EQ(findings[1].level, Level::ok) << "the camera itself is fine";
}

TEST(Doctor, AnotherCameraInItsPlaceIsUnmatchedT2) {
  const std::vector<Finding> findings = check_calibrated_cameras(one_camera_calibration(), {webcam("FFFF")});
  ASSERT_EQ(findings.size(), 3u) << findings_text(findings);
  EXPECT_EQ(findings[1].level, Level::fail);
  EXPECT_EQ(findings[2].level, Level::warn);
  EXPECT_NE(findings[2].words.find("unmatched"), std::string::npos);
}

TEST(Doctor, AModeThatTheCameraLacksT2) {
  V4l2CameraInfo camera = webcam("3F2A");
  camera.sizes = {{PixelFormat::mjpeg, 640, 480, {15.0}}, {PixelFormat::yuyv, 640, 480, {30.0}}};
  const std::vector<Finding> findings = check_calibrated_cameras(one_camera_calibration(), {camera});
  EXPECT_EQ(findings[1].level, Level::fail);
  EXPECT_NE(findings[1].words.find("640x480"), std::string::npos);
}

TEST(Doctor, ABadStepAndAClosedNode) {
  Calibration calibration = one_camera_calibration();
  calibration.cameras[0].results["intrinsics"] = {Verdict::bad, 9.0, "px", "", "9 px is too much"};
  EXPECT_EQ(check_calibrated_cameras(calibration, {webcam("3F2A")})[1].level, Level::warn);
  V4l2CameraInfo closed = webcam("3F2A");
  closed.unusable = "no permission";
  const Finding finding = check_calibrated_cameras(one_camera_calibration(), {closed})[1];
  EXPECT_EQ(finding.level, Level::fail);
  EXPECT_NE(finding.remedy.find("udev"), std::string::npos);
}

TEST(Doctor, AFullBusIsSaid) {
  Calibration calibration = one_camera_calibration();
  calibration.rig = default_rig();
  calibration.cameras.resize(calibration.rig.cameras.size());
  std::vector<V4l2CameraInfo> cameras;
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    CameraRecord& record = calibration.cameras[i];
    record.device = {"HD Webcam", std::to_string(i), ""};
    record.format = PixelFormat::yuyv;
    record.frames_per_s = 60.0;
    V4l2CameraInfo camera = webcam(std::to_string(i));
    camera.node.node = "/dev/video" + std::to_string(i);
    cameras.push_back(camera);
  }
  const std::vector<Finding> findings = check_usb_bandwidth(calibration, cameras);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].level, Level::warn) << findings[0].words;
  const std::vector<Finding> fine = check_usb_bandwidth(one_camera_calibration(), {webcam("3F2A")});
  ASSERT_EQ(fine.size(), 1u);
  EXPECT_EQ(fine[0].level, Level::ok) << fine[0].words;
}

TEST(Doctor, InputsThatMayNotBeOpened) {
  InputDevice glove;
  glove.device.devnode = "/dev/hidraw0";
  const auto closed = check_inputs({glove}, [](const std::string&) { return false; });
  EXPECT_EQ(closed[0].level, Level::fail);
  EXPECT_NE(closed[0].words.find("/dev/hidraw0"), std::string::npos);
  const auto open = check_inputs({glove}, [](const std::string&) { return true; });
  EXPECT_EQ(open[0].level, Level::ok);
  const auto none = check_inputs({}, [](const std::string&) { return true; });
  EXPECT_EQ(none[0].level, Level::warn) << "a glove is wanted";
  EXPECT_FALSE(any_failed(none)) << "but the daemon runs without";
}

TEST(Doctor, UdevRulesAreFoundWhereverTheyAreInstalled) {
  const test::TemporaryDirectory root;
  EXPECT_EQ(check_udev_rules(root.path()).level, Level::warn);
  std::filesystem::create_directories(root.path() / "usr/local/lib/udev/rules.d");
  std::ofstream(root.path() / "usr/local/lib/udev/rules.d/70-handloft.rules") << "#\n";
  EXPECT_EQ(check_udev_rules(root.path()).level, Level::ok);
}

TEST(Doctor, TheRuntimeFolderIsOursAlone) {
  const test::TemporaryDirectory folder;
  EXPECT_EQ(check_runtime_folder(nullptr).level, Level::warn);
  EXPECT_EQ(check_runtime_folder("/does/not/exist").level, Level::fail);
  chmod(folder.path().c_str(), 0755);
  EXPECT_EQ(check_runtime_folder(folder.path().c_str()).level, Level::fail);
  chmod(folder.path().c_str(), 0700);
  EXPECT_EQ(check_runtime_folder(folder.path().c_str()).level, Level::ok);
}

TEST(Doctor, GovernorClockAndProcessors) {
  const test::TemporaryDirectory root;
  const auto write = [&](const std::string& file, const std::string& text) {
    const auto path = root.path() / file;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text << '\n';
  };
  for (const Finding& finding : check_machine(root.path(), 4))
    EXPECT_EQ(finding.level, Level::ok) << finding.words;
  write("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave");
  write("sys/devices/system/cpu/cpu0/cpufreq/scaling_driver", "acpi-cpufreq");
  write("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet");
  for (const Finding& finding : check_machine(root.path(), 1)) {
    EXPECT_EQ(finding.level, Level::warn) << finding.subject;
    EXPECT_FALSE(finding.remedy.empty()) << finding.subject;
  }
  write("sys/devices/system/cpu/cpu0/cpufreq/scaling_driver", "intel_pstate");
  EXPECT_EQ(check_machine(root.path(), 4)[1].level, Level::ok) << "it scales by load under that name";
}

TEST(Doctor, TheSocketAndTheLibrary) {
  EXPECT_EQ(check_socket("unix:x", std::nullopt).level, Level::ok);
  EXPECT_EQ(check_socket("unix:x", make_error(ErrorCode::not_found, "nobody")).level, Level::ok);
  EXPECT_EQ(check_socket("unix:x", make_error(ErrorCode::timeout, "no answer")).level, Level::fail);
  EXPECT_EQ(check_hid_library([](const char*) { return false; }).level, Level::fail);
}

TEST(Doctor, AnswersForPeopleAndPrograms) {
  const std::vector<Finding> findings{{Level::ok, "clock", "tsc", ""},
                                      {Level::fail, "glove", "closed", "open it"}};
  EXPECT_TRUE(any_failed(findings));
  EXPECT_EQ(findings_text(findings), "ok    clock: tsc\nFAIL  glove: closed\n      -> open it\n");
  const nlohmann::json document = nlohmann::json::parse(findings_json(findings), nullptr, false);
  EXPECT_EQ(document[1]["level"], "fail");
  EXPECT_EQ(document[1]["remedy"], "open it");
}

TEST(DeviceSources, ACalibrationIsForItsOwnModeT2) {
  const Calibration calibration = one_camera_calibration();
  const V4l2CameraOptions options = camera_options(calibration, 0);
  EXPECT_EQ(options.selector.serial, "3F2A");
  EXPECT_EQ(options.selector.path, "") << "the serial number tells it, wherever it is plugged in";
  EXPECT_EQ(options.mode.width_px, calibration.rig.cameras[0].intrinsics.width_px);
  EXPECT_EQ(options.mode.format, PixelFormat::mjpeg);
  CameraHealth health;
  health.present = true;
  health.model = "HD Webcam";
  health.mode = {PixelFormat::mjpeg, 640, 480, 30.0};
  EXPECT_EQ(facts_of("camera/left", health, calibration, 0).problem, "");
  health.mode.width_px = 1280;
  EXPECT_TRUE(facts_of("camera/left", health, calibration, 0).problem.starts_with("unmatched"));
  health.mode.width_px = 640;
  health.model = "Other Webcam";
  EXPECT_TRUE(facts_of("camera/left", health, calibration, 0).problem.starts_with("unmatched"));
}

TEST(DeviceSources, CamerasWithoutSerialNumbersAreToldByTheirSockets) {
  Calibration calibration = one_camera_calibration();
  calibration.cameras[0].device.serial.clear();
  EXPECT_EQ(camera_options(calibration, 0).selector.path, "pci-1");
}

TEST(DeviceSources, AnInputThatNobodyPluggedInIsNoProblem) {
  DeviceStatus status;
  status.problem = "not plugged in: plug the glove in";
  EXPECT_EQ(facts_of("glove", status).problem, "");
  status.problem = "/dev/hidraw0 may not be opened";
  EXPECT_EQ(facts_of("glove", status).problem, status.problem);
}

}  // namespace
}  // namespace handloft::tracking
