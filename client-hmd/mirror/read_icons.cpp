#include "client-hmd/mirror/read_icons.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

namespace handloft::client {
namespace {

constexpr std::size_t bytes_per_point = 3 * sizeof(float);
constexpr double unit_tolerance = 1e-3;

Error corrupt(std::string field, std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message), std::move(field));
}

std::optional<IconShape> read_shape(v1::IconShape shape) {
  switch (shape) {
    case v1::ICON_POINT:
      return IconShape::point;
    case v1::ICON_CURVE:
      return IconShape::curve;
    case v1::ICON_REGION:
      return IconShape::region;
    default:
      return std::nullopt;
  }
}

std::optional<IconState> read_state(v1::IconState state) {
  switch (state) {
    case v1::ICON_STATE_UNSPECIFIED:
    case v1::ICON_DRIVING:
      return IconState::driving;
    case v1::ICON_PASSIVE:
      return IconState::passive;
    case v1::ICON_SLEEPING:
      return IconState::sleeping;
    default:
      return std::nullopt;
  }
}

/// Derivatives other than the normal count as such; what is not told is a position.
std::optional<IconProperty> read_property(v1::IconProperty property) {
  switch (property) {
    case v1::ICON_PROPERTY_UNSPECIFIED:
    case v1::ICON_POSITION:
      return IconProperty::position;
    case v1::ICON_TANGENT_U:
    case v1::ICON_TANGENT_V:
    case v1::ICON_SECOND_U:
    case v1::ICON_SECOND_V:
    case v1::ICON_TWIST:
      return IconProperty::derivative;
    case v1::ICON_NORMAL:
      return IconProperty::normal;
    default:
      return std::nullopt;
  }
}

Result<std::vector<Vec3f>> read_outline(const std::string& bytes, std::size_t most, double reach_m) {
  if (bytes.size() % bytes_per_point != 0) {
    return corrupt("outline",
                   fmt::format("found {} bytes, expected a multiple of {}", bytes.size(), bytes_per_point));
  }
  const std::size_t count = bytes.size() / bytes_per_point;
  if (count > most) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {}, expected at most {}", count, most), "outline");
  }
  std::vector<Vec3f> points(count);
  if (count > 0) std::memcpy(points.data(), bytes.data(), bytes.size());
  const auto bad = [reach_m](float v) { return !std::isfinite(v) || std::abs(v) > reach_m; };
  if (std::any_of(points.begin(), points.end(),
                  [&bad](const Vec3f& p) { return bad(p.x) || bad(p.y) || bad(p.z); })) {
    return corrupt("outline", "expected finite positions in the room");
  }
  return points;
}

Result<SceneIcon> read_icon(const v1::Icon& message, const IconLimits& limits, std::size_t outline_room) {
  if (message.id().empty() || message.id().size() > limits.max_text_bytes) {
    return corrupt("id",
                   fmt::format("found {} bytes, expected 1..{}", message.id().size(), limits.max_text_bytes));
  }
  if (message.label().size() > limits.max_label_bytes) {
    return corrupt("label", fmt::format("found {} bytes, expected at most {}", message.label().size(),
                                        limits.max_label_bytes));
  }
  const auto shape = read_shape(message.shape());
  if (!shape)
    return corrupt("shape", fmt::format("found {}, expected 0..2", static_cast<int>(message.shape())));
  const auto state = read_state(message.state());
  if (!state)
    return corrupt("state", fmt::format("found {}, expected 0..3", static_cast<int>(message.state())));
  const auto property = read_property(message.property());
  if (!property) {
    return corrupt("property", fmt::format("found {}, expected 0..7", static_cast<int>(message.property())));
  }
  if (message.role() < v1::ICON_ROLE_UNSPECIFIED || message.role() > v1::ICON_LOAD) {
    return corrupt("role", fmt::format("found {}, expected 0..2", static_cast<int>(message.role())));
  }
  SceneIcon icon;
  icon.id = message.id();
  icon.shape = *shape;
  icon.load = message.role() == v1::ICON_LOAD;
  icon.property = *property;
  icon.state = *state;
  icon.label = message.label();
  icon.colour_rgba = message.colour_rgba();
  icon.target = message.target();
  icon.held = message.held();
  const v1::Vec3& place = message.place();
  for (const double v : {place.x(), place.y(), place.z()}) {
    if (!std::isfinite(v) || std::abs(v) > limits.max_coordinate_m) {
      return corrupt("place", "expected a finite position in the room");
    }
  }
  icon.place = {static_cast<float>(place.x()), static_cast<float>(place.y()), static_cast<float>(place.z())};
  if (message.has_direction()) {
    const v1::Vec3& way = message.direction();
    const double length = std::hypot(way.x(), way.y(), way.z());
    if (!(std::abs(length - 1) <= unit_tolerance)) return corrupt("direction", "expected a unit vector");
    icon.direction = Vec3f{static_cast<float>(way.x() / length), static_cast<float>(way.y() / length),
                           static_cast<float>(way.z() / length)};
  }
  Result<std::vector<Vec3f>> outline = read_outline(message.outline(), outline_room, limits.max_coordinate_m);
  if (!outline) return outline.error();
  icon.outline = std::move(*outline);
  return icon;
}

}  // namespace

Result<std::vector<SceneIcon>> read_icons(const google::protobuf::RepeatedPtrField<v1::Icon>& icons,
                                          const IconLimits& limits) {
  const auto count = static_cast<std::size_t>(icons.size());
  if (count > limits.max_icons) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {}, expected at most {}", count, limits.max_icons), "icons");
  }
  std::vector<SceneIcon> all;
  all.reserve(count);
  std::size_t room = limits.max_outline_points;
  for (const v1::Icon& message : icons) {
    Result<SceneIcon> icon = read_icon(message, limits, room);
    if (!icon) {
      return make_error(icon.error().code, icon.error().message,
                        fmt::format("icons[{}].{}", all.size(), icon.error().field));
    }
    room -= icon->outline.size();
    all.push_back(std::move(*icon));
  }
  return all;
}

}  // namespace handloft::client
