// The calibration file (T2, T11): what is refused, and in which words.

#include "daemon-tracking/source/calibration_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

std::string default_text() {
  Calibration calibration = calibration_of(default_rig());
  calibration.date = "2026-11-22T12:20:00Z";
  calibration.glove = GloveRanges{{"Handloft glove", "7", "1-2"}, 12, 900, 8, 1011};
  calibration.cameras[0].results["intrinsics"] = {Verdict::good, 0.21, "px", "2026-11-22T12:20:00Z",
                                                  "Sharp."};
  return format_calibration(calibration).value();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

Error refusal(const std::string& text) {
  const Result<Calibration> read = parse_calibration(text, "lab.toml");
  EXPECT_FALSE(read.ok());
  return read ? Error{} : read.error();
}

TEST(CalibrationFile, T11HoldsTheDefaultRig) {
  const Result<Calibration> read = parse_calibration(default_text(), "lab.toml");
  ASSERT_TRUE(read.ok()) << read.error().describe();
  const Rig rig = default_rig();
  ASSERT_EQ(read->rig.cameras.size(), rig.cameras.size());
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    EXPECT_EQ(read->rig.cameras[i].name, rig.cameras[i].name);
    EXPECT_EQ(read->rig.cameras[i].intrinsics.fy_px, rig.cameras[i].intrinsics.fy_px);
    EXPECT_TRUE(read->rig.cameras[i].world_from_camera.isApprox(rig.cameras[i].world_from_camera, 1e-14));
    EXPECT_TRUE(read->rig.cameras[i].head_from_camera.isApprox(rig.cameras[i].head_from_camera, 1e-14));
  }
  ASSERT_EQ(read->rig.table_tags.size(), rig.table_tags.size());
  ASSERT_EQ(read->rig.head_tags.size(), rig.head_tags.size());
  EXPECT_TRUE(read->rig.head_tags[1].body_from_tag.isApprox(rig.head_tags[1].body_from_tag, 1e-14));
  EXPECT_EQ(read->rig.colours[3].cb, rig.colours[3].cb);
  ASSERT_TRUE(read->glove);
  EXPECT_EQ(read->glove->force_full, 900.0);
  EXPECT_EQ(read->cameras[0].results.at("intrinsics").words, "Sharp.");
}

TEST(CalibrationFile, T11RefusesNamingFileLineTableKeyAndWhatWasExpected) {
  struct Case {
    const char *from, *to, *key, *expected;
  };
  const Case cases[] = {
      {"offset_ns = 0", "offset_ns = \"late\"", "camera[0].time.offset_ns", "whole nanoseconds"},
      {"width_px = 640", "width_px = 64.5", "camera[0].mode.width_px", "a whole number"},
      {"width_px = 640", "width_px = 9000", "camera[0].mode.width_px", "1 to 8192"},
      {"focal_px = [602.0, 601.0]", "focal_px = [602.0]", "camera[0].lens.focal_px", "a list of 2 numbers"},
      {"focal_px = [602.0, 601.0]", "focal_px = [602.0, nan]", "camera[0].lens.focal_px", "1 to 100000"},
      {"format = \"mjpeg\"", "format = \"png\"", "camera[0].mode.format", "\"yuyv\""},
      {"role = \"table\"", "roll = \"table\"", "camera[0].role", "missing"},
      {"frames_per_s = 30.0", "frames_per_s = 30.0, lens = 1", "camera[0].mode.lens", "no such key"},
      {"verdict = \"good\"", "verdict = \"fine\"", "camera[0].results.intrinsics.verdict", "\"usable\""},
      {"name = \"right\"", "name = \"left\"", "camera[1].name", "each name once"},
      {"id = 21", "id = 20", "head_tag[1].id", "each tag once"},
      {"edge_m = 0.05", "edge_m = -1", "table_tag[0].edge_m", "0.001 to 2"},
      {"orientation_wxyz = [1.0, 0.0, 0.0, 0.0]", "orientation_wxyz = [0, 0, 0, 0]",
       "table_tag[0].orientation_wxyz", "length 1"},
      {"force_full = 900.0", "force_full = 12", "glove.force_full", "at least one step above"},
  };
  for (const Case& one : cases) {
    const Error error = refusal(replaced(default_text(), one.from, one.to));
    EXPECT_EQ(error.code, ErrorCode::invalid_argument) << one.to;
    EXPECT_TRUE(error.field.starts_with("lab.toml:")) << error.describe();
    EXPECT_NE(error.field.find(one.key), std::string::npos) << error.describe() << " for " << one.to;
    EXPECT_NE(error.message.find(one.expected), std::string::npos) << error.describe() << " for " << one.to;
  }
}

TEST(CalibrationFile, T11RefusesOtherFiles) {
  EXPECT_EQ(refusal("version = 2").code, ErrorCode::unsupported);
  EXPECT_EQ(refusal("version = [").code, ErrorCode::data_corrupt);
  EXPECT_EQ(refusal("").code, ErrorCode::invalid_argument);
  EXPECT_EQ(refusal(std::string(max_calibration_bytes + 1, '#')).code, ErrorCode::resource_exhausted);
  const Result<Calibration> none = load_calibration("/nonexistent/lab.toml");
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::not_found);
}

TEST(CalibrationFile, T11SavesTheWholeFileOrNone) {
  const test::TemporaryDirectory folder;
  const auto path = folder.path() / "lab.toml";
  Calibration calibration = calibration_of(default_rig());
  ASSERT_TRUE(save_calibration(calibration, path).ok());
  ASSERT_TRUE(load_calibration(path).ok());
  calibration.rig.cameras[0].intrinsics.fx_px = std::numeric_limits<double>::quiet_NaN();
  const Status refused = save_calibration(calibration, path);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().field, "camera[0].lens.focal_px");
  EXPECT_TRUE(load_calibration(path).ok()) << "the old file stays";
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1)
      << "nothing is left beside it";
  EXPECT_EQ(save_calibration(calibration_of(default_rig()), folder.path() / "none" / "lab.toml").error().code,
            ErrorCode::io);
}

TEST(CalibrationFile, T2ACalibrationBelongsToItsDeviceAndMode) {
  Calibration calibration = calibration_of(default_rig());
  const DeviceIdentity device{"HD Webcam", "4F2A", "usb-1"};
  EXPECT_TRUE(check_device(calibration, 0, device, 640, 480).ok()) << "nothing was said of the device";
  calibration.cameras[0].device = device;
  EXPECT_TRUE(check_device(calibration, 0, device, 640, 480).ok());
  EXPECT_TRUE(check_device(calibration, 0, {"HD Webcam", "4F2A", "usb-2"}, 640, 480).ok()) << "another port";
  EXPECT_FALSE(check_device(calibration, 0, {"HD Webcam", "4F2B", "usb-1"}, 640, 480).ok());
  EXPECT_FALSE(check_device(calibration, 0, {"Other", "4F2A", "usb-1"}, 640, 480).ok());
  EXPECT_FALSE(check_device(calibration, 0, device, 1280, 720).ok());
  EXPECT_FALSE(check_device(calibration, 9, device, 640, 480).ok());
  calibration.cameras[0].device.serial.clear();
  EXPECT_TRUE(check_device(calibration, 0, {"HD Webcam", "", "usb-1"}, 640, 480).ok());
  EXPECT_FALSE(check_device(calibration, 0, {"HD Webcam", "", "usb-2"}, 640, 480).ok());
}

TEST(CalibrationFile, T6ACameraMayHaveColoursOfItsOwn) {
  Calibration calibration = calibration_of(default_rig());
  calibration.cameras[1].colours = calibration.rig.colours;
  (*calibration.cameras[1].colours)[0].cr = 190;
  EXPECT_EQ(rig_for_camera(calibration, 0).colours[0].cr, calibration.rig.colours[0].cr);
  EXPECT_EQ(rig_for_camera(calibration, 1).colours[0].cr, 190);
}

}  // namespace
}  // namespace handloft::tracking
