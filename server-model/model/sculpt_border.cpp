#include "server-model/model/sculpt_border.h"

#include <fmt/format.h>

#include <utility>

#include "server-model/geometry/bspline_refine.h"
#include "server-model/geometry/region_border.h"
#include "server-model/model/sculpt_solve.h"

namespace handloft::model {

using geometry::BSplineSurface;
using geometry::Direction;
using geometry::RegionBorder;

namespace {

/// A region whose outside is held has so many spans more than its degree: as many functions are its own.
constexpr int own_functions = 3;

using SurfacePtr = std::shared_ptr<const BSplineSurface>;

Result<SurfacePtr> with_knots(const BSplineSurface& surface, const RegionBorder& border) {
  auto along_u = geometry::insert_knots(surface, Direction::u, border.u);
  if (!along_u) return along_u.error();
  auto along_v = geometry::insert_knots(*along_u, Direction::v, border.v);
  if (!along_v) return along_v.error();
  return std::make_shared<const BSplineSurface>(std::move(*along_v));
}

bool lies_over_knots(const SculptIcon& icon) {
  return icon.role == IconRole::constraint && icon.shape != IconShape::point;
}

/// What a region's outside holds stays where it is at rest; so what was sculpted before comes to rest first.
Status rest_as_it_is(SculptShape& shape, const SculptIcon& icon, std::string_view field, const Limits& limits,
                     std::vector<std::string>& notes) {
  if (!icon.outside || shape.surface->control == shape.rest->control) return {};
  shape.rest = shape.surface;
  auto icons = std::make_shared<std::vector<SculptIcon>>(*shape.icons);
  for (SculptIcon& each : *icons) {
    if (auto status = begin_icon(each, shape, field, limits); !status) return status;
  }
  shape.icons = std::move(icons);
  notes.push_back(
      fmt::format("the present shape was committed: the outside of region \"{}\" holds it", icon.id));
  return {};
}

}  // namespace

geometry::UvRectangle region_of(const SculptIcon& icon) {
  return {icon.parameters[0], icon.parameters[1]};
}

RegionHold region_hold(const SculptIcon& icon, const BSplineSurface& rest) {
  if (icon.stiffness > 0 && !icon.outside) return RegionHold::spring;
  return geometry::on_knots(rest, region_of(icon)) ? RegionHold::points : RegionHold::places;
}

Status fit_border(SculptShape& shape, SculptIcon& icon, std::string_view field, const Limits& limits,
                  std::vector<std::string>& notes) {
  if (icon.shape != IconShape::region || icon.role != IconRole::constraint || !icon.acts()) return {};
  if (auto status = rest_as_it_is(shape, icon, field, limits, notes); !status) return status;
  const BSplineSurface& rest = *shape.rest;
  if (region_hold(icon, rest) == RegionHold::spring) return {};
  const int inner = icon.outside ? std::max(rest.u.degree(), rest.v.degree()) + own_functions : 0;
  const auto below = [&](Error error) {
    error.field = error.field.empty() ? std::string(field) : fmt::format("{}.{}", field, error.field);
    return error;
  };
  auto border = geometry::region_border(rest, region_of(icon), inner);
  if (!border) return below(border.error());
  if (border->is_sliver) {
    notes.push_back(fmt::format("region \"{}\" is narrower than a span may be: {}", icon.id,
                                icon.outside ? "no knots were inserted at its border"
                                             : "it is held at places, without knots at its border"));
    return {};
  }
  const auto keep_corners = [&] { icon.parameters = {border->region.lower, border->region.upper}; };
  if (border->u.empty() && border->v.empty()) {
    keep_corners();
    return {};
  }
  if (border->control_u * border->control_v > limits.max_control_points) {
    notes.push_back(
        fmt::format("knots at the border of region \"{}\" would make {} x {} control points, more "
                    "than {}: it {}",
                    icon.id, border->control_u, border->control_v, limits.max_control_points,
                    icon.outside ? "ends at the knots there are" : "is held at places"));
    return {};
  }
  auto finer_rest = with_knots(rest, *border);
  if (!finer_rest) return below(finer_rest.error());
  const bool at_rest = shape.surface == shape.rest;
  auto finer_surface = at_rest ? finer_rest : with_knots(*shape.surface, *border);
  if (!finer_surface) return below(finer_surface.error());
  shape.rest = std::move(*finer_rest);
  shape.surface = at_rest ? shape.rest : std::move(*finer_surface);
  keep_corners();
  auto icons = std::make_shared<std::vector<SculptIcon>>(*shape.icons);
  for (SculptIcon& each : *icons) {
    if (!lies_over_knots(each)) continue;
    if (auto status = begin_icon(each, shape, field, limits); !status) return status;
  }
  shape.icons = std::move(icons);
  notes.push_back(fmt::format("{} knots at the border of region \"{}\": {} x {} control points",
                              border->u.size() + border->v.size(), icon.id, border->control_u,
                              border->control_v));
  return {};
}

}  // namespace handloft::model
