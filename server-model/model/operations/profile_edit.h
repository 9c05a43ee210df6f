#pragma once
// What curves do to one fitted shape (A8, A9, A19, A20) and to its mirror images (A12): the part of
// ModifyProfile below the division of strokes.

#include <cstdint>
#include <map>
#include <memory>
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

/// A fitted shape made ready for strokes, which costs about as much as a stroke itself: its points factored
/// with its surface.
struct ProfileSolver {
  DualShape shape;                              ///< Refitted where its fit was stale (A9).
  std::vector<geometry::WeightedPoint> points;  ///< Its points in its frame.
  geometry::ProfileFitter fitter;
};

/// Solvers kept while a profile is drawn: every frame evaluates the strokes anew on the same base document,
/// and with these costs the strokes and a walk over the points, not another factorisation of them. By the
/// identity of the shapes, so a shape that changed beneath the gesture is made ready again, and every result
/// is the same to the bit. Not thread-safe.
class ProfileSolvers {
 public:
  /// Errors: rank_deficient when a stale fit's points carry no surface any more.
  Result<std::shared_ptr<const ProfileSolver>> of(const DualPtr& shape);

 private:
  struct Kept {
    DualPtr shape;  ///< Kept alive, or another one might be made where it was.
    std::shared_ptr<const ProfileSolver> solver;
  };
  std::map<std::string, Kept, std::less<>> kept_;  ///< By id.
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
                    std::string_view field, const Limits& limits, ProfileSolvers& solvers,
                    std::vector<std::string>& notes);

}  // namespace handloft::model
