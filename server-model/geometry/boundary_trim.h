#pragma once
// The visible part of a surface within a drawn curve (A24, eq. 8): T = 1 / (1 + exp(-10 d / d_max)), where d
// is the signed distance to the closed curve in the base plane, positive inside by the even-odd rule (so that
// both loops of an eight are inside, and what a curl goes round twice is outside), and d_max the largest
// inside. T = 1/2 on the curve, 0.99995 at d_max, 1/255 at d = -0.554 d_max.
//
// The paper takes d_max over the mesh's vertices, so that opacities would change with the mesh. Here it is
// the radius of the largest circle inside the curve, found by branch and bound on the Lipschitz bound of d;
// the paper's distance to samples is there for comparison. A tree over the curve's segments answers d in
// O(log m).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// T of eq. 8, in 0..1; 0 for NaN. Precondition: d_max > 0.
double boundary_opacity(double d, double d_max);
/// d / d_max at which T = opacity: -ln(1 / opacity - 1) / 10. Precondition: 0 < opacity < 1.
double boundary_distance_of_opacity(double opacity);

struct BoundaryTrimOptions {
  enum class Distance : std::uint8_t {
    segments,  ///< To the curve itself.
    samples,   ///< To its vertices, as eq. 8 is printed: a bumpy edge where they are sparse.
  };
  Distance distance = Distance::segments;
  /// A24: an opening of more than this part of the curve's length is no slip of the hand.
  double max_gap_fraction = 0.1;
  /// Of d_max, as a fraction of it: shifts an opacity by at most 2.3e-5, a hundredth of what eight bits show.
  double reach_tolerance = 1e-4;
  std::size_t max_vertices = 200'000;
  /// Bounds the search for d_max in long strips of even width, where each place is as good as the next.
  std::size_t max_search_cells = 100'000;
};

/// The faintest opacity that eight bits can show: meshes end where there is no more.
inline constexpr double faintest_opacity = 1.0 / 255;

/// In the x-y plane of a surface's frame.
class BoundaryTrim {
 public:
  /// From a curve in the world: its gap is measured in space, then it is projected along the frame's normal.
  /// Errors: invalid_argument (numbers not finite, fewer than three places, a gap above the limit - with both
  /// figures -, nothing enclosed as seen along the normal), resource_exhausted (too many vertices).
  static Result<BoundaryTrim> create(std::span<const Vec3> curve, const Frame& frame,
                                     const BoundaryTrimOptions& options = {});
  /// From a curve in the plane.
  static Result<BoundaryTrim> create(std::span<const Vec2> curve, const BoundaryTrimOptions& options = {});

  /// The closed polygon without repeated vertices; the last is joined to the first.
  const std::vector<Vec2>& polygon() const { return polygon_; }
  /// Metres, positive inside.
  double signed_distance(const Vec2& xy) const;
  bool inside(const Vec2& xy) const;
  double opacity(const Vec2& xy) const { return boundary_opacity(signed_distance(xy), reach_); }

  /// d_max, metres, > 0, and where it is.
  double reach() const { return reach_; }
  const Vec2& deepest() const { return deepest_; }

  /// The curve's box.
  Box2 box() const;
  /// A box outside of which all opacities are below 1/255.
  Box2 visible_box() const;
  /// The place on the curve that is nearest to `xy`.
  Vec2 nearest(const Vec2& xy) const;

 private:
  struct Node {
    Vec2 lower = Vec2::Zero(), upper = Vec2::Zero();
  };
  BoundaryTrim() = default;
  void build_tree();
  Status find_reach(const BoundaryTrimOptions& options);

  std::vector<Vec2> polygon_;
  BoundaryTrimOptions::Distance distance_ = BoundaryTrimOptions::Distance::segments;
  std::vector<Node> nodes_;  ///< A complete binary tree over runs of segments in the order of the curve.
  std::size_t leaves_ = 0;   ///< A power of two; leaf i is nodes_[leaves_ + i].
  double reach_ = 0;
  Vec2 deepest_ = Vec2::Zero();
};

}  // namespace handloft::geometry
