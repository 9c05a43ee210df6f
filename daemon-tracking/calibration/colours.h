#pragma once
// The five fingertip colours as one camera sees them (T6, T11), learned from a stretch in which the gloved
// hand moves about: what stays is the background (each pixel's median over time), what comes and goes is the
// hand, and the caps are the five clusters of its chroma that suit the chart's hues best. Measures how far
// the five are from each other and from the background, and names pairs that are too alike (magenta and cyan
// caps confused: PSMoveService#143). Pure; deterministic.

#include <array>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/calibration_file.h"
#include "daemon-tracking/vision/image_decode.h"

namespace handloft::tracking {

struct ColourOptions {
  std::size_t min_frames = 15;        ///< Fewer make no median.
  std::size_t max_frames = 60;        ///< Kept; when there are more, every other one is let go.
  int min_luma = 24, max_luma = 250;  ///< Chroma is undefined beyond; as FingertipTrackerOptions.
  double moved_chroma = 12.0;         ///< Away from the pixel's median, in either axis: something is there.
  double hue_tolerance = 40.0;    ///< How far light and camera may shift a cap's chroma (standard deviation).
  std::size_t min_samples = 150;  ///< Of a cap, over all frames: 5 samples in each of 30.
  double sigma_margin = 1.3;      ///< Rims are mixed with what lies behind: wider than the caps' cores.
  double least_sigma = 3.0;       ///< No camera is steadier from day to day.
  /// Distances of two means in standard deviations of the pair: at 6, one sample of a thousand is confused.
  double good_separation = 6.0, usable_separation = 4.0;
  double lookalike_share = 0.002;  ///< Of the background: a thing of a cap's colour, larger than a cap.
};

/// How far two colours are apart.
struct ColourPair {
  Finger a = Finger::thumb, b = Finger::thumb;
  double separation = 0.0;  ///< Standard deviations.
};

struct ColourCalibration {
  std::array<FingertipColour, finger_count> colours;
  std::array<std::size_t, finger_count> samples{};
  std::vector<ColourPair> pairs;                       ///< All ten, the closest first.
  std::array<double, finger_count> lookalike_share{};  ///< Of the background that looks like this cap.
  StepResult result;  ///< Bad: not to be used; its words name the pair or the cap.
};

class ColourLearner {
 public:
  explicit ColourLearner(const std::array<FingertipColour, finger_count>& chart,
                         const ColourOptions& options = {});

  /// Frames without chroma, or of another size than the first, are passed over.
  void add(const PlanarImage& image);
  std::size_t frames() const { return kept_.size(); }

  /// Errors: failed_precondition for too few frames, or a cap that was not seen, named.
  Result<ColourCalibration> learn() const;

 private:
  struct Sample {
    std::uint8_t y, cb, cr;
  };
  std::array<FingertipColour, finger_count> chart_;
  ColourOptions options_;
  int width_ = 0, height_ = 0;
  std::vector<std::vector<Sample>> kept_;
  std::size_t every_ = 1, seen_ = 0;
};

std::string_view finger_name(Finger finger);

}  // namespace handloft::tracking
