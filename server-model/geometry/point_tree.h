#pragma once
// A tree over fixed points: boxes that halve at the median of their longest side, the points of a box
// contiguous in memory. It groups the points for the propagation of a push (propagation.h) and finds farthest
// pairs.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// (a - b)^2, always in this order of additions: who compares distances with a range must get the same bits.
inline double squared_distance(const Vec3& a, const Vec3& b) {
  const double dx = a.x() - b.x(), dy = a.y() - b.y(), dz = a.z() - b.z();
  return dx * dx + dy * dy + dz * dz;
}

class PointTree {
 public:
  struct Node {
    Vec3 centre = Vec3::Zero();
    Vec3 half = Vec3::Zero();           ///< Half extents of the tight box.
    std::uint32_t begin = 0, end = 0;   ///< Slots of its points.
    std::uint32_t left = 0, right = 0;  ///< Children; 0: a leaf.
    std::uint32_t size() const { return end - begin; }
    bool leaf() const { return left == 0; }
  };

  PointTree() = default;
  /// O(n log n). Precondition: finite coordinates, fewer than 2^32 points.
  PointTree(std::span<const Vec3> points, std::size_t leaf_size);

  std::size_t size() const { return points_.size(); }
  /// Node 0 is the root; empty without points.
  const std::vector<Node>& nodes() const { return nodes_; }
  /// By slot.
  const std::vector<Vec3>& points() const { return points_; }
  /// The index of a slot's point in the input, and back.
  std::uint32_t index_of(std::size_t slot) const { return order_[slot]; }
  std::uint32_t slot_of(std::size_t index) const { return slots_[index]; }

  /// Calls `visit(slot)` for the points within `reach` of the segment a..b, and perhaps some more.
  void near_segment(const Vec3& a, const Vec3& b, double reach,
                    const std::function<void(std::uint32_t)>& visit) const;

 private:
  std::uint32_t build(std::span<const Vec3> points, std::uint32_t begin, std::uint32_t end,
                      std::size_t leaf_size);

  std::vector<Node> nodes_;
  std::vector<Vec3> points_;
  std::vector<std::uint32_t> order_, slots_;
};

/// Squares of the least and largest distances between two boxes, rounding apart.
struct DistanceBounds {
  double least, largest;
};
DistanceBounds squared_distance_bounds(const PointTree::Node& a, const PointTree::Node& b);

/// The largest squared distance between a point of `from` and a point of `to` that `is_target(slot)` accepts,
/// exact (the same bits as by all pairs); 0 when there is no such pair. `targets_in(node)` says how many of a
/// node's points are accepted. Branch and bound: usually a few hundred pairs are looked at.
double farthest_squared_distance(const PointTree& from, const PointTree& to,
                                 const std::function<bool(std::uint32_t)>& is_target,
                                 std::span<const std::uint32_t> targets_in);

}  // namespace handloft::geometry
