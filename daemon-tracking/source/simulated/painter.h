#pragma once
// Paints the moving things of the scene, balls (fingertip caps) and tapered limbs (fingers, arm), over a
// picture, with soft, area-true edges. A ball's outline is exact: a pixel is inside when its ray passes the
// centre within the radius.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "daemon-tracking/source/simulated/image_planes.h"
#include "daemon-tracking/source/simulated/lens.h"

namespace handloft::tracking {

struct PaintColour {
  float y = 128, cb = 128, cr = 128;
};

/// Coordinates in the camera's frame, metres.
struct Ball {
  /// Where it is over the exposure: what is seen is the mean of its images there.
  std::vector<Eigen::Vector3f> centres_m;
  float radius_m = 0;
  PaintColour colour;
};

/// A cone with rounded ends.
struct Limb {
  Eigen::Vector3f a_m, b_m;
  float radius_a_m = 0, radius_b_m = 0;
  PaintColour colour;
};

/// Rows of a picture, the end exclusive: what a rolling shutter exposes at about one time.
struct Rows {
  int begin = 0, end = 0;
};

class Painter {
 public:
  /// `edge_px`: standard deviation of the blur of edges, pixels.
  Painter(const CameraIntrinsics& intrinsics, double edge_px);

  void add(Ball ball);
  void add(const Limb& limb);
  /// Paints everything added since the last time, the farthest first, into the rows. `up`: the light's
  /// direction in the camera's frame.
  void paint(ImagePlanes& image, const Eigen::Vector3f& up, const Rows& rows);

  /// (x, y) of the ray of each pixel, row by row.
  const std::vector<Eigen::Vector2f>& rays() const { return rays_; }
  const Lens& lens() const { return lens_; }

 private:
  struct Entry {
    float distance_m = 0;
    bool ball = false;
    std::size_t index = 0;
  };
  void paint_ball(ImagePlanes& image, const Ball& ball, const Eigen::Vector3f& up, const Rows& rows) const;
  void paint_limb(ImagePlanes& image, const Limb& limb, const Rows& rows) const;

  Lens lens_;
  float edge_width_px_;
  std::vector<Eigen::Vector2f> rays_;
  std::vector<Ball> balls_;
  std::vector<Limb> limbs_;
  std::vector<Entry> order_;
};

}  // namespace handloft::tracking
