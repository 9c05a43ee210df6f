#pragma once
// An imported CAD model (STEP, IGES): the whole of it in the CAD kernel's own form, so that the faces that
// nobody sculpts are written again as they were. Its B-spline faces are entities of their own (SculptShape).

#include <memory>
#include <string>
#include <vector>

#include "server-model/geometry/types.h"
#include "server-model/model/entity.h"
#include "server-model/model/reference_shape.h"

namespace handloft::model {

struct CadModel final : Entity {
  std::shared_ptr<const std::string> boundary_representation;  ///< Never null; only the exchange reads it.
  double metres_per_unit = 0.001;                              ///< Of the representation.
  geometry::Vec3 translation = geometry::Vec3::Zero();         ///< From it into the world, after scaling.
  std::shared_ptr<const ReferenceMesh> rest;  ///< The faces that are not sculptable; may be null.
  std::vector<std::string> faces;             ///< Ids of its sculptable faces, as imported.

  EntityKind kind() const override { return EntityKind::cad_model; }
  std::shared_ptr<Entity> clone() const override { return std::make_shared<CadModel>(*this); }
};
using CadModelPtr = std::shared_ptr<const CadModel>;

inline CadModelPtr as_cad_model(const EntityPtr& entity) {
  return entity && entity->kind() == EntityKind::cad_model ? std::static_pointer_cast<const CadModel>(entity)
                                                           : nullptr;
}

}  // namespace handloft::model
