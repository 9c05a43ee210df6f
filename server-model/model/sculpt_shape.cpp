#include "server-model/model/sculpt_shape.h"

#include <algorithm>

namespace handloft::model {

const SculptIcon* SculptShape::find_icon(std::string_view icon) const {
  const auto found =
      std::find_if(icons->begin(), icons->end(), [&](const SculptIcon& each) { return each.id == icon; });
  return found == icons->end() ? nullptr : &*found;
}

std::string_view to_string(IconShape shape) {
  constexpr std::array<std::string_view, 3> names{"point", "curve", "region"};
  return names.at(static_cast<std::size_t>(shape));
}

std::string_view to_string(IconRole role) {
  return role == IconRole::constraint ? "constraint" : "load";
}

std::string_view to_string(IconProperty property) {
  constexpr std::array<std::string_view, 7> names{"position", "tangent_u", "tangent_v", "second_u",
                                                  "second_v", "twist",     "normal"};
  return names.at(static_cast<std::size_t>(property));
}

std::string_view to_string(IconState state) {
  constexpr std::array<std::string_view, 3> names{"driving", "passive", "sleeping"};
  return names.at(static_cast<std::size_t>(state));
}

}  // namespace handloft::model
