#include "server-model/model/sculpt_query.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server-model/model/bspline_message.h"
#include "server-model/model/operations/sculpting.h"
#include "server-model/model/sculpt_solve.h"
#include "server-model/model/vector_message.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

void write(const SculptIcon& icon, const geometry::BSplineSurface& surface, v1::SculptIconInfo& to) {
  to.set_id(icon.id);
  to.set_shape(to_proto(icon.shape));
  to.set_role(to_proto(icon.role));
  to.set_property(to_proto(icon.property));
  to.set_state(to_proto(icon.state));
  for (const geometry::Vec2& parameter : icon.parameters) write_vector(parameter, *to.add_parameters());
  write_vector(icon.place, *to.mutable_place());
  write_vector(icon_direction(icon, surface), *to.mutable_direction());
  to.set_stiffness(icon.stiffness);
  for (const std::string& sensor : icon.sensors) to.add_sensors(sensor);
  to.set_label(std::string(icon_label(icon)));
}

}  // namespace

Result<v1::QueryResult> sculpt(const v1::SculptQuery& query, const Document& document) {
  auto found = require_sculpt(document, query.entity(), "sculpt.entity");
  if (!found) return found.error();
  const SculptShape& shape = **found;
  const geometry::BSplineSurface& surface = *shape.surface;
  v1::QueryResult result;
  v1::SculptResult& out = *result.mutable_sculpt();
  out.set_entity(shape.id);
  for (const SculptIcon& icon : *shape.icons) write(icon, surface, *out.add_icons());
  out.set_control_u(static_cast<std::uint32_t>(surface.u.control_count()));
  out.set_control_v(static_cast<std::uint32_t>(surface.v.control_count()));
  out.set_degree_u(static_cast<std::uint32_t>(surface.u.degree()));
  out.set_degree_v(static_cast<std::uint32_t>(surface.v.degree()));
  write_vector(geometry::Vec2(surface.u.lower(), surface.v.lower()), *out.mutable_lower());
  write_vector(geometry::Vec2(surface.u.upper(), surface.v.upper()), *out.mutable_upper());
  double most = 0;
  for (std::size_t i = 0; i < surface.control.size(); ++i) {
    most = std::max(most, (surface.control[i] - shape.rest->control[i]).norm());
  }
  out.set_max_displacement_m(most);
  out.set_trimmed(shape.trim != nullptr);
  out.set_model(shape.model);
  out.set_face(shape.face);
  if (query.control()) write_surface(surface, *out.mutable_surface());
  return result;
}

Result<v1::QueryResult> evaluate_sculpt(const v1::EvaluateQuery& query, const SculptShape& shape,
                                        const Limits& limits) {
  if (static_cast<std::size_t>(query.at_size()) > limits.max_points_per_query) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} places, expected at most {}", query.at_size(), limits.max_points_per_query),
        "evaluate.at");
  }
  v1::QueryResult result;
  v1::EvaluateResult& out = *result.mutable_evaluate();
  out.set_entity(shape.id);
  for (int i = 0; i < query.at_size(); ++i) {
    const double u = query.at(i).x(), v = query.at(i).y();
    if (!std::isfinite(u) || !std::isfinite(v)) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found ({}, {}), expected finite numbers", u, v),
                        fmt::format("evaluate.at[{}]", i));
    }
    write_vector(shape.surface->evaluate(u, v), *out.add_positions());
    const geometry::Vec3 normal = shape.surface->normal(u, v);
    write_vector(shape.reversed ? geometry::Vec3(-normal) : normal, *out.add_normals());
    out.add_opacity(1);
  }
  return result;
}

}  // namespace handloft::model
