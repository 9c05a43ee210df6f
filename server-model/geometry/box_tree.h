#pragma once
// A tree of axis-aligned boxes over items that keep their places in it while they move: built once by the
// items' order, its boxes made again from the leaves up when some items have moved. For searches that bring
// their own order and pruning.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "server-model/geometry/types.h"

namespace handloft::geometry {

struct Box3 {
  Vec3 lower = Vec3::Constant(1e300), upper = Vec3::Constant(-1e300);  ///< Empty.

  void include(const Vec3& p) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  void include(const Box3& box) {
    lower = lower.cwiseMin(box.lower);
    upper = upper.cwiseMax(box.upper);
  }
  Vec3 centre() const { return (lower + upper) / 2; }
  /// 0 inside.
  double squared_distance(const Vec3& p) const {
    const double x = std::max({lower.x() - p.x(), 0.0, p.x() - upper.x()});
    const double y = std::max({lower.y() - p.y(), 0.0, p.y() - upper.y()});
    const double z = std::max({lower.z() - p.z(), 0.0, p.z() - upper.z()});
    return x * x + y * y + z * z;
  }
};

class BoxTree {
 public:
  struct Node {
    Box3 box;
    std::uint32_t second = 0;  ///< The second child; the first follows its parent. 0: a leaf.
    std::uint32_t item = 0;    ///< Of a leaf.
  };

  BoxTree() = default;
  /// Over all items, halved by their order: who follows whom should be near.
  static BoxTree over_sequence(std::size_t items);
  /// Over the cells (i, j) of a grid, item i * columns + j, for which `keep` holds 1; halved along the longer
  /// side.
  static BoxTree over_grid(int rows, int columns, std::span<const std::uint8_t> keep);

  /// Before the first refit all boxes are empty.
  const std::vector<Node>& nodes() const { return nodes_; }
  bool empty() const { return nodes_.empty(); }

  /// All boxes again, from the items' boxes.
  void refit(std::span<const Box3> boxes);
  /// Those above items for which `moved` holds 1.
  void refit(std::span<const Box3> boxes, std::span<const std::uint8_t> moved);

 private:
  void sequence(std::uint32_t begin, std::uint32_t end);
  bool grid(int columns, std::span<const std::uint8_t> keep, int i0, int i1, int j0, int j1);

  std::vector<Node> nodes_;  ///< Parents before children.
  std::vector<std::uint8_t> dirty_;
};

}  // namespace handloft::geometry
