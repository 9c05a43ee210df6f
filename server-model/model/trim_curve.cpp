#include "server-model/model/trim_curve.h"

#include <utility>

#include "server-model/geometry/symmetry.h"

namespace handloft::model {

Result<std::shared_ptr<const geometry::BoundaryTrim>> TrimCurve::in(const geometry::Frame& frame) const {
  {
    const std::lock_guard lock(mutex_);
    if (trim_ && frame_->origin == frame.origin && frame_->rotation == frame.rotation) return trim_;
  }
  auto made = geometry::BoundaryTrim::create(points_, frame);
  if (!made) return made.error();
  auto trim = std::make_shared<const geometry::BoundaryTrim>(*std::move(made));
  const std::lock_guard lock(mutex_);
  frame_ = frame;
  trim_ = trim;
  return trim;
}

std::shared_ptr<const TrimCurve> mirrored(const std::shared_ptr<const TrimCurve>& curve,
                                          const geometry::Plane& plane) {
  if (!curve) return nullptr;
  return curve->mapped([&](const geometry::Vec3& point) { return geometry::reflect_point(point, plane); });
}

}  // namespace handloft::model
