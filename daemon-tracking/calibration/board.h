#pragma once
// What cameras are calibrated with (T11): a chessboard, a ChArUco board, or a flat board of AprilTags. Finds
// it in a picture and tells each corner's place on the board. Board frame: origin in the middle, x right and
// y up as it is printed, z out of the printed face; metres. A chessboard with an odd sum of inner corners (9
// x 6) looks the same only one way round: its first corner is the one whose inner square is dark, so that all
// cameras agree.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/calibration/charuco.h"
#include "daemon-tracking/calibration/chessboard_shape.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/vision/body_pose.h"
#include "daemon-tracking/vision/image_decode.h"

namespace handloft::tracking {

/// One of the three.
struct Board {
  std::optional<ChessboardShape> chessboard;
  std::optional<CharucoShape> charuco;
  std::vector<TagPlacement> tags;  ///< In the board's frame.

  static Board chess(const ChessboardShape& shape) { return {shape, std::nullopt, {}}; }
  static Board of_charuco(const CharucoShape& shape) { return {std::nullopt, shape, {}}; }
  static Board of_tags(std::vector<TagPlacement> tags) {
    return {std::nullopt, std::nullopt, std::move(tags)};
  }
};

/// The board as one camera saw it in one picture.
struct BoardView {
  std::uint32_t camera = 0;
  TimePoint time;
  std::string source;                      ///< For messages: a file's name, "left at 12.3 s".
  std::vector<int> ids;                    ///< Which corner of the board each is, unique.
  std::vector<CornerMeasurement> corners;  ///< point_m in the board's frame.
  /// How far corners moved since the same camera's picture before, on average; nullopt when there was none
  /// within 0.2 s that shows them.
  std::optional<double> motion_px;
  /// Width of the edges between black and white at the corners; nullopt when not measured. Sharp: below 3.
  std::optional<double> edge_width_px;
};

class BoardFinder {
 public:
  /// Errors: invalid_argument for a chessboard of fewer than 3 x 3 or more than 30 x 30 inner corners, or a
  /// square that is not positive; for ChArUco as check_charuco(); for tags as TagTracker::create, or when
  /// there are none.
  static Result<BoardFinder> create(const Board& board);
  ~BoardFinder();
  BoardFinder(BoardFinder&&) noexcept;
  BoardFinder& operator=(BoardFinder&&) noexcept;

  /// nullopt when the board is not there, a chessboard not as a whole. The view's `motion_px` is filled from
  /// the pictures given before with the same camera.
  std::optional<BoardView> find(const Plane& luma, std::uint32_t camera, TimePoint time, std::string source);

 private:
  struct State;
  explicit BoardFinder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Which of the usual chessboards a picture shows: for a message when the expected one is not found.
std::optional<ChessboardShape> guess_chessboard(const Plane& luma);

/// The pose of a flat board's view through a known lens, camera_from_board, with the smaller reprojection
/// error of the two that a plane allows. nullopt for fewer than 4 corners or none that fits.
std::optional<Eigen::Isometry3d> pose_of_view(const CameraIntrinsics& lens, const BoardView& view);

}  // namespace handloft::tracking
