#pragma once
// Coloured fingertips in one camera's chroma planes (T6): each finger a Gaussian in (Cb, Cr), the background
// a broad one; a 128 x 128 table says for every chroma which finger is likelier than the background.
// Connected patches of one class become blobs with likelihood-weighted centroids. Chroma of too dark or
// clipped pixels is undefined and is skipped. A cap is seen as a sphere; the centre of its image (an ellipse)
// is off its centre's image by less than 0.05 px for caps of 8 mm farther than 0.4 m, which is left
// uncorrected.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/vision/image_decode.h"
#include "daemon-tracking/vision/observation.h"

namespace handloft::tracking {

/// One class of the colour model: a Gaussian in (Cb, Cr).
struct ChromaGaussian {
  Eigen::Vector2d mean{128, 128};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity() * 64.0;
};

struct FingertipTrackerOptions {
  int min_luma = 24;   ///< Below, chroma is noise.
  int max_luma = 250;  ///< Above, a channel is clipped.
  double background_sigma =
      14.0;  ///< Of the neutral background (table, paper, wall) about grey, both chroma axes.
  double background_share =
      0.02;  ///< Uniform part of the background density over all chroma: anything may be there.
  double min_log_ratio = 1.0;       ///< log(finger / background) from which a pixel counts.
  double gate_sigmas = 4.0;         ///< And no farther than this from the finger's mean.
  double min_area_px = 12.0;        ///< Smaller patches are noise. Full-size pixels.
  double max_area_px = 20000.0;     ///< Larger ones are a sleeve, not a fingertip.
  double centroid_sigma_px = 0.12;  ///< s0: of a large clean blob.
  double centroid_area_px2 = 1.5;   ///< k of sigma^2 = s0^2 + k / area.
  /// A disc fills its smallest enclosing circle; below this share part of it is hidden, and while more than
  /// half its rim shows, the circle's centre is the disc's, which the centroid is not.
  double hidden_fill = 0.75;
  double hidden_sigma_px = 0.25;  ///< Of a centre found that way: the rim's samples are 2 px apart.
  double border_sigma_px = 4.0;   ///< Added for a patch that touches the border: its centre is not the tip's.
  int max_blobs_per_finger = 3;   ///< The largest are kept, the fusion chooses among them.
  int whole_frame_every = 10;     ///< Frames; 3 Hz at 30 fps.
  int whole_frame_when_lost_every = 2;  ///< While a finger is missing.
  double roi_radius_px = 48.0;  ///< Half a region's side: 18 mm of motion per frame at 0.5 m is 22 px.
};

class FingertipTracker {
 public:
  /// Fails with invalid_argument when a colour is not finite or a sigma is not positive.
  static Result<FingertipTracker> create(const std::array<FingertipColour, finger_count>& colours,
                                         const FingertipTrackerOptions& options);

  /// Blobs sorted by finger, then by falling area; empty for a picture without chroma. Deterministic in the
  /// sequence of calls.
  std::vector<FingertipBlob> track(const PlanarImage& image, TimePoint capture_time);

  /// Forgets all tracks: the next call searches the whole frame.
  void reset();

  const std::array<ChromaGaussian, finger_count>& model() const { return model_; }
  /// The class of a chroma: 0..4 a finger, 5 background.
  int classify(std::uint8_t cb, std::uint8_t cr) const {
    return table_[static_cast<std::size_t>(((cb >> 1) << 7) | (cr >> 1))];
  }

 private:
  struct Track {
    bool seen = false;
    TimePoint time;
    Eigen::Vector2d centre_px{0, 0};
    Eigen::Vector2d velocity_px_s{0, 0};
    double radius_px = 0.0;
  };
  struct Region {
    int x0, y0, x1, y1;  ///< Chroma samples, half open
  };

  FingertipTracker(const FingertipTrackerOptions& options);
  void build_table();
  double log_ratio(int finger, double cb, double cr) const;
  std::vector<Region> regions(const PlanarImage& image, TimePoint capture_time);
  void search(const PlanarImage& image, const Region& region, std::vector<FingertipBlob>& blobs);

  FingertipTrackerOptions options_;
  std::array<ChromaGaussian, finger_count> model_;
  std::vector<std::uint8_t> table_;  ///< 128 x 128 classes
  std::vector<float> weight_;        ///< 128 x 128 weights in (0, 1] of the table's class
  std::array<Track, finger_count> tracks_;
  std::uint64_t frames_ = 0;
  std::vector<std::uint8_t> mask_;  ///< Classes of the region being searched
};

}  // namespace handloft::tracking
