#include "server-model/geometry/box_tree.h"

#include <algorithm>

namespace handloft::geometry {

BoxTree BoxTree::over_sequence(std::size_t items) {
  BoxTree tree;
  if (items > 0) {
    tree.nodes_.reserve(2 * items - 1);
    tree.sequence(0, static_cast<std::uint32_t>(items));
  }
  return tree;
}

void BoxTree::sequence(std::uint32_t begin, std::uint32_t end) {
  const std::size_t here = nodes_.size();
  nodes_.emplace_back();
  if (end - begin == 1) {
    nodes_[here].item = begin;
    return;
  }
  const std::uint32_t middle = begin + (end - begin) / 2;
  sequence(begin, middle);
  nodes_[here].second = static_cast<std::uint32_t>(nodes_.size());
  sequence(middle, end);
}

BoxTree BoxTree::over_grid(int rows, int columns, std::span<const std::uint8_t> keep) {
  BoxTree tree;
  if (rows > 0 && columns > 0) {
    tree.nodes_.reserve(2 * keep.size());
    tree.grid(columns, keep, 0, rows, 0, columns);
  }
  return tree;
}

/// False, and nothing added, where no cell is kept.
bool BoxTree::grid(int columns, std::span<const std::uint8_t> keep, int i0, int i1, int j0, int j1) {
  if (i1 - i0 == 1 && j1 - j0 == 1) {
    const int item = i0 * columns + j0;
    if (keep[static_cast<std::size_t>(item)] == 0) return false;
    nodes_.emplace_back().item = static_cast<std::uint32_t>(item);
    return true;
  }
  const std::size_t here = nodes_.size();
  nodes_.emplace_back();
  const bool along_i = i1 - i0 >= j1 - j0;
  const int middle = along_i ? (i0 + i1) / 2 : (j0 + j1) / 2;
  const bool first =
      along_i ? grid(columns, keep, i0, middle, j0, j1) : grid(columns, keep, i0, i1, j0, middle);
  if (!first) nodes_.pop_back();  // The other half stands alone.
  const std::size_t second_at = nodes_.size();
  const bool second =
      along_i ? grid(columns, keep, middle, i1, j0, j1) : grid(columns, keep, i0, i1, middle, j1);
  if (first && second) {
    nodes_[here].second = static_cast<std::uint32_t>(second_at);
  } else if (first) {
    // The first half alone: it takes its parent's place.
    nodes_.erase(nodes_.begin() + static_cast<std::ptrdiff_t>(here));
    for (std::size_t n = here; n < nodes_.size(); ++n) {
      if (nodes_[n].second != 0) --nodes_[n].second;
    }
  }
  return first || second;
}

void BoxTree::refit(std::span<const Box3> boxes) {
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    Node& node = nodes_[n];
    if (node.second == 0) {
      node.box = boxes[node.item];
    } else {
      node.box = nodes_[n + 1].box;
      node.box.include(nodes_[node.second].box);
    }
  }
}

void BoxTree::refit(std::span<const Box3> boxes, std::span<const std::uint8_t> moved) {
  dirty_.assign(nodes_.size(), 0);
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    Node& node = nodes_[n];
    if (node.second == 0) {
      dirty_[n] = moved[node.item];
      if (dirty_[n] != 0) node.box = boxes[node.item];
    } else if (dirty_[n + 1] != 0 || dirty_[node.second] != 0) {
      dirty_[n] = 1;
      node.box = nodes_[n + 1].box;
      node.box.include(nodes_[node.second].box);
    }
  }
}

}  // namespace handloft::geometry
