#include "client-hmd/mirror/limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace handloft::client {
namespace {

struct Quantity {
  const char* name;
  std::size_t SceneSize::*held;
  std::size_t MirrorLimits::*most;
};

constexpr std::array<Quantity, 8> quantities{{
    {"entities", &SceneSize::entities, &MirrorLimits::max_entities},
    {"points", &SceneSize::points, &MirrorLimits::max_points},
    {"points.palette", &SceneSize::styles, &MirrorLimits::max_styles},
    {"vertices", &SceneSize::vertices, &MirrorLimits::max_vertices},
    {"indices", &SceneSize::indices, &MirrorLimits::max_indices},
    {"curves", &SceneSize::curves, &MirrorLimits::max_curves},
    {"curve points", &SceneSize::curve_points, &MirrorLimits::max_curve_points},
    {"icons", &SceneSize::icons, &MirrorLimits::max_icons},
}};

}  // namespace

SceneSize& SceneSize::operator+=(const SceneSize& other) {
  for (const Quantity& q : quantities) this->*q.held += other.*q.held;
  return *this;
}

SceneSize& SceneSize::operator-=(const SceneSize& other) {
  for (const Quantity& q : quantities) this->*q.held -= std::min(this->*q.held, other.*q.held);
  return *this;
}

SceneSize size_of(const Entity& entity) {
  SceneSize size;
  size.entities = 1;
  if (entity.points != nullptr) {
    size.points = entity.points->points.size();
    size.styles = entity.points->styles.size();
  }
  if (entity.surface != nullptr) {
    size.vertices = entity.surface->vertices.size();
    size.indices = entity.surface->indices.size();
  }
  if (entity.curves != nullptr) {
    size.curves = entity.curves->size();
    for (const SceneCurve& curve : *entity.curves) size.curve_points += curve.points.size();
  }
  if (entity.icons != nullptr) {
    size.icons = entity.icons->size();
    for (const SceneIcon& icon : *entity.icons) size.curve_points += icon.outline.size();
  }
  return size;
}

SceneSize size_of(const Scene& scene) {
  SceneSize size;
  for (const auto& [id, entity] : scene.entities) size += size_of(*entity);
  return size;
}

MirrorLimits room_beside(const SceneSize& others, const MirrorLimits& limits) {
  MirrorLimits room = limits;
  for (const Quantity& q : quantities) room.*q.most -= std::min(room.*q.most, others.*q.held);
  return room;
}

Status check_size(const SceneSize& size, const MirrorLimits& limits) {
  for (const Quantity& q : quantities) {
    if (size.*q.held <= limits.*q.most) continue;
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("the scene would have {}, a viewer holds {} at most", size.*q.held, limits.*q.most),
        q.name);
  }
  return {};
}

}  // namespace handloft::client
