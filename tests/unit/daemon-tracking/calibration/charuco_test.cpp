// ChArUco boards (T11): printed, seen whole, in part and upside down, and a lens measured with one.

#include "daemon-tracking/calibration/charuco.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "daemon-tracking/calibration/board.h"
#include "daemon-tracking/calibration/intrinsics.h"
#include "daemon-tracking/calibration/print.h"
#include "daemon-tracking/vision/camera_model.h"

namespace handloft::tracking {
namespace {

constexpr double dots_per_mm = 6.0;

CharucoShape small_board() {
  CharucoShape shape;
  shape.corners = {8, 6, 0.025};
  return shape;
}

struct Printed {
  PrintPage page;
  Plane picture;
  double left_mm = 0, top_mm = 0;  ///< Of the board.
};

Printed printed(const CharucoShape& shape) {
  PrintOptions options;
  options.charuco = shape;
  std::vector<PrintPage> pages = lay_out_pages(default_rig(), options).value();
  const auto page = std::find_if(pages.begin(), pages.end(),
                                 [](const PrintPage& p) { return p.title.starts_with("ChArUco"); });
  Printed result{*page, rasterise(*page, dots_per_mm).value(), 1e9, 1e9};
  for (const PageRectangle& square : page->rectangles) {
    result.left_mm = std::min(result.left_mm, square.x_mm);
    result.top_mm = std::min(result.top_mm, square.y_mm);
  }
  return result;
}

Plane turned_by_half(Plane plane) {
  std::reverse(plane.samples.begin(), plane.samples.end());
  return plane;
}

Plane left_part(const Plane& plane, int width) {
  Plane part{width, plane.height_px, {}};
  for (int y = 0; y < plane.height_px; ++y)
    for (int x = 0; x < width; ++x) part.samples.push_back(plane.at(x, y));
  return part;
}

TEST(Charuco, T11EveryCornerOfThePrintedBoardIsFoundWhereItIs) {
  for (const MarkerDictionary dictionary :
       {MarkerDictionary::m4x4_50, MarkerDictionary::m5x5_100, MarkerDictionary::m6x6_250}) {
    CharucoShape shape = small_board();
    shape.dictionary = dictionary;
    const Printed board = printed(shape);
    auto finder = CharucoFinder::create(shape).value();
    const auto corners = finder.find(board.picture);
    ASSERT_EQ(corners.size(), 48u);
    for (const CharucoFinder::Corner& corner : corners) {
      EXPECT_NEAR((corner.x_px + 0.5) / dots_per_mm, board.left_mm + 25.0 * (corner.column + 1), 0.05);
      EXPECT_NEAR((corner.y_px + 0.5) / dots_per_mm, board.top_mm + 25.0 * (corner.row + 1), 0.05);
    }
  }
}

TEST(Charuco, T11APartOfTheBoardTellsWhichPartItIs) {
  const Printed board = printed(small_board());
  auto finder = CharucoFinder::create(small_board()).value();
  const auto half = finder.find(left_part(board.picture, board.picture.width_px / 2));
  EXPECT_GE(half.size(), 18u);
  EXPECT_LT(half.size(), 30u);
  for (const CharucoFinder::Corner& corner : half) EXPECT_LE(corner.column, 4);
}

TEST(Charuco, T11TheBoardFrameIsThatOfAChessboardAlsoUpsideDown) {
  const Printed board = printed(small_board());
  auto finder = BoardFinder::create(Board::of_charuco(small_board())).value();
  const auto upright = finder.find(board.picture, 0, from_ns(1), "upright");
  const auto turned = finder.find(turned_by_half(board.picture), 1, from_ns(1), "turned");
  ASSERT_TRUE(upright && turned);
  ASSERT_EQ(upright->ids.size(), 48u);
  ASSERT_EQ(turned->ids.size(), 48u);
  for (std::size_t i = 0; i < upright->ids.size(); ++i) {
    const auto same =
        std::find(turned->ids.begin(), turned->ids.end(), upright->ids[i]) - turned->ids.begin();
    const Eigen::Vector2d there = turned->corners[static_cast<std::size_t>(same)].pixel;
    EXPECT_NEAR(upright->corners[i].pixel.x() + there.x(), board.picture.width_px - 1, 0.3);
    EXPECT_NEAR(upright->corners[i].pixel.y() + there.y(), board.picture.height_px - 1, 0.3);
    EXPECT_EQ(upright->corners[i].point_m, turned->corners[static_cast<std::size_t>(same)].point_m);
  }
  // Upper left: x to the left, y up.
  EXPECT_EQ(upright->ids.front(), 0);
  EXPECT_NEAR(upright->corners.front().point_m.x(), -3.5 * 0.025, 1e-12);
  EXPECT_NEAR(upright->corners.front().point_m.y(), 2.5 * 0.025, 1e-12);
}

TEST(Charuco, SaysWhatABoardCannotBe) {
  CharucoShape shape = small_board();
  EXPECT_TRUE(check_charuco(shape).ok());
  shape.marker_m = 0.024;
  EXPECT_FALSE(check_charuco(shape).ok());
  shape = small_board();
  shape.corners.square_m = std::nan("");
  EXPECT_FALSE(CharucoFinder::create(shape).ok());
  shape = small_board();
  shape.corners.columns = 2;
  EXPECT_FALSE(check_charuco(shape).ok());
  shape.corners = {20, 20, 0.025};  // 220 light squares
  const Status refused = check_charuco(shape);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("100 markers"), std::string::npos);
  auto finder = CharucoFinder::create(small_board()).value();
  EXPECT_TRUE(finder.find(Plane{64, 64, std::vector<std::uint8_t>(64 * 64, 128)}).empty());
}

/// What a camera with `lens` sees of the printed board at `camera_from_board`; grey about it.
Plane photographed(const Printed& board, const CameraIntrinsics& lens,
                   const Eigen::Isometry3d& camera_from_board) {
  const CharucoShape shape = small_board();
  const double half_x = 12.5 * (shape.corners.columns + 1), half_y = 12.5 * (shape.corners.rows + 1);
  const Eigen::Isometry3d board_from_camera = camera_from_board.inverse();
  const auto model = CameraModel::create(lens).value();
  Plane picture{lens.width_px, lens.height_px, {}};
  constexpr int parts = 3;  // Samples a pixel and axis.
  for (int y = 0; y < picture.height_px; ++y) {
    for (int x = 0; x < picture.width_px; ++x) {
      double sum = 0;
      for (int part = 0; part < parts * parts; ++part) {
        const Eigen::Vector2d pixel(x + (part % parts + 0.5) / parts - 0.5,
                                    y + (part / parts + 0.5) / parts - 0.5);
        const auto ray = model.ray(pixel);
        double luma = 190;
        if (ray) {
          const Eigen::Vector3d from = board_from_camera.translation();
          const Eigen::Vector3d along = board_from_camera.linear() * *ray;
          const Eigen::Vector3d at = from - along * (from.z() / along.z());
          const double px = (board.left_mm + half_x + 1e3 * at.x()) * dots_per_mm;
          const double py = (board.top_mm + half_y - 1e3 * at.y()) * dots_per_mm;
          if (px >= 0 && py >= 0 && px < board.picture.width_px && py < board.picture.height_px)
            luma = 30 + 0.75 * board.picture.at(static_cast<int>(px), static_cast<int>(py));
        }
        sum += luma;
      }
      picture.samples.push_back(static_cast<std::uint8_t>(std::lround(sum / (parts * parts))));
    }
  }
  return picture;
}

TEST(Charuco, T11ALensIsMeasuredFromBoardsThatReachOverThePicturesEdge) {
  const Printed board = printed(small_board());
  CameraIntrinsics lens = default_rig().cameras.front().intrinsics;
  auto finder = BoardFinder::create(Board::of_charuco(small_board())).value();
  std::vector<BoardView> views;
  std::size_t partial = 0;
  int shot = 0;
  for (const double across : {-0.09, 0.0, 0.09}) {
    for (const double down : {-0.07, 0.0, 0.07}) {
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translation() = Eigen::Vector3d(across, down, 0.24 + 0.02 * (shot % 3));
      // The board's z looks at the camera, its y up.
      pose.linear() = (Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()) *
                       Eigen::AngleAxisd(0.5 * std::sin(2.1 * shot), Eigen::Vector3d::UnitX()) *
                       Eigen::AngleAxisd(0.5 * std::cos(1.3 * shot), Eigen::Vector3d::UnitY()) *
                       Eigen::AngleAxisd(0.4 * shot, Eigen::Vector3d::UnitZ()))
                          .toRotationMatrix();
      const auto view =
          finder.find(photographed(board, lens, pose), 0, from_ns(1'000'000'000L * ++shot), "shot");
      if (!view) continue;
      partial += view->ids.size() < 48 ? 1 : 0;
      views.push_back(*view);
    }
  }
  EXPECT_GE(partial, 4u);
  const auto measured = calibrate_intrinsics(views, lens.width_px, lens.height_px, {});
  ASSERT_TRUE(measured.ok()) << measured.error().describe();
  EXPECT_LT(measured->rms_px, 0.15);
  EXPECT_NEAR(measured->lens.fx_px, lens.fx_px, 0.003 * lens.fx_px);
  EXPECT_NEAR(measured->lens.fy_px, lens.fy_px, 0.003 * lens.fy_px);
  EXPECT_NEAR(measured->lens.cx_px, lens.cx_px, 0.6);
  EXPECT_NEAR(measured->lens.cy_px, lens.cy_px, 0.6);
}

}  // namespace
}  // namespace handloft::tracking
