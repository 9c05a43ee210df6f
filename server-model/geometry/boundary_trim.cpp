#include "server-model/geometry/boundary_trim.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

namespace handloft::geometry {
namespace {

constexpr double steepness = 10;  ///< Of eq. 8.

/// Segments a leaf of the tree: their boxes overlap too much for less to pay.
constexpr std::size_t leaf_segments = 8;

/// Cells a side with which the search for the deepest place begins, at least.
constexpr int first_cells = 8;

/// A curve whose deepest place is nearer than this fraction of its box to it encloses nothing but rounding.
constexpr double least_reach_fraction = 1e-7;

double segment_distance_squared(const Vec2& p, const Vec2& a, const Vec2& b, Vec2* foot) {
  const Vec2 along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  const Vec2 nearest = a + t * along;
  if (foot != nullptr) *foot = nearest;
  return (p - nearest).squaredNorm();
}

double box_distance_squared(const Vec2& p, const Vec2& lower, const Vec2& upper) {
  return (lower - p).cwiseMax(p - upper).cwiseMax(0.0).squaredNorm();
}

template <typename Point>
Status check_curve(std::span<const Point> curve, const BoundaryTrimOptions& options) {
  if (curve.size() > options.max_vertices) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} places, expected at most {}", curve.size(), options.max_vertices),
                      "curve");
  }
  if (curve.size() < 3) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} places, expected at least 3", curve.size()), "curve");
  }
  double length = 0;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    if (!curve[i].allFinite()) {
      return make_error(ErrorCode::invalid_argument, "found a number that is not finite",
                        fmt::format("curve[{}]", i));
    }
    if (i > 0) length += (curve[i] - curve[i - 1]).norm();
  }
  const double gap = (curve.front() - curve.back()).norm();
  if (!std::isfinite(length)) {
    return make_error(ErrorCode::invalid_argument, "found a curve of infinite length", "curve");
  }
  if (gap > options.max_gap_fraction * length) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found a gap of {:.4g} m in a curve of {:.4g} m, expected at most {:.4g} m: "
                    "draw the curve closed",
                    gap, length, options.max_gap_fraction * length),
        "curve");
  }
  return {};
}

}  // namespace

double boundary_opacity(double d, double d_max) {
  if (std::isnan(d)) return 0;
  return 1 / (1 + std::exp(-steepness * d / d_max));
}

double boundary_distance_of_opacity(double opacity) {
  assert(opacity > 0 && opacity < 1);
  return -std::log(1 / opacity - 1) / steepness;
}

Result<BoundaryTrim> BoundaryTrim::create(std::span<const Vec3> curve, const Frame& frame,
                                          const BoundaryTrimOptions& options) {
  if (Status status = check_curve(curve, options); !status.ok()) return status.error();
  std::vector<Vec2> plane;
  plane.reserve(curve.size());
  for (const Vec3& p : curve) plane.emplace_back(frame.to_local(p).head<2>());
  BoundaryTrimOptions closed = options;  // Its gap was measured in space.
  closed.max_gap_fraction = std::numeric_limits<double>::infinity();
  return create(plane, closed);
}

Result<BoundaryTrim> BoundaryTrim::create(std::span<const Vec2> curve, const BoundaryTrimOptions& options) {
  if (Status status = check_curve(curve, options); !status.ok()) return status.error();
  BoundaryTrim trim;
  trim.distance_ = options.distance;
  for (const Vec2& p : curve) {
    if (trim.polygon_.empty() || trim.polygon_.back() != p) trim.polygon_.push_back(p);
  }
  while (trim.polygon_.size() > 1 && trim.polygon_.back() == trim.polygon_.front()) trim.polygon_.pop_back();
  if (trim.polygon_.size() < 3) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} different places seen along the base plane's normal, expected at "
                                  "least 3",
                                  trim.polygon_.size()),
                      "curve");
  }
  trim.build_tree();
  if (Status status = trim.find_reach(options); !status.ok()) return status.error();
  return trim;
}

void BoundaryTrim::build_tree() {
  const std::size_t count = polygon_.size();
  leaves_ = std::bit_ceil((count + leaf_segments - 1) / leaf_segments);
  nodes_.assign(2 * leaves_, Node{Vec2::Constant(std::numeric_limits<double>::infinity()),
                                  Vec2::Constant(-std::numeric_limits<double>::infinity())});
  for (std::size_t i = 0; i < count; ++i) {
    Node& leaf = nodes_[leaves_ + i / leaf_segments];
    for (const Vec2& p : {polygon_[i], polygon_[(i + 1) % count]}) {
      leaf.lower = leaf.lower.cwiseMin(p);
      leaf.upper = leaf.upper.cwiseMax(p);
    }
  }
  for (std::size_t i = leaves_ - 1; i > 0; --i) {
    nodes_[i].lower = nodes_[2 * i].lower.cwiseMin(nodes_[2 * i + 1].lower);
    nodes_[i].upper = nodes_[2 * i].upper.cwiseMax(nodes_[2 * i + 1].upper);
  }
}

Box2 BoundaryTrim::box() const {
  return {0.5 * (nodes_[1].lower + nodes_[1].upper), 0.5 * (nodes_[1].upper - nodes_[1].lower)};
}

Box2 BoundaryTrim::visible_box() const {
  Box2 visible = box();
  visible.half_extent.array() -= boundary_distance_of_opacity(faintest_opacity) * reach_;
  return visible;
}

Vec2 BoundaryTrim::nearest(const Vec2& xy) const {
  const std::size_t count = polygon_.size();
  Vec2 found = polygon_.front();
  double best = std::numeric_limits<double>::infinity();
  // Depth first, the nearer child first: at most one node a level waits.
  std::array<std::size_t, 64> stack{};
  std::size_t depth = 0;
  stack[depth++] = 1;
  while (depth > 0) {
    const std::size_t node = stack[--depth];
    if (!(box_distance_squared(xy, nodes_[node].lower, nodes_[node].upper) < best)) continue;
    if (node < leaves_) {
      std::size_t near = 2 * node;
      std::size_t far = near + 1;
      if (box_distance_squared(xy, nodes_[far].lower, nodes_[far].upper) <
          box_distance_squared(xy, nodes_[near].lower, nodes_[near].upper)) {
        std::swap(near, far);
      }
      stack[depth++] = far;
      stack[depth++] = near;
      continue;
    }
    const std::size_t begin = (node - leaves_) * leaf_segments;
    const std::size_t end = std::min(begin + leaf_segments, count);
    for (std::size_t i = begin; i < end; ++i) {
      Vec2 foot = polygon_[i];
      double d2 = (xy - foot).squaredNorm();
      if (distance_ == BoundaryTrimOptions::Distance::segments) {
        d2 = segment_distance_squared(xy, polygon_[i], polygon_[(i + 1) % count], &foot);
      }
      if (d2 < best) {
        best = d2;
        found = foot;
      }
    }
  }
  return found;
}

bool BoundaryTrim::inside(const Vec2& xy) const {
  if (!xy.allFinite()) return false;
  // How many segments a ray towards +x crosses; a segment has its lower end and not its upper one, so that
  // vertices on the ray count once.
  const std::size_t count = polygon_.size();
  bool odd = false;
  std::array<std::size_t, 64> stack{};
  std::size_t depth = 0;
  stack[depth++] = 1;
  while (depth > 0) {
    const std::size_t node = stack[--depth];
    const Node& box = nodes_[node];
    if (!(box.lower.y() <= xy.y() && xy.y() <= box.upper.y() && xy.x() <= box.upper.x())) continue;
    if (node < leaves_) {
      stack[depth++] = 2 * node;
      stack[depth++] = 2 * node + 1;
      continue;
    }
    const std::size_t begin = (node - leaves_) * leaf_segments;
    const std::size_t end = std::min(begin + leaf_segments, count);
    for (std::size_t i = begin; i < end; ++i) {
      const Vec2& a = polygon_[i];
      const Vec2& b = polygon_[(i + 1) % count];
      if ((a.y() > xy.y()) == (b.y() > xy.y())) continue;
      const double x = a.x() + (xy.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      if (xy.x() < x) odd = !odd;
    }
  }
  return odd;
}

double BoundaryTrim::signed_distance(const Vec2& xy) const {
  const double distance = (xy - nearest(xy)).norm();
  return inside(xy) ? distance : -distance;
}

Status BoundaryTrim::find_reach(const BoundaryTrimOptions& options) {
  // The signed distance changes by no more than the way between two places: a square cell of half side h
  // whose centre has d holds nothing deeper than d + sqrt(2) h. The most promising cell is divided until none
  // can beat the best place found by more than the tolerance.
  struct Cell {
    double bound = 0;
    Vec2 centre = Vec2::Zero();
    double half = 0;
    bool operator<(const Cell& other) const { return bound < other.bound; }
  };
  const Box2 around = box();
  const double size = around.half_extent.maxCoeff();
  const auto nothing_enclosed = [] {
    return make_error(ErrorCode::invalid_argument,
                      "found nothing enclosed by the curve as seen along the base plane's normal", "curve");
  };
  if (!(size > 0)) return nothing_enclosed();
  reach_ = 0;
  std::priority_queue<Cell> cells;
  std::size_t made = 0;
  const auto add = [&](const Vec2& centre, double half) {
    const double d = signed_distance(centre);
    if (d > reach_) {
      reach_ = d;
      deepest_ = centre;
    }
    ++made;
    const double bound = d + std::numbers::sqrt2 * half;
    if (bound > reach_ * (1 + options.reach_tolerance)) cells.push({bound, centre, half});
  };
  const double half = std::max(around.half_extent.minCoeff(), size / first_cells) / first_cells;
  const Eigen::Vector2i divisions = (around.half_extent / half).array().ceil().cast<int>().cwiseMax(1);
  for (int i = 0; i < divisions.x(); ++i) {
    for (int j = 0; j < divisions.y(); ++j) {
      add(around.lower() + half * Vec2(2 * i + 1, 2 * j + 1), half);
    }
  }
  const double floor = least_reach_fraction * size;
  while (!cells.empty() && made < options.max_search_cells) {
    const Cell cell = cells.top();
    if (cell.bound <= std::max(reach_ * (1 + options.reach_tolerance), floor)) break;
    cells.pop();
    const double quarter = cell.half / 2;
    for (const double x : {-quarter, quarter}) {
      for (const double y : {-quarter, quarter}) add(cell.centre + Vec2(x, y), quarter);
    }
  }
  return reach_ > floor ? Status{} : Status{nothing_enclosed()};
}

}  // namespace handloft::geometry
