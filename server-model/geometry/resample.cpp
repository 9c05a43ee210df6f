#include "server-model/geometry/resample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace handloft::geometry {
namespace {

/// Arc length at every point, rising from 0.
Result<std::vector<double>> arc_lengths(std::span<const Vec3> points) {
  if (points.empty()) {
    return make_error(ErrorCode::invalid_argument, "found no points, expected a curve", "points");
  }
  std::vector<double> lengths;
  lengths.reserve(points.size());
  double length = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) {
      return make_error(ErrorCode::invalid_argument, "found a coordinate that is not finite, expected metres",
                        fmt::format("points[{}]", i));
    }
    if (i > 0) length += (points[i] - points[i - 1]).norm();
    lengths.push_back(length);
  }
  if (!std::isfinite(length)) {
    return make_error(ErrorCode::invalid_argument, "the coordinates are too large to compute with", "points");
  }
  return lengths;
}

struct Place {
  Vec3 point;
  std::size_t before = 0;  ///< The last given point that is not beyond the place.
};

/// Walks along a curve; the places asked for must not go back.
class Walker {
 public:
  Walker(std::span<const Vec3> points, std::span<const double> lengths)
      : points_(points), lengths_(lengths) {}

  Place at(double s) {
    const std::size_t last = points_.size() - 1;
    while (i_ < last && lengths_[i_ + 1] <= s) ++i_;
    if (i_ == last) return {points_[last], last};
    const double part = std::clamp((s - lengths_[i_]) / (lengths_[i_ + 1] - lengths_[i_]), 0.0, 1.0);
    return {points_[i_] + part * (points_[i_ + 1] - points_[i_]), i_};
  }

 private:
  std::span<const Vec3> points_;
  std::span<const double> lengths_;
  std::size_t i_ = 0;
};

}  // namespace

double curve_length(std::span<const Vec3> points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

Result<std::vector<Vec3>> resample_evenly(std::span<const Vec3> points, std::size_t count) {
  auto lengths = arc_lengths(points);
  if (!lengths.ok()) return lengths.error();
  const double total = lengths->back();
  Walker walker(points, *lengths);
  std::vector<Vec3> result;
  result.reserve(count);
  if (count == 1) {
    result.push_back(walker.at(0.5 * total).point);
    return result;
  }
  for (std::size_t k = 0; k < count; ++k) {
    const double fraction = static_cast<double>(k) / static_cast<double>(count - 1);
    result.push_back(k + 1 == count ? points.back() : walker.at(fraction * total).point);
  }
  return result;
}

Result<std::vector<std::vector<Vec3>>> split_curve(std::span<const Vec3> points,
                                                   std::span<const double> fractions) {
  auto lengths = arc_lengths(points);
  if (!lengths.ok()) return lengths.error();
  double former = 0;
  for (std::size_t k = 0; k < fractions.size(); ++k) {
    if (!(fractions[k] >= former && fractions[k] <= 1)) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found {}, expected {}..1: fractions of the length, rising", fractions[k], former),
          fmt::format("fractions[{}]", k));
    }
    former = fractions[k];
  }
  std::vector<std::vector<Vec3>> parts(1);
  parts.reserve(fractions.size() + 1);
  Walker walker(points, *lengths);
  std::size_t next = 0;  // The first given point that no part has yet.
  for (const double fraction : fractions) {
    const Place cut = walker.at(fraction * lengths->back());
    for (; next <= cut.before; ++next) parts.back().push_back(points[next]);
    // A cut at a given point is that point: it isn't doubled in the part before.
    if (parts.back().empty() || parts.back().back() != cut.point) parts.back().push_back(cut.point);
    parts.push_back({cut.point});
  }
  for (; next < points.size(); ++next) parts.back().push_back(points[next]);
  return parts;
}

}  // namespace handloft::geometry
