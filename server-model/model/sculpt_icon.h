#pragma once
// An icon on a surface: where it is, which way it points, what it is seen as, and what it holds from when on
// (D13, D14, D17).

#include <array>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/sculpt_rows.h"
#include "server-model/model/limits.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// What a drag by 1 m is to derivatives: the icon's arrow is so long, its tip moves (D7).
inline constexpr double icon_arrow_m = 0.05;

/// Takes the icon's rows as they are on the present surface: what it holds from now on, its motion none
/// (D13). Errors: resource_exhausted for more rows than the limit.
Status begin_icon(SculptIcon& icon, const SculptShape& shape, std::string_view field, const Limits& limits);

/// Where an icon is shown: its parameters, or the middle of them.
geometry::Vec2 icon_middle(const SculptIcon& icon);

bool has_moved(const SculptIcon& icon);  ///< Since it began to act.

/// Orders, along u and v, of the derivative that an icon is about.
std::array<int, 2> orders_of(IconProperty property);

/// Of a region constraint that does not hold control points.
Result<std::vector<geometry::CurvePlace>> places_in_region(const SculptIcon& icon,
                                                           const geometry::BSplineSurface& rest);

geometry::Vec3 value_of(const geometry::SurfaceFunctional& functional,
                        const std::vector<geometry::Vec3>& control);

/// Places of an icon's curve or border on a surface, for viewers; empty for points.
std::vector<geometry::Vec3> icon_outline(const SculptIcon& icon, const geometry::BSplineSurface& surface);

/// The icon's direction on a surface: of tangents, second derivatives and twist the derivative's, else the
/// normal; unit, or zero where it vanishes.
geometry::Vec3 icon_direction(const SculptIcon& icon, const geometry::BSplineSurface& surface);

}  // namespace handloft::model
