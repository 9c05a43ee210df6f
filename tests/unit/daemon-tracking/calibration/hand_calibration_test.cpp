// Fingertip colours (T6, T11) and glove ranges (T9, T11): learned where the data are good, refused in words
// where they are not.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "daemon-tracking/calibration/colours.h"
#include "daemon-tracking/calibration/glove_ranges.h"

namespace handloft::tracking {
namespace {

using Colours = std::array<FingertipColour, finger_count>;

/// Five caps of 12 chroma samples that go round before a grey-brown table, with noise.
PlanarImage frame_of(const Colours& caps, int index, std::mt19937& random) {
  constexpr int width = 320, height = 240;
  std::normal_distribution<double> noise(0, 2.0);
  PlanarImage image;
  image.chroma_step_x = 2;
  image.chroma_step_y = 1;
  image.y = {2 * width, height, std::vector<std::uint8_t>(2 * width * height, 120)};
  image.cb = {width, height, {}};
  image.cr = {width, height, {}};
  for (int i = 0; i < width * height; ++i) {
    image.cb.samples.push_back(static_cast<std::uint8_t>(123 + noise(random)));
    image.cr.samples.push_back(static_cast<std::uint8_t>(132 + noise(random)));
  }
  for (std::size_t finger = 0; finger < caps.size(); ++finger) {
    const double angle = 0.35 * index + 1.2 * static_cast<double>(finger);
    const int cx = static_cast<int>(160 + 100 * std::cos(angle)),
              cy = static_cast<int>(120 + 70 * std::sin(angle));
    for (int y = cy - 6; y < cy + 6; ++y)
      for (int x = cx - 6; x < cx + 6; ++x) {
        const auto at = static_cast<std::size_t>(y * width + x);
        image.cb.samples[at] =
            static_cast<std::uint8_t>(std::clamp(caps[finger].cb + 2 * noise(random), 0.0, 255.0));
        image.cr.samples[at] =
            static_cast<std::uint8_t>(std::clamp(caps[finger].cr + 2 * noise(random), 0.0, 255.0));
      }
  }
  return image;
}

Result<ColourCalibration> learned(const Colours& caps, int frames = 40) {
  ColourLearner learner(default_rig().colours);
  std::mt19937 random(3);
  for (int i = 0; i < frames; ++i) learner.add(frame_of(caps, i, random));
  return learner.learn();
}

TEST(Colours, T11LearnsTheCapsAsTheCameraSeesThem) {
  // This camera sees everything a little greener and paler than the chart.
  Colours seen = default_rig().colours;
  for (FingertipColour& colour : seen) {
    colour.cb = 128 + 0.85 * (colour.cb - 128) - 4;
    colour.cr = 128 + 0.85 * (colour.cr - 128) - 6;
  }
  const auto made = learned(seen);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    EXPECT_NEAR(made->colours[i].cb, seen[i].cb, 1.5) << i;
    EXPECT_NEAR(made->colours[i].cr, seen[i].cr, 1.5) << i;
    EXPECT_NEAR(made->colours[i].sigma_cb, 1.3 * 4, 2.0);
  }
  EXPECT_EQ(made->result.verdict, Verdict::good) << made->result.words;
  EXPECT_EQ(made->pairs.size(), 10U);
}

TEST(Colours, T11NamesTheTwoThatAreTooAlike) {
  Colours caps = default_rig().colours;
  // Thumb red (103, 217), little finger magenta (176, 196): somebody took a red that is nearly magenta.
  caps[0].cb = 166;
  caps[0].cr = 204;
  const auto made = learned(caps);
  if (made) {
    EXPECT_EQ(made->result.verdict, Verdict::bad);
    EXPECT_NE(made->result.words.find("thumb"), std::string::npos) << made->result.words;
    EXPECT_NE(made->result.words.find("little"), std::string::npos) << made->result.words;
  } else {
    // Or they are one cluster, and one of the two has no cap of its own.
    const bool named = made.error().message.find("thumb") != std::string::npos ||
                       made.error().message.find("little") != std::string::npos;
    EXPECT_TRUE(named) << made.error().message;
  }
}

TEST(Colours, T11SaysWhatIsMissing) {
  EXPECT_FALSE(learned(default_rig().colours, 5).ok()) << "too few frames";
  Colours caps = default_rig().colours;
  caps[2].cb = 123;
  caps[2].cr = 132;  // A middle finger without a cap.
  const auto bare = learned(caps);
  ASSERT_FALSE(bare.ok());
  EXPECT_NE(bare.error().message.find("middle"), std::string::npos) << bare.error().message;
  ColourLearner grey(default_rig().colours);
  grey.add({});
  EXPECT_EQ(grey.frames(), 0U);
}

std::vector<GloveReport> session(double force_rest, double force_peak, double turn_low, double turn_high,
                                 double noise) {
  std::vector<GloveReport> reports;
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, noise);
  for (int i = 0; i < 2500; ++i) {
    const double t = i / 250.0;
    const double press = t > 3 && t < 7 ? std::pow(std::sin(3.14159265 * (t - 3) * 1.25), 2) : 0.0;
    const double turn = t < 7.5 ? 0.5 : 0.5 + 0.5 * std::sin(2 * 3.14159265 * (t - 7.5) / 2.5);
    GloveReport report;
    report.force = static_cast<std::uint16_t>(
        std::clamp(force_rest + press * (force_peak - force_rest) + normal(random), 0.0, 1023.0));
    report.potentiometer =
        static_cast<std::uint16_t>(std::clamp(turn_low + turn * (turn_high - turn_low), 0.0, 1023.0));
    reports.push_back(report);
  }
  return reports;
}

TEST(GloveRangesOf, T11FindsRestFullAndStops) {
  const auto made = calibrate_glove(session(40, 800, 15, 1000, 2.0));
  ASSERT_TRUE(made.ok()) << made.error().describe();
  EXPECT_NEAR(made->ranges.force_zero, 48, 5);
  EXPECT_NEAR(made->ranges.force_full, 795, 15);
  EXPECT_NEAR(made->ranges.potentiometer_low, 19, 5);
  EXPECT_NEAR(made->ranges.potentiometer_high, 996, 5);
  EXPECT_EQ(made->result.verdict, Verdict::good) << made->result.words;
  const auto noisy = calibrate_glove(session(40, 400, 15, 1000, 25.0));
  ASSERT_TRUE(noisy.ok());
  EXPECT_NE(noisy->result.verdict, Verdict::good) << noisy->result.words;
  const auto clipped = calibrate_glove(session(40, 1400, 15, 1000, 2.0));
  ASSERT_TRUE(clipped.ok());
  EXPECT_EQ(clipped->result.verdict, Verdict::usable) << clipped->result.words;
}

TEST(GloveRangesOf, T11RefusesWhatTellsNoRange) {
  const auto message = [](const std::vector<GloveReport>& reports) {
    const auto made = calibrate_glove(reports);
    return made.ok() ? std::string() : made.error().message;
  };
  EXPECT_NE(message({}).find("plugged in"), std::string::npos);
  EXPECT_NE(message(session(40, 60, 15, 1000, 2.0)).find("press as hard"), std::string::npos);
  EXPECT_NE(message(session(40, 800, 500, 520, 2.0)).find("stop to stop"), std::string::npos);
  EXPECT_NE(message(std::vector<GloveReport>(300)).find("press as hard"), std::string::npos) << "a dead pad";
  std::vector<GloveReport> stuck(300);
  for (GloveReport& report : stuck) report.force = report.potentiometer = 1023;
  EXPECT_FALSE(calibrate_glove(stuck).ok());
}

}  // namespace
}  // namespace handloft::tracking
