#include "client-hmd/main/scene_extent.h"

namespace handloft::client {
namespace {

constexpr float half_opaque = 0.5F;

glm::dvec3 vec(const Vec3f& v) {
  return {double{v.x}, double{v.y}, double{v.z}};
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
}

}  // namespace

std::vector<glm::dvec3> visible_places(const Scene& scene) {
  std::vector<glm::dvec3> places;
  for (const auto& [id, entity] : scene.entities) add(*entity, places);
  return places;
}

}  // namespace handloft::client
