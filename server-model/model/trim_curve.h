#pragma once
// A drawn curve that trims a shape (A24), in the world as it was drawn: so it moves with the shape's points,
// and is projected anew when the base plane changes. Immutable; shared by documents.

#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/boundary_trim.h"
#include "server-model/geometry/types.h"

namespace handloft::model {

class TrimCurve {
 public:
  /// World, metres; closed without repeating the first place.
  explicit TrimCurve(std::vector<geometry::Vec3> points) : points_(std::move(points)) {}

  const std::vector<geometry::Vec3>& points() const { return points_; }

  /// The trim in the x-y plane of a frame. That of the latest frame is remembered, since every later version
  /// of the shape has the same until its plane is fitted again. Errors: as BoundaryTrim::create().
  Result<std::shared_ptr<const geometry::BoundaryTrim>> in(const geometry::Frame& frame) const;

  /// The curve of map(p) for every place p: when the shape's points move so, so does its curve.
  template <typename Map>
  std::shared_ptr<const TrimCurve> mapped(const Map& map) const {
    std::vector<geometry::Vec3> images;
    images.reserve(points_.size());
    for (const geometry::Vec3& point : points_) images.push_back(map(point));
    return std::make_shared<const TrimCurve>(std::move(images));
  }

  /// Of the places: two curves of the same places are the same.
  bool operator==(const TrimCurve& other) const { return points_ == other.points_; }

 private:
  std::vector<geometry::Vec3> points_;
  mutable std::mutex mutex_;
  mutable std::optional<geometry::Frame> frame_;  ///< Of trim_.
  mutable std::shared_ptr<const geometry::BoundaryTrim> trim_;
};

/// The mirror image of a curve that may be missing: p' = p - 2 ((p - o) . n) n of every place (A12).
std::shared_ptr<const TrimCurve> mirrored(const std::shared_ptr<const TrimCurve>& curve,
                                          const geometry::Plane& plane);

}  // namespace handloft::model
