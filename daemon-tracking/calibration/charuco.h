#pragma once
// A ChArUco board (T11): a chessboard with a numbered marker in each light square, so that any part of it
// tells which corners it shows; held half out of the picture it reaches the corners of the lens, where
// distortion is. Detection is OpenCV's (aruco module; Garrido-Jurado et al. 2014). The upper left square is
// dark; markers are numbered row by row from the top, as OpenCV draws boards since 4.6 (before, boards with
// an even number of rows of squares were another way round: those are not found).

#include <array>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/calibration/chessboard_shape.h"
#include "daemon-tracking/vision/image_decode.h"

namespace handloft::tracking {

/// OpenCV's predefined sets of markers; the smallest that has enough is the safest.
enum class MarkerDictionary { m4x4_50, m5x5_100, m6x6_250 };

struct CharucoShape {
  ChessboardShape corners;    ///< Inner corners; there is a square more each way.
  double marker_m = 0.01875;  ///< A marker's black edge; less than a square's.
  MarkerDictionary dictionary = MarkerDictionary::m5x5_100;
};

/// Errors: invalid_argument for inner corners outside 3..30 each way, sizes that are no sizes, a marker that
/// does not leave a rim in its square, or more light squares than the dictionary has markers.
Status check_charuco(const CharucoShape& shape);

/// A marker as it is printed: `dark[row][column]` of a square of `cells` a side, its rim included.
struct CharucoMarker {
  int column = 0, row = 0;  ///< Of its square, from the upper left.
  std::vector<std::vector<bool>> dark;
};

/// All markers of a board that check_charuco() finds good.
std::vector<CharucoMarker> charuco_markers(const CharucoShape& shape);

/// Not thread-safe.
class CharucoFinder {
 public:
  /// Errors: as check_charuco().
  static Result<CharucoFinder> create(const CharucoShape& shape);
  ~CharucoFinder();
  CharucoFinder(CharucoFinder&&) noexcept;
  CharucoFinder& operator=(CharucoFinder&&) noexcept;

  struct Corner {
    int column = 0, row = 0;  ///< From the upper left inner corner.
    double x_px = 0, y_px = 0;
  };
  /// The inner corners that are to be had, each once, in the order of rows; empty when there are none.
  std::vector<Corner> find(const Plane& luma);

 private:
  struct State;
  explicit CharucoFinder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace handloft::tracking
