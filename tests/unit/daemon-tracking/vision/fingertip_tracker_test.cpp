#include "daemon-tracking/vision/fingertip_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace handloft::tracking {
namespace {

std::array<FingertipColour, finger_count> colours() {
  return {{{Finger::thumb, 95, 103, 217, 10, 10},
           {Finger::index, 130, 88, 64, 10, 10},
           {Finger::middle, 78, 208, 101, 10, 10},
           {Finger::ring, 195, 35, 153, 10, 10},
           {Finger::little, 115, 176, 196, 10, 10}}};
}

FingertipTracker tracker(FingertipTrackerOptions options = {}) {
  return FingertipTracker::create(colours(), options).value();
}

/// 640 x 480, 4:2:0, grey, with discs: chroma samples mix by the share of their pixels that lie in the disc.
class Picture {
 public:
  Picture() {
    image_.chroma_step_x = image_.chroma_step_y = 2;
    image_.y = {640, 480, std::vector<std::uint8_t>(640 * 480, 150)};
    image_.cb = {320, 240, std::vector<std::uint8_t>(320 * 240, 128)};
    image_.cr = image_.cb;
  }
  /// A disc; pixels right of `hidden_from_x` are covered by something grey.
  void disc(Finger finger, double x, double y, double radius, double hidden_from_x = 1e9, int luma = 110) {
    const FingertipColour colour = colours()[static_cast<std::size_t>(finger)];
    const int reach = static_cast<int>(radius) + 2;
    for (int cy = std::max(0, static_cast<int>(y) / 2 - reach);
         cy < std::min(240, static_cast<int>(y) / 2 + reach); ++cy)
      for (int cx = std::max(0, static_cast<int>(x) / 2 - reach);
           cx < std::min(320, static_cast<int>(x) / 2 + reach); ++cx) {
        int inside = 0;
        for (int sub = 0; sub < 64; ++sub) {
          const double px = 2 * cx - 0.5 + (sub % 8 + 0.5) / 4.0, py = 2 * cy - 0.5 + (sub / 8 + 0.5) / 4.0;
          inside += std::hypot(px - x, py - y) < radius && px < hidden_from_x ? 1 : 0;
        }
        if (inside == 0) continue;
        const double share = inside / 64.0;
        const auto i = static_cast<std::size_t>(cy * 320 + cx);
        image_.cb.samples[i] = static_cast<std::uint8_t>(std::lround(128 + share * (colour.cb - 128)));
        image_.cr.samples[i] = static_cast<std::uint8_t>(std::lround(128 + share * (colour.cr - 128)));
        for (int row = 0; row < 2; ++row)
          for (int column = 0; column < 2; ++column)
            image_.y.samples[static_cast<std::size_t>((2 * cy + row) * 640 + 2 * cx + column)] =
                static_cast<std::uint8_t>(luma);
      }
  }
  const PlanarImage& image() const { return image_; }

 private:
  PlanarImage image_;
};

constexpr TimePoint start = from_ns(1'000'000'000);

TEST(FingertipTracker, CentresAreSubPixelT6) {
  for (double shift : {0.0, 0.3, 0.7, 1.1, 1.6}) {
    Picture picture;
    for (int f = 0; f < finger_count; ++f)
      picture.disc(static_cast<Finger>(f), 100 + 80 * f + shift, 200 + shift, 6.0);
    auto vision = tracker();
    const auto blobs = vision.track(picture.image(), start);
    ASSERT_EQ(blobs.size(), 5u);
    for (int f = 0; f < finger_count; ++f) {
      const FingertipBlob& blob = blobs[static_cast<std::size_t>(f)];
      EXPECT_EQ(static_cast<int>(blob.finger), f);
      EXPECT_LT((blob.centre_px - Eigen::Vector2d(100 + 80 * f + shift, 200 + shift)).norm(), 0.4);
      const auto best = std::max_element(blob.log_likelihood.begin(), blob.log_likelihood.end());
      EXPECT_EQ(best - blob.log_likelihood.begin(), f);
      EXPECT_FALSE(blob.at_border);
    }
  }
}

TEST(FingertipTracker, AHalfHiddenDiscIsFoundByItsRim) {
  Picture picture;
  picture.disc(Finger::index, 300.4, 200.2, 8.0,
               303.0);  // Its right third is covered: the centroid is 1.7 px off
  auto vision = tracker();
  const auto blobs = vision.track(picture.image(), start);
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_LT((blobs[0].centre_px - Eigen::Vector2d(300.4, 200.2)).norm(), 1.1);
  FingertipTrackerOptions centroid_only;
  centroid_only.hidden_fill = 0.0;
  const auto naive = tracker(centroid_only).track(picture.image(), start);
  EXPECT_GT((naive[0].centre_px - Eigen::Vector2d(300.4, 200.2)).norm(), 1.2);
  EXPECT_GT(blobs[0].covariance(0, 0), naive[0].covariance(0, 0));
}

TEST(FingertipTracker, UncertaintyGrowsForSmallAndCutBlobs) {
  Picture picture;
  picture.disc(Finger::index, 300, 200, 9.0);
  picture.disc(Finger::ring, 200, 200, 3.0);
  picture.disc(Finger::thumb, 1.0, 100, 6.0);
  auto vision = tracker();
  const auto blobs = vision.track(picture.image(), start);
  ASSERT_EQ(blobs.size(), 3u);
  EXPECT_TRUE(blobs[0].at_border);
  EXPECT_GT(blobs[0].covariance(0, 0), 10.0);
  EXPECT_GT(blobs[2].covariance(0, 0), blobs[1].covariance(0, 0));
}

TEST(FingertipTracker, GreyDarkAndClippedPixelsAreNoFingertips) {
  Picture empty;
  auto vision = tracker();
  EXPECT_TRUE(vision.track(empty.image(), start).empty());
  Picture dark;
  dark.disc(Finger::index, 300, 200, 8, 1e9, 10);
  EXPECT_TRUE(tracker().track(dark.image(), start).empty());
  Picture clipped;
  clipped.disc(Finger::index, 300, 200, 8, 1e9, 254);
  EXPECT_TRUE(tracker().track(clipped.image(), start).empty());
  EXPECT_TRUE(tracker().track(PlanarImage{}, start).empty());
}

TEST(FingertipTracker, RegionsSeeWhatTheWholeFrameSees) {
  auto tracking = tracker();
  FingertipTrackerOptions everywhere;
  everywhere.whole_frame_every = everywhere.whole_frame_when_lost_every = 1;
  auto searching = tracker(everywhere);
  for (int frame = 0; frame < 25; ++frame) {
    Picture picture;
    for (int f = 0; f < finger_count; ++f)
      picture.disc(static_cast<Finger>(f), 60 + 50 * f + 9.0 * frame, 120 + 5.0 * frame, 6.0);
    const TimePoint time = start + std::chrono::milliseconds(33 * frame);
    const auto a = tracking.track(picture.image(), time);
    const auto b = searching.track(picture.image(), time);
    ASSERT_EQ(a.size(), b.size()) << frame;
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].centre_px, b[i].centre_px) << frame;
  }
}

TEST(FingertipTracker, RefusesBadColours) {
  auto twice = colours();
  twice[1].finger = Finger::thumb;
  EXPECT_FALSE(FingertipTracker::create(twice, {}).ok());
  auto flat = colours();
  flat[2].sigma_cb = 0;
  EXPECT_FALSE(FingertipTracker::create(flat, {}).ok());
}

}  // namespace
}  // namespace handloft::tracking
