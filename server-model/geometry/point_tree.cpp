#include "server-model/geometry/point_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace handloft::geometry {

namespace {
constexpr std::uint32_t slot_granularity = 8;
}

PointTree::PointTree(std::span<const Vec3> points, std::size_t leaf_size)
    : order_(points.size()), slots_(points.size()) {
  if (points.empty()) return;
  std::iota(order_.begin(), order_.end(), 0U);
  nodes_.reserve(4 * points.size() / std::max<std::size_t>(1, leaf_size) + 1);
  build(points, 0, static_cast<std::uint32_t>(points.size()), std::max<std::size_t>(1, leaf_size));
  points_.reserve(points.size());
  for (std::size_t slot = 0; slot < order_.size(); ++slot) {
    points_.push_back(points[order_[slot]]);
    slots_[order_[slot]] = static_cast<std::uint32_t>(slot);
  }
}

std::uint32_t PointTree::build(std::span<const Vec3> points, std::uint32_t begin, std::uint32_t end,
                               std::size_t leaf_size) {
  Vec3 low = points[order_[begin]], high = low;
  for (std::uint32_t i = begin + 1; i < end; ++i) {
    low = low.cwiseMin(points[order_[i]]);
    high = high.cwiseMax(points[order_[i]]);
  }
  const auto self = static_cast<std::uint32_t>(nodes_.size());
  Node node;
  node.centre = 0.5 * (low + high);
  node.half = 0.5 * (high - low);
  node.begin = begin;
  node.end = end;
  nodes_.push_back(node);
  int axis = 0;
  const double longest = node.half.maxCoeff(&axis);
  if (end - begin <= leaf_size || !(longest > 0)) return self;
  // Near the middle, at a whole number of registers' points where there are many.
  const std::uint32_t half = (end - begin) / 2;
  const std::uint32_t middle = begin + (half >= slot_granularity ? half - half % slot_granularity : half);
  // Ties by index, so that the tree depends on the points alone.
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t i, std::uint32_t j) {
                     const double a = points[i][axis], b = points[j][axis];
                     return a < b || (a == b && i < j);
                   });
  const std::uint32_t left = build(points, begin, middle, leaf_size);
  const std::uint32_t right = build(points, middle, end, leaf_size);
  nodes_[self].left = left;
  nodes_[self].right = right;
  return self;
}

void PointTree::near_segment(const Vec3& a, const Vec3& b, double reach,
                             const std::function<void(std::uint32_t)>& visit) const {
  if (nodes_.empty()) return;
  // The box round the capsule; the caller looks closer.
  const Vec3 low = a.cwiseMin(b).array() - reach, high = a.cwiseMax(b).array() + reach;
  std::vector<std::uint32_t> open{0};
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (((node.centre + node.half).array() < low.array()).any()) continue;
    if (((node.centre - node.half).array() > high.array()).any()) continue;
    if (node.leaf()) {
      for (std::uint32_t slot = node.begin; slot < node.end; ++slot) visit(slot);
    } else {
      open.push_back(node.right);
      open.push_back(node.left);
    }
  }
}

DistanceBounds squared_distance_bounds(const PointTree::Node& a, const PointTree::Node& b) {
  const Vec3 apart = (a.centre - b.centre).cwiseAbs();
  const Vec3 halves = a.half + b.half;
  return {(apart - halves).cwiseMax(0.0).squaredNorm(), (apart + halves).squaredNorm()};
}

double farthest_squared_distance(const PointTree& from, const PointTree& to,
                                 const std::function<bool(std::uint32_t)>& is_target,
                                 std::span<const std::uint32_t> targets_in) {
  if (from.size() == 0 || to.size() == 0 || targets_in[0] == 0) return 0;
  // Bounds are computed in another way than distances: a pair must not be missed for rounding.
  constexpr double safety = 1 + 1e-12;
  struct Pair {
    std::uint32_t a, b;
    double bound;
  };
  const auto bounded = [&](std::uint32_t a, std::uint32_t b) {
    return Pair{a, b, safety * squared_distance_bounds(from.nodes()[a], to.nodes()[b]).largest};
  };
  double best = 0;
  std::vector<Pair> open{bounded(0, 0)};
  while (!open.empty()) {
    const Pair pair = open.back();
    open.pop_back();
    if (pair.bound <= best) continue;
    const PointTree::Node& a = from.nodes()[pair.a];
    const PointTree::Node& b = to.nodes()[pair.b];
    if (a.leaf() && b.leaf()) {
      for (std::uint32_t t = b.begin; t < b.end; ++t) {
        if (!is_target(t)) continue;
        for (std::uint32_t s = a.begin; s < a.end; ++s) {
          best = std::max(best, squared_distance(from.points()[s], to.points()[t]));
        }
      }
      continue;
    }
    const bool split_b = a.leaf() || (!b.leaf() && b.half.squaredNorm() >= a.half.squaredNorm());
    std::array<Pair, 2> halves = split_b ? std::array{bounded(pair.a, b.left), bounded(pair.a, b.right)}
                                         : std::array{bounded(a.left, pair.b), bounded(a.right, pair.b)};
    if (halves[0].bound > halves[1].bound) std::swap(halves[0], halves[1]);
    for (const Pair& half : halves) {  // The farther one is looked at first.
      if (half.bound > best && targets_in[half.b] > 0) open.push_back(half);
    }
  }
  return best;
}

}  // namespace handloft::geometry
