// handloft-calibrate over real kernel interfaces (T11): a live V4L2 camera (vivid), which shows no board, and
// a USB glove (FunctionFS) that is pressed and turned while it listens.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "daemon-tracking/source/calibration_file.h"
#include "tests/hardware/driven_device.h"
#include "tests/hardware/vivid_calibration.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 60s;  // Only a failing test waits so long: the guest is slow.

TEST(CalibrateDevicesT11, ALiveCameraWithoutABoardIsLookedAtAndRefusedInWords) {
  const test::TemporaryDirectory folder;
  const std::string file = (folder.path() / "calibration.toml").string();
  const Calibration before = test::vivid_calibration();
  ASSERT_TRUE(save_calibration(before, file).ok());
  test::Process calibrate({test::program("handloft-calibrate").string(), "intrinsics", "--file", file,
                           "--out", folder.path().string(), "--camera", "left=/dev/video0", "--seconds", "4"},
                          folder.path() / "errors.txt");
  const std::string said = calibrate.read_all(patience);
  EXPECT_EQ(calibrate.wait(patience), std::optional<int>(1));
  const std::string words = said + calibrate.error_output();
  const std::size_t at = words.find("saw no chessboard");
  ASSERT_NE(at, std::string::npos) << words;
  const std::size_t count = words.find(" in ", at);
  ASSERT_NE(count, std::string::npos) << words;
  EXPECT_GE(std::atoi(words.c_str() + count + 4), 10) << words;
  const auto after = load_calibration(file);
  ASSERT_TRUE(after.ok());
  EXPECT_EQ(after->rig.cameras.front().intrinsics.fx_px, before.rig.cameras.front().intrinsics.fx_px);
}

TEST(CalibrateDevicesT11, ALiveGlovesRangesAreMeasuredAndItsIdentityIsKept) {
  const test::TemporaryDirectory folder;
  const std::string file = (folder.path() / "calibration.toml").string();
  ASSERT_TRUE(save_calibration(test::vivid_calibration(), file).ok());
  test::DrivenDevice glove({"glove_gadget"});
  glove.tell("force 40");
  glove.tell("pot 60");
  glove.tell("plug");
  glove.hear("plugged");
  test::Process calibrate({test::program("handloft-calibrate").string(), "glove", "--file", file, "--out",
                           folder.path().string(), "--seconds", "8"},
                          folder.path() / "errors.txt");
  // At rest for a half of each round, then pressed to 840 while the potentiometer goes over all of its way.
  for (int step = 0; !calibrate.wait(20ms); ++step) {
    const double phase = step % 100 / 100.0;
    const double pressed = phase < 0.5 ? 0.0 : std::sin((phase - 0.5) * 2 * M_PI);
    glove.tell(fmt::format("force {}", 40 + static_cast<int>(800 * pressed)));
    glove.tell(fmt::format("pot {}", 60 + static_cast<int>(900 * std::abs(std::sin(M_PI * phase)))));
  }
  ASSERT_EQ(calibrate.wait(patience), std::optional<int>(0))
      << calibrate.read_all(patience) << calibrate.error_output();
  const auto after = load_calibration(file);
  ASSERT_TRUE(after.ok());
  ASSERT_TRUE(after->glove);
  EXPECT_NEAR(after->glove->force_zero, 40, 20);
  EXPECT_NEAR(after->glove->force_full, 840, 100);
  EXPECT_LT(after->glove->potentiometer_low, 120);
  EXPECT_GT(after->glove->potentiometer_high, 880);
  EXPECT_EQ(after->glove->device.serial, "GADGET1");
}

}  // namespace
}  // namespace handloft::tracking
