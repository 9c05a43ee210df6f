// The program's steps without devices: options, files, refusals in words (T11).

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "daemon-tracking/calibrate/live_input.h"
#include "daemon-tracking/calibrate/options.h"
#include "daemon-tracking/calibrate/steps.h"
#include "daemon-tracking/calibration/picture.h"
#include "daemon-tracking/source/glove_report.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

namespace fs = std::filesystem;

const fs::path chessboards = "/usr/share/doc/opencv-doc/examples/data";
constexpr const char* date = "2026-11-22T12:00:00Z";

struct Lab {
  test::TemporaryDirectory folder;
  CalibrateOptions options;
  explicit Lab(const std::string& step) {
    options.step = step;
    options.file = (folder.path() / "lab.toml").string();
    options.out = (folder.path() / "pictures").string();
  }
  Result<Verdict> run() { return run_step(options, date, nullptr); }
};

TEST(CalibrateOptionsOf, T11ReadTheCommandLine) {
  CalibrateOptions options;
  OptionTable table = make_calibrate_table(options);
  ASSERT_TRUE(table.parse({"intrinsics", "--images", "x", "--camera", "left", "--square-mm", "30"}).ok());
  EXPECT_EQ(options.step, "intrinsics");
  EXPECT_EQ(options.cameras, std::vector<std::string>{"left"});
  EXPECT_NEAR(options.chessboard().square_m, 0.03, 1e-12);
  CalibrateOptions other;
  OptionTable second = make_calibrate_table(other);
  EXPECT_FALSE(second.parse({"focus"}).ok());
  options.simulate = true;
  EXPECT_FALSE(check_calibrate_options(options).ok()) << "two sources";
  CalibrateOptions glove;
  glove.step = "glove";
  glove.images = "x";
  EXPECT_FALSE(check_calibrate_options(glove).ok());
}

TEST(CalibrateSteps, T11PrintBeginsAFile) {
  Lab lab("print");
  ASSERT_TRUE(lab.run().ok());
  EXPECT_TRUE(fs::exists(fs::path(lab.options.out) / "handloft-print.pdf"));
  const auto file = load_calibration(lab.options.file);
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->date, date);
}

TEST(CalibrateSteps, T11LensesAndPlacesFromFoldersOfPictures) {
  if (!fs::exists(chessboards / "left01.jpg")) GTEST_SKIP() << "Debian's opencv-doc is not installed";
  Lab lab("intrinsics");
  const fs::path images = lab.folder.path() / "images";
  fs::create_directory(images);
  for (const char* name : {"01", "02", "03", "04", "05", "06", "07", "08", "09", "11", "12", "13", "14"})
    for (const char* side : {"left", "right"})
      fs::copy_file(chessboards / (std::string(side) + name + ".jpg"),
                    images / (std::string(side) + name + ".jpg"));
  lab.options.images = images.string();
  const auto lenses = lab.run();
  ASSERT_TRUE(lenses.ok()) << lenses.error().describe();
  EXPECT_NE(*lenses, Verdict::bad);
  for (const char* picture : {"intrinsics-left.png", "coverage-left.png", "intrinsics-right.png"})
    EXPECT_TRUE(fs::exists(fs::path(lab.options.out) / picture)) << picture;
  lab.options.step = "extrinsics";
  lab.options.cameras = {"left", "right"};
  const auto places = lab.run();
  ASSERT_TRUE(places.ok()) << places.error().describe();
  const auto file = load_calibration(lab.options.file);
  ASSERT_TRUE(file.ok());
  EXPECT_NEAR(file->rig.cameras[0].intrinsics.fx_px, 533.3, 1.0);
  const double baseline = (file->rig.cameras[0].world_from_camera.translation() -
                           file->rig.cameras[1].world_from_camera.translation())
                              .norm();
  EXPECT_NEAR(baseline, 0.0833, 0.0005) << "squares of 25 mm";
  EXPECT_EQ(file->cameras[0].results.at("intrinsics").date, date);
}

TEST(CalibrateSteps, T11RefusesInWordsAndLeavesTheFileAsItWas) {
  if (!fs::exists(chessboards / "left01.jpg")) GTEST_SKIP() << "Debian's opencv-doc is not installed";
  Lab lab("intrinsics");
  const fs::path images = lab.folder.path() / "images";
  fs::create_directory(images);
  lab.options.images = images.string();
  lab.options.cameras = {"left"};
  EXPECT_EQ(lab.run().error().code, ErrorCode::not_found) << "an empty folder";
  for (const char* name : {"left01.jpg", "left02.jpg", "left03.jpg"})
    fs::copy_file(chessboards / name, images / name);
  const auto few = lab.run();
  ASSERT_FALSE(few.ok());
  EXPECT_NE(few.error().message.find("at least 6"), std::string::npos) << few.error().describe();
  EXPECT_EQ(few.error().field, "intrinsics.left");
  lab.options.columns = 7;
  lab.options.rows = 5;
  // 7 x 5 corners may be found inside of a larger board; a larger one than the real cannot.
  lab.options.columns = 11;
  lab.options.rows = 8;
  const auto wrong = lab.run();
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("is it the right board"), std::string::npos)
      << wrong.error().describe();
  EXPECT_FALSE(fs::exists(lab.options.file));
  std::ofstream(images / "left04.jpg") << "no picture";
  lab.options.columns = 9;
  lab.options.rows = 6;
  EXPECT_FALSE(lab.run().ok()) << "a broken picture is passed over, not believed";
  lab.options.cameras = {"top"};
  EXPECT_EQ(lab.run().error().code, ErrorCode::invalid_argument);
}

TEST(CalibrateSteps, T11RefusesADamagedFileAndAMissingRecording) {
  Lab lab("head-rig");
  lab.options.recording = (lab.folder.path() / "none.rec").string();
  EXPECT_FALSE(lab.run().ok());
  std::ofstream(lab.options.file) << "version = 1\n";
  const auto damaged = lab.run();
  ASSERT_FALSE(damaged.ok());
  EXPECT_NE(damaged.error().field.find("lab.toml"), std::string::npos) << damaged.error().describe();
  Lab check("check");
  check.options.simulate = true;
  EXPECT_EQ(check.run().error().code, ErrorCode::not_found) << "nothing to check";
}

TEST(CalibrateSteps, T11TheGlovesIdentityIsThatOfItsNodeAndOfNoOther) {
  PluggedDevice mouse{"hidraw", "/dev/hidraw0", "", "hub-1", "7", 0x046d, 0xc626, "SpaceNavigator", false};
  PluggedDevice glove{"hidraw",          "/dev/hidraw1",   "",   "hub-2", "G4", glove_usb_vendor,
                      glove_usb_product, "Handloft Glove", false};
  EXPECT_FALSE(glove_identity({}).has_value());
  EXPECT_FALSE(glove_identity({mouse}).has_value());
  const auto found = glove_identity({mouse, glove});
  ASSERT_TRUE(found);
  EXPECT_EQ(*found, (DeviceIdentity{"Handloft Glove", "G4", "hub-2"}));
}

TEST(CalibrateSteps, T11TheGloveOfTheSimulatedRig) {
  Lab lab("glove");
  lab.options.simulate = true;
  const auto verdict = lab.run();
  ASSERT_TRUE(verdict.ok()) << verdict.error().describe();
  const auto file = load_calibration(lab.options.file);
  ASSERT_TRUE(file.ok() && file->glove);
  EXPECT_NEAR(file->glove->force_zero, 5, 5);
  EXPECT_NEAR(file->glove->force_full, 0.92 * 1023, 15);
  EXPECT_LT(file->glove->potentiometer_low, 40);
  EXPECT_GT(file->glove->potentiometer_high, 980);
}

}  // namespace
}  // namespace handloft::tracking
