// What is printed (T11): tags are found by the detector where the page says, at their size.

#include "daemon-tracking/calibration/print.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "daemon-tracking/vision/tag_tracker.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

constexpr double dots_per_mm = 6.0;  // 150 dpi: a coarse printer.

void expect_tags(const PrintPage& page, std::set<int>& found_ids) {
  const auto picture = rasterise(page, dots_per_mm);
  ASSERT_TRUE(picture.ok()) << picture.error().describe();
  TagTrackerOptions options;
  for (const PageTag& tag : page.tags) options.known_ids.push_back(tag.id);
  TagTracker tracker = TagTracker::create(options).value();
  const auto found = tracker.track(*picture, from_ns(1));
  EXPECT_EQ(found.tags.size(), page.tags.size()) << page.title;
  for (const TagDetection& tag : found.tags) {
    found_ids.insert(tag.id);
    const auto placed =
        std::find_if(page.tags.begin(), page.tags.end(), [&](const PageTag& p) { return p.id == tag.id; });
    ASSERT_NE(placed, page.tags.end());
    const double half = placed->edge_mm / 2;
    // Bottom left first, counter-clockwise; the page's y runs down.
    const Eigen::Vector2d corners[] = {{-half, half}, {half, half}, {half, -half}, {-half, -half}};
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d centre_of_first_dot(0.5, 0.5);
      const Eigen::Vector2d at = (tag.corners_px[i] + centre_of_first_dot) / dots_per_mm;
      EXPECT_LT((at - Eigen::Vector2d(placed->centre_x_mm, placed->centre_y_mm) - corners[i]).norm(), 0.15)
          << page.title << " tag " << tag.id;
    }
  }
}

TEST(Print, T11EveryTagOfTheRigIsFoundWhereAndAsLargeAsItShouldBe) {
  const Rig rig = default_rig();
  for (const Paper paper : {Paper::a4, Paper::letter}) {
    PrintOptions options;
    options.paper = paper;
    const auto pages = lay_out_pages(rig, options);
    ASSERT_TRUE(pages.ok()) << pages.error().describe();
    std::set<int> found;
    for (const PrintPage& page : *pages) {
      if (!page.tags.empty()) expect_tags(page, found);
      for (const auto& r : page.rectangles) {
        EXPECT_GE(r.x_mm, 5) << page.title;
        EXPECT_LE(r.x_mm + r.width_mm, page.width_mm - 5) << page.title;
        EXPECT_LE(r.y_mm + r.height_mm, page.height_mm - 5) << page.title;
      }
    }
    EXPECT_EQ(found.size(), rig.table_tags.size() + rig.head_tags.size());
  }
}

TEST(Print, T11ThePosterIsTheTableItself) {
  const Rig rig = default_rig();
  PrintOptions options;
  options.table = TablePrint::one_sheet;
  const auto pages = lay_out_pages(rig, options);
  ASSERT_TRUE(pages.ok());
  const PrintPage& board = pages->front();
  ASSERT_EQ(board.tags.size(), rig.table_tags.size());
  for (std::size_t i = 1; i < board.tags.size(); ++i) {
    const Eigen::Vector3d apart =
        1e3 * (rig.table_tags[i].body_from_tag.translation() - rig.table_tags[0].body_from_tag.translation());
    EXPECT_NEAR(board.tags[i].centre_x_mm - board.tags[0].centre_x_mm, apart.x(), 1e-9);
    EXPECT_NEAR(board.tags[i].centre_y_mm - board.tags[0].centre_y_mm, -apart.y(), 1e-9);
  }
  std::set<int> found;
  expect_tags(board, found);
}

TEST(Print, T11TheHeadsFacesSayWhereTheRigHasThem) {
  const auto pages = lay_out_pages(default_rig(), {});
  ASSERT_TRUE(pages.ok());
  std::string words;
  for (const PrintPage& page : *pages)
    for (const PageText& text : page.texts) words += text.words + "\n";
  // head_tag(21, {-0.075, 0.065, -0.040}, 38.0, 40.0)
  EXPECT_NE(words.find("tag 21: mm 75 left, 65 up, 40 forward;\nfaces 40 up deg, 38 left deg"),
            std::string::npos)
      << words;
}

TEST(Print, T11TheChessboardIsFoundByItsFinder) {
  const auto pages = lay_out_pages(default_rig(), {});
  ASSERT_TRUE(pages.ok());
  const auto page = std::find_if(pages->begin(), pages->end(),
                                 [](const PrintPage& p) { return p.title.starts_with("chessboard"); });
  ASSERT_NE(page, pages->end());
  const auto picture = rasterise(*page, 4.0);
  ASSERT_TRUE(picture.ok());
  BoardFinder finder = BoardFinder::create(Board::chess({})).value();
  const auto view = finder.find(*picture, 0, from_ns(1), "page");
  ASSERT_TRUE(view);
  ASSERT_EQ(view->corners.size(), 54U);
  // First to last corner: 8 squares across, 5 down, 25 mm each; the first one top left.
  const Eigen::Vector2d across = (view->corners.back().pixel - view->corners.front().pixel) / 4.0;
  EXPECT_NEAR(across.x(), 200.0, 0.05);
  EXPECT_NEAR(across.y(), 125.0, 0.05);
}

TEST(Print, T11WritesAPdfAndRefusesWhatDoesNotFit) {
  const test::TemporaryDirectory folder;
  const auto pages = lay_out_pages(default_rig(), {});
  ASSERT_TRUE(pages.ok());
  const auto path = folder.path() / "print.pdf";
  ASSERT_TRUE(write_pdf(*pages, path).ok());
  std::ifstream in(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  EXPECT_TRUE(text.starts_with("%PDF-"));
  EXPECT_NE(text.find("/MediaBox [ 0 0 595.27"), std::string::npos) << "A4 in points";
  EXPECT_FALSE(write_pdf(*pages, folder.path() / "none" / "print.pdf").ok());
  Rig rig = default_rig();
  rig.table_tags[0].edge_m = 0.4;
  EXPECT_FALSE(lay_out_pages(rig, {}).ok());
  rig = default_rig();
  rig.head_tags[0].id = 999;
  EXPECT_FALSE(lay_out_pages(rig, {}).ok());
  PrintOptions options;
  options.chessboard.square_m = 0.05;
  EXPECT_FALSE(lay_out_pages(default_rig(), options).ok());
}

}  // namespace
}  // namespace handloft::tracking
