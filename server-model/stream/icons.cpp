#include "server-model/stream/icons.h"

#include <algorithm>
#include <bit>
#include <string>

#include "server-model/model/sculpt_solve.h"

namespace handloft::stream {
namespace {

constexpr std::uint32_t red = 0xD8372AFF, green = 0x2FA84FFF, yellow = 0xF2C31BFF, grey = 0x8C9199FF;

void append(const geometry::Vec3& place, std::string& bytes) {
  for (const double coordinate : place) {
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(coordinate));
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes.push_back(static_cast<char>((bits >> shift) & 0xffU));
  }
}

void write(const geometry::Vec3& from, v1::Vec3& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

bool has_direction(const model::SculptIcon& icon) {
  return icon.shape == model::IconShape::point && icon.role == model::IconRole::constraint &&
         icon.property != model::IconProperty::position;
}

}  // namespace

std::uint32_t icon_colour_rgba(const model::SculptIcon& icon) {
  if (icon.state == model::IconState::sleeping) return grey;
  if (icon.role == model::IconRole::load) return green;
  const bool derivative = icon.shape == model::IconShape::point &&
                          icon.property != model::IconProperty::position &&
                          icon.property != model::IconProperty::normal;
  return derivative ? yellow : red;
}

bool icons_differ(const SceneEntity& before, const SceneEntity& after) {
  const model::SculptPtr now = model::as_sculpt(after.entity);
  const model::SculptPtr then = model::as_sculpt(before.entity);
  if (!then) return now && !now->icons->empty();
  if (then->icons->empty() && now->icons->empty()) return false;
  return then->icons != now->icons || then->surface != now->surface || before.icon_marks != after.icon_marks;
}

void write_icons(const SceneEntity& entity, v1::EntityState& state) {
  const model::SculptPtr shape = model::as_sculpt(entity.entity);
  state.set_icons_shown(true);
  for (const model::SculptIcon& icon : *shape->icons) {
    v1::Icon& out = *state.add_icons();
    out.set_id(icon.id);
    out.set_shape(to_proto(icon.shape));
    out.set_role(to_proto(icon.role));
    out.set_property(to_proto(icon.property));
    out.set_state(to_proto(icon.state));
    write(icon.place, *out.mutable_place());
    if (has_direction(icon)) {
      geometry::Vec3 direction = model::icon_direction(icon, *shape->surface);
      if (icon.property == model::IconProperty::normal && shape->reversed) direction = -direction;
      if (!direction.isZero()) write(direction, *out.mutable_direction());
    }
    for (const geometry::Vec3& place : model::icon_outline(icon, *shape->surface))
      append(place, *out.mutable_outline());
    out.set_label(std::string(model::icon_label(icon)));
    out.set_colour_rgba(icon_colour_rgba(icon));
    for (const IconMark& mark : entity.icon_marks) {
      if (mark.icon != icon.id) continue;
      out.set_target(out.target() || mark.kind == IconMark::Kind::target);
      out.set_held(out.held() || mark.kind == IconMark::Kind::held);
    }
  }
}

}  // namespace handloft::stream
