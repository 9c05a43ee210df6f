#pragma once
// Surfaces that the tests of sculpting start from, and ways to look at what comes out.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "server-model/geometry/sculpt_system.h"

namespace handloft::geometry {

/// The unit square in the x-y plane, x = u, y = v.
inline BSplineSurface flat_surface(int degree, int nu, int nv) {
  BSplineSurface surface{
      KnotVector::uniform(degree, nu).value(), KnotVector::uniform(degree, nv).value(), {}, {}};
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j)
      surface.control.emplace_back(surface.u.greville(i), surface.v.greville(j), 0);
  return surface;
}

/// A hood-like sheet: 1.2 m by 0.8 m, curved both ways, over uneven knots.
inline BSplineSurface curved_surface(int degree = 3) {
  const auto knots = [degree](std::initializer_list<double> inner) -> KnotVector {
    std::vector<double> all(static_cast<std::size_t>(degree) + 1, 0.0);
    all.insert(all.end(), inner);
    all.insert(all.end(), static_cast<std::size_t>(degree) + 1, 2.0);
    return KnotVector::open(degree, all).value();
  };
  BSplineSurface surface{
      knots({0.2, 0.5, 0.6, 0.9, 1.1, 1.4, 1.6, 1.8}), knots({0.4, 0.7, 1.0, 1.3, 1.5}), {}, {}};
  for (int i = 0; i < surface.u.control_count(); ++i)
    for (int j = 0; j < surface.v.control_count(); ++j) {
      const double s = surface.u.greville(i) / 2;
      const double t = surface.v.greville(j) / 2;
      surface.control.emplace_back(1.2 * s, 0.8 * t, 0.2 * std::sin(2 * s) + 0.1 * t * t - 0.05 * s * t);
    }
  return surface;
}

inline BSplineSurface with_control(BSplineSurface surface, const std::vector<Vec3>& control) {
  surface.control = control;
  return surface;
}

inline double extent(const BSplineSurface& surface) {
  Vec3 lower = surface.control.front();
  Vec3 upper = lower;
  for (const Vec3& point : surface.control) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  return (upper - lower).norm();
}

inline void append(std::vector<SculptRow>& rows, const std::array<SculptRow, 2>& more) {
  rows.insert(rows.end(), more.begin(), more.end());
}

inline double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double largest = a.size() == b.size() ? 0 : INFINITY;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

inline bool same_bits(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec3)) == 0;
}

}  // namespace handloft::geometry
