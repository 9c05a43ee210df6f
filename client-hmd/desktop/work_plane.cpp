#include "client-hmd/desktop/work_plane.h"

#include <cmath>

namespace handloft::client {
namespace {

constexpr double least_slope = 0.035;  ///< sin 2 degrees.
constexpr double farthest_m = 5.0;
/// A line that is seen shorter than this share of its length points at the eye.
constexpr double least_foreshortening = 0.25;
constexpr double probe_m = 0.001;

/// Pixel centres are whole numbers in a Pinhole, but the window's corner is its origin.
constexpr double pixel_centre = 0.5;

}  // namespace

Ray ray_through(const Eye& eye, const glm::dvec2& at_px) {
  const Pinhole& lens = eye.pinhole;
  const glm::dvec3 in_eye((at_px.x - pixel_centre - lens.cx_px) / lens.fx_px,
                          -(at_px.y - pixel_centre - lens.cy_px) / lens.fy_px, -1.0);
  return {eye.world_from_eye.position, glm::normalize(eye.world_from_eye.orientation * in_eye)};
}

std::optional<glm::dvec2> seen_at(const Eye& eye, const glm::dvec3& place) {
  const glm::dvec3 in_eye =
      glm::conjugate(eye.world_from_eye.orientation) * (place - eye.world_from_eye.position);
  if (!(in_eye.z < -1e-6)) return std::nullopt;
  const Pinhole& lens = eye.pinhole;
  return glm::dvec2(lens.fx_px * in_eye.x / -in_eye.z + lens.cx_px + pixel_centre,
                    -lens.fy_px * in_eye.y / -in_eye.z + lens.cy_px + pixel_centre);
}

double pixels_per_metre(const Eye& eye, const glm::dvec3& place) {
  const glm::dvec3 in_eye =
      glm::conjugate(eye.world_from_eye.orientation) * (place - eye.world_from_eye.position);
  return eye.pinhole.fy_px / std::max(-in_eye.z, eye.depth.near_m);
}

WorkPlane work_plane(PlaneKind kind, const glm::dvec3& anchor, const Eye& eye) {
  const glm::dvec3 back = eye.world_from_eye.orientation * glm::dvec3(0.0, 0.0, 1.0);
  glm::dvec3 normal(0.0, 0.0, 1.0);
  switch (kind) {
    case PlaneKind::table:
      break;
    case PlaneKind::front:
      normal = {0.0, 1.0, 0.0};
      break;
    case PlaneKind::side:
      normal = {1.0, 0.0, 0.0};
      break;
    case PlaneKind::screen:
      normal = back;
      break;
  }
  return {anchor, glm::dot(normal, back) < 0.0 ? -normal : normal};
}

std::optional<glm::dvec3> meet(const Ray& ray, const WorkPlane& plane) {
  const double slope = glm::dot(ray.direction, plane.normal);
  if (!(std::abs(slope) > least_slope)) return std::nullopt;
  const double distance = glm::dot(plane.origin - ray.origin, plane.normal) / slope;
  if (!(distance > 0.0 && distance <= farthest_m)) return std::nullopt;
  return ray.at(distance);
}

double along_line(const Eye& eye, const glm::dvec3& from, const glm::dvec3& direction,
                  const glm::dvec2& from_px, const glm::dvec2& at_px) {
  const double scale = pixels_per_metre(eye, from);
  const auto here = seen_at(eye, from);
  const auto ahead = seen_at(eye, from + probe_m * direction);
  if (!here || !ahead) return 0.0;
  const glm::dvec2 step = (*ahead - *here) / probe_m;  // Pixels a metre, at `from`.
  const double length = glm::length(step);
  if (length < least_foreshortening * scale) return -(at_px.y - from_px.y) / scale;
  // The pointer is taken onto the line's image; the line's place there is where its ray comes nearest.
  const glm::dvec2 image = step / length;
  const glm::dvec2 on_image = *here + glm::dot(at_px - from_px, image) * image;
  const Ray ray = ray_through(eye, on_image);
  const double cosine = glm::dot(ray.direction, direction);
  const double denominator = 1.0 - cosine * cosine;
  if (!(denominator > 1e-9)) return 0.0;
  const glm::dvec3 to_eye = ray.origin - from;
  const double along = (glm::dot(to_eye, direction) - cosine * glm::dot(to_eye, ray.direction)) / denominator;
  // Beyond the horizon of the line the nearest place is behind the eye or nowhere.
  const double linear = glm::dot(at_px - from_px, image) / length;
  return std::isfinite(along) && std::abs(along) <= 4.0 * std::abs(linear) ? along : linear;
}

std::string_view words_of(PlaneKind kind) {
  switch (kind) {
    case PlaneKind::table:
      return "level";
    case PlaneKind::front:
      return "front";
    case PlaneKind::side:
      return "side";
    case PlaneKind::screen:
      return "screen";
  }
  return "";
}

}  // namespace handloft::client
