#include "server-model/interaction/target.h"

#include <algorithm>
#include <limits>

namespace handloft::interaction {
namespace {

using Eigen::Vector3d;

/// Places a side of the visible surface's box at which it is looked at. Over a shape of 20 cm they are 8 mm
/// apart, which is 0.3 mm too far for a hand 25 mm away: which shape is meant does not hang on that.
constexpr int samples_per_side = 25;

Vector3d nearest_on_segment(const Vector3d& point, const Vector3d& from, const Vector3d& to) {
  const Vector3d way = to - from;
  const double length2 = way.squaredNorm();
  if (!(length2 > 0)) return from;
  return from + std::clamp((point - from).dot(way) / length2, 0.0, 1.0) * way;
}

/// What of a fitted surface is seen, as places.
std::vector<Vector3d> visible_places(const model::DualShape& shape) {
  std::vector<Vector3d> places;
  if (!shape.fitted()) return places;
  const auto trim = shape.trim();
  if (!trim) return places;
  const geometry::Box2 box = trim->solid_box();
  places.reserve(std::size_t{samples_per_side} * samples_per_side);
  for (int i = 0; i < samples_per_side; ++i) {
    for (int k = 0; k < samples_per_side; ++k) {
      const Eigen::Vector2d unit(2.0 * i / (samples_per_side - 1) - 1, 2.0 * k / (samples_per_side - 1) - 1);
      const Eigen::Vector2d xy = box.centre + box.half_extent.cwiseProduct(unit);
      if (!trim->solid(xy)) continue;
      places.push_back(shape.fit->surface.world_point(shape.fit->frame, xy.x(), xy.y()));
    }
  }
  return places;
}

}  // namespace

const TargetFinder::Known& TargetFinder::known(const model::DualPtr& shape) {
  Known& known = known_[shape->id];
  if (known.shape == shape) return known;
  known.shape = shape;
  known.surface = visible_places(*shape);
  known.box.setEmpty();
  for (const model::DualPoint& point : shape->points) known.box.extend(point.position());
  for (const Vector3d& place : known.surface) known.box.extend(place);
  return known;
}

std::optional<Near> TargetFinder::look(const model::DualPtr& shape, const Vector3d& from, const Vector3d& to,
                                       double limit_m) {
  const Known& seen = known(shape);
  if (seen.box.isEmpty()) return std::nullopt;
  Eigen::AlignedBox3d way(from.cwiseMin(to), from.cwiseMax(to));
  if (seen.box.squaredExteriorDistance(way) > limit_m * limit_m) return std::nullopt;
  double best2 = limit_m * limit_m;
  std::optional<Near> found;
  const auto consider = [&](const Vector3d& place) {
    const double distance2 = (place - nearest_on_segment(place, from, to)).squaredNorm();
    if (distance2 > best2 || (found && distance2 == best2)) return;
    best2 = distance2;
    if (!found) found.emplace();
    found->position = place;
  };
  for (const model::DualPoint& point : shape->points) consider(point.position());
  for (const Vector3d& place : seen.surface) consider(place);
  if (found) {
    found->entity = shape->id;
    found->distance_m = std::sqrt(best2);
  }
  return found;
}

void TargetFinder::forget_removed(const model::Document& document) {
  std::erase_if(known_, [&](const auto& entry) { return !document.entities.contains(entry.first); });
}

std::optional<Near> TargetFinder::nearest(const model::Document& document, const Vector3d& from,
                                          const Vector3d& to) {
  forget_removed(document);
  std::optional<Near> best;
  for (const auto& [id, entity] : document.entities) {
    const model::DualPtr shape = model::as_dual(entity);
    if (!shape) continue;
    auto found = look(shape, from, to, best ? best->distance_m : reach_m_);
    if (found && (!best || found->distance_m < best->distance_m)) best = std::move(found);
  }
  return best;
}

std::vector<Near> TargetFinder::all_within_reach(const model::Document& document, const Vector3d& from,
                                                 const Vector3d& to) {
  forget_removed(document);
  std::vector<Near> all;
  for (const auto& [id, entity] : document.entities) {
    const model::DualPtr shape = model::as_dual(entity);
    if (!shape) continue;
    if (auto found = look(shape, from, to, reach_m_)) all.push_back(*std::move(found));
  }
  return all;
}

std::optional<Near> TargetFinder::within_reach(const model::Document& document, std::string_view entity,
                                               const Vector3d& from, const Vector3d& to) {
  const model::DualPtr shape = document.find_dual(entity);
  return shape ? look(shape, from, to, reach_m_) : std::nullopt;
}

}  // namespace handloft::interaction
