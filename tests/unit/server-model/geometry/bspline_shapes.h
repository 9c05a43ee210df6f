#pragma once
// B-spline surfaces whose closest points are formulas, and random bumpy ones. Exact spheres and tori are
// rational, from circles of nine points.

#include <array>
#include <cmath>

#include "tests/unit/server-model/geometry/bspline_samples.h"

namespace handloft::geometry::samples {

/// Rows of a circle's (or arc's) points turned about z.
inline BSplineSurface revolved(const BSplineCurve& profile_xz) {
  const BSplineCurve round = circle();
  BSplineSurface surface{round.knots, profile_xz.knots, {}, {}};
  for (std::size_t i = 0; i < round.control.size(); ++i) {
    for (std::size_t j = 0; j < profile_xz.control.size(); ++j) {
      const Vec3& p = profile_xz.control[j];
      surface.control.emplace_back(p.x() * round.control[i].x(), p.x() * round.control[i].y(), p.z());
      surface.weights.push_back(round.weights[i] * profile_xz.weights[j]);
    }
  }
  return surface;
}

/// Around the origin; poles at v = 0 (below) and v = 1.
inline BSplineSurface sphere(double radius) {
  const double w = std::sqrt(0.5);
  const BSplineCurve half{
      KnotVector::open(2, {0, 0, 0, 0.5, 0.5, 1, 1, 1}).value(),
      {{0, 0, -radius}, {radius, 0, -radius}, {radius, 0, 0}, {radius, 0, radius}, {0, 0, radius}},
      {1, w, 1, w, 1}};
  return revolved(half);
}

inline BSplineSurface torus(double major, double minor) {
  BSplineCurve profile = circle();
  for (Vec3& p : profile.control) p = Vec3(major + minor * p.x(), 0, minor * p.y());
  return revolved(profile);
}

/// z = 0 over [0, width] x [0, height], in n x m bicubic spans at uneven knots.
inline BSplineSurface flat(double width, double height, int n, int m) {
  BSplineSurface surface{KnotVector::uniform(3, n).value(), KnotVector::uniform(3, m).value(), {}, {}};
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      surface.control.emplace_back(width * surface.u.greville(i), height * surface.v.greville(j), 0);
    }
  }
  return surface;
}

/// Bicubic n x m over the unit square with waves of a tenth of it: like a hood's.
inline BSplineSurface wavy(int n, int m) {
  BSplineSurface surface = flat(1, 1, n, m);
  for (Vec3& p : surface.control) {
    p.z() = 0.05 * std::sin(5 * p.x()) * std::cos(4 * p.y()) + 0.02 * std::sin(11 * p.x() + 7 * p.y());
  }
  return surface;
}

/// Closed along u by a periodic knot vector: a vase about z, height 1, cubic.
inline BSplineSurface vase(int around, int along) {
  BSplineSurface surface{
      KnotVector::uniform_periodic(3, around).value(), KnotVector::uniform(3, along).value(), {}, {}};
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < along; ++j) {
      const double turn = 2 * M_PI * i / around, z = surface.v.greville(j);
      const double radius = 0.3 + 0.1 * std::sin(6 * z);
      surface.control.emplace_back(radius * std::cos(turn), radius * std::sin(turn), z);
    }
  }
  return surface;
}

}  // namespace handloft::geometry::samples
