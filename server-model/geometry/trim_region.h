#pragma once
// A region of a surface's parameters bounded by loops (a trimmed face's outer bound and holes), by the
// even-odd rule: which places lie inside, and where the loops cross the spans of the surface.

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// A closed polyline in (u, v); the last place is joined to the first.
using TrimLoop = std::vector<Vec2>;

class TrimRegion {
 public:
  static constexpr std::size_t max_vertices = 1U << 20;  ///< Of all loops together.

  /// Without loops: nothing is trimmed away. Places within 1e-9 of the domain's size outside of it are
  /// brought onto its edge. Errors, naming the field ("loops[1][7]"): invalid_argument for numbers that are
  /// not finite or outside the domain, loops of fewer than three places; resource_exhausted for too many.
  static Result<TrimRegion> create(std::vector<TrimLoop> loops, const Vec2& lower, const Vec2& upper);

  bool empty() const { return loops_.empty(); }
  const std::vector<TrimLoop>& loops() const { return loops_; }
  /// True for everything when there are no loops. On a loop: either. O(segments at that v).
  bool inside(const Vec2& uv) const;

  /// A part of a loop that lies in one cell of a grid.
  struct Part {
    Vec2 from = Vec2::Zero(), to = Vec2::Zero();
    int i = 0, j = 0;  ///< The cell: us[i]..us[i + 1], vs[j]..vs[j + 1].
  };
  /// All loops, cut where they cross the lines of the grid, which covers the domain; in order.
  std::vector<Part> parts(std::span<const double> us, std::span<const double> vs) const;

 private:
  struct Segment {
    Vec2 from, to;
  };
  std::size_t band_of(double v) const;

  std::vector<TrimLoop> loops_;
  Vec2 lower_ = Vec2::Zero(), upper_ = Vec2::Zero();
  std::vector<Segment> segments_;
  std::vector<std::vector<std::uint32_t>> bands_;  ///< Segments by strips of v.
};

}  // namespace handloft::geometry
