#include "server-model/model/control_net.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "server-model/geometry/bezier_patch.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

static_assert(std::endian::native == std::endian::little, "ControlNetResult.points are little-endian");

struct Net {
  std::size_t rows = 0;
  std::size_t columns = 0;
};

Result<v1::QueryResult> write_net(const v1::ControlNetQuery& query, Net net,
                                  std::span<const geometry::Vec3> control) {
  const std::size_t most = query.max_points() != 0 ? query.max_points() : default_net_points;
  if (control.size() > most) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("\"{}\" has {} x {} control points, expected at most {}", query.entity(),
                                  net.rows, net.columns, most),
                      "control_net.max_points");
  }
  v1::QueryResult result;
  v1::ControlNetResult& out = *result.mutable_control_net();
  out.set_entity(query.entity());
  out.set_rows(static_cast<std::uint32_t>(net.rows));
  out.set_columns(static_cast<std::uint32_t>(net.columns));
  constexpr std::size_t point_bytes = 3 * sizeof(float);
  out.mutable_points()->reserve(control.size() * point_bytes);
  for (const geometry::Vec3& point : control) {
    const Eigen::Vector3f packed = point.cast<float>();
    if (!packed.allFinite()) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("\"{}\" has a control point beyond the range of numbers", query.entity()),
                        "control_net.entity");
    }
    out.mutable_points()->append(reinterpret_cast<const char*>(packed.data()), point_bytes);
  }
  return result;
}

Result<v1::QueryResult> of_fit(const v1::ControlNetQuery& query, const DualShape& shape) {
  if (!shape.fit) {
    return make_error(ErrorCode::failed_precondition, fmt::format("\"{}\" is not fitted yet", shape.id),
                      "control_net.entity");
  }
  const auto trim = shape.trim();
  if (!trim) return trim.error();
  const auto patch = geometry::to_bezier_patch(shape.fit->surface, shape.fit->frame, trim->solid_box());
  if (!patch) return patch.error();
  const auto side = static_cast<std::size_t>(patch->degree) + 1;
  return write_net(query, {side, side}, patch->control);
}

}  // namespace

Result<v1::QueryResult> control_net(const v1::ControlNetQuery& query, const Document& document) {
  if (const SculptPtr sculpted = as_sculpt(document.find(query.entity()))) {
    const geometry::BSplineSurface& surface = *sculpted->surface;
    return write_net(query,
                     {static_cast<std::size_t>(surface.u.control_count()),
                      static_cast<std::size_t>(surface.v.control_count())},
                     surface.control);
  }
  auto found = require_dual(document, query.entity(), "control_net.entity");
  if (!found) return found.error();
  return of_fit(query, **found);
}

}  // namespace handloft::model
