#include "client-hmd/render/colour_vision.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client-hmd/render/colours.h"

namespace handloft::client {
namespace {

using Matrix = std::array<glm::dvec3, 3>;  // Rows.

constexpr Matrix protan{glm::dvec3{0.152286, 1.052583, -0.204868}, glm::dvec3{0.114503, 0.786281, 0.099216},
                        glm::dvec3{-0.003882, -0.048116, 1.051998}};
constexpr Matrix deutan{glm::dvec3{0.367322, 0.860646, -0.227968}, glm::dvec3{0.280085, 0.672501, 0.047413},
                        glm::dvec3{-0.011820, 0.042940, 0.968881}};
constexpr Matrix tritan{glm::dvec3{1.255528, -0.076749, -0.178779}, glm::dvec3{-0.078411, 0.930809, 0.147602},
                        glm::dvec3{0.004733, 0.691367, 0.303900}};
constexpr Matrix xyz_from_rgb{glm::dvec3{0.4124564, 0.3575761, 0.1804375},
                              glm::dvec3{0.2126729, 0.7151522, 0.0721750},
                              glm::dvec3{0.0193339, 0.1191920, 0.9503041}};
constexpr glm::dvec3 white_d65{0.95047, 1.0, 1.08883};

glm::dvec3 times(const Matrix& rows, const glm::dvec3& v) {
  return {glm::dot(rows[0], v), glm::dot(rows[1], v), glm::dot(rows[2], v)};
}

double radians(double degrees) {
  return degrees * std::numbers::pi / 180.0;
}

/// Hue in degrees, 0..360; 0 for grey.
double hue(double a, double b) {
  if (a == 0.0 && b == 0.0) return 0.0;
  const double degrees = std::atan2(b, a) * 180.0 / std::numbers::pi;
  return degrees < 0.0 ? degrees + 360.0 : degrees;
}

double relative_luminance(std::uint32_t colour) {
  return glm::dot(glm::dvec3(linear_rgb(colour)), glm::dvec3(0.2126, 0.7152, 0.0722));
}

}  // namespace

glm::dvec3 seen_by(Sight sight, const glm::dvec3& linear) {
  switch (sight) {
    case Sight::protanopia:
      return glm::clamp(times(protan, linear), 0.0, 1.0);
    case Sight::deuteranopia:
      return glm::clamp(times(deutan, linear), 0.0, 1.0);
    case Sight::tritanopia:
      return glm::clamp(times(tritan, linear), 0.0, 1.0);
    case Sight::normal:
      break;
  }
  return glm::clamp(linear, 0.0, 1.0);
}

glm::dvec3 cielab(const glm::dvec3& linear) {
  const glm::dvec3 relative = times(xyz_from_rgb, linear) / white_d65;
  const auto f = [](double t) {
    return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0;
  };
  const double x = f(relative.x), y = f(relative.y), z = f(relative.z);
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

double colour_difference(const glm::dvec3& first, const glm::dvec3& second) {
  const auto power_share = [](double chroma) {  // sqrt(C^7 / (C^7 + 25^7))
    const double c7 = std::pow(chroma, 7.0);
    return std::sqrt(c7 / (c7 + std::pow(25.0, 7.0)));
  };
  const double plain_chroma = 0.5 * (std::hypot(first.y, first.z) + std::hypot(second.y, second.z));
  const double stretch = 1.0 + 0.5 * (1.0 - power_share(plain_chroma));
  const double a1 = first.y * stretch, a2 = second.y * stretch;
  const double c1 = std::hypot(a1, first.z), c2 = std::hypot(a2, second.z);
  const double h1 = hue(a1, first.z), h2 = hue(a2, second.z);
  const bool grey = c1 * c2 == 0.0;

  double turn = grey ? 0.0 : h2 - h1;
  if (turn > 180.0) turn -= 360.0;
  if (turn < -180.0) turn += 360.0;
  const double d_light = second.x - first.x;
  const double d_chroma = c2 - c1;
  const double d_hue = 2.0 * std::sqrt(c1 * c2) * std::sin(radians(0.5 * turn));

  const double light = 0.5 * (first.x + second.x);
  const double chroma = 0.5 * (c1 + c2);
  double mean_hue = h1 + h2;
  if (!grey) {
    mean_hue *= 0.5;
    if (std::abs(h1 - h2) > 180.0) mean_hue += h1 + h2 < 360.0 ? 180.0 : -180.0;
  }
  const double t = 1.0 - 0.17 * std::cos(radians(mean_hue - 30.0)) +
                   0.24 * std::cos(radians(2.0 * mean_hue)) + 0.32 * std::cos(radians(3.0 * mean_hue + 6.0)) -
                   0.20 * std::cos(radians(4.0 * mean_hue - 63.0));
  const double from_middle = (light - 50.0) * (light - 50.0);
  const double s_light = 1.0 + 0.015 * from_middle / std::sqrt(20.0 + from_middle);
  const double s_chroma = 1.0 + 0.045 * chroma;
  const double s_hue = 1.0 + 0.015 * chroma * t;
  const double blue = (mean_hue - 275.0) / 25.0;
  const double rotation = -std::sin(radians(60.0 * std::exp(-blue * blue))) * 2.0 * power_share(chroma);
  const double l = d_light / s_light, c = d_chroma / s_chroma, h = d_hue / s_hue;
  return std::sqrt(std::max(0.0, l * l + c * c + h * h + rotation * c * h));
}

double colour_difference(std::uint32_t a, std::uint32_t b, Sight sight) {
  return colour_difference(cielab(seen_by(sight, linear_rgb(a))), cielab(seen_by(sight, linear_rgb(b))));
}

double contrast_ratio(std::uint32_t a, std::uint32_t b) {
  const double one = relative_luminance(a) + 0.05, other = relative_luminance(b) + 0.05;
  return std::max(one, other) / std::min(one, other);
}

}  // namespace handloft::client
