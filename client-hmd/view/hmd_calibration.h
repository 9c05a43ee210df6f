#pragma once
// What a side-by-side headset is like (V4): where on its screen each eye looks, how far it sees, how its
// lenses bend the picture and where the eyes are in the head. From a TOML file (deploy/config/hmd.toml is the
// default one and documents every field).
//
// Lens model, as most public figures have it: a pixel at p = (pixel - lens centre) / unit_radius_px, with
// r = |p|, is seen in the direction whose tangents are t = tangent_per_unit * p * (k0 + k1 r^2 + k2 r^4 +
// k3 r^6), with coefficients of its own for red, green and blue. Pixels: centre of the top left one is (0,
// 0). Head axes: x right, y up, z backwards (OpenGL's); directions on the screen: x right, y down.

#include <array>
#include <glm/glm.hpp>
#include <string>
#include <string_view>

#include "client-hmd/view/pinhole.h"
#include "common/base/result.h"

namespace handloft::client {

/// Pixels of a picture's part, origin top left.
struct PixelArea {
  int x_px = 0;
  int y_px = 0;
  int width_px = 1;
  int height_px = 1;
};

/// Angles from straight ahead, all positive.
struct FieldOfView {
  double up_rad = 0.785398163397448;
  double down_rad = 0.785398163397448;
  double left_rad = 0.785398163397448;
  double right_rad = 0.785398163397448;
};

/// k0..k3 of the lens model.
using RadialPolynomial = std::array<double, 4>;

/// Order of colour channels everywhere.
enum class Channel { red, green, blue };
inline constexpr std::size_t channel_count = 3;

struct EyeCalibration {
  PixelArea area;  ///< Of the screen.
  FieldOfView field_of_view;
  glm::dvec2 lens_centre_px{0.0};  ///< From the area's top left pixel.
  double unit_radius_px = 1.0;
  double tangent_per_unit = 1.0;
  std::array<RadialPolynomial, channel_count> distortion{{{1, 0, 0, 0}, {1, 0, 0, 0}, {1, 0, 0, 0}}};
  RigidPose head_from_eye;  ///< The head's origin lies between the eyes.
};

struct HmdCalibration {
  std::string name;
  int width_px = 0;  ///< Of the whole screen.
  int height_px = 0;
  double refresh_hz = 60.0;
  double interpupillary_distance_m = 0.0;
  std::array<EyeCalibration, 2> eyes;  ///< Left, right.
};

/// Of deploy/config/hmd.toml: two plain halves of 960x1080 px without lenses, 90 degrees each.
HmdCalibration default_hmd_calibration();

/// Errors: invalid_argument naming file and field ("left.lens_centre_px") for what is missing, unknown, of
/// another type, not finite or out of range; also for areas outside the screen or over each other, and for a
/// lens that does not widen monotonically over its area.
Result<HmdCalibration> parse_hmd_calibration(std::string_view toml, const std::string& file_name);
/// Errors: also not_found, io, and resource_exhausted above 64 KiB.
Result<HmdCalibration> read_hmd_calibration(const std::string& path);

/// The same optics on a canvas of another size: as large as fits, in its middle. Sizes >= 2 px.
HmdCalibration scaled_to(const HmdCalibration& calibration, int width_px, int height_px);

/// Tangents (right, down) of the direction in which a pixel of the eye's area is seen.
glm::dvec2 view_tangent(const EyeCalibration& eye, Channel channel, const glm::dvec2& pixel);

/// The pixel that is seen there, by Newton's method kept between bounds; the inverse of view_tangent() within
/// 1e-9 px over the area. Beyond what the lens shows: a pixel outside the area.
glm::dvec2 pixel_seen_at(const EyeCalibration& eye, Channel channel, const glm::dvec2& tangent);

/// What of the field of view the area can show at all: the smaller of both on each side.
FieldOfView visible_field(const EyeCalibration& eye);

/// Undistorted picture that holds visible_field(); `density`: its pixels for one of the screen at the lens
/// centre. At most 4096 px a side.
Pinhole undistorted_pinhole(const EyeCalibration& eye, double density = 1.0);

}  // namespace handloft::client
