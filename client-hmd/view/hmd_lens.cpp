#include <algorithm>
#include <cmath>

#include "client-hmd/view/hmd_calibration.h"

namespace handloft::client {
namespace {

constexpr int longest_side_px = 4096;
constexpr int border_samples = 64;

const RadialPolynomial& polynomial(const EyeCalibration& eye, Channel channel) {
  return eye.distortion[static_cast<std::size_t>(channel)];
}

double bent(const RadialPolynomial& k, double r) {
  const double r2 = r * r;
  return r * (k[0] + r2 * (k[1] + r2 * (k[2] + r2 * k[3])));
}

double bent_slope(const RadialPolynomial& k, double r) {
  const double r2 = r * r;
  return k[0] + r2 * (3.0 * k[1] + r2 * (5.0 * k[2] + r2 * 7.0 * k[3]));
}

/// The farthest corner of the area from the lens centre, in units of the lens model.
double largest_radius(const EyeCalibration& eye) {
  double radius = 0.0;
  for (const double x : {-0.5, eye.area.width_px - 0.5}) {
    for (const double y : {-0.5, eye.area.height_px - 0.5}) {
      radius = std::max(radius, glm::length(glm::dvec2(x, y) - eye.lens_centre_px));
    }
  }
  return radius / eye.unit_radius_px;
}

}  // namespace

glm::dvec2 view_tangent(const EyeCalibration& eye, Channel channel, const glm::dvec2& pixel) {
  const glm::dvec2 p = (pixel - eye.lens_centre_px) / eye.unit_radius_px;
  const double r2 = glm::dot(p, p);
  const RadialPolynomial& k = polynomial(eye, channel);
  return eye.tangent_per_unit * (k[0] + r2 * (k[1] + r2 * (k[2] + r2 * k[3]))) * p;
}

glm::dvec2 pixel_seen_at(const EyeCalibration& eye, Channel channel, const glm::dvec2& tangent) {
  constexpr int most_steps = 80;
  constexpr double beyond = 2.0;  // Outside the area, and therefore dark.
  const double wanted = glm::length(tangent) / eye.tangent_per_unit;
  if (wanted < 1e-15) return eye.lens_centre_px;
  const RadialPolynomial& k = polynomial(eye, channel);
  double low = 0.0;
  double high = largest_radius(eye);
  double r = high * beyond;
  if (wanted <= bent(k, high)) {
    r = std::min(wanted / k[0], high);
    for (int step = 0; step < most_steps; ++step) {
      const double error = bent(k, r) - wanted;
      (error > 0.0 ? high : low) = r;
      const double slope = bent_slope(k, r);
      double next = slope > 0.0 ? r - error / slope : low - 1.0;
      if (!(next > low && next < high)) next = 0.5 * (low + high);
      if (std::abs(next - r) < 1e-14) break;
      r = next;
    }
  }
  return eye.lens_centre_px + tangent / glm::length(tangent) * (r * eye.unit_radius_px);
}

FieldOfView visible_field(const EyeCalibration& eye) {
  double left = 0.0, right = 0.0, up = 0.0, down = 0.0;
  const auto look = [&](const glm::dvec2& pixel) {
    for (const Channel channel : {Channel::red, Channel::green, Channel::blue}) {
      const glm::dvec2 t = view_tangent(eye, channel, pixel);
      left = std::max(left, -t.x);
      right = std::max(right, t.x);
      up = std::max(up, -t.y);
      down = std::max(down, t.y);
    }
  };
  // The lens widens outwards, so that the extremes lie on the border.
  for (int i = 0; i <= border_samples; ++i) {
    const double share = static_cast<double>(i) / border_samples;
    const double x = share * eye.area.width_px - 0.5;
    const double y = share * eye.area.height_px - 0.5;
    look({x, -0.5});
    look({x, eye.area.height_px - 0.5});
    look({-0.5, y});
    look({eye.area.width_px - 0.5, y});
  }
  FieldOfView field = eye.field_of_view;
  field.left_rad = std::min(field.left_rad, std::atan(left));
  field.right_rad = std::min(field.right_rad, std::atan(right));
  field.up_rad = std::min(field.up_rad, std::atan(up));
  field.down_rad = std::min(field.down_rad, std::atan(down));
  return field;
}

Pinhole undistorted_pinhole(const EyeCalibration& eye, double density) {
  const FieldOfView field = visible_field(eye);
  const double left = std::tan(field.left_rad);
  const double up = std::tan(field.up_rad);
  const double wide = left + std::tan(field.right_rad);
  const double high = up + std::tan(field.down_rad);
  const double k0 = polynomial(eye, Channel::green)[0];
  const double px_per_tangent = density * eye.unit_radius_px / (eye.tangent_per_unit * k0);
  const auto side = [px_per_tangent](double tangents) {
    return std::clamp(static_cast<int>(std::lround(tangents * px_per_tangent)), 1, longest_side_px);
  };
  Pinhole out;
  out.width_px = side(wide);
  out.height_px = side(high);
  out.fx_px = out.width_px / wide;
  out.fy_px = out.height_px / high;
  // The picture's left edge is half a pixel before the centre of its first pixel.
  out.cx_px = left * out.fx_px - 0.5;
  out.cy_px = up * out.fy_px - 0.5;
  return out;
}

}  // namespace handloft::client
