#pragma once
// The closest point of a B-spline surface to a place, and the first hit of a ray: branch and bound over the
// Bezier pieces with Newton's method where a piece's distance is sure to have one minimum, so that no seed is
// trusted. Elsewhere (places beyond the radius of curvature, poles) the squared distance itself is taken as a
// Bernstein polynomial and halved until its coefficients show the least value (after Johnson and Cohen, "A
// framework for efficient minimum distance computations", 1998; Chen and others, "Computing the minimum
// distance between a point and a NURBS curve", 2008). Double precision throughout.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/propagation.h"
#include "server-model/geometry/trim_region.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

namespace detail {
struct ProjectorData;
}

struct ClosestOnSurface {
  Vec2 uv = Vec2::Zero();
  Vec3 place = Vec3::Zero();
  double distance_m = 0;
  /// The truth is nearer by no more than this: 0 but where so many places are equally near that the search
  /// gave up (a sphere's centre that is none to the last digit).
  double gap_m = 0;
};

struct SurfaceHit {
  Vec2 uv = Vec2::Zero();
  Vec3 place = Vec3::Zero();
  double distance_m = 0;  ///< From the ray's origin.
};

struct ProjectorOptions {
  /// A question halves no more boxes than this before it says how sure it is: some 10 ms.
  std::size_t max_boxes = 20'000;
};

/// A surface prepared for many questions; any number of threads may ask at once. To make it takes some 1 us a
/// span.
class SurfaceProjector {
 public:
  /// Loops restrict every answer to a region of the parameters, its edge included (TrimRegion). Errors:
  /// invalid_argument as check(surface) and TrimRegion::create say, failed_precondition for loops that
  /// enclose nothing.
  static Result<SurfaceProjector> create(const BSplineSurface& surface, std::vector<TrimLoop> loops = {},
                                         const ProjectorOptions& options = {});
  SurfaceProjector(SurfaceProjector&&) noexcept;
  SurfaceProjector& operator=(SurfaceProjector&&) noexcept;
  ~SurfaceProjector();

  /// The nearest of all places, to 1e-12 of the surface's size; one of them where several are equally near.
  /// Errors: invalid_argument for a place that is not finite or farther than 1e100.
  Result<ClosestOnSurface> closest(const Vec3& place) const;
  /// The same, sooner when `seed` is close to the answer (tracking). Any seed is allowed.
  Result<ClosestOnSurface> closest(const Vec3& place, const Vec2& seed) const;
  /// One answer a place. Errors: as above ("places[3]"), and lengths that differ; then no answer counts.
  Status closest(std::span<const Vec3> places, std::span<ClosestOnSurface> answers,
                 const ParallelFor& parallel = run_in_turn) const;

  /// The first place on {origin + t direction, t >= 0}, grazing ones within rounding included; nothing when
  /// there is none. `direction` needs no unit length. Errors: invalid_argument for numbers that are not
  /// finite (or beyond 1e100) and a direction without length.
  Result<std::optional<SurfaceHit>> ray(const Vec3& origin, const Vec3& direction) const;
  Status rays(std::span<const Vec3> origins, std::span<const Vec3> directions,
              std::span<std::optional<SurfaceHit>> hits, const ParallelFor& parallel = run_in_turn) const;

  /// Other control points for the same knots, weights and loops: what depends on those that changed is made
  /// again. Errors: invalid_argument for another count or numbers that are not finite; nothing is changed
  /// then.
  Status refit(std::span<const Vec3> control);

  std::size_t piece_count() const;

 private:
  explicit SurfaceProjector(std::unique_ptr<detail::ProjectorData> data);
  std::unique_ptr<detail::ProjectorData> data_;
};

}  // namespace handloft::geometry
