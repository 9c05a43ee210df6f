#include "client-hmd/main/scene_extent.h"

namespace handloft::client {
namespace {

constexpr float half_opaque = 0.5F;
/// Balls, and arrows in whatever direction they point (icon_pass.cpp): to scale, an icon reaches so far.
constexpr double ball_m = 0.006, arrow_m = 0.05;

glm::dvec3 vec(const Vec3f& v) {
  return {double{v.x}, double{v.y}, double{v.z}};
}

void add(const SceneIcon& icon, std::vector<glm::dvec3>& places) {
  const glm::dvec3 place = vec(icon.place);
  for (const double side : {-ball_m, ball_m}) {
    places.push_back(place + glm::dvec3(side, 0, 0));
    places.push_back(place + glm::dvec3(0, side, 0));
    places.push_back(place + glm::dvec3(0, 0, side));
  }
  if (icon.direction) places.push_back(place + arrow_m * vec(*icon.direction));
  for (const Vec3f& point : icon.outline) places.push_back(vec(point));
}

void add(const Entity& entity, std::vector<glm::dvec3>& places) {
  if (entity.shows_surface()) {
    for (const SurfaceVertex& vertex : entity.surface->vertices) {
      if (vertex.opacity >= half_opaque) places.push_back(vec(vertex.position));
    }
  }
  if (entity.shows_points()) {
    for (const FuzzyPoint& point : entity.points->points) places.push_back(vec(point.position));
  }
  if (entity.curves != nullptr) {
    for (const SceneCurve& curve : *entity.curves) {
      for (const Vec3f& point : curve.points) places.push_back(vec(point));
    }
  }
  if (entity.icons != nullptr) {
    for (const SceneIcon& icon : *entity.icons) add(icon, places);
  }
}

}  // namespace

std::vector<glm::dvec3> visible_places(const Scene& scene) {
  std::vector<glm::dvec3> places;
  for (const auto& [id, entity] : scene.entities) add(*entity, places);
  return places;
}

}  // namespace handloft::client
