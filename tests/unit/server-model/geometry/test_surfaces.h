#pragma once
// Random but repeatable clouds and surfaces for the geometry tests.

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry::test {

inline double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// n points on a rectangle of 2 a x 2 b about a centre away from 0, heights within h, weights in (0.05, 1).
inline std::vector<WeightedPoint> random_cloud(std::mt19937_64& random, std::size_t n, double a = 0.08,
                                               double b = 0.05, double h = 0.01) {
  std::vector<WeightedPoint> points(n);
  for (WeightedPoint& p : points) {
    p.position = {0.03 + uniform(random, -a, a), -0.02 + uniform(random, -b, b), uniform(random, -h, h)};
    p.weight = uniform(random, 0.05, 1.0);
  }
  return points;
}

inline PolynomialSurface random_surface(std::mt19937_64& random, int degree, const Box2& box,
                                        double height = 0.01) {
  std::vector<double> c(static_cast<std::size_t>(coefficient_count(degree)));
  for (double& x : c) x = uniform(random, -height, height);
  return *PolynomialSurface::from_scaled(degree, box, c);
}

inline Frame random_frame(std::mt19937_64& random) {
  const Vec3 axis =
      Vec3(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.1, 1)).normalized();
  Frame frame;
  frame.rotation = Eigen::AngleAxisd(uniform(random, 0, 3), axis).toRotationMatrix();
  frame.origin = {uniform(random, -0.3, 0.3), uniform(random, -0.3, 0.3), uniform(random, 0, 0.3)};
  return frame;
}

/// Correct decimal digits: -log10 of the relative error, at most 16.
inline double digits(double found, double expected) {
  const double error = std::abs(found - expected) / std::abs(expected);
  return error == 0 ? 16.0 : std::min(16.0, -std::log10(error));
}

}  // namespace handloft::geometry::test
