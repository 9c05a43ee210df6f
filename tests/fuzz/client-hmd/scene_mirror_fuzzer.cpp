// Bytes as a SceneSnapshot and SceneDeltas into the mirror, and as what somebody says of a hand: never a
// crash, never an index or number that is not valid. Two bytes (little-endian) before each piece say how long
// it is; the first piece is the snapshot.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "client-hmd/mirror/activity.h"
#include "client-hmd/mirror/scene_mirror.h"

namespace {

using handloft::client::Entity;
using handloft::client::SceneMirror;

constexpr std::size_t most_icons = 100, most_curve_points = 10'000;

void require(bool condition) {
  if (!condition) std::abort();
}

void check(const SceneMirror& mirror) {
  const auto& alternatives = mirror.scene()->alternatives;
  require(alternatives.names.empty() ||
          std::count(alternatives.names.begin(), alternatives.names.end(), alternatives.present) > 0);
  const handloft::client::MirrorLimits most;
  require(mirror.scene()->storage.problem.size() <= most.max_long_text_bytes);
  require(mirror.scene()->history.undo_refused.size() <= most.max_long_text_bytes);
  if (mirror.scene()->comments != nullptr) {
    require(mirror.scene()->comments->size() <= most.max_comments);
    for (const auto& comment : *mirror.scene()->comments) {
      require(!comment.id.empty() && comment.text.size() <= most.max_long_text_bytes);
      require(std::isfinite(comment.x + comment.y + comment.z));
    }
  }
  if (mirror.scene()->versions != nullptr) {
    require(mirror.scene()->versions->size() <= most.max_versions);
    for (const auto& version : *mirror.scene()->versions) require(!version.name.empty());
  }
  for (const auto& [id, entity] : mirror.scene()->entities) {
    require(entity->leased_by_name.size() <= most.max_text_bytes);
    if (entity->points != nullptr) {
      require(entity->settled_points <= entity->points->points.size());
      for (const auto& point : entity->points->points) {
        require(point.style < entity->points->styles.size());
        require(std::isfinite(point.position.x) && std::isfinite(point.position.y) &&
                std::isfinite(point.position.z));
      }
    }
    if (entity->distances_m != nullptr) {
      require(entity->surface != nullptr && entity->distances_m->size() == entity->surface->vertices.size());
      for (const float distance : *entity->distances_m) require(std::isfinite(distance));
    }
    if (entity->icons != nullptr) {
      require(entity->icons->size() <= most_icons);
      std::size_t outlines = 0;
      for (const auto& icon : *entity->icons) {
        require(!icon.id.empty() && icon.id.size() <= 256 && icon.label.size() <= 16);
        require(std::isfinite(icon.place.x + icon.place.y + icon.place.z));
        if (icon.direction)
          require(std::abs(std::hypot(icon.direction->x, icon.direction->y, icon.direction->z) - 1) < 0.01F);
        for (const auto& point : icon.outline) require(std::isfinite(point.x + point.y + point.z));
        outlines += icon.outline.size();
      }
      require(outlines <= most_curve_points);
    }
    if (entity->surface != nullptr) {
      for (const std::uint32_t index : entity->surface->indices)
        require(index < entity->surface->vertices.size());
      for (const auto& vertex : entity->surface->vertices) {
        require(std::isfinite(vertex.position.x) && std::isfinite(vertex.normal.z));
      }
    }
  }
}

void check(const handloft::v1::Presence& presence) {
  const auto activity = handloft::client::read_activity(presence);
  if (!activity) return;
  require(activity->range >= 0.0F && activity->range <= 1.0F);
  if (activity->disk) {
    require(std::isfinite(activity->disk->centre.x) && std::isfinite(activity->disk->normal.y) &&
            activity->disk->radius_m >= 0.0F && activity->disk->radius_m <= 1.0F);
  }
  if (activity->symmetry_plane) require(std::isfinite(activity->symmetry_plane->normal.z));
  if (activity->hand) {
    for (const auto& tip : activity->hand->tips) {
      require(std::isfinite(tip.place.x + tip.place.y + tip.place.z));
      require(std::isfinite(tip.velocity.x + tip.velocity.y + tip.velocity.z));
    }
    require(activity->hand->pressure >= 0.0F && activity->hand->pressure <= 1.0F);
  }
  if (activity->head) {
    const auto& q = activity->head->orientation;
    require(std::abs(std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])) - 1.0F) < 0.01F);
    require(std::isfinite(activity->head->place.x + activity->head->velocity.y +
                          activity->head->angular_velocity.z));
  }
  if (activity->curve != nullptr) {
    for (const auto& point : activity->curve->points) require(std::isfinite(point.x + point.y + point.z));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  handloft::client::MirrorLimits limits;
  limits.max_points = 10'000;
  limits.max_vertices = 10'000;
  limits.max_icons = most_icons;
  limits.max_curve_points = most_curve_points;
  SceneMirror mirror(limits);
  bool first = true;
  constexpr std::size_t header = 2;
  while (size >= header) {
    const std::size_t wanted = data[0] + 256U * data[1];
    const std::size_t length = std::min(wanted, size - header);
    const int bytes = static_cast<int>(length);
    if (first) {
      handloft::v1::SceneSnapshot snapshot;
      if (snapshot.ParseFromArray(data + header, bytes)) (void)mirror.apply(snapshot).ok();
    } else {
      handloft::v1::SceneDelta delta;
      if (delta.ParseFromArray(data + header, bytes)) (void)mirror.apply(delta).ok();
    }
    handloft::v1::Presence presence;
    if (presence.ParseFromArray(data + header, bytes)) check(presence);
    first = false;
    check(mirror);
    data += header + length;
    size -= header + length;
  }
  return 0;
}
