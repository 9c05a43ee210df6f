#include "server-model/geometry/push.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace handloft::geometry {

namespace {

// Turns of more than this are looked at in pieces, each short enough for at most one touch and one release.
constexpr double max_turn_rad = 0.02;
// A piece with several events is halved, this often at most (2^-12 of 0.02 rad).
constexpr int max_depth = 12;
// Below this a rotation is none: over a disk of 60 mm it moves the rim by less than 1e-13 m.
constexpr double least_turn_rad = 1e-12;

// The moment in [low, high] where f becomes negative; f(low) >= 0 > f(high). Illinois regula falsi, which a
// linear f ends in one step.
template <typename F>
double crossing(double low, double high, const F& f) {
  double f_low = f(low), f_high = f(high);
  if (!(f_low > 0)) return low;
  int side = 0;
  for (int i = 0; i < 100; ++i) {
    const double t = std::clamp((low * f_high - high * f_low) / (f_high - f_low), low, high);
    const double value = f(t);
    if (value == 0 || high - low <= 4e-16) return t;
    if (value > 0) {
      if (t == low) return t;
      low = t;
      f_low = value;
      if (side == 1) f_high *= 0.5;
      side = 1;
    } else {
      if (t == high) return t;
      high = t;
      f_high = value;
      if (side == -1) f_low *= 0.5;
      side = -1;
    }
  }
  return 0.5 * (low + high);
}

}  // namespace

// n and m = k x n at a moment, and the centre.
struct DiskSweep::Moment {
  Vec3 centre, normal, across;
  double radius_m;
};

DiskSweep::DiskSweep(const DiskPose& from, const DiskPose& to)
    : from_(from), to_(to), step_(to.centre - from.centre), reach_m_(std::max(from.radius_m, to.radius_m)) {
  const Vec3 turn = from.normal.cross(to.normal);
  angle_ = std::atan2(turn.norm(), from.normal.dot(to.normal));
  if (angle_ <= least_turn_rad || turn.norm() <= least_turn_rad) {
    if (angle_ <= least_turn_rad) angle_ = 0;
    axis_ = from.normal.unitOrthogonal();
  } else {
    axis_ = turn.normalized();
  }
  across_ = axis_.cross(from.normal);
  pieces_ = std::max(1, static_cast<int>(std::ceil(angle_ / max_turn_rad)));
}

DiskSweep::Moment DiskSweep::at(double t) const {
  const double c = std::cos(angle_ * t), s = std::sin(angle_ * t);
  return {from_.centre + t * step_, c * from_.normal + s * across_, c * across_ - s * from_.normal,
          from_.radius_m + t * (to_.radius_m - from_.radius_m)};
}

double DiskSweep::height(const Vec3& point, double t) const {
  const Vec3 offset = point - from_.centre - t * step_;
  if (angle_ == 0) return offset.dot(from_.normal);
  return offset.dot(std::cos(angle_ * t) * from_.normal + std::sin(angle_ * t) * across_);
}

double DiskSweep::height_rate(const Vec3& point, double t) const {
  const Moment now = at(t);
  return angle_ * (point - now.centre).dot(now.across) - step_.dot(now.normal);
}

Vec3 DiskSweep::push(const Vec3& point) const {
  Vec3 p = point;
  for (int i = 0; i < pieces_; ++i) {
    p = advance(p, static_cast<double>(i) / pieces_, static_cast<double>(i + 1) / pieces_, 0);
  }
  return p;
}

Vec3 DiskSweep::advance(const Vec3& point, double begin, double end, int depth) const {
  const auto h = [&](double t) { return height(point, t); };
  const double h_begin = h(begin);
  if (h_begin < -contact_slack_m) return point;  // Behind.
  double last = end;
  if (h(end) >= 0) {
    if (angle_ == 0) return point;
    // A turning plane may dip below the point and rise again.
    const auto falling = [&](double t) { return -height_rate(point, t); };
    if (!(falling(begin) > 0 && falling(end) < 0)) return point;
    last = crossing(begin, end, falling);
    if (h(last) >= 0) return point;
  }
  const double touch = crossing(begin, last, h);
  const Moment then = at(touch);
  const Vec3 offset = point - then.centre;
  const double a = offset.dot(axis_), b = offset.dot(then.across);
  if (a * a + b * b > then.radius_m * then.radius_m) return point;  // The plane passes beside the disk.
  return carry(point, touch, end, depth);
}

Vec3 DiskSweep::carry(const Vec3& point, double touch, double end, int depth) const {
  const Moment first = at(touch);
  const Vec3 offset = point - first.centre;
  const double a0 = offset.dot(axis_), b0 = offset.dot(first.across);
  const double a_rate = -step_.dot(axis_);
  const double along_m = step_.dot(first.across), along_n = step_.dot(first.normal);
  const auto a = [&](double t) { return a0 + a_rate * (t - touch); };
  const auto b = [&](double t) {
    const double dt = t - touch;
    if (angle_ == 0) return b0 - along_m * dt;
    const double half = std::sin(0.5 * angle_ * dt);
    return b0 - (along_m * std::sin(angle_ * dt) - along_n * 2 * half * half) / angle_;
  };
  // >= 0 while the point is within the disk, and while the disk advances upon it.
  const auto within = [&](double t) {
    const double radius = from_.radius_m + t * (to_.radius_m - from_.radius_m);
    return radius - std::hypot(a(t), b(t));
  };
  const auto advancing = [&](double t) { return step_.dot(at(t).normal) - angle_ * b(t); };

  double release = end;
  bool slid_off = false;
  if (within(end) < 0) {
    release = crossing(touch, end, within);
    slid_off = true;
  }
  if (advancing(release) < 0) {
    release = crossing(touch, release, advancing);
    slid_off = false;
  }
  Vec3 carried;
  if (angle_ == 0) {
    // Along n alone, so that the push is parallel to it to the last bit but rounding.
    carried = point + std::max(0.0, step_.dot(from_.normal) * release - height(point, 0)) * from_.normal;
  } else {
    const Moment then = at(release);
    carried = then.centre + a(release) * axis_ + b(release) * then.across;
  }
  // A disk that receded may come again within this piece.
  if (!slid_off && release < end && angle_ != 0 && depth < max_depth && height(carried, end) < 0) {
    const double middle = 0.5 * (release + end);
    carried = advance(carried, release, middle, depth + 1);
    carried = advance(carried, middle, end, depth + 1);
  }
  return carried;
}

}  // namespace handloft::geometry
