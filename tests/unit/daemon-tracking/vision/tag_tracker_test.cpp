#include "daemon-tracking/vision/tag_tracker.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

extern "C" {
#include <apriltag.h>
#include <tag36h11.h>
}

namespace handloft::tracking {
namespace {

constexpr TimePoint start = from_ns(1'000'000'000);

/// 640 x 480 grey picture with tags, drawn four times larger and averaged: an independent anti-aliased
/// drawing.
class Scene {
 public:
  Scene() : large_(480 * scale, 640 * scale, CV_8UC1, cv::Scalar(170)) {}

  /// Corners of the black square in the order of TagDetection (bottom left first, counter-clockwise), in
  /// pixels with the top left pixel's centre at (0, 0).
  void tag(int id, const std::array<Eigen::Vector2d, 4>& corners) {
    apriltag_family_t* family = tag36h11_create();
    image_u8_t* bitmap = apriltag_to_image(family, id);
    cv::Mat small(bitmap->height, bitmap->width, CV_8UC1, bitmap->buf,
                  static_cast<std::size_t>(bitmap->stride));
    constexpr int cell = 16;
    cv::Mat drawn;
    cv::resize(small, drawn, {}, cell, cell, cv::INTER_NEAREST);
    // The bitmap has one white cell around the black square.
    const float low = cell - 0.5f, high = static_cast<float>(cell * (bitmap->width - 1)) - 0.5f;
    const std::vector<cv::Point2f> from{{low, high}, {high, high}, {high, low}, {low, low}};
    std::vector<cv::Point2f> to;
    for (const auto& corner : corners)
      to.emplace_back(static_cast<float>((corner.x() + 0.5) * scale - 0.5),
                      static_cast<float>((corner.y() + 0.5) * scale - 0.5));
    const cv::Mat map = cv::getPerspectiveTransform(from, to);
    cv::Mat warped, mask;
    cv::warpPerspective(drawn, warped, map, large_.size(), cv::INTER_LINEAR);
    cv::warpPerspective(cv::Mat(drawn.size(), CV_8UC1, cv::Scalar(255)), mask, map, large_.size(),
                        cv::INTER_NEAREST);
    warped.copyTo(large_, mask);
    std::free(bitmap->buf);
    std::free(bitmap);
    tag36h11_destroy(family);
  }
  Plane plane() const {
    cv::Mat small;
    cv::resize(large_, small, {640, 480}, 0, 0, cv::INTER_AREA);
    Plane out{640, 480, std::vector<std::uint8_t>(small.data, small.data + 640 * 480)};
    return out;
  }

 private:
  static constexpr int scale = 4;
  cv::Mat large_;
};

std::array<Eigen::Vector2d, 4> square(double x, double y, double edge) {
  return {Eigen::Vector2d(x, y + edge), {x + edge, y + edge + 3}, {x + edge - 2, y}, {x + 1, y - 2}};
}

TagTrackerOptions options(std::vector<int> ids) {
  TagTrackerOptions out;
  out.known_ids = std::move(ids);
  return out;
}

TEST(TagTracker, CornersInTheOrderAndPlaceOfTheTagT5) {
  const auto corners = square(200.3, 150.6, 60);
  Scene scene;
  scene.tag(3, corners);
  auto tracker = TagTracker::create(options({3})).value();
  for (int frame = 0; frame < 3; ++frame) {
    const auto found = tracker.track(scene.plane(), start + std::chrono::milliseconds(33 * frame));
    EXPECT_EQ(found.searched_whole_frame, frame == 0);
    ASSERT_EQ(found.tags.size(), 1u);
    EXPECT_EQ(found.tags[0].id, 3);
    // A region's corners must agree with the whole frame's: the offset was added.
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_LT((found.tags[0].corners_px[i] - corners[i]).norm(), 0.35) << i;
  }
}

TEST(TagTracker, FollowsAMovingTagInRegions) {
  auto tracker = TagTracker::create(options({1, 2})).value();
  int whole = 0;
  for (int frame = 0; frame < 14; ++frame) {
    const auto corners = square(60 + 14.0 * frame, 100 + 6.0 * frame, 44);
    Scene scene;
    scene.tag(2, corners);
    const auto found = tracker.track(scene.plane(), start + std::chrono::milliseconds(33 * frame));
    whole += found.searched_whole_frame ? 1 : 0;
    ASSERT_EQ(found.tags.size(), 1u) << frame;
    for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((found.tags[0].corners_px[i] - corners[i]).norm(), 0.4);
  }
  EXPECT_EQ(whole, 1);
}

TEST(TagTracker, FindsALostTagAgain) {
  auto tracker = TagTracker::create(options({2})).value();
  Scene before, after;
  before.tag(2, square(60, 60, 50));
  after.tag(2, square(500, 350, 50));
  ASSERT_EQ(tracker.track(before.plane(), start).tags.size(), 1u);
  std::size_t found = 0;
  for (int frame = 1; frame <= 3 && found == 0; ++frame)
    found = tracker.track(after.plane(), start + std::chrono::milliseconds(33 * frame)).tags.size();
  EXPECT_EQ(found, 1u);
}

TEST(TagTracker, ASearchThatWaitsFindsWhatCameIntoViewForTheNextFrameT15) {
  auto waiting = options({1, 2});
  waiting.whole_frame_search = WholeFrameSearch::later;
  waiting.whole_frame_every = 4;
  auto tracker = TagTracker::create(waiting).value();
  Scene one, two;
  one.tag(2, square(60, 60, 50));
  two.tag(2, square(60, 60, 50));
  two.tag(1, square(400, 300, 50));
  const auto at = [](int frame) { return start + std::chrono::milliseconds(33 * frame); };
  // Nothing is tracked yet: this search can't wait.
  EXPECT_TRUE(tracker.track(one.plane(), at(0)).searched_whole_frame);
  EXPECT_FALSE(tracker.search_due());
  for (int frame = 1; frame < 4; ++frame) {
    EXPECT_EQ(tracker.track(two.plane(), at(frame)).tags.size(), 1u);
    EXPECT_FALSE(tracker.search_due());
    tracker.search(two.plane(), at(frame));  // Not due: nothing comes of it.
  }
  const auto due = tracker.track(two.plane(), at(4));
  EXPECT_EQ(due.tags.size(), 1u);
  EXPECT_FALSE(due.searched_whole_frame);
  ASSERT_TRUE(tracker.search_due());
  tracker.search(two.plane(), at(4));
  EXPECT_FALSE(tracker.search_due());
  EXPECT_EQ(tracker.track(two.plane(), at(5)).tags.size(), 2u);
}

TEST(TagTracker, IgnoresForeignSmallAndCutTags) {
  Scene scene;
  scene.tag(7, square(100, 100, 50));    // Not ours
  scene.tag(1, square(300, 100, 14));    // Too small
  scene.tag(2, square(400, 427.5, 50));  // Its lower edge lies on the border
  auto tracker = TagTracker::create(options({1, 2})).value();
  EXPECT_TRUE(tracker.track(scene.plane(), start).tags.empty());
  EXPECT_TRUE(tracker.track(Plane{}, start + std::chrono::milliseconds(33)).tags.empty());
  EXPECT_TRUE(tracker.track(Plane{4, 4, std::vector<std::uint8_t>(16)}, start + std::chrono::milliseconds(66))
                  .tags.empty());
}

TEST(TagTracker, StandingTagsAreLookedAtNowAndThen) {
  auto with_standing = options({1, 2});
  with_standing.standing_ids = {1};
  auto tracker = TagTracker::create(with_standing).value();
  Scene scene;
  scene.tag(1, square(100, 100, 50));
  scene.tag(2, square(400, 200, 50));
  int standing = 0, moving = 0;
  for (int frame = 0; frame < 41; ++frame)
    for (const auto& tag : tracker.track(scene.plane(), start + std::chrono::milliseconds(33 * frame)).tags)
      ++(tag.id == 1 ? standing : moving);
  EXPECT_EQ(moving, 41);
  EXPECT_GE(standing, 4);
  EXPECT_LE(standing, 9);
}

TEST(TagTracker, RefusesBadOptions) {
  EXPECT_FALSE(TagTracker::create(options(std::vector<int>(65))).ok());
  auto bad = options({1});
  bad.search_decimation = 0;
  EXPECT_FALSE(TagTracker::create(bad).ok());
}

}  // namespace
}  // namespace handloft::tracking
