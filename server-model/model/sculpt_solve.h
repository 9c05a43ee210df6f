#pragma once
// From icons to the surface: each icon's constraint rows and loads (D5 - D13, D15, D16), the solution of
// least energy (geometry/sculpt_system.h), and where the icons then are (D14). The result depends on the
// shape's value alone, to the bit: what is kept between calls (factors, response columns) only makes it
// quick.

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/model/document.h"
#include "server-model/model/limits.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// What a drag by 1 m is to derivatives: the icon's arrow is so long, its tip moves (D7).
inline constexpr double icon_arrow_m = 0.05;

/// Takes the icon's rows as they are on the present surface: what it holds from now on, its motion none
/// (D13). Errors: resource_exhausted for more rows than the limit.
Status begin_icon(SculptIcon& icon, const SculptShape& shape, std::string_view field, const Limits& limits);

/// Sets shape.surface, and its icons' places (D14), from the rest shape and the icons that act. Errors with
/// `field`: failed_precondition when constraints contradict each other (the icons are named; D20) or nothing
/// holds the surface against a load; resource_exhausted for more rows than the limit.
Status settle(SculptShape& shape, std::string_view field, const ApplyContext& context,
              std::vector<std::string>& notes);

/// By place of a curve icon, how far it goes with a bend: 1 where it is held, 0 out of reach. `reference`:
/// where the places were.
std::vector<double> bend_weights(const SculptIcon& icon, const IconBend& bend,
                                 const geometry::BSplineSurface& rest,
                                 const std::vector<geometry::Vec3>& reference);

/// Places of an icon's curve or border on a surface, for viewers; empty for points.
std::vector<geometry::Vec3> icon_outline(const SculptIcon& icon, const geometry::BSplineSurface& surface);

/// The icon's direction on a surface: of tangents, second derivatives and twist the derivative's, else the
/// normal; unit, or zero where it vanishes.
geometry::Vec3 icon_direction(const SculptIcon& icon, const geometry::BSplineSurface& surface);

}  // namespace handloft::model
