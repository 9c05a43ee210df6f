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

std::string_view icon_label(const SculptIcon& icon) {
  constexpr std::array<std::string_view, 7> labels{"", "R", "V", "R2", "V2", "RV", ""};
  return icon.role == IconRole::constraint ? labels.at(static_cast<std::size_t>(icon.property)) : "";
}

namespace v1 = handloft::v1;

v1::IconShape to_proto(IconShape shape) {
  return static_cast<v1::IconShape>(static_cast<int>(shape) + v1::ICON_POINT);
}

v1::IconRole to_proto(IconRole role) {
  return static_cast<v1::IconRole>(static_cast<int>(role) + v1::ICON_CONSTRAINT);
}

v1::IconProperty to_proto(IconProperty property) {
  return static_cast<v1::IconProperty>(static_cast<int>(property) + v1::ICON_POSITION);
}

v1::IconState to_proto(IconState state) {
  return static_cast<v1::IconState>(static_cast<int>(state) + v1::ICON_DRIVING);
}

}  // namespace handloft::model
