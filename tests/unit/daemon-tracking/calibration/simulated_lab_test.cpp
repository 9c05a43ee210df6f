// Lenses, places and the check against the simulation's truth (T11): corners are projected by the
// simulation's own lens, boards are rendered where a picture matters.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "daemon-tracking/calibration/check.h"
#include "daemon-tracking/calibration/extrinsics.h"
#include "daemon-tracking/calibration/image_folder.h"
#include "daemon-tracking/calibration/intrinsics.h"
#include "daemon-tracking/calibration/picture.h"
#include "daemon-tracking/calibration/simulated_board.h"
#include "daemon-tracking/source/simulated/lens.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

constexpr double degrees = 57.29577951308232;
constexpr ChessboardShape shape{9, 6, 0.025};

/// A board's view with noise; empty when a corner is out of the picture.
BoardView view_of(const CameraCalibration& camera, std::uint32_t index,
                  const Eigen::Isometry3d& world_from_board, TimePoint time, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 0.15);
  const Lens lens(camera.intrinsics);
  BoardView view;
  view.camera = index;
  view.time = time;
  view.source = fmt::format("{} {}", camera.name, to_ns(time));
  for (int row = 0; row < shape.rows; ++row) {
    for (int column = 0; column < shape.columns; ++column) {
      const Eigen::Vector3d point((column - 4) * shape.square_m, (2.5 - row) * shape.square_m, 0);
      const auto pixel = lens.project(camera.world_from_camera.inverse() * (world_from_board * point));
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > 639 || pixel->y() > 479) return {};
      view.ids.push_back(row * shape.columns + column);
      view.corners.push_back({point, *pixel + Eigen::Vector2d(noise(random), noise(random))});
    }
  }
  return view;
}

std::vector<BoardView> lens_views(const CameraCalibration& camera, int poses) {
  std::mt19937 random(8);
  std::vector<BoardView> views;
  for (const Eigen::Isometry3d& pose : waved_before(camera, shape, poses)) {
    BoardView view = view_of(camera, 0, pose,
                             from_ns(static_cast<std::int64_t>(views.size() + 1) * 1'000'000'000), random);
    if (!view.ids.empty()) views.push_back(std::move(view));
  }
  return views;
}

TEST(SimulatedLab, T11FindsTheLensAndSaysHowSureItIs) {
  const CameraCalibration camera = default_rig().cameras[0];
  const auto made = calibrate_intrinsics(lens_views(camera, 20), 640, 480);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  EXPECT_EQ(made->result.verdict, Verdict::good) << made->result.words;
  const LensVector error = lens_vector(made->lens) - lens_vector(camera.intrinsics);
  for (int i = 0; i < lens_unknowns; ++i) EXPECT_LT(std::abs(error[i]), 4 * made->sigmas[i]) << i;
  EXPECT_LT(std::abs(error[0]), 1.0) << "px of focal length";
}

TEST(SimulatedLab, T11RefusesBadViewsEachWithItsReason) {
  const CameraCalibration camera = default_rig().cameras[0];
  std::vector<BoardView> views = lens_views(camera, 16);
  const std::size_t all = views.size();
  ASSERT_GE(all, 10U);
  views[1].motion_px = 4.0;
  views[2].edge_width_px = 9.0;
  for (CornerMeasurement& corner : views[3].corners)
    corner.pixel.y() += 2.0 * std::sin(corner.pixel.x() / 25);  // A bent sheet.
  const auto made = calibrate_intrinsics(views, 640, 480);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  EXPECT_EQ(made->used.size(), all - 3);
  std::string reasons;
  for (const ViewReport& view : made->views) reasons += view.refused + "\n";
  EXPECT_NE(reasons.find("moved by 4.0 px"), std::string::npos) << reasons;
  EXPECT_NE(reasons.find("blurred"), std::string::npos) << reasons;
  EXPECT_NE(reasons.find("the others to"), std::string::npos) << reasons;
}

TEST(SimulatedLab, T11RefusesDataThatCannotGiveALens) {
  const CameraCalibration camera = default_rig().cameras[0];
  const auto reason = [](const std::vector<BoardView>& views) {
    const auto made = calibrate_intrinsics(views, 640, 480);
    return made.ok() ? std::string("accepted") : made.error().message;
  };
  std::vector<BoardView> few = lens_views(camera, 16);
  few.resize(3);
  EXPECT_NE(reason(few).find("at least 6"), std::string::npos) << reason(few);
  EXPECT_NE(reason({}).find("at least 6"), std::string::npos);
  // Sixteen pictures of a board that lies still are one.
  EXPECT_NE(reason(std::vector<BoardView>(16, few[0])).find("different views"), std::string::npos);
  // Pushed about in one plane, never tilted.
  std::mt19937 random(1);
  std::vector<BoardView> flat;
  for (int i = 0; i < 12; ++i) {
    Eigen::Isometry3d board = Eigen::Isometry3d::Identity();
    board.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).toRotationMatrix();
    board.translation() = Eigen::Vector3d(0.06 * std::sin(2.0 * i), 0.05 * std::cos(1.3 * i), 0.6);
    BoardView view =
        view_of(camera, 0, camera.world_from_camera * board, from_ns(i * 1'000'000'000LL), random);
    if (!view.ids.empty()) flat.push_back(std::move(view));
  }
  ASSERT_GE(flat.size(), 8U);
  EXPECT_NE(reason(flat).find("from one angle"), std::string::npos) << reason(flat);
  EXPECT_EQ(calibrate_intrinsics(few, 0, 480).error().code, ErrorCode::invalid_argument);
}

/// The table cameras' views of a board here and there, and of the table's tags, which lie a little off.
ExtrinsicsInput lab(const Rig& rig, const std::vector<TagPlacement>& real_tags, int poses) {
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0, 0.15);
  ExtrinsicsInput input;
  for (std::uint32_t camera = 0; camera < 2; ++camera) {
    input.names.push_back(rig.cameras[camera].name);
    input.lenses.push_back(rig.cameras[camera].intrinsics);
    const Lens lens(rig.cameras[camera].intrinsics);
    BoardView table;
    table.camera = camera;
    for (std::size_t t = 0; t < real_tags.size(); ++t)
      for (std::size_t i = 0; i < 4; ++i) {
        const auto pixel =
            lens.project(rig.cameras[camera].world_from_camera.inverse() * tag_corners(real_tags[t])[i]);
        if (!pixel) continue;
        table.ids.push_back(real_tags[t].id * 4 + static_cast<int>(i));
        table.corners.push_back(
            {tag_corners(rig.table_tags[t])[i], *pixel + Eigen::Vector2d(noise(random), noise(random))});
      }
    input.table_views.push_back(std::move(table));
  }
  TimePoint time = from_ns(1'000'000'000);
  for (const Eigen::Isometry3d& pose : waved_over_table(rig, poses)) {
    for (std::uint32_t camera = 0; camera < 2; ++camera) {
      BoardView view =
          view_of(rig.cameras[camera], camera, pose, time + camera * std::chrono::milliseconds(9), random);
      if (!view.ids.empty()) input.views.push_back(std::move(view));
    }
    time += std::chrono::seconds(1);
  }
  input.moments = shared_moments(input.views);
  input.table_tags = rig.table_tags;
  return input;
}

TEST(SimulatedLab, T11FindsTheCamerasAndTheGluedTags) {
  const Rig rig = default_rig();
  std::mt19937 random(2);
  std::normal_distribution<double> slip(0, 0.002);
  std::vector<TagPlacement> real = rig.table_tags;
  for (TagPlacement& tag : real)
    tag.body_from_tag.translation() += Eigen::Vector3d(slip(random), slip(random), 0);
  const ExtrinsicsInput input = lab(rig, real, 14);
  EXPECT_GE(input.moments.size(), 8U);
  const auto made = calibrate_extrinsics(input);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  // The world is where the tags are on average: move the truth there before comparing.
  std::vector<Eigen::Vector3d> found, truth;
  for (std::size_t i = 0; i < real.size(); ++i) {
    for (const auto& point : tag_corners(made->table_tags[i])) found.push_back(point);
    for (const auto& point : tag_corners(real[i])) truth.push_back(point);
  }
  const Eigen::Isometry3d shift = best_motion(truth, found);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_LT((shift * truth[i] - found[i]).norm(), 0.0005);
  for (std::size_t i = 0; i < 2; ++i) {
    const Eigen::Isometry3d real_camera = shift * rig.cameras[i].world_from_camera;
    EXPECT_LT((made->world_from_camera[i].translation() - real_camera.translation()).norm(), 0.001);
    EXPECT_LT(
        degrees *
            Eigen::AngleAxisd(made->world_from_camera[i].linear().transpose() * real_camera.linear()).angle(),
        0.1);
    EXPECT_EQ(made->results[i].verdict, Verdict::good) << made->results[i].words;
  }
}

TEST(SimulatedLab, T11LeavesOutABoardThatMovedBetweenTwoCameras) {
  const Rig rig = default_rig();
  ExtrinsicsInput input = lab(rig, rig.table_tags, 14);
  for (CornerMeasurement& corner : input.views[5].corners) corner.pixel += Eigen::Vector2d(9, -4);
  const auto made = calibrate_extrinsics(input);
  ASSERT_TRUE(made.ok()) << made.error().describe();
  ASSERT_EQ(made->refused.size(), 1U);
  EXPECT_NE(made->refused[0].refused.find("did the board move"), std::string::npos);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_LT(
        (made->world_from_camera[i].translation() - rig.cameras[i].world_from_camera.translation()).norm(),
        0.0015);
}

TEST(SimulatedLab, T11NamesACameraThatSharesNothing) {
  const Rig rig = default_rig();
  ExtrinsicsInput input = lab(rig, rig.table_tags, 6);
  input.table_views.clear();
  input.moments.clear();
  auto made = calibrate_extrinsics(input);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("no two cameras"), std::string::npos);
  input = lab(rig, rig.table_tags, 6);
  input.table_views.resize(1);
  input.moments.clear();
  made = calibrate_extrinsics(input);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("'right'"), std::string::npos) << made.error().message;
  input.lenses.clear();
  EXPECT_EQ(calibrate_extrinsics(input).error().code, ErrorCode::invalid_argument);
}

TEST(SimulatedLab, T12TheCheckTellsACameraThatWasBumped) {
  const Rig rig = default_rig();
  Calibration calibration = calibration_of(rig);
  std::vector<TagSight> sights;
  for (std::uint32_t camera = 0; camera < 2; ++camera) {
    const Lens lens(rig.cameras[camera].intrinsics);
    TagSight sight;
    sight.camera = camera;
    for (const TagPlacement& tag : rig.table_tags) {
      TagDetection seen;
      seen.id = tag.id;
      for (std::size_t i = 0; i < 4; ++i)
        seen.corners_px[i] =
            *lens.project(rig.cameras[camera].world_from_camera.inverse() * tag_corners(tag)[i]);
      sight.tags.push_back(seen);
    }
    for (int frame = 0; frame < 4; ++frame) {
      sight.time = from_ns(frame * 33'000'000);
      sights.push_back(sight);
    }
  }
  auto fine = check_sights(calibration, sights);
  ASSERT_TRUE(fine.ok()) << fine.error().describe();
  EXPECT_LT(*fine->cameras[0].table_px, 1e-6);
  ASSERT_TRUE(fine->point_m);
  EXPECT_LT(*fine->point_m, 1e-6);
  EXPECT_EQ(fine->cameras[2].result.verdict, Verdict::bad) << "the head's camera saw nothing";
  calibration.rig.cameras[0].world_from_camera.translation().x() += 0.005;
  const auto bumped = check_sights(calibration, sights);
  ASSERT_TRUE(bumped.ok());
  EXPECT_EQ(bumped->cameras[0].result.verdict, Verdict::bad);
  EXPECT_NE(bumped->cameras[0].result.words.find("moved"), std::string::npos);
  EXPECT_EQ(bumped->cameras[1].result.verdict, Verdict::good);
  EXPECT_GT(*bumped->point_m, 0.001);
  EXPECT_FALSE(check_sights(calibration, {}).ok());
}

TEST(SimulatedLab, T11ARenderedBoardIsFoundWhereItIs) {
  const Rig rig = default_rig();
  SimulatedBoardOptions options;
  options.frames_per_pose = 3;
  const auto poses = waved_before(rig.cameras[1], shape, 2);
  const auto stream = simulated_board_stream(rig, {1}, poses, options);
  BoardFinder finder = BoardFinder::create(Board::chess(shape)).value();
  FrameDecoder decoder;
  const Lens lens(rig.cameras[1].intrinsics);
  double worst = 0;
  int still = 0, jumped = 0, frames = 0;
  for (; auto sample = stream->next(); ++frames) {
    const CameraFrame& frame = std::get<CameraFrame>(*sample);
    const auto picture = decoder.decode(frame, DecodePlanes::luma);
    ASSERT_TRUE(picture.ok());
    const auto view = finder.find((*picture)->y, 1, frame.capture_time, "frame");
    ASSERT_TRUE(view) << frames;
    if (view->motion_px) ++(*view->motion_px < 0.5 ? still : jumped);
    ASSERT_TRUE(view->edge_width_px);
    EXPECT_LT(*view->edge_width_px, 4.0);
    const auto& pose = poses[static_cast<std::size_t>(frames / 3)];
    for (const CornerMeasurement& corner : view->corners) {
      const auto truth = lens.project(rig.cameras[1].world_from_camera.inverse() * (pose * corner.point_m));
      worst = std::max(worst, (*truth - corner.pixel).norm());
    }
  }
  EXPECT_EQ(frames, 6);
  EXPECT_EQ(still, 4);
  EXPECT_EQ(jumped, 1);
  EXPECT_LT(worst, 0.5) << "also the right way round";
}

TEST(Pictures, T11WhatIsSavedIsReadAgainAndFoldersAreStreams) {
  const test::TemporaryDirectory folder;
  Plane luma{64, 48, std::vector<std::uint8_t>(64 * 48, 90)};
  luma.samples[5 * 64 + 7] = 200;
  const Picture picture(luma);
  for (const char* name : {"left01.png", "left02.png", "right02.png", "notes.txt"})
    ASSERT_TRUE(picture.save(folder.path() / name).ok());
  const auto again = read_picture(folder.path() / "left01.png");
  ASSERT_TRUE(again.ok()) << again.error().describe();
  EXPECT_EQ(again->width_px, 64);
  EXPECT_EQ((*again->bytes)[5 * 64 + 7], 200);
  EXPECT_EQ((*again->bytes)[0], 90);
  auto stream = ImageFolder::open(folder.path(), {"left", "right"});
  ASSERT_TRUE(stream.ok()) << stream.error().describe();
  std::vector<CameraFrame> frames;
  while (auto sample = (*stream)->next()) frames.push_back(std::get<CameraFrame>(*sample));
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[1].capture_time, frames[2].capture_time) << "left02 and right02 belong together";
  EXPECT_NE(frames[0].capture_time, frames[1].capture_time);
  EXPECT_EQ(frames[2].camera, 1U);
  EXPECT_FALSE(ImageFolder::open(folder.path() / "none", {"left"}).ok());
  EXPECT_FALSE(read_picture(folder.path() / "notes.txt").ok());
  EXPECT_FALSE(read_picture(folder.path() / "none.png").ok());
  EXPECT_FALSE(picture.save(folder.path() / "none" / "a.png").ok());
}

}  // namespace
}  // namespace handloft::tracking
