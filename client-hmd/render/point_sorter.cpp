#include "client-hmd/render/point_sorter.h"

#include <optional>
#include <utility>

namespace handloft::client {
namespace {

std::shared_ptr<const SortedPoints> sorted(const LeadingPoints& points) {
  auto result = std::make_shared<SortedPoints>();
  result->of = points;
  if (std::optional<PointCells> cells = into_cells(*points.set, points.count)) {
    result->cells = std::move(*cells);
  }
  return result;
}

}  // namespace

PointSorter::PointSorter() : NewestWorker(sorted) {}

}  // namespace handloft::client
