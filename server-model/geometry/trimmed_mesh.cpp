// Triangles of trimmed faces (bspline_tessellate.h): the loops' places and the corners of the surface's cells
// inside, in one constrained Delaunay triangulation.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server-model/geometry/bspline_refine.h"
#include "server-model/geometry/constrained_delaunay.h"
#include "server-model/geometry/surface_cells.h"

namespace handloft::geometry {

namespace {

/// Corners of cells nearer to a loop than this part of the cell are left out: their triangles would be thin.
constexpr double clearance = 0.3;
/// Edges' bounds are held to this part of the tolerance: a triangle's middle may be farther than its edges'
/// by a third.
constexpr double edge_part = 0.75;
constexpr int refinement_rounds = 24;

/// Segments in a grid of buckets, for "is one nearer than ...".
class NearSegments {
 public:
  NearSegments(const std::vector<TrimLoop>& loops, const Vec2& lower, const Vec2& extent)
      : lower_(lower), extent_(extent), buckets_(side * side) {
    for (const TrimLoop& loop : loops) {
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const Vec2 a = unit(loop[k]), b = unit(loop[(k + 1) % loop.size()]);
        each_bucket(a.cwiseMin(b), a.cwiseMax(b), [&](std::size_t n) { buckets_[n].push_back({a, b}); });
      }
    }
  }
  /// Distances as parts of a box's sides.
  bool any_within(const Vec2& place, const Vec2& box) const {
    const Vec2 p = unit(place), reach = box.cwiseQuotient(extent_);
    bool found = false;
    each_bucket(p - reach, p + reach, [&](std::size_t n) {
      for (const auto& [from, to] : buckets_[n]) {
        if (found) return;
        const Vec2 a = (from - p).cwiseQuotient(reach), b = (to - p).cwiseQuotient(reach), d = b - a;
        const double length = d.squaredNorm();
        const double t = length > 0 ? std::clamp(-a.dot(d) / length, 0.0, 1.0) : 0;
        found = (a + t * d).squaredNorm() < 1;
      }
    });
    return found;
  }

 private:
  static constexpr std::size_t side = 64;
  Vec2 unit(const Vec2& uv) const { return (uv - lower_).cwiseQuotient(extent_); }
  template <typename Visit>
  static void each_bucket(const Vec2& low, const Vec2& high, const Visit& visit) {
    const auto bucket = [](double x) {
      return static_cast<std::size_t>(std::clamp(x * side, 0.0, static_cast<double>(side - 1)));
    };
    for (std::size_t i = bucket(low.x()); i <= bucket(high.x()); ++i) {
      for (std::size_t j = bucket(low.y()); j <= bucket(high.y()); ++j) visit(i * side + j);
    }
  }
  Vec2 lower_, extent_;
  std::vector<std::vector<std::pair<Vec2, Vec2>>> buckets_;
};

/// Where a segment crosses a crease, as a part of it; -1 when it crosses none.
double crease_crossing(const SpanBends& bends, const Vec2& a, const Vec2& b) {
  constexpr double end = 1e-9;
  for (int axis = 0; axis < 2; ++axis) {
    for (const double line : axis == 0 ? bends.creases_u() : bends.creases_v()) {
      if ((a[axis] - line) * (b[axis] - line) >= 0) continue;
      const double t = (line - a[axis]) / (b[axis] - a[axis]);
      if (t > end && t < 1 - end) return t;
    }
  }
  return -1;
}

/// Where to cut a segment that does not keep to the tolerance, as a part of it; -1 when it does.
double cut_of(const SpanBends& bends, const Vec2& a, const Vec2& b, double tolerance) {
  if (const double crossing = crease_crossing(bends, a, b); crossing > 0) return crossing;
  return bends.chord_bound(a.cwiseMin(b), a.cwiseMax(b)) > tolerance ? 0.5 : -1;
}

Vec2 part_of(const Vec2& a, const Vec2& b, double t) {
  return t == 0.5 ? Vec2((a + b) / 2) : Vec2(a + t * (b - a));  // The middle is one from both ends.
}

TrimLoop refine(const SpanBends& bends, const TrimLoop& loop, double tolerance, std::size_t most) {
  constexpr int least_halvings = 40;
  TrimLoop result;
  std::vector<std::pair<Vec2, int>> ends;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    Vec2 at = loop[k];
    ends.assign(1, {loop[(k + 1) % loop.size()], 0});
    while (!ends.empty()) {
      const auto [end, depth] = ends.back();
      const double cut = cut_of(bends, at, end, tolerance);
      if (cut < 0 || depth >= least_halvings || result.size() + ends.size() >= most) {
        result.push_back(at);
        at = end;
        ends.pop_back();
      } else {
        ends.back().second = depth + 1;
        ends.emplace_back(part_of(at, end, cut), depth + 1);
      }
    }
  }
  return result;
}

Error crossing_loops() {
  return make_error(ErrorCode::invalid_argument,
                    "found loops that cross or touch along an edge, expected none", "loops");
}

}  // namespace

Result<TrimLoop> refined_loop(const BSplineSurface& surface, const TrimLoop& loop, double chord_tolerance_m,
                              std::size_t max_places) {
  SurfaceMeshOptions options;
  options.chord_tolerance_m = chord_tolerance_m;
  if (const Status status = check(surface); !status.ok()) return status.error();
  if (const Status status = detail::check_options(options); !status.ok()) return status.error();
  Result<TrimRegion> region = TrimRegion::create({loop}, {surface.u.lower(), surface.v.lower()},
                                                 {surface.u.upper(), surface.v.upper()});
  if (!region.ok()) return region.error();
  return refine(SpanBends(surface), region->loops().front(), chord_tolerance_m, max_places);
}

Result<TriangleMesh> tessellate(const BSplineSurface& surface, std::vector<TrimLoop> loops,
                                const SurfaceMeshOptions& options, std::vector<Vec2>* parameters) {
  if (const Status status = check(surface); !status.ok()) return status.error();
  if (const Status status = detail::check_options(options); !status.ok()) return status.error();
  const Vec2 lower(surface.u.lower(), surface.v.lower()), upper(surface.u.upper(), surface.v.upper());
  Result<TrimRegion> given = TrimRegion::create(std::move(loops), lower, upper);
  if (!given.ok()) return given.error();
  if (given->empty()) {
    return make_error(ErrorCode::failed_precondition, "found no loops, expected one or more", "loops");
  }
  const SpanBends bends(surface);
  const detail::SurfaceJoints joints(surface);
  std::vector<TrimLoop> rims = given->loops();
  if (options.loop_places == SurfaceMeshOptions::LoopPlaces::refined) {
    for (TrimLoop& rim : rims) {
      rim = refine(bends, rim, edge_part * options.chord_tolerance_m, options.max_vertices / 2);
    }
  }

  // Lengths in space are what angles are measured in.
  const auto speed = [](double length, double extent) { return length > 0 ? length / extent : 1 / extent; };
  const Vec2 scale(speed(mean_row_length(surface, Direction::u), upper.x() - lower.x()),
                   speed(mean_row_length(surface, Direction::v), upper.y() - lower.y()));
  ConstrainedDelaunay mesh(lower, upper, scale);
  std::vector<Vec2> places;
  const auto insert = [&](const Vec2& uv) {
    const std::uint32_t n = mesh.insert(uv);
    if (n != ConstrainedDelaunay::none && n == places.size()) places.push_back(uv);
    return n;
  };
  std::vector<std::vector<std::uint32_t>> rim_numbers;
  for (const TrimLoop& rim : rims) {
    std::vector<std::uint32_t>& numbers = rim_numbers.emplace_back();
    for (const Vec2& uv : rim) numbers.push_back(insert(uv));
  }
  for (const std::vector<std::uint32_t>& numbers : rim_numbers) {
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const std::uint32_t from = numbers[k], to = numbers[(k + 1) % numbers.size()];
      if (from != to && !mesh.constrain(from, to)) return crossing_loops();
    }
  }
  const NearSegments near(rims, lower, upper - lower);
  for (const detail::SurfaceCell& cell : detail::surface_cells(surface, bends, joints, options)) {
    const Vec2 reach = clearance * (cell.upper - cell.lower);
    for (const Vec2& corner : {cell.lower, cell.upper, Vec2(cell.lower.x(), cell.upper.y()),
                               Vec2(cell.upper.x(), cell.lower.y())}) {
      if (given->inside(corner) && !near.any_within(corner, reach)) insert(corner);
    }
  }
  // Edges that are too long for how the surface bends, or that cross a crease.
  for (int round = 0; round < refinement_rounds && places.size() < options.max_vertices; ++round) {
    const std::size_t before = places.size();
    for (const auto& [a, b] : mesh.free_edges()) {
      const double cut = cut_of(bends, places[a], places[b], edge_part * options.chord_tolerance_m);
      if (cut > 0 && places.size() < options.max_vertices) insert(part_of(places[a], places[b], cut));
    }
    if (places.size() == before) break;
  }

  const std::vector<std::array<std::uint32_t, 3>> triangles = mesh.inside();
  if (triangles.empty()) {
    return make_error(ErrorCode::failed_precondition, "the loops enclose nothing", "loops");
  }
  detail::SurfaceVertices vertices(surface, joints);
  for (const auto& [a, b, c] : triangles) {
    const std::uint32_t first = vertices.at(places[a]), second = vertices.at(places[b]);
    vertices.triangle(first, second, vertices.at(places[c]));
  }
  if (parameters != nullptr) *parameters = vertices.parameters();
  return std::move(vertices).take();
}

}  // namespace handloft::geometry
