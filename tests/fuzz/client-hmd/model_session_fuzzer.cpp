// A whole session of a hostile server: bytes as Envelopes, one after another, through the count of their
// parts, the parser, the mirror and what is shown across restarts. Two bytes (little-endian) before each
// piece say how long it is. Never a crash, never more than the limits, never an index or number that is not
// valid, and a refused message leaves the scene as it was.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "client-hmd/mirror/activity.h"
#include "client-hmd/mirror/resume.h"
#include "client-hmd/mirror/scene_mirror.h"
#include "common/net/framing.h"
#include "common/net/message_parts.h"
#include "proto/session.pb.h"

namespace {

using namespace handloft;
using namespace handloft::client;

constexpr std::size_t most_parts = 2000;

void require(bool condition) {
  if (!condition) std::abort();
}

MirrorLimits small_limits() {
  MirrorLimits limits;
  limits.max_entities = 16;
  limits.max_points = 2000;
  limits.max_styles = 64;
  limits.max_vertices = 2000;
  limits.max_indices = 6000;
  limits.max_curves = 40;
  limits.max_curve_points = 1000;
  limits.max_icons = 40;
  return limits;
}

bool finite(const Vec3f& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void check_entity(const Entity& entity) {
  require(!entity.id.empty() && entity.id.size() <= 256 && entity.name.size() <= 256);
  if (entity.points != nullptr) {
    require(entity.settled_points <= entity.points->points.size());
    for (const FuzzyPoint& point : entity.points->points) {
      require(point.style < entity.points->styles.size() && finite(point.position));
    }
  }
  if (entity.surface != nullptr) {
    for (const std::uint32_t index : entity.surface->indices)
      require(index < entity.surface->vertices.size());
    for (const SurfaceVertex& vertex : entity.surface->vertices) {
      require(finite(vertex.position) && finite(vertex.normal));
    }
  }
  if (entity.distances_m != nullptr) {
    require(entity.surface != nullptr && entity.distances_m->size() == entity.surface->vertices.size());
  }
  if (entity.curves != nullptr) {
    for (const SceneCurve& curve : *entity.curves) {
      require(std::all_of(curve.points.begin(), curve.points.end(), finite));
    }
  }
  if (entity.icons != nullptr) {
    for (const SceneIcon& icon : *entity.icons) require(finite(icon.place));
  }
}

/// What the graphics card is told of: an index buffer is kept for meshes of one number, so it must fit them.
struct Resident {
  std::map<std::string, std::shared_ptr<const SurfaceMesh>> meshes;

  void update(const Scene& scene) {
    std::erase_if(meshes, [&scene](const auto& item) { return scene.entities.count(item.first) == 0; });
    for (const auto& [id, entity] : scene.entities) {
      if (entity->surface == nullptr) {
        meshes.erase(id);
        continue;
      }
      std::shared_ptr<const SurfaceMesh>& kept = meshes[id];
      if (kept != nullptr && kept->topology != 0 && kept->topology == entity->surface->topology) {
        require(kept->indices == entity->surface->indices);
      }
      kept = entity->surface;
    }
  }
};

template <typename Message>
void apply(SceneMirror& mirror, const Message& message) {
  const std::shared_ptr<const Scene> before = mirror.scene();
  const bool applied = mirror.apply(message).ok();
  require(applied || mirror.scene() == before);
  require(check_size(size_of(*mirror.scene()), small_limits()).ok());
  for (const auto& [id, entity] : mirror.scene()->entities) check_entity(*entity);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  SceneMirror mirror(small_limits());
  Resumption resumption;
  Resident resident;
  std::shared_ptr<const Scene> shown = mirror.scene();
  TimePoint now = from_ns(1'000'000'000);
  constexpr std::size_t header = 2;
  v1::Envelope envelope;
  while (size >= header) {
    const std::size_t wanted = data[0] + 256U * data[1];
    const std::size_t length = std::min(wanted, size - header);
    const std::span<const std::uint8_t> payload(data + header, length);
    data += header + length;
    size -= header + length;
    now += std::chrono::milliseconds(wanted & 0xFFU);
    const auto parts = net::count_message_parts(payload, most_parts);
    const bool parsed = net::parse_envelope(payload, envelope).ok();
    // The count refuses whatever the parser refuses, but for texts that are no UTF-8.
    if (parsed && !parts) require(parts.error().code == ErrorCode::resource_exhausted);
    if (!parsed || !parts) continue;
    if (envelope.has_snapshot()) {
      apply(mirror, envelope.snapshot());
      resumption.begin(now);
    } else if (envelope.has_delta()) {
      apply(mirror, envelope.delta());
    } else if (envelope.has_presence()) {
      (void)read_activity(envelope.presence()).ok();
    }
    shown = resumption.choose(shown, mirror.scene(), now);
    resident.update(*shown);
  }
  return 0;
}
