#pragma once
// How much a viewer holds, however much it is sent (F2 of reliability.md): every figure is of the whole
// mirrored scene, so that neither one message nor a thousand modest ones can fill the memory. At all limits
// together a scene takes about 450 MiB, and the next one shares what did not change.

#include <cstddef>

#include "client-hmd/mirror/scene.h"
#include "common/base/result.h"

namespace handloft::client {

struct MirrorLimits {
  std::size_t max_entities = 4096;
  std::size_t max_points = std::size_t{8} << 20;        ///< 128 MiB
  std::size_t max_styles = std::size_t{1} << 18;        ///< 11 MiB; a cloud has a thousand at most.
  std::size_t max_vertices = std::size_t{4} << 20;      ///< 112 MiB, and 16 of distances.
  std::size_t max_indices = std::size_t{24} << 20;      ///< 96 MiB: six a vertex, as in a triangle grid.
  std::size_t max_curves = std::size_t{1} << 16;        ///< Lines; 4 MiB without their points.
  std::size_t max_curve_points = std::size_t{4} << 20;  ///< Icons' outlines too; 48 MiB.
  std::size_t max_icons = std::size_t{1} << 16;         ///< 20 MiB with their texts.
  // Of one entity or text.
  std::size_t max_entity_icons = 4096;  ///< A surface has tens.
  std::size_t max_text_bytes = 256;
  std::size_t max_alternatives = 256;      ///< A document holds 64.
  std::size_t max_long_text_bytes = 4096;  ///< Comments and notes: what a document holds.
  std::size_t max_comments = 4096;
  std::size_t max_comments_bytes = std::size_t{4} << 20;  ///< Of all together.
  std::size_t max_versions = 1024;
  std::size_t max_people = 256;
  double max_coordinate_m = 1e4;  ///< As in common/codec: nothing on a table is 10 km away.
  double max_radius_m = 1.0;      ///< A fuzzy point is 12.7 mm at most (A2); a metre hides the scene.
};

/// What a scene, or one entity of it, holds.
struct SceneSize {
  std::size_t entities = 0;
  std::size_t points = 0;
  std::size_t styles = 0;
  std::size_t vertices = 0;
  std::size_t indices = 0;
  std::size_t curves = 0;
  std::size_t curve_points = 0;  ///< Of curves and of icons' outlines.
  std::size_t icons = 0;

  SceneSize& operator+=(const SceneSize& other);
  /// Precondition: `other` is part of it.
  SceneSize& operator-=(const SceneSize& other);
  bool operator==(const SceneSize&) const = default;
};

SceneSize size_of(const Entity& entity);
SceneSize size_of(const Scene& scene);

/// What an entity may still hold beside a scene of size `others`: `limits` less that.
MirrorLimits room_beside(const SceneSize& others, const MirrorLimits& limits);

/// Errors: resource_exhausted with the field and both figures: "points: the scene would have 8388609, a
/// viewer holds 8388608 at most".
Status check_size(const SceneSize& size, const MirrorLimits& limits);

}  // namespace handloft::client
