#pragma once
// Puts large clouds into cells off the frame loop (newest_worker.h).

#include <cstddef>
#include <memory>

#include "client-hmd/render/newest_worker.h"
#include "client-hmd/render/point_cells.h"

namespace handloft::client {

/// The first `count` points of a set.
struct LeadingPoints {
  std::shared_ptr<const PointSet> set;
  std::size_t count = 0;
  bool operator==(const LeadingPoints&) const = default;
};

struct SortedPoints {
  LeadingPoints of;
  PointCells cells;
};

class PointSorter : public NewestWorker<LeadingPoints, SortedPoints> {
 public:
  PointSorter();
};

}  // namespace handloft::client
