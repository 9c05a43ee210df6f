#include "server-model/geometry/residual_matching.h"

#include <cassert>

namespace handloft::geometry {

std::vector<double> vertical_residuals(const PolynomialSurface& surface,
                                       std::span<const WeightedPoint> local_points) {
  std::vector<double> residuals;
  residuals.reserve(local_points.size());
  for (const WeightedPoint& point : local_points) {
    residuals.push_back(point.position.z() - surface.value(point.position.x(), point.position.y()));
  }
  return residuals;
}

void match_residuals(const PolynomialSurface& surface, std::span<const double> residuals,
                     std::span<WeightedPoint> local_points) {
  assert(residuals.size() == local_points.size());
  for (std::size_t i = 0; i < local_points.size(); ++i) {
    Vec3& position = local_points[i].position;
    position.z() = surface.value(position.x(), position.y()) + residuals[i];
  }
}

std::vector<WeightedPoint> follow_surface(std::span<const WeightedPoint> world_points, const Frame& frame,
                                          const PolynomialSurface& before, const PolynomialSurface& after) {
  std::vector<WeightedPoint> moved(world_points.begin(), world_points.end());
  for (WeightedPoint& point : moved) point.position = frame.to_local(point.position);
  const std::vector<double> residuals = vertical_residuals(before, moved);
  match_residuals(after, residuals, moved);
  for (WeightedPoint& point : moved) point.position = frame.to_world(point.position);
  return moved;
}

}  // namespace handloft::geometry
