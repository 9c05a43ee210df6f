#include "daemon-tracking/calibration/board.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "daemon-tracking/calibration/bundle.h"
#include "daemon-tracking/vision/tag_tracker.h"

namespace handloft::tracking {
namespace {

// Corners are refined within this share of the distance to the next one, and no farther than 11 px.
constexpr double refine_share = 0.4, refine_least_px = 3.0, refine_most_px = 11.0;
constexpr Duration longest_gap = std::chrono::milliseconds(200);
// Corners this near to where they were are followed; farther, the board is looked for anew.
constexpr double still_there_px = 3.0;
constexpr double least_contrast = 20.0;
// Frames between thorough searches of a video in which nothing is found: twice as many each time, up to this.
constexpr int longest_wait = 64;

/// OpenCV's view of a plane; it is not written to.
cv::Mat mat_of(const Plane& luma) {
  return {luma.height_px, luma.width_px, CV_8UC1, const_cast<std::uint8_t*>(luma.samples.data())};
}

double nearest_neighbour_px(const std::vector<cv::Point2f>& corners, int columns) {
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if ((i + 1) % static_cast<std::size_t>(columns) != 0)
      least = std::min(least, cv::norm(corners[i] - corners[i + 1]));
    if (i + static_cast<std::size_t>(columns) < corners.size())
      least = std::min(least, cv::norm(corners[i] - corners[i + static_cast<std::size_t>(columns)]));
  }
  return least;
}

/// An inner corner's place on the board; rows run down, y up.
Eigen::Vector3d place_on_board(const ChessboardShape& shape, int column, int row) {
  return {(column - 0.5 * (shape.columns - 1)) * shape.square_m,
          (0.5 * (shape.rows - 1) - row) * shape.square_m, 0.0};
}

/// Luma in the middle of the square whose first corner is (column, row).
double square_luma(const cv::Mat& image, const std::vector<cv::Point2f>& corners, int columns, int column,
                   int row) {
  const auto at = [&](int i, int j) { return corners[corner_index(columns, i, j)]; };
  const cv::Point2f middle =
      0.25F * (at(column, row) + at(column + 1, row) + at(column, row + 1) + at(column + 1, row + 1));
  const int x = std::clamp(static_cast<int>(std::lround(middle.x)), 0, image.cols - 1);
  const int y = std::clamp(static_cast<int>(std::lround(middle.y)), 0, image.rows - 1);
  return image.at<std::uint8_t>(y, x);
}

/// Looks in a picture of half the size when it is large enough: OpenCV takes a second over a whole frame that
/// shows tags or half a board, 0.1 s over the small one. The corners are refined in the whole one anyway.
/// Only single pictures, of which none may be lost, are searched again as a whole.
enum class Search { quick, thorough };
bool find_corners(const cv::Mat& image, const ChessboardShape& shape, Search search,
                  std::vector<cv::Point2f>& corners) {
  constexpr int worth_halving_px = 400;
  const bool halve = std::min(image.cols, image.rows) >= worth_halving_px;
  const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  if (halve) {
    cv::Mat small;
    cv::pyrDown(image, small);
    if (cv::findChessboardCorners(small, {shape.columns, shape.rows}, corners, flags)) {
      for (cv::Point2f& corner : corners) corner *= 2;
      return true;
    }
    if (search == Search::quick) return false;
  }
  return cv::findChessboardCorners(image, {shape.columns, shape.rows}, corners, flags);
}

/// Dark and light squares in turn, all over the board.
bool looks_like_board(const cv::Mat& image, const std::vector<cv::Point2f>& corners,
                      const ChessboardShape& shape) {
  double darkest_light = 255, lightest_dark = 0;
  for (int row = 0; row + 1 < shape.rows; ++row) {
    for (int column = 0; column + 1 < shape.columns; ++column) {
      const double luma = square_luma(image, corners, shape.columns, column, row);
      if ((row + column) % 2 == 0)
        lightest_dark = std::max(lightest_dark, luma);
      else
        darkest_light = std::min(darkest_light, luma);
    }
  }
  return darkest_light > lightest_dark + least_contrast;
}

}  // namespace

struct BoardFinder::State {
  Board board;
  std::map<std::uint32_t, TagTracker> trackers;  ///< By camera.
  TagTrackerOptions tag_options;
  std::optional<CharucoFinder> charuco;
  std::map<std::uint32_t, BoardView> last;  ///< In which the board was found.
  struct Pace {
    int wait = 0,
        next = 2;  ///< Frames until the next thorough search, and how many the one after that waits.
  };
  std::map<std::uint32_t, Pace> pace;            ///< Of thorough searches, by camera.
  std::map<std::uint32_t, TimePoint> last_time;  ///< Of any picture.

  std::optional<BoardView> find_chessboard(const Plane& luma, Search search, const BoardView* before) const;
  std::optional<BoardView> find_charuco(const Plane& luma);
  std::optional<BoardView> find_tags(const Plane& luma, std::uint32_t camera, TimePoint time);
};

std::optional<BoardView> BoardFinder::State::find_chessboard(const Plane& luma, Search search,
                                                             const BoardView* before) const {
  const ChessboardShape& shape = *board.chessboard;
  const cv::Mat image = mat_of(luma);
  std::vector<cv::Point2f> corners;
  const auto refine = [&] {
    const int half = static_cast<int>(std::clamp(refine_share * nearest_neighbour_px(corners, shape.columns),
                                                 refine_least_px, refine_most_px));
    cv::cornerSubPix(image, corners, {half, half}, {-1, -1},
                     {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 0.001});
  };
  bool found = false;
  if (before != nullptr) {
    // A board that is held still is where it was.
    for (const CornerMeasurement& corner : before->corners) {
      const Eigen::Vector2f pixel = corner.pixel.cast<float>();
      corners.emplace_back(pixel.x(), pixel.y());
    }
    refine();
    double farthest = 0;
    for (std::size_t i = 0; i < corners.size(); ++i)
      farthest =
          std::max(farthest, (before->corners[i].pixel - Eigen::Vector2d(corners[i].x, corners[i].y)).norm());
    found = farthest < still_there_px && looks_like_board(image, corners, shape);
  }
  if (!found) {
    corners.clear();
    if (!find_corners(image, shape, search, corners)) return std::nullopt;
    refine();
  }
  // Rows must run down when columns run right, and the first square must be dark.
  const cv::Point2f along = corners[1] - corners[0],
                    down = corners[static_cast<std::size_t>(shape.columns)] - corners[0];
  if (along.x * down.y - along.y * down.x < 0)
    for (auto row = corners.begin(); row != corners.end(); row += shape.columns)
      std::reverse(row, row + shape.columns);
  if (square_luma(image, corners, shape.columns, 0, 0) > square_luma(image, corners, shape.columns, 1, 0) &&
      (shape.columns + shape.rows) % 2 == 1)
    std::reverse(corners.begin(), corners.end());

  BoardView view;
  for (int row = 0; row < shape.rows; ++row) {
    for (int column = 0; column < shape.columns; ++column) {
      const auto index = corner_index(shape.columns, column, row);
      if (!std::isfinite(corners[index].x) || !std::isfinite(corners[index].y)) return std::nullopt;
      view.ids.push_back(static_cast<int>(index));
      view.corners.push_back({place_on_board(shape, column, row), {corners[index].x, corners[index].y}});
    }
  }
  const cv::Scalar sharpness = cv::estimateChessboardSharpness(image, {shape.columns, shape.rows}, corners);
  if (std::isfinite(sharpness[0]) && sharpness[0] > 0) view.edge_width_px = sharpness[0];
  return view;
}

std::optional<BoardView> BoardFinder::State::find_charuco(const Plane& luma) {
  const ChessboardShape& shape = board.charuco->corners;
  BoardView view;
  for (const CharucoFinder::Corner& corner : charuco->find(luma)) {
    view.ids.push_back(corner.row * shape.columns + corner.column);
    view.corners.push_back({place_on_board(shape, corner.column, corner.row), {corner.x_px, corner.y_px}});
  }
  if (view.ids.empty()) return std::nullopt;
  return view;
}

std::optional<BoardView> BoardFinder::State::find_tags(const Plane& luma, std::uint32_t camera,
                                                       TimePoint time) {
  auto tracker = trackers.find(camera);
  if (tracker == trackers.end()) {
    Result<TagTracker> made = TagTracker::create(tag_options);
    if (!made) return std::nullopt;
    tracker = trackers.emplace(camera, std::move(*made)).first;
  }
  // A picture that does not follow the last one is searched as if it were the first.
  const auto before = last.find(camera);
  if (before == last.end() || time <= before->second.time || time - before->second.time > longest_gap)
    tracker->second.reset();
  BoardView view;
  for (const TagDetection& tag : tracker->second.track(luma, time).tags) {
    const auto placed = std::find_if(board.tags.begin(), board.tags.end(),
                                     [&](const TagPlacement& placement) { return placement.id == tag.id; });
    if (placed == board.tags.end()) continue;
    const auto points = tag_corners(*placed);
    for (std::size_t i = 0; i < points.size(); ++i) {
      view.ids.push_back(tag.id * 4 + static_cast<int>(i));
      view.corners.push_back({points[i], tag.corners_px[i]});
    }
  }
  if (view.ids.empty()) return std::nullopt;
  return view;
}

BoardFinder::BoardFinder(std::unique_ptr<State> state) : state_(std::move(state)) {}
BoardFinder::~BoardFinder() = default;
BoardFinder::BoardFinder(BoardFinder&&) noexcept = default;
BoardFinder& BoardFinder::operator=(BoardFinder&&) noexcept = default;

Result<BoardFinder> BoardFinder::create(const Board& board) {
  auto state = std::make_unique<State>();
  state->board = board;
  if (board.chessboard) {
    const ChessboardShape& shape = *board.chessboard;
    const auto fits = [](int corners) {
      return corners >= fewest_board_corners && corners <= most_board_corners;
    };
    if (!fits(shape.columns) || !fits(shape.rows))
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {} x {} inner corners, expected {} to {} each", shape.columns,
                                    shape.rows, fewest_board_corners, most_board_corners),
                        "board");
    if (!(shape.square_m > 0) || !std::isfinite(shape.square_m))
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found squares of {} m, expected a positive size", shape.square_m),
                        "board");
  } else if (board.charuco) {
    Result<CharucoFinder> finder = CharucoFinder::create(*board.charuco);
    if (!finder) return finder.error();
    state->charuco = std::move(*finder);
  } else {
    if (board.tags.empty())
      return make_error(ErrorCode::invalid_argument, "found no tags, expected a board with some", "board");
    for (const TagPlacement& tag : board.tags) state->tag_options.known_ids.push_back(tag.id);
    // Calibration has time: every frame is searched as a whole.
    state->tag_options.whole_frame_every = 1;
    state->tag_options.whole_frame_when_none_every = 1;
    const Result<TagTracker> tried = TagTracker::create(state->tag_options);
    if (!tried) return tried.error();
  }
  return BoardFinder(std::move(state));
}

std::optional<BoardView> BoardFinder::find(const Plane& luma, std::uint32_t camera, TimePoint time,
                                           std::string source) {
  constexpr int smallest_side_px = 32;
  if (luma.width_px < smallest_side_px || luma.height_px < smallest_side_px) return std::nullopt;
  std::optional<BoardView> view;
  const auto before_time = state_->last_time.find(camera);
  try {
    const bool video = before_time != state_->last_time.end() && time > before_time->second &&
                       time - before_time->second <= longest_gap;
    if (state_->charuco) {
      view = state_->find_charuco(luma);
    } else if (!state_->board.chessboard) {
      view = state_->find_tags(luma, camera, time);
    } else {
      const auto seen = state_->last.find(camera);
      const bool just_seen = video && seen != state_->last.end() && time - seen->second.time <= longest_gap;
      State::Pace& pace = state_->pace[camera];
      const bool thorough = !video || --pace.wait <= 0;
      view = state_->find_chessboard(luma, thorough ? Search::thorough : Search::quick,
                                     just_seen ? &seen->second : nullptr);
      if (view) pace = {};
      if (!view && thorough) pace = {pace.next, std::min(longest_wait, 2 * pace.next)};
    }
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  state_->last_time[camera] = time;
  if (!view) return std::nullopt;
  view->camera = camera;
  view->time = time;
  view->source = std::move(source);
  const auto before = state_->last.find(camera);
  if (before != state_->last.end() && time > before->second.time &&
      time - before->second.time <= longest_gap) {
    double sum = 0;
    int same = 0;
    for (std::size_t i = 0; i < view->ids.size(); ++i) {
      const auto& ids = before->second.ids;
      const auto at = std::find(ids.begin(), ids.end(), view->ids[i]);
      if (at == ids.end()) continue;
      const auto index = static_cast<std::size_t>(at - ids.begin());
      sum += (view->corners[i].pixel - before->second.corners[index].pixel).norm();
      ++same;
    }
    if (same > 0) view->motion_px = sum / same;
  }
  state_->last[camera] = *view;
  return view;
}

std::optional<ChessboardShape> guess_chessboard(const Plane& luma) {
  const cv::Mat image = mat_of(luma);
  for (const auto& [columns, rows] :
       {std::pair{9, 6}, {8, 6}, {7, 6}, {8, 5}, {7, 5}, {10, 7}, {11, 8}, {6, 4}, {5, 4}}) {
    std::vector<cv::Point2f> corners;
    try {
      if (find_corners(image, {columns, rows, 1.0}, Search::quick, corners))
        return ChessboardShape{columns, rows, 0.025};
    } catch (const cv::Exception&) {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

std::optional<Eigen::Isometry3d> pose_of_view(const CameraIntrinsics& lens, const BoardView& view) {
  if (view.corners.size() < 4) return std::nullopt;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const CornerMeasurement& corner : view.corners) {
    points.emplace_back(corner.point_m.x(), corner.point_m.y(), corner.point_m.z());
    pixels.emplace_back(corner.pixel.x(), corner.pixel.y());
  }
  const cv::Matx33d matrix(lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1);
  const cv::Mat distortion(1, 5, CV_64F, const_cast<double*>(lens.distortion.data()));
  std::vector<cv::Mat> turns, shifts;
  try {
    const bool flat =
        std::all_of(points.begin(), points.end(), [](const cv::Point3d& p) { return p.z == 0.0; });
    cv::solvePnPGeneric(points, pixels, matrix, distortion, turns, shifts, false,
                        flat ? cv::SOLVEPNP_IPPE : cv::SOLVEPNP_SQPNP);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  std::optional<Eigen::Isometry3d> best;
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < turns.size(); ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    const Eigen::Vector3d turn(turns[i].at<double>(0), turns[i].at<double>(1), turns[i].at<double>(2));
    pose.linear() = rotation_from_vector(turn).toRotationMatrix();
    pose.translation() =
        Eigen::Vector3d(shifts[i].at<double>(0), shifts[i].at<double>(1), shifts[i].at<double>(2));
    if (!pose.matrix().allFinite()) continue;
    // Each of the two is brought to its own minimum before they are compared.
    BundleProblem problem;
    problem.lenses.push_back({lens, {}});
    problem.poses.push_back({pose, Hold::free});
    for (const CornerMeasurement& corner : view.corners) {
      BundleCorner& seen = problem.corners.emplace_back();
      seen.chain[0] = {0, BundleLink::Way::forward};
      seen.links = 1;
      seen.point_m = corner.point_m;
      seen.pixel = corner.pixel;
    }
    BundleOptions options;
    options.max_iterations = 20;
    const auto refined = adjust(problem, options);
    if (!refined || refined->rms_px >= least) continue;
    least = refined->rms_px;
    best = problem.poses[0].value;
  }
  return best;
}

}  // namespace handloft::tracking
