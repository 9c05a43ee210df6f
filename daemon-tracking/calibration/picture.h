#pragma once
// Pictures of what a calibration saw (T11), to be looked at: a frame with marks on it, as PNG; and pictures
// read from files. Drawn with cairo. Never throws; a picture that can't be made is an error.

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "daemon-tracking/source/sample.h"
#include "daemon-tracking/vision/image_decode.h"

namespace handloft::tracking {

struct Ink {
  double red = 0, green = 0, blue = 0, alpha = 1;
};
namespace ink {
inline constexpr Ink good{0.1, 0.8, 0.2, 1}, bad{0.95, 0.15, 0.1, 1}, note{1.0, 0.85, 0.1, 1};
inline constexpr Ink white{1, 1, 1, 1}, black{0, 0, 0, 1};
}  // namespace ink

class Picture {
 public:
  /// An even grey picture. Sizes are cut to 1..8192.
  Picture(int width_px, int height_px, Ink background);
  /// A frame as it was seen, without its colours.
  explicit Picture(const Plane& luma);
  ~Picture();
  Picture(Picture&&) noexcept;
  Picture& operator=(Picture&&) noexcept;

  // Coordinates in pixels, the centre of the top left one at (0, 0).
  void circle(const Eigen::Vector2d& centre, double radius_px, const Ink& colour);
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Ink& colour, double width_px = 1.0);
  void fill(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, const Ink& colour);
  void text(const Eigen::Vector2d& at, std::string_view words, const Ink& colour, double size_px = 14.0);

  int width_px() const;
  int height_px() const;

  /// Errors: io, naming the file.
  Status save(const std::filesystem::path& path) const;

 private:
  struct Canvas;
  std::unique_ptr<Canvas> canvas_;
};

/// A JPEG or PNG file as a camera's frame: a JPEG's own bytes, a PNG in grey. Errors: not_found, io,
/// unsupported for other files, data_corrupt.
Result<CameraFrame> read_picture(const std::filesystem::path& path);

}  // namespace handloft::tracking
