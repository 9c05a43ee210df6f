#pragma once
// A mesh around which shapes are designed, such as a scanned hand or a chassis (Fuge et al., figure 14). It
// is imported, shown and measured against, never changed by a shape.

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "server-model/geometry/mesh_distance.h"
#include "server-model/model/entity.h"

namespace handloft::model {

struct ReferenceMesh {
  std::vector<std::array<float, 3>> positions;          ///< World, metres.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Counterclockwise seen from outside.

  /// Some triangle has an area, so that there is something to measure to.
  bool has_area() const;

  /// Prepared for questions by the first who asks (some 15 ms for 20,000 triangles, 0.3 s for 300,000) and
  /// kept; any thread may, so whoever must not wait lets another thread be the first. Null when no triangle
  /// has an area.
  const geometry::MeshDistance* distance() const;

 private:
  mutable std::once_flag prepared_;
  mutable std::unique_ptr<const geometry::MeshDistance> distance_;
};

struct ReferenceShape final : Entity {
  std::shared_ptr<const ReferenceMesh> mesh;  ///< Never null in a document.

  EntityKind kind() const override { return EntityKind::reference; }
  std::shared_ptr<Entity> clone() const override { return std::make_shared<ReferenceShape>(*this); }
};
using ReferencePtr = std::shared_ptr<const ReferenceShape>;

/// The entity as a reference; null when it is null or of another kind.
inline ReferencePtr as_reference(const EntityPtr& entity) {
  return entity && entity->kind() == EntityKind::reference
             ? std::static_pointer_cast<const ReferenceShape>(entity)
             : nullptr;
}

}  // namespace handloft::model
