#pragma once
// The push of a moving disk (A14). Between two poses the disk moves as a continuum: its centre and radius
// linearly, its normal by a steady rotation. A point that the disk's front meets within the radius is carried
// along the normal until the disk recedes or leaves it sideways; nothing is ever pulled, and no point can be
// jumped over, however fast the hand.
//
// The rule for a point p in front of the disk (h = (p - C) . n >= 0), which makes the result independent of
// how often the motion is sampled:
//   touch    at the first moment when h falls to 0 while |p - C| <= radius; beyond the radius the plane
//   passes
//            the point, which is then behind the disk and safe;
//   carry    in the frame (k, m, n) that turns with the disk about k at the rate w, the offset a k + b m of a
//            touching point obeys  a' = -C' . k,  b' = -C' . m,  both integrable in closed form, and the
//            point is at C + a k + b m;
//   release  when  C' . n - w b < 0  (the disk recedes) or  a^2 + b^2 > radius^2  (it slid off).
// Events are solved for to rounding, so a motion cut into pieces gives the same push within 1e-12 m as the
// motion whole. The push is the path along n: parallel to it wherever n is constant.

#include "server-model/geometry/disk.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// A point this little behind the disk still counts as in front of it: rounding must not drop a touching
/// point from one frame to the next. A nanometre is far below any hand and far above rounding.
inline constexpr double contact_slack_m = 1e-9;

/// The motion between two poses with unit normals. Opposite normals turn about an arbitrary fixed axis.
class DiskSweep {
 public:
  DiskSweep(const DiskPose& from, const DiskPose& to);

  /// Where the sweep leaves a point that is at `point` when it begins.
  Vec3 push(const Vec3& point) const;

  /// All that the sweep can touch lies within `reach_m()` of the segment from().centre .. to().centre.
  double reach_m() const { return reach_m_; }
  const DiskPose& from() const { return from_; }
  const DiskPose& to() const { return to_; }

 private:
  struct Moment;
  Moment at(double t) const;
  double height(const Vec3& point, double t) const;       // h
  double height_rate(const Vec3& point, double t) const;  // dh/dt of a resting point
  Vec3 advance(const Vec3& point, double begin, double end, int depth) const;
  Vec3 carry(const Vec3& point, double touch, double end, int depth) const;

  DiskPose from_, to_;
  Vec3 step_ = Vec3::Zero();     // Of the centre
  Vec3 axis_ = Vec3::UnitX();    // k, of rotation
  Vec3 across_ = Vec3::UnitY();  // m = k x n at the beginning
  double angle_ = 0;             // w, per sweep
  double reach_m_ = 0;
  int pieces_ = 1;
};

}  // namespace handloft::geometry
