#include "server-model/model/entity.h"

namespace handloft::model {

std::string_view to_string(EntityKind kind) {
  switch (kind) {
    case EntityKind::dual_shape:
      return "dual_shape";
    case EntityKind::reference:
      return "reference";
    case EntityKind::sculpt_surface:
      return "sculpt_surface";
    case EntityKind::cad_model:
      return "cad_model";
  }
  return "dual_shape";
}

}  // namespace handloft::model
