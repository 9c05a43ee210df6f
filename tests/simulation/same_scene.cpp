#include "tests/simulation/same_scene.h"

#include <fmt/core.h>

#include <cmath>
#include <cstddef>
#include <memory>

#include "client-hmd/mirror/scene_mirror.h"
#include "server-model/stream/viewer.h"

namespace handloft::simulation {
namespace {

/// The wire's step is a micrometre, and pieces that came at different times have different origins.
constexpr double rounding_m = 2e-6;

bool near(const client::Vec3f& a, const client::Vec3f& b) {
  return std::abs(a.x - b.x) <= rounding_m && std::abs(a.y - b.y) <= rounding_m &&
         std::abs(a.z - b.z) <= rounding_m;
}

bool same_points(const client::PointSet* a, const client::PointSet* b) {
  // Whose last point was deleted is drawn like one that never had any.
  const bool none_a = a == nullptr || a->points.empty();
  const bool none_b = b == nullptr || b->points.empty();
  if (none_a || none_b) return none_a == none_b;
  if (a->points.size() != b->points.size()) return false;
  for (std::size_t i = 0; i < a->points.size(); ++i) {
    if (!near(a->points[i].position, b->points[i].position) ||
        !(a->styles.at(a->points[i].style) == b->styles.at(b->points[i].style)))
      return false;
  }
  return true;
}

bool same_surface(const client::SurfaceMesh* a, const client::SurfaceMesh* b) {
  if (a == nullptr || b == nullptr) return a == b;
  if (a->indices != b->indices || a->vertices.size() != b->vertices.size()) return false;
  for (std::size_t i = 0; i < a->vertices.size(); ++i) {
    const client::SurfaceVertex& one = a->vertices[i];
    const client::SurfaceVertex& other = b->vertices[i];
    if (!(one.position == other.position) || !(one.normal == other.normal) || one.opacity != other.opacity)
      return false;
  }
  return true;
}

template <typename T>
bool same_list(const std::shared_ptr<const std::vector<T>>& a,
               const std::shared_ptr<const std::vector<T>>& b) {
  const bool none_a = !a || a->empty();
  const bool none_b = !b || b->empty();
  return none_a || none_b ? none_a == none_b : *a == *b;
}

/// In what they differ; empty: in nothing.
std::string difference(const client::Entity& a, const client::Entity& b) {
  if (a.name != b.name) return "name";
  if (a.kind != b.kind) return "kind";
  if (a.revision != b.revision) return "revision";
  if (a.representation != b.representation) return "representation";
  if (a.provisional != b.provisional) return "provisional";
  if (!same_points(a.points.get(), b.points.get())) return "points";
  if (!same_surface(a.surface.get(), b.surface.get())) {
    const auto size = [](const auto& surface) { return surface ? surface->vertices.size() : 0; };
    return fmt::format("surface ({} vertices for {})", size(a.surface), size(b.surface));
  }
  if (!same_list(a.curves, b.curves)) return "curves";
  if (!same_list(a.icons, b.icons)) return "icons";
  if (!same_list(a.distances_m, b.distances_m)) return "distances";
  if (std::abs(a.residual_rms_m - b.residual_rms_m) > 1e-12) return "residual";
  return {};
}

}  // namespace

std::vector<std::string> differences(const client::Scene& found, const stream::Scene& served) {
  stream::Viewer viewer;
  client::SceneMirror fresh;
  while (const auto message = viewer.next(served)) {
    const Status applied =
        message->has_snapshot() ? fresh.apply(message->snapshot()) : fresh.apply(message->delta());
    if (!applied) return {"scene, and nobody could join now: " + applied.error().describe()};
  }
  const client::Scene& expected = *fresh.scene();
  std::vector<std::string> result;
  if (found.epoch != expected.epoch || found.sequence != expected.sequence)
    result.push_back("sequence than " + std::to_string(expected.sequence));
  if (found.alternatives.present != expected.alternatives.present ||
      found.alternatives.names != expected.alternatives.names)
    result.emplace_back("list of alternatives");
  if (found.entities.size() != expected.entities.size()) result.emplace_back("number of entities");
  for (const auto& [id, entity] : expected.entities) {
    const auto its = found.entities.find(id);
    if (its == found.entities.end()) {
      result.push_back("scene: \"" + id + "\" is missing");
      continue;
    }
    const std::string what = difference(*its->second, *entity);
    if (!what.empty()) result.push_back(fmt::format("{} of \"{}\"", what, id));
  }
  return result;
}

}  // namespace handloft::simulation
