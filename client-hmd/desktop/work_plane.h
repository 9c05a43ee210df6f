#pragma once
// The pointer in space: rays through pixels, the plane that the 3D cursor moves on (V6), and how a drag on
// the screen goes along a line in the world. Metres, world frame.

#include <glm/glm.hpp>
#include <optional>

#include "client-hmd/desktop/desktop_state.h"
#include "client-hmd/view/pinhole.h"

namespace handloft::client {

struct Ray {
  glm::dvec3 origin{0.0};
  glm::dvec3 direction{0.0, 0.0, -1.0};  ///< Unit.
  glm::dvec3 at(double distance_m) const { return origin + distance_m * direction; }
};

/// Through the pixel, in coordinates whose (0, 0) is the picture's top left corner; the lens's distortion is
/// not applied, as for everything virtual.
Ray ray_through(const Eye& eye, const glm::dvec2& at_px);

/// Where a place is seen, in the same pixels; nullopt behind the eye.
std::optional<glm::dvec2> seen_at(const Eye& eye, const glm::dvec3& place);

/// How large a metre there is on the screen, in pixels.
double pixels_per_metre(const Eye& eye, const glm::dvec3& place);

struct WorkPlane {
  glm::dvec3 origin{0.0};
  glm::dvec3 normal{0.0, 0.0, 1.0};  ///< Unit.
};

/// The plane of that kind through `anchor` as seen from `eye`, its normal towards the viewer.
WorkPlane work_plane(PlaneKind kind, const glm::dvec3& anchor, const Eye& eye);

/// Where the ray meets it. nullopt where it hardly does: nearly parallel (below 2 degrees), behind the eye,
/// or farther than 5 m: a cursor there would jump by metres a pixel.
std::optional<glm::dvec3> meet(const Ray& ray, const WorkPlane& plane);

/// How far along the line from `from` in the unit `direction` the pointer has gone that was seen at `from`
/// then and is at `at_px` now, metres. Of a line towards the eye, which has no length on the screen, up is
/// along and down is back, by the screen's size of a metre there.
double along_line(const Eye& eye, const glm::dvec3& from, const glm::dvec3& direction,
                  const glm::dvec2& from_px, const glm::dvec2& at_px);

std::string_view words_of(PlaneKind kind);

}  // namespace handloft::client
