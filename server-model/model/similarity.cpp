#include "server-model/model/similarity.h"

#include <cmath>

#include "server-model/geometry/symmetry.h"

namespace handloft::model {

using geometry::Vec3;

Similarity Similarity::mirrored(const geometry::Plane& plane) const {
  // Of a rotation about axis a by t, the mirror image is that about the image of a by -t; of the vector part
  // sin(t/2) a that is minus the mirrored vector.
  Similarity image;
  image.scale = scale;
  const Vec3 vector = -geometry::reflect_direction(rotation.vec(), plane);
  image.rotation = Eigen::Quaterniond(rotation.w(), vector.x(), vector.y(), vector.z());
  // M S M 0 = image.shift.
  image.shift = geometry::reflect_point((*this)(geometry::reflect_point(Vec3::Zero(), plane)), plane);
  return image;
}

Similarity Similarity::after(const Similarity& other) const {
  Similarity both;
  both.scale = scale * other.scale;
  both.rotation = (rotation * other.rotation).normalized();
  both.shift = (*this)(other.shift);
  return both;
}

// x = s R y + t, so y = (1/s) R' (x - t).
Similarity Similarity::inverse() const {
  Similarity back;
  back.scale = 1 / scale;
  back.rotation = rotation.conjugate();
  back.shift = -back.scale * (back.rotation * shift);
  return back;
}

bool Similarity::finite() const {
  return std::isfinite(scale) && rotation.coeffs().allFinite() && shift.allFinite();
}

bool Similarity::operator==(const Similarity& other) const {
  return scale == other.scale && rotation.coeffs() == other.rotation.coeffs() && shift == other.shift;
}

bool same_motion(const std::shared_ptr<const Similarity>& a, const std::shared_ptr<const Similarity>& b) {
  return a == b || (a && b && *a == *b);
}

}  // namespace handloft::model
