#include "client-hmd/desktop/picker.h"

#include <cmath>
#include <limits>

namespace handloft::client {
namespace {

glm::dvec3 place(const Vec3f& v) {
  return {v.x, v.y, v.z};
}

/// The nearest to a pixel of what is offered to it.
class NearestSeen {
 public:
  NearestSeen(const Eye& eye, const glm::dvec2& at_px, double within_px)
      : eye_(eye), at_px_(at_px), best2_(within_px * within_px) {}

  /// True: it is the nearest so far.
  bool offer(const glm::dvec3& at) {
    const auto pixel = seen_at(eye_, at);
    if (!pixel) return false;
    const glm::dvec2 away = *pixel - at_px_;
    const double distance2 = glm::dot(away, away);
    if (!(distance2 < best2_)) return false;
    best2_ = distance2;
    return true;
  }

 private:
  const Eye& eye_;
  glm::dvec2 at_px_;
  double best2_;
};

Picked picked_of(const Entity& entity, const glm::dvec3& at, const Eye& eye) {
  Picked picked;
  picked.entity = entity.id;
  picked.name = entity.name;
  picked.kind = entity.kind;
  picked.at = at;
  const glm::dvec3 to_eye = eye.world_from_eye.position - at;
  const double length = glm::length(to_eye);
  if (length > 0.0) picked.normal = to_eye / length;
  return picked;
}

}  // namespace

const MeshIndex& Picker::index_of(const std::string& id, const std::shared_ptr<const SurfaceMesh>& mesh) {
  const auto known = indices_.find(id);
  if (known != indices_.end() && known->second.mesh() == mesh.get()) return known->second;
  return indices_.insert_or_assign(id, MeshIndex(mesh)).first->second;
}

void Picker::forget_removed(const Scene& scene) {
  std::erase_if(indices_, [&](const auto& entry) { return !scene.entities.contains(entry.first); });
}

std::optional<Picked> Picker::pick(const Scene& scene, const Eye& eye, const glm::dvec2& at_px) {
  forget_removed(scene);
  const Ray ray = ray_through(eye, at_px);
  std::optional<Picked> best;
  double best_m = std::numeric_limits<double>::max();
  for (const auto& [id, entity] : scene.entities) {
    if (!entity->shows_surface()) continue;
    const auto hit = index_of(id, entity->surface).meet(ray);
    if (!hit || hit->distance_m >= best_m) continue;
    best_m = hit->distance_m;
    best = picked_of(*entity, ray.at(hit->distance_m), eye);
    best->normal = hit->normal;
    best->on_surface = true;
  }
  if (best) return best;
  NearestSeen nearest(eye, at_px, options_.point_px);
  for (const auto& [id, entity] : scene.entities) {
    if (!entity->shows_points()) continue;
    for (const FuzzyPoint& point : entity->points->points) {
      if (nearest.offer(place(point.position))) best = picked_of(*entity, place(point.position), eye);
    }
  }
  return best;
}

std::optional<Picked> Picker::pick_icon(const Scene& scene, const Eye& eye, const glm::dvec2& at_px) {
  NearestSeen nearest(eye, at_px, options_.icon_px);
  std::optional<Picked> best;
  for (const auto& each : scene.entities) {
    const Entity& entity = *each.second;
    if (entity.icons == nullptr) continue;
    for (const SceneIcon& icon : *entity.icons) {
      const auto consider = [&](const glm::dvec3& at) {
        if (!nearest.offer(at)) return;
        best = picked_of(entity, at, eye);
        best->icon = icon.id;
      };
      consider(place(icon.place));
      for (const Vec3f& at : icon.outline) consider(place(at));
    }
  }
  if (!best) return best;
  const auto pixel = seen_at(eye, best->at);
  const auto under = pixel ? pick(scene, eye, *pixel) : std::nullopt;
  if (under && under->on_surface && under->entity == best->entity) best->normal = under->normal;
  return best;
}

std::optional<Picked> Picker::snap(const Scene& scene, const Eye& eye, const glm::dvec2& at_px) const {
  NearestSeen nearest(eye, at_px, options_.snap_px);
  std::optional<Picked> best;
  const auto consider = [&](const Entity& entity, const glm::dvec3& at) {
    if (nearest.offer(at)) best = picked_of(entity, at, eye);
  };
  for (const auto& [id, entity] : scene.entities) {
    if (entity->shows_points()) {
      for (const FuzzyPoint& point : entity->points->points) consider(*entity, place(point.position));
    }
    if (entity->curves == nullptr) continue;
    for (const SceneCurve& curve : *entity->curves) {
      if (curve.points.empty() || curve.closed) continue;
      consider(*entity, place(curve.points.front()));
      consider(*entity, place(curve.points.back()));
    }
  }
  return best;
}

}  // namespace handloft::client
