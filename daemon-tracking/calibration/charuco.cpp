#include "daemon-tracking/calibration/charuco.h"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core.hpp>
#include <utility>

namespace handloft::tracking {
namespace {

/// A marker needs light about it: at least this share of its square's edge, both sides together.
constexpr double least_rim = 0.1;
/// A corner between fewer markers than these two is guessed, not measured.
constexpr int markers_about_a_corner = 2;
// The module puts the centre of the top left pixel at (0.5, 0.5), we at (0, 0).
constexpr double pixel_centre = 0.5;

struct DictionaryFacts {
  int code;
  int markers;
  int bits;  ///< A side, without the rim.
};

DictionaryFacts facts_of(MarkerDictionary dictionary) {
  switch (dictionary) {
    case MarkerDictionary::m4x4_50:
      return {cv::aruco::DICT_4X4_50, 50, 4};
    case MarkerDictionary::m5x5_100:
      return {cv::aruco::DICT_5X5_100, 100, 5};
    case MarkerDictionary::m6x6_250:
      break;
  }
  return {cv::aruco::DICT_6X6_250, 250, 6};
}

Error refused(std::string words) {
  return make_error(ErrorCode::invalid_argument, std::move(words), "board");
}

}  // namespace

Status check_charuco(const CharucoShape& shape) {
  const ChessboardShape& corners = shape.corners;
  const auto fits = [](int count) { return count >= fewest_board_corners && count <= most_board_corners; };
  if (!fits(corners.columns) || !fits(corners.rows))
    return refused(fmt::format("found {} x {} inner corners, expected {} to {} each", corners.columns,
                               corners.rows, fewest_board_corners, most_board_corners));
  if (!(corners.square_m > 0) || !std::isfinite(corners.square_m))
    return refused(fmt::format("found squares of {} m, expected a positive size", corners.square_m));
  if (!(shape.marker_m > 0) || !(shape.marker_m <= (1 - least_rim) * corners.square_m))
    return refused(
        fmt::format("found markers of {} m in squares of {} m, expected at most {:.0f} % of a square",
                    shape.marker_m, corners.square_m, 100 * (1 - least_rim)));
  const int light_squares = (corners.columns + 1) * (corners.rows + 1) / 2;
  const DictionaryFacts facts = facts_of(shape.dictionary);
  if (light_squares > facts.markers)
    return refused(fmt::format("found {} light squares, but the dictionary has {} markers", light_squares,
                               facts.markers));
  return {};
}

std::vector<CharucoMarker> charuco_markers(const CharucoShape& shape) {
  const DictionaryFacts facts = facts_of(shape.dictionary);
  const auto dictionary = cv::aruco::getPredefinedDictionary(facts.code);
  std::vector<CharucoMarker> markers;
  for (int row = 0; row <= shape.corners.rows; ++row) {
    for (int column = 0; column <= shape.corners.columns; ++column) {
      if ((row + column) % 2 == 0) continue;
      CharucoMarker& marker = markers.emplace_back(CharucoMarker{column, row, {}});
      const int cells = facts.bits + 2;
      cv::Mat bitmap;
      cv::aruco::drawMarker(dictionary, static_cast<int>(markers.size()) - 1, cells, bitmap, 1);
      for (int y = 0; y < cells; ++y) {
        std::vector<bool>& line = marker.dark.emplace_back();
        for (int x = 0; x < cells; ++x) line.push_back(bitmap.at<std::uint8_t>(y, x) == 0);
      }
    }
  }
  return markers;
}

struct CharucoFinder::State {
  CharucoShape shape;
  cv::Ptr<cv::aruco::Dictionary> dictionary;
  cv::Ptr<cv::aruco::CharucoBoard> board;
  cv::Ptr<cv::aruco::DetectorParameters> parameters;
};

CharucoFinder::CharucoFinder(std::unique_ptr<State> state) : state_(std::move(state)) {}
CharucoFinder::~CharucoFinder() = default;
CharucoFinder::CharucoFinder(CharucoFinder&&) noexcept = default;
CharucoFinder& CharucoFinder::operator=(CharucoFinder&&) noexcept = default;

Result<CharucoFinder> CharucoFinder::create(const CharucoShape& shape) {
  if (const Status good = check_charuco(shape); !good) return good.error();
  auto state = std::make_unique<State>();
  state->shape = shape;
  try {
    state->dictionary = cv::aruco::getPredefinedDictionary(facts_of(shape.dictionary).code);
    state->board = cv::aruco::CharucoBoard::create(shape.corners.columns + 1, shape.corners.rows + 1,
                                                   static_cast<float>(shape.corners.square_m),
                                                   static_cast<float>(shape.marker_m), state->dictionary);
    state->parameters = cv::aruco::DetectorParameters::create();
  } catch (const cv::Exception& error) {
    return make_error(ErrorCode::internal, error.what(), "board");
  }
  return CharucoFinder(std::move(state));
}

std::vector<CharucoFinder::Corner> CharucoFinder::find(const Plane& luma) {
  // The library only reads the picture; its interface lacks the const.
  const cv::Mat image(luma.height_px, luma.width_px, CV_8UC1, const_cast<std::uint8_t*>(luma.samples.data()));
  std::vector<Corner> corners;
  try {
    std::vector<std::vector<cv::Point2f>> marker_corners;
    std::vector<int> marker_ids, ids;
    std::vector<cv::Point2f> places;
    cv::aruco::detectMarkers(image, state_->dictionary, marker_corners, marker_ids, state_->parameters);
    if (marker_ids.empty()) return corners;
    cv::aruco::interpolateCornersCharuco(marker_corners, marker_ids, image, state_->board, places, ids,
                                         cv::noArray(), cv::noArray(), markers_about_a_corner);
    const int columns = state_->shape.corners.columns;
    for (std::size_t i = 0; i < ids.size(); ++i)
      if (std::isfinite(places[i].x) && std::isfinite(places[i].y))
        corners.push_back(
            {ids[i] % columns, ids[i] / columns, places[i].x - pixel_centre, places[i].y - pixel_centre});
  } catch (const cv::Exception&) {
    corners.clear();
  }
  return corners;
}

}  // namespace handloft::tracking
