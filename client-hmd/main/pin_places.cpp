#include "client-hmd/main/pin_places.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

namespace handloft::client {
namespace {

constexpr float shown_opacity = 0.5F;  ///< What an export trims to (A26).
constexpr float infinitely_far = std::numeric_limits<float>::infinity();

glm::vec3 vec(const Vec3f& v) {
  return {v.x, v.y, v.z};
}

/// What a pass over all that is shown finds.
struct Sight {
  glm::vec3 low{infinitely_far}, high{-infinitely_far};
  glm::vec3 nearest{0.0F};
  float nearest_distance = infinitely_far;
  std::size_t nearest_vertex = 0;
  bool on_surface = false;

  void take(const glm::vec3& at, const glm::vec3& place) {
    low = glm::min(low, at);
    high = glm::max(high, at);
    const float distance = glm::distance(at, place);
    if (!(distance < nearest_distance)) return;
    nearest_distance = distance;
    nearest = at;
    on_surface = false;
  }
};

/// Ericson, "Real-Time Collision Detection" (2005), section 5.1.5.
glm::vec3 nearest_of_triangle(const glm::vec3& p, const glm::vec3& a, const glm::vec3& b,
                              const glm::vec3& c) {
  const glm::vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const float d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0.0F && d2 <= 0.0F) return a;
  const float d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0.0F && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0F && d1 >= 0.0F && d3 <= 0.0F) return a + d1 / (d1 - d3) * ab;
  const float d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0.0F && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0F && d2 >= 0.0F && d6 <= 0.0F) return a + d2 / (d2 - d6) * ac;
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0.0F && d4 - d3 >= 0.0F && d5 - d6 >= 0.0F)
    return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const float sum = va + vb + vc;
  return sum > 0.0F ? a + vb / sum * ab + vc / sum * ac : a;
}

/// Where the vertical through `place` meets the triangle; nullopt: nowhere.
std::optional<float> height_at(const glm::vec3& place, const glm::vec3& a, const glm::vec3& b,
                               const glm::vec3& c) {
  const auto area = [](const glm::vec3& o, const glm::vec3& p, const glm::vec3& q) {
    return (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x);
  };
  const float whole = area(a, b, c);
  if (whole == 0.0F) return std::nullopt;
  const float u = area(place, b, c) / whole, v = area(place, c, a) / whole, w = 1.0F - u - v;
  if (u < 0.0F || v < 0.0F || w < 0.0F) return std::nullopt;
  return u * a.z + v * b.z + w * c.z;
}

/// Between the vertices, on the triangles about the nearest one.
glm::vec3 nearest_of_surface(const SurfaceMesh& mesh, std::size_t vertex, const glm::vec3& place) {
  glm::vec3 nearest = vec(mesh.vertices[vertex].position);
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::uint32_t a = mesh.indices[i], b = mesh.indices[i + 1], c = mesh.indices[i + 2];
    if (a != vertex && b != vertex && c != vertex) continue;
    const glm::vec3 found =
        nearest_of_triangle(place, vec(mesh.vertices[a].position), vec(mesh.vertices[b].position),
                            vec(mesh.vertices[c].position));
    if (glm::distance(found, place) < glm::distance(nearest, place)) nearest = found;
  }
  return nearest;
}

std::optional<float> top_of_surface(const SurfaceMesh& mesh, const glm::vec3& place) {
  std::optional<float> top;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const SurfaceVertex& a = mesh.vertices[mesh.indices[i]];
    const SurfaceVertex& b = mesh.vertices[mesh.indices[i + 1]];
    const SurfaceVertex& c = mesh.vertices[mesh.indices[i + 2]];
    if (std::max({a.opacity, b.opacity, c.opacity}) < shown_opacity) continue;
    const std::optional<float> height = height_at(place, vec(a.position), vec(b.position), vec(c.position));
    if (height && (!top || *height > *top)) top = height;
  }
  return top;
}

std::size_t size_of(const Entity& entity) {
  return (entity.shows_points() ? entity.points->points.size() : 0) +
         (entity.shows_surface() ? entity.surface->vertices.size() : 0);
}

}  // namespace

glm::vec3 shown_pin_place(const Entity& entity, const glm::vec3& place, const PinPlacesOptions& options) {
  Sight sight;
  if (entity.shows_surface()) {
    for (std::size_t i = 0; i < entity.surface->vertices.size(); ++i) {
      const SurfaceVertex& vertex = entity.surface->vertices[i];
      if (vertex.opacity < shown_opacity) continue;
      const float before = sight.nearest_distance;
      sight.take(vec(vertex.position), place);
      if (!(sight.nearest_distance < before)) continue;
      sight.nearest_vertex = i;
      sight.on_surface = true;
    }
  } else if (entity.shows_points()) {
    for (const FuzzyPoint& point : entity.points->points) sight.take(vec(point.position), place);
  }
  if (!(sight.low.x <= sight.high.x)) return place;  // Nothing of it is to be seen.
  const float reach = options.near_share * glm::distance(sight.low, sight.high);
  if (sight.nearest_distance <= reach) {
    return sight.on_surface ? nearest_of_surface(*entity.surface, sight.nearest_vertex, place)
                            : sight.nearest;
  }
  const bool within =
      glm::all(glm::greaterThanEqual(place, sight.low)) && glm::all(glm::lessThanEqual(place, sight.high));
  if (!within) return place;
  float top = sight.high.z;
  if (sight.on_surface) top = top_of_surface(*entity.surface, place).value_or(top);
  return {place.x, place.y, top};
}

void PinPlaces::follow(const Scene& scene) {
  if (scene.comments == nullptr) {
    known_.clear();
    return;
  }
  std::set<std::string_view> open;
  std::size_t looked_at = 0;
  for (const PinnedComment* comment : open_threads(*scene.comments)) {
    if (!comment->placed) continue;
    open.insert(comment->id);
    const glm::vec3 told{comment->x, comment->y, comment->z};
    const auto found = scene.entities.find(comment->entity);
    const auto entry = known_.try_emplace(comment->id, Known{nullptr, told, told}).first;
    Known& known = entry->second;
    if (found == scene.entities.end()) {
      known = {nullptr, told, told};
      continue;
    }
    const std::shared_ptr<const Entity>& entity = found->second;
    if (known.entity == entity && known.told == told) continue;
    if (looked_at >= options_.most_a_frame) continue;  // In one of the next frames.
    looked_at += size_of(*entity);
    known = {entity, told, shown_pin_place(*entity, told, options_)};
  }
  std::erase_if(known_, [&open](const auto& item) { return !open.contains(item.first); });
}

glm::vec3 PinPlaces::place_of(const PinnedComment& comment) const {
  const auto found = known_.find(comment.id);
  return found == known_.end() ? glm::vec3(comment.x, comment.y, comment.z) : found->second.shown;
}

}  // namespace handloft::client
