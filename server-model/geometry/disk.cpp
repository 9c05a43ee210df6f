#include "server-model/geometry/disk.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace handloft::geometry {

namespace {
Vec3 centroid(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}
}  // namespace

Vec3 newell_area(std::span<const Vec3> polygon) {
  Vec3 twice_area = Vec3::Zero();
  if (polygon.size() < 3) return twice_area;
  const Vec3 centre = centroid(polygon);
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3& next = polygon[(i + 1) % polygon.size()];
    twice_area += (polygon[i] - centre).cross(next - centre);
  }
  return 0.5 * twice_area;
}

ModificationDisk::ModificationDisk(const DiskOptions& options, const std::optional<Vec3>& hint)
    : options_(options) {
  if (hint && hint->allFinite() && hint->stableNorm() > 0) normal_ = hint->stableNormalized();
}

std::optional<DiskPose> ModificationDisk::update(std::span<const Vec3> fingertips, double pressure) {
  if (fingertips.empty()) return std::nullopt;
  if (!std::all_of(fingertips.begin(), fingertips.end(), [](const Vec3& p) { return p.allFinite(); })) {
    return std::nullopt;
  }
  const Vec3 area = newell_area(fingertips);
  if (area.norm() >= options_.min_area_m2) {
    const Vec3 unit = area.normalized();
    normal_ = normal_ && normal_->dot(unit) < 0 ? Vec3(-unit) : unit;
  }
  if (!normal_) return std::nullopt;
  const double rho = std::isfinite(pressure) ? std::clamp(pressure, 0.0, 1.0) : 0.0;
  return DiskPose{centroid(fingertips), *normal_,
                  options_.min_radius_m + (options_.max_radius_m - options_.min_radius_m) * rho};
}

}  // namespace handloft::geometry
