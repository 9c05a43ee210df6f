#include "server-model/model/operations/point_region.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server-model/model/validate.h"

namespace handloft::model {
namespace {

template <typename Inside>
std::vector<std::uint32_t> select(const DualShape& shape, const Inside& inside) {
  std::vector<std::uint32_t> indices;
  std::uint32_t index = 0;
  for (std::size_t c = 0; c < shape.points.chunk_count(); ++c) {
    for (const DualPoint& point : shape.points.chunk(c)) {
      if (inside(point)) indices.push_back(index);
      ++index;
    }
  }
  return indices;
}

Result<std::vector<std::uint32_t>> in_sphere(const handloft::v1::PointRegion::Sphere& sphere,
                                             const DualShape& shape, const std::string& field,
                                             const Limits& limits) {
  auto centre = read_vector(sphere.centre(), field + ".centre", limits);
  if (!centre) return centre.error();
  const double radius = sphere.radius_m();
  if (!(radius >= 0 && radius <= 4 * limits.max_coordinate_m)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected metres, 0 or more", radius), field + ".radius_m");
  }
  return select(shape, [&](const DualPoint& p) { return (p.position() - *centre).norm() <= radius; });
}

Result<std::vector<std::uint32_t>> in_box(const handloft::v1::PointRegion::Box& box, const DualShape& shape,
                                          const std::string& field, const Limits& limits) {
  auto minimum = read_vector(box.minimum(), field + ".minimum", limits);
  if (!minimum) return minimum.error();
  auto maximum = read_vector(box.maximum(), field + ".maximum", limits);
  if (!maximum) return maximum.error();
  for (int axis = 0; axis < 3; ++axis) {
    if ((*minimum)[axis] > (*maximum)[axis]) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {} above the maximum {}", (*minimum)[axis], (*maximum)[axis]),
                        fmt::format("{}.minimum.{}", field, "xyz"[axis]));
    }
  }
  return select(shape, [&](const DualPoint& point) {
    const geometry::Vec3 p = point.position();
    return (p.array() >= minimum->array()).all() && (p.array() <= maximum->array()).all();
  });
}

template <typename Numbers>
std::vector<std::uint32_t> sorted_once(const Numbers& numbers) {
  std::vector<std::uint32_t> sorted(numbers.begin(), numbers.end());
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return sorted;
}

Result<std::vector<std::uint32_t>> of_strokes(const handloft::v1::PointRegion::Strokes& strokes,
                                              const DualShape& shape, const std::string& field) {
  const std::vector<std::uint32_t> numbers = sorted_once(strokes.numbers());
  for (const std::uint32_t number : numbers) {
    if (number == 0 || number > shape.stroke_count) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected strokes 1..{}", number, shape.stroke_count),
                        field + ".numbers");
    }
  }
  return select(shape, [&](const DualPoint& point) {
    return std::binary_search(numbers.begin(), numbers.end(), point.stroke);
  });
}

}  // namespace

Result<std::vector<std::uint32_t>> points_in(const handloft::v1::PointRegion& region, const DualShape& shape,
                                             const std::string& field, const Limits& limits) {
  switch (region.region_case()) {
    case handloft::v1::PointRegion::kSphere:
      return in_sphere(region.sphere(), shape, field + ".sphere", limits);
    case handloft::v1::PointRegion::kBox:
      return in_box(region.box(), shape, field + ".box", limits);
    case handloft::v1::PointRegion::kStrokes:
      return of_strokes(region.strokes(), shape, field + ".strokes");
    case handloft::v1::PointRegion::kIndices: {
      std::vector<std::uint32_t> indices = sorted_once(region.indices().indices());
      if (!indices.empty() && indices.back() >= shape.points.size()) {
        return make_error(ErrorCode::invalid_argument,
                          fmt::format("found {}, expected less than {}, the number of points", indices.back(),
                                      shape.points.size()),
                          field + ".indices.indices");
      }
      return indices;
    }
    case handloft::v1::PointRegion::REGION_NOT_SET:
      break;
  }
  return make_error(ErrorCode::invalid_argument, "found no region, expected sphere, box, strokes or indices",
                    field);
}

}  // namespace handloft::model
