#include "server-model/model/entity.h"

namespace handloft::model {

std::string_view to_string(EntityKind kind) {
  switch (kind) {
    case EntityKind::dual_shape:
      return "dual_shape";
    case EntityKind::reference:
      return "reference";
  }
  return "dual_shape";
}

}  // namespace handloft::model
