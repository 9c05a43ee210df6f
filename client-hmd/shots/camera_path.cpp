#include "client-hmd/shots/camera_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

namespace handloft::client {
namespace {

/// target, log of the distance, azimuth, elevation, field of view: what is interpolated, each by itself.
using Numbers = std::array<double, 7>;

constexpr double pole_rad = glm::half_pi<double>() - 1e-3;  ///< As OrbitCamera::orbit() keeps clear of it.

Numbers numbers_of(const OrbitCamera& camera) {
  return {camera.target.x,    camera.target.y,      camera.target.z, std::log(camera.distance_m),
          camera.azimuth_rad, camera.elevation_rad, camera.fov_y_rad};
}

OrbitCamera camera_of(const Numbers& n) {
  OrbitCamera camera;
  camera.target = {n[0], n[1], n[2]};
  camera.distance_m = std::exp(n[3]);
  camera.azimuth_rad = n[4];
  camera.elevation_rad = std::clamp(n[5], -pole_rad, pole_rad);
  camera.fov_y_rad = std::clamp(n[6], 0.01, 3.0);  // A spline may swing a little beyond its keys.
  return camera;
}

}  // namespace

CameraPath::CameraPath(std::vector<CameraKey> keys, Easing easing, Ends ends)
    : keys_(std::move(keys)), easing_(easing), ends_(ends) {}

OrbitCamera CameraPath::at(double time_s) const {
  const std::size_t last = keys_.size() - 1;
  if (last == 0 || !(time_s > keys_.front().time_s)) return keys_.front().camera;
  if (time_s >= keys_.back().time_s) return keys_.back().camera;
  std::size_t i = 0;
  while (keys_[i + 1].time_s <= time_s) ++i;
  const double step_s = keys_[i + 1].time_s - keys_[i].time_s;
  const double u = (time_s - keys_[i].time_s) / step_s;
  const Numbers from = numbers_of(keys_[i].camera);
  const Numbers to = numbers_of(keys_[i + 1].camera);
  Numbers out{};
  if (easing_ == Easing::linear) {
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = from[k] + u * (to[k] - from[k]);
    return camera_of(out);
  }
  // The slope at key `at` of the quantity `k`: of the chord from the key before to the one behind.
  const auto slope = [&](std::size_t at, std::size_t k) {
    if (at > 0 && at < last) {
      const double rise = numbers_of(keys_[at + 1].camera)[k] - numbers_of(keys_[at - 1].camera)[k];
      return rise / (keys_[at + 1].time_s - keys_[at - 1].time_s);
    }
    if (ends_ == Ends::open) return 0.0;
    // Round a loop's seam: the last stretch, then the first one.
    const double rise = numbers_of(keys_[last].camera)[k] - numbers_of(keys_[last - 1].camera)[k] +
                        numbers_of(keys_[1].camera)[k] - numbers_of(keys_[0].camera)[k];
    return rise / (keys_[last].time_s - keys_[last - 1].time_s + keys_[1].time_s - keys_[0].time_s);
  };
  const double u2 = u * u;
  const double u3 = u2 * u;
  for (std::size_t k = 0; k < out.size(); ++k) {
    out[k] = (2 * u3 - 3 * u2 + 1) * from[k] + (u3 - 2 * u2 + u) * step_s * slope(i, k) +
             (3 * u2 - 2 * u3) * to[k] + (u3 - u2) * step_s * slope(i + 1, k);
  }
  return camera_of(out);
}

OrbitCamera looking_from(const glm::dvec3& eye, const glm::dvec3& target, double fov_y_rad,
                         double near_azimuth_rad) {
  const glm::dvec3 back = eye - target;
  OrbitCamera camera;
  camera.target = target;
  camera.distance_m = glm::length(back);
  camera.fov_y_rad = fov_y_rad;
  camera.elevation_rad =
      std::clamp(std::asin(std::clamp(back.z / camera.distance_m, -1.0, 1.0)), -pole_rad, pole_rad);
  constexpr double upright = 1e-9;
  camera.azimuth_rad = near_azimuth_rad;
  if (std::hypot(back.x, back.y) > upright * camera.distance_m) {
    camera.azimuth_rad +=
        std::remainder(std::atan2(back.y, back.x) - near_azimuth_rad, glm::two_pi<double>());
  }
  return camera;
}

}  // namespace handloft::client
