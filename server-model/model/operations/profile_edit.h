#pragma once
// What curves do to one fitted shape (A8, A9, A19, A20) and to its mirror images (A12): the part of
// ModifyProfile below the division of strokes.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/profile_modification.h"
#include "server-model/model/document.h"

namespace handloft::model {

enum class KeptCurves : std::uint8_t {
  none,
  as_points,  ///< A tenth as many points as the shape has join it, along the curves on the surface (A20).
};

struct ProfileEdit {
  std::vector<geometry::Curve> strokes;  ///< As drawn, world; each of at least one point.
  KeptCurves keep = KeptCurves::none;
  std::int64_t time_ns = 0;  ///< Of the kept points.
};

/// Changes a fitted shape so that it follows the strokes; its points keep their residuals. A stale fit is
/// refitted first in its frozen frame (A9).
/// Same-shape symmetry (A12): the mirrored strokes act as well (with as many temporary points in all), and
/// linked images are placed exactly at the mirror images of their originals.
/// Where residuals then are not the former ones (a base plane that is not symmetric, points besides that have
/// no image, points that hardly determine the surface) the shape is fitted again: in every case the surface
/// is the optimum of its points, and the residuals are theirs. A linked, fitted partner becomes the mirror
/// image; one that has points of its own is edited by the mirrored strokes, its linked points stay mirror
/// images, and it is fitted to both. Of one without a surface the linked points follow. Cost: O(points).
/// Errors, with `field`: rank_deficient when a stale fit's points carry no surface any more; invalid_argument
/// when points would leave the workspace; resource_exhausted when there is no room for kept points.
Status edit_profile(Document& document, std::string_view entity, const ProfileEdit& edit,
                    std::string_view field, const Limits& limits, std::vector<std::string>& notes);

}  // namespace handloft::model
