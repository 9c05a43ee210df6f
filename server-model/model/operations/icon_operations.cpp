// Icons of a sculpted surface (D6 - D19): added, changed, dragged, deleted.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "server-model/geometry/bspline_projection.h"
#include "server-model/geometry/region_border.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/sculpting.h"
#include "server-model/model/sculpt_border.h"
#include "server-model/model/sculpt_solve.h"
#include "server-model/model/validate.h"
#include "server-model/model/vector_message.h"

namespace handloft::model {

namespace v1 = handloft::v1;
using geometry::Vec2;
using geometry::Vec3;

namespace {

Error unknown_value(int found, std::string_view expected, const std::string& field) {
  return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected {}", found, expected),
                    field);
}

Status take_role(v1::IconRole asked, IconRole& role, const std::string& field) {
  if (asked == v1::ICON_ROLE_UNSPECIFIED) return {};
  if (asked != v1::ICON_CONSTRAINT && asked != v1::ICON_LOAD) {
    return unknown_value(asked, "ICON_CONSTRAINT or ICON_LOAD", field);
  }
  role = asked == v1::ICON_LOAD ? IconRole::load : IconRole::constraint;
  return {};
}

Status take_property(v1::IconProperty asked, IconProperty& property, const std::string& field) {
  if (asked == v1::ICON_PROPERTY_UNSPECIFIED) return {};
  if (asked < v1::ICON_POSITION || asked > v1::ICON_NORMAL) {
    return unknown_value(asked, "one of ICON_POSITION..ICON_NORMAL", field);
  }
  property = static_cast<IconProperty>(asked - v1::ICON_POSITION);
  return {};
}

Status take_state(v1::IconState asked, IconState& state, const std::string& field) {
  if (asked == v1::ICON_STATE_UNSPECIFIED) return {};
  if (asked < v1::ICON_DRIVING || asked > v1::ICON_SLEEPING) {
    return unknown_value(asked, "ICON_DRIVING, ICON_PASSIVE or ICON_SLEEPING", field);
  }
  state = static_cast<IconState>(asked - v1::ICON_DRIVING);
  return {};
}

Status take_sensors(const google::protobuf::RepeatedPtrField<std::string>& asked,
                    std::vector<std::string>& sensors, const std::string& field, const Limits& limits) {
  if (asked.empty()) return {};
  if (static_cast<std::size_t>(asked.size()) > limits.max_icon_sensors) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {}, expected at most {}", asked.size(), limits.max_icon_sensors),
                      field);
  }
  for (int i = 0; i < asked.size(); ++i) {
    if (auto status = check_id(asked[i], fmt::format("{}[{}]", field, i), limits); !status) return status;
  }
  sensors.assign(asked.begin(), asked.end());
  return {};
}

Status check_stiffness(double stiffness, const std::string& field) {
  if (stiffness >= 0 && std::isfinite(stiffness)) return {};
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found {}, expected 0 or a number above", stiffness), field);
}

Result<IconShape> read_shape(v1::IconShape asked) {
  switch (asked) {
    case v1::ICON_POINT:
      return IconShape::point;
    case v1::ICON_CURVE:
      return IconShape::curve;
    case v1::ICON_REGION:
      return IconShape::region;
    default:
      return unknown_value(asked, "ICON_POINT, ICON_CURVE or ICON_REGION", "add_icon.shape");
  }
}

double into(const geometry::KnotVector& knots, double parameter) {
  return knots.is_periodic() ? parameter : std::clamp(parameter, knots.lower(), knots.upper());
}

/// The parameters that a message names, or nearest to the places that it names.
Result<std::vector<Vec2>> read_parameters(const v1::AddIcon& request, IconShape shape,
                                          const geometry::BSplineSurface& surface, const Limits& limits) {
  if (!request.parameters().empty() && !request.places().empty()) {
    return make_error(ErrorCode::invalid_argument, "found parameters and places, expected either",
                      "add_icon.places");
  }
  const bool by_place = !request.places().empty();
  const auto count = static_cast<std::size_t>(by_place ? request.places_size() : request.parameters_size());
  const std::string field = by_place ? "add_icon.places" : "add_icon.parameters";
  const bool fits = shape == IconShape::point    ? count == 1
                    : shape == IconShape::region ? count == 2
                                                 : count >= 2 && count <= limits.max_icon_corners;
  if (!fits) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected {}", count,
                    shape == IconShape::point    ? "one for a point"
                    : shape == IconShape::region ? "two opposite corners for a region"
                                                 : fmt::format("2..{} for a curve", limits.max_icon_corners)),
        field);
  }
  std::vector<Vec2> parameters;
  parameters.reserve(count);
  if (by_place) {
    auto projector = geometry::SurfaceProjector::create(surface);  // An icon may lie beyond the trim.
    if (!projector) return projector.error();
    for (std::size_t i = 0; i < count; ++i) {
      auto place = read_vector(request.places(static_cast<int>(i)), fmt::format("{}[{}]", field, i), limits);
      if (!place) return place.error();
      auto nearest = projector->closest(*place);
      if (!nearest) return nearest.error();
      parameters.push_back(nearest->uv);
    }
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      const v1::Vec2& p = request.parameters(static_cast<int>(i));
      if (!std::isfinite(p.x()) || !std::isfinite(p.y())) {
        return make_error(ErrorCode::invalid_argument,
                          fmt::format("found ({}, {}), expected finite parameters", p.x(), p.y()),
                          fmt::format("{}[{}]", field, i));
      }
      parameters.emplace_back(into(surface.u, p.x()), into(surface.v, p.y()));
    }
  }
  if (by_place) parameters = geometry::without_jumps(surface, parameters);
  if (shape == IconShape::point) {  // Of a closed direction one turn tells all.
    parameters.front() = {surface.u.wrap(parameters.front().x()), surface.v.wrap(parameters.front().y())};
  }
  if (shape == IconShape::region) {
    auto region = geometry::region_of(surface, parameters[0], parameters[1]);
    if (!region) {
      return make_error(ErrorCode::invalid_argument,
                        "found a region without area, expected two opposite corners", field);
    }
    parameters = {region->lower, region->upper};
  }
  return parameters;
}

/// Stored values of enum fields in a message are resolved, so that the log says what was done.
void put_icon(SculptShape& shape, std::size_t index, SculptIcon icon) {
  auto icons = std::make_shared<std::vector<SculptIcon>>(*shape.icons);
  if (index == icons->size()) {
    icons->push_back(std::move(icon));
  } else {
    (*icons)[index] = std::move(icon);
  }
  shape.icons = std::move(icons);
}

std::string free_icon_id(const SculptShape& shape) {
  for (std::uint64_t n = 1;; ++n) {
    std::string id = fmt::format("icon-{}", n);
    if (shape.find_icon(id) == nullptr) return id;
  }
}

std::string describe(const SculptIcon& icon) {
  if (icon.role == IconRole::load) return fmt::format("{} load", to_string(icon.shape));
  if (icon.shape != IconShape::point) return fmt::format("{} constraint", to_string(icon.shape));
  return fmt::format("{} constraint", to_string(icon.property));
}

Status check_kind(const SculptIcon& icon, const std::string& field) {
  if (icon.shape != IconShape::point && icon.property != IconProperty::position) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} of a {}, expected position: only points hold others",
                                  to_string(icon.property), to_string(icon.shape)),
                      field + ".property");
  }
  if (icon.outside && (icon.shape != IconShape::region || icon.role != IconRole::constraint)) {
    return make_error(ErrorCode::invalid_argument,
                      "found the outside of another icon than a region constraint", field + ".outside");
  }
  return {};
}

/// A normal icon asks for a tangent plane (D8), which has two sides.
bool is_met_from_behind(const SculptIcon& icon, const geometry::BSplineSurface& surface) {
  if (icon.role != IconRole::constraint || icon.property != IconProperty::normal) return false;
  const Vec2& uv = icon.parameters.front();
  return surface.normal(uv.x(), uv.y()).dot(icon.rotation * icon.reference->front()) < 0;
}

}  // namespace

Result<Outcome> add_icon(const Document& document, const v1::AddIcon& request, const ApplyContext& context) {
  const Limits& limits = context.limits;
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_add_icon() = request;
  if (request.has_create()) {
    v1::CreateSculptSurface create = request.create();
    if (create.id().empty()) create.set_id(request.entity());
    if (create.id() != request.entity()) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found \"{}\", expected \"{}\", the entity that gets the icon",
                                    create.id(), request.entity()),
                        "add_icon.create.id");
    }
    auto made = make_sculpt_surface(document, create, "add_icon.create", context, outcome.notes);
    if (!made) return made.error();
    auto entity = std::make_shared<const SculptShape>(std::move(*made));
    if (auto status = add_entity(outcome.document, entity, "add_icon.create.id", limits); !status) {
      return status.error();
    }
  }
  auto found = require_sculpt(outcome.document, request.entity(), "add_icon.entity");
  if (!found) return found.error();
  SculptShape shape = **found;
  if (shape.icons->size() >= limits.max_icons) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("\"{}\" has {} icons, expected at most that", shape.id, limits.max_icons),
                      "add_icon.entity");
  }
  SculptIcon icon;
  icon.id = request.id().empty() ? free_icon_id(shape) : request.id();
  if (auto status = check_id(icon.id, "add_icon.id", limits); !status) return status.error();
  if (shape.find_icon(icon.id) != nullptr) {
    return make_error(ErrorCode::already_exists, fmt::format("\"{}\" has an icon \"{}\"", shape.id, icon.id),
                      "add_icon.id");
  }
  auto icon_shape = read_shape(request.shape());
  if (!icon_shape) return icon_shape.error();
  icon.shape = *icon_shape;
  if (auto status = take_role(request.role(), icon.role, "add_icon.role"); !status) return status.error();
  if (auto status = take_property(request.property(), icon.property, "add_icon.property"); !status) {
    return status.error();
  }
  if (auto status = take_state(request.state(), icon.state, "add_icon.state"); !status) return status.error();
  if (auto status = take_sensors(request.sensors(), icon.sensors, "add_icon.sensors", limits); !status) {
    return status.error();
  }
  if (auto status = check_stiffness(request.stiffness(), "add_icon.stiffness"); !status)
    return status.error();
  icon.stiffness = request.stiffness();
  icon.outside = request.outside();
  if (auto status = check_kind(icon, "add_icon"); !status) return status.error();
  auto parameters = read_parameters(request, icon.shape, *shape.surface, limits);
  if (!parameters) return parameters.error();
  icon.parameters = std::move(*parameters);
  if (auto status = fit_border(shape, icon, "add_icon", limits, outcome.notes); !status)
    return status.error();
  if (auto status = begin_icon(icon, shape, "add_icon", limits); !status) return status.error();

  // Where it was projected to is what the log keeps: nothing is projected twice.
  v1::AddIcon& effective = *outcome.effective.mutable_add_icon();
  effective.set_id(icon.id);
  effective.clear_places();
  effective.clear_parameters();
  for (const Vec2& p : icon.parameters) write_vector(p, *effective.add_parameters());
  if (request.has_create()) effective.mutable_create()->set_id(shape.id);
  outcome.words = fmt::format("Add {} to \"{}\"", describe(icon), shape.name);
  const std::string id = icon.id;
  put_icon(shape, shape.icons->size(), std::move(icon));
  if (auto status = settle(shape, "add_icon", context, outcome.notes, id); !status) return status.error();
  put(outcome.document, std::move(shape));
  return outcome;
}

Result<Outcome> change_icon(const Document& document, const v1::ChangeIcon& request,
                            const ApplyContext& context) {
  auto found = require_sculpt(document, request.entity(), "change_icon.entity");
  if (!found) return found.error();
  auto index = require_icon(**found, request.icon(), "change_icon.icon");
  if (!index) return index.error();
  SculptShape shape = **found;
  const SculptIcon before = (*shape.icons)[*index];
  SculptIcon icon = before;
  if (auto status = take_role(request.role(), icon.role, "change_icon.role"); !status) return status.error();
  if (auto status = take_property(request.property(), icon.property, "change_icon.property"); !status) {
    return status.error();
  }
  if (auto status = take_state(request.state(), icon.state, "change_icon.state"); !status)
    return status.error();
  if (auto status = take_sensors(request.sensors(), icon.sensors, "change_icon.sensors", context.limits);
      !status) {
    return status.error();
  }
  if (request.has_stiffness()) {
    if (auto status = check_stiffness(request.stiffness(), "change_icon.stiffness"); !status)
      return status.error();
    icon.stiffness = request.stiffness();
  }
  if (auto status = check_kind(icon, "change_icon"); !status) return status.error();
  // What acts anew, or holds something else, begins at the surface as it is (D13); one that acts on keeps
  // what it holds, and so does a driving one that becomes passive.
  const bool anew = (icon.acts() && !before.acts()) || icon.role != before.role ||
                    icon.property != before.property ||
                    (icon.shape == IconShape::region && icon.role == IconRole::constraint &&
                     (icon.stiffness > 0) != (before.stiffness > 0));
  Outcome outcome;
  if (anew) {
    if (auto status = fit_border(shape, icon, "change_icon", context.limits, outcome.notes); !status) {
      return status.error();
    }
    if (auto status = begin_icon(icon, shape, "change_icon", context.limits); !status) return status.error();
  }
  outcome.words = fmt::format("Make icon \"{}\" of \"{}\" a {} {}", icon.id, shape.name,
                              to_string(icon.state), describe(icon));
  put_icon(shape, *index, std::move(icon));
  if (auto status = settle(shape, "change_icon", context, outcome.notes, before.id); !status)
    return status.error();
  outcome.document = document;
  *outcome.effective.mutable_change_icon() = request;
  put(outcome.document, std::move(shape));
  return outcome;
}

Result<Outcome> drag_icon(const Document& document, const v1::DragIcon& request,
                          const ApplyContext& context) {
  auto found = require_sculpt(document, request.entity(), "drag_icon.entity");
  if (!found) return found.error();
  auto index = require_icon(**found, request.icon(), "drag_icon.icon");
  if (!index) return index.error();
  SculptShape shape = **found;
  SculptIcon icon = (*shape.icons)[*index];
  if (icon.state != IconState::driving) {
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("icon \"{}\" is {}, only driving ones follow a hand", icon.id, to_string(icon.state)),
        "drag_icon.icon");
  }
  auto translation = read_vector(request.translation(), "drag_icon.translation", context.limits);
  if (!translation) return translation.error();
  auto rotation = read_rotation(request.rotation(), request.has_rotation(), "drag_icon.rotation");
  if (!rotation) return rotation.error();
  if (!(request.reach_m() >= 0 && request.reach_m() <= context.limits.max_coordinate_m)) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected 0..{}", request.reach_m(), context.limits.max_coordinate_m),
        "drag_icon.reach_m");
  }
  if (request.reach_m() == 0 && request.held_at() != 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} without a reach, expected reach_m above 0 for a bend, or none "
                                  "of both for a motion",
                                  request.held_at()),
                      "drag_icon.held_at");
  }
  if (request.reach_m() > 0) {
    if (icon.shape != IconShape::curve) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found a reach for a {}, expected one for a curve only", to_string(icon.shape)),
          "drag_icon.reach_m");
    }
    if (request.has_rotation()) {
      return make_error(ErrorCode::invalid_argument,
                        "found a rotation of a curve that is bent, expected none", "drag_icon.rotation");
    }
    if (!(request.held_at() >= 0 && request.held_at() <= 1)) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected 0..1", request.held_at()), "drag_icon.held_at");
    }
    if (icon.bends.size() >= context.limits.max_icon_bends) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("icon \"{}\" was bent {} times, expected at most that: commit it",
                                    icon.id, context.limits.max_icon_bends),
                        "drag_icon.icon");
    }
    icon.bends.push_back({request.held_at(), request.reach_m(), *translation});
  } else {
    // p -> pivot + R (p - pivot) + t, then about where it is now: the motions add up about the pivot that
    // moved along.
    icon.translation += *translation;
    icon.rotation = (*rotation * icon.rotation).normalized();
  }
  Outcome outcome;
  outcome.words = fmt::format("Drag icon \"{}\" of \"{}\"", icon.id, shape.name);
  put_icon(shape, *index, std::move(icon));
  if (auto status = settle(shape, "drag_icon", context, outcome.notes, request.icon()); !status)
    return status.error();
  if (const SculptIcon& dragged = (*shape.icons)[*index]; is_met_from_behind(dragged, *shape.surface)) {
    outcome.notes.push_back(fmt::format(
        "icon \"{}\" is met from behind: beyond a right angle the surface doesn't turn over", dragged.id));
  }
  outcome.document = document;
  *outcome.effective.mutable_drag_icon() = request;
  put(outcome.document, std::move(shape));
  return outcome;
}

Result<Outcome> delete_icon(const Document& document, const v1::DeleteIcon& request,
                            const ApplyContext& context) {
  auto found = require_sculpt(document, request.entity(), "delete_icon.entity");
  if (!found) return found.error();
  auto index = require_icon(**found, request.icon(), "delete_icon.icon");
  if (!index) return index.error();
  SculptShape shape = **found;
  auto icons = std::make_shared<std::vector<SculptIcon>>(*shape.icons);
  icons->erase(icons->begin() + static_cast<std::ptrdiff_t>(*index));
  shape.icons = std::move(icons);
  Outcome outcome;
  if (auto status = settle(shape, "delete_icon", context, outcome.notes); !status) return status.error();
  outcome.document = document;
  *outcome.effective.mutable_delete_icon() = request;
  outcome.words = fmt::format("Delete icon \"{}\" of \"{}\"", request.icon(), shape.name);
  put(outcome.document, std::move(shape));
  return outcome;
}

}  // namespace handloft::model
