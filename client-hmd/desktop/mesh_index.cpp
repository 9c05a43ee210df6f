#include "client-hmd/desktop/mesh_index.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace handloft::client {
namespace {

constexpr std::size_t triangles_per_run = 32;
constexpr std::size_t runs_per_group = 64;
constexpr float half_opaque = 0.5F;

glm::dvec3 place(const Vec3f& v) {
  return {v.x, v.y, v.z};
}

struct Barycentric {
  double distance_m, u, v;
};

/// Moeller and Trumbore, 1997; both sides.
std::optional<Barycentric> meet_triangle(const Ray& ray, const glm::dvec3& a, const glm::dvec3& b,
                                         const glm::dvec3& c) {
  const glm::dvec3 ab = b - a;
  const glm::dvec3 ac = c - a;
  const glm::dvec3 p = glm::cross(ray.direction, ac);
  const double determinant = glm::dot(ab, p);
  if (determinant == 0.0) return std::nullopt;
  const glm::dvec3 s = ray.origin - a;
  const double u = glm::dot(s, p) / determinant;
  if (!(u >= 0.0 && u <= 1.0)) return std::nullopt;
  const glm::dvec3 q = glm::cross(s, ab);
  const double v = glm::dot(ray.direction, q) / determinant;
  if (!(v >= 0.0 && u + v <= 1.0)) return std::nullopt;
  const double distance = glm::dot(ac, q) / determinant;
  if (!(distance > 0.0) || !std::isfinite(distance)) return std::nullopt;
  return Barycentric{distance, u, v};
}

}  // namespace

MeshIndex::MeshIndex(std::shared_ptr<const SurfaceMesh> mesh) : mesh_(std::move(mesh)) {
  constexpr float most = std::numeric_limits<float>::max();
  const Box none{glm::vec3(most), glm::vec3(-most)};
  const std::vector<std::uint32_t>& indices = mesh_->indices;
  const std::size_t triangles = indices.size() / 3;
  runs_.reserve(triangles / triangles_per_run + 1);
  for (std::size_t first = 0; first < triangles; first += triangles_per_run) {
    Box box = none;
    const std::size_t end = std::min(first + triangles_per_run, triangles);
    for (std::size_t i = 3 * first; i < 3 * end; ++i) {
      const Vec3f& at = mesh_->vertices[indices[i]].position;
      const glm::vec3 corner(at.x, at.y, at.z);
      box.low = glm::min(box.low, corner);
      box.high = glm::max(box.high, corner);
    }
    runs_.push_back(box);
  }
  for (std::size_t first = 0; first < runs_.size(); first += runs_per_group) {
    Box box = none;
    const std::size_t end = std::min(first + runs_per_group, runs_.size());
    for (std::size_t i = first; i < end; ++i) {
      box.low = glm::min(box.low, runs_[i].low);
      box.high = glm::max(box.high, runs_[i].high);
    }
    groups_.push_back(box);
  }
}

// Slabs; a ray along a face has infinities or NaN there, which min and max in this order pass over.
bool MeshIndex::meets(const Box& box, const Ray& ray, const glm::dvec3& inverse, double within_m) {
  double near_m = 0.0;
  double far_m = within_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double one = (static_cast<double>(box.low[axis]) - ray.origin[axis]) * inverse[axis];
    const double other = (static_cast<double>(box.high[axis]) - ray.origin[axis]) * inverse[axis];
    const double low = std::min(one, other);
    const double high = std::max(one, other);
    if (low > near_m) near_m = low;
    if (high < far_m) far_m = high;
  }
  return near_m <= far_m;
}

std::optional<MeshHit> MeshIndex::meet(const Ray& ray) const {
  const glm::dvec3 inverse = 1.0 / ray.direction;
  const std::vector<std::uint32_t>& indices = mesh_->indices;
  const std::size_t triangles = indices.size() / 3;
  double best_m = std::numeric_limits<double>::max();
  std::optional<MeshHit> best;
  const auto look_at = [&](std::size_t triangle) {
    const SurfaceVertex& a = mesh_->vertices[indices[3 * triangle]];
    const SurfaceVertex& b = mesh_->vertices[indices[3 * triangle + 1]];
    const SurfaceVertex& c = mesh_->vertices[indices[3 * triangle + 2]];
    const auto hit = meet_triangle(ray, place(a.position), place(b.position), place(c.position));
    if (!hit || hit->distance_m >= best_m) return;
    const double w = 1.0 - hit->u - hit->v;
    const double opacity = w * static_cast<double>(a.opacity) + hit->u * static_cast<double>(b.opacity) +
                           hit->v * static_cast<double>(c.opacity);
    if (opacity < static_cast<double>(half_opaque)) return;
    const glm::dvec3 sum = w * place(a.normal) + hit->u * place(b.normal) + hit->v * place(c.normal);
    const double length = glm::length(sum);
    glm::dvec3 normal = length > 1e-6 ? sum / length : -ray.direction;
    if (glm::dot(normal, ray.direction) > 0.0) normal = -normal;
    best_m = hit->distance_m;
    best = MeshHit{best_m, normal};
  };
  for (std::size_t group = 0; group < groups_.size(); ++group) {
    if (!meets(groups_[group], ray, inverse, best_m)) continue;
    const std::size_t last_run = std::min((group + 1) * runs_per_group, runs_.size());
    for (std::size_t run = group * runs_per_group; run < last_run; ++run) {
      if (!meets(runs_[run], ray, inverse, best_m)) continue;
      const std::size_t end = std::min((run + 1) * triangles_per_run, triangles);
      for (std::size_t triangle = run * triangles_per_run; triangle < end; ++triangle) look_at(triangle);
    }
  }
  return best;
}

}  // namespace handloft::client
