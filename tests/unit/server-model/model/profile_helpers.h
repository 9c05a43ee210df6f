#pragma once
// What the tests of ModifyProfile share: strokes, shapes that they are drawn over, and how far a surface is
// from the fit of its points (A8).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "server-model/geometry/polynomial_fit.h"
#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model::test {

using geometry::Vec3;

inline std::vector<v1::Point> stroke(const std::function<Vec3(double)>& at, std::size_t n = 60) {
  std::vector<v1::Point> points;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 p = at(static_cast<double>(i) / static_cast<double>(n - 1));
    points.push_back(point(p.x(), p.y(), p.z(), 0.7));
    points.back().set_time_ns(static_cast<std::int64_t>(i) * 1000);
  }
  return points;
}

inline std::vector<v1::Point> line(const Vec3& from, const Vec3& to) {
  return stroke([&](double t) { return Vec3(from + t * (to - from)); });
}

/// An arch over x = x0 - 0.03 .. x0 + 0.03 at y.
inline std::vector<v1::Point> arch(double height, double y = 0, double x0 = 0) {
  return stroke([=](double t) { return Vec3(x0 - 0.03 + 0.06 * t, y, 0.01 + height * 4 * t * (1 - t)); });
}

inline v1::ProfileCurve curve(const std::vector<v1::Point>& points, const std::string& entity = "") {
  v1::ProfileCurve result;
  for (const auto& p : points) *result.add_points() = p;
  result.set_entity(entity);
  return result;
}

inline v1::Operation profile(const std::vector<v1::ProfileCurve>& curves, bool keep = false) {
  v1::Operation operation;
  for (const auto& one : curves) *operation.mutable_modify_profile()->add_curves() = one;
  operation.mutable_modify_profile()->set_keep_as_points(keep);
  return operation;
}

inline std::vector<v1::Point> random_points(std::size_t n, std::uint64_t seed, double x0 = 0) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<v1::Point> points;
  for (std::size_t i = 0; i < n; ++i) {
    points.push_back(point(x0 + 0.04 * unit(random), 0.03 * unit(random), 0.01 + 0.003 * unit(random),
                           0.55 + 0.45 * unit(random)));
  }
  return points;
}

inline Document fitted(const std::string& id, const std::vector<v1::Point>& points, std::uint32_t degree = 2,
                       Document base = {}) {
  return applied(std::move(base), {create(id, degree), add(id, points), fit(id)});
}

inline std::vector<geometry::WeightedPoint> local_points(const DualShape& shape) {
  std::vector<geometry::WeightedPoint> points;
  for (const DualPoint& p : shape.points) {
    points.push_back({shape.fit->frame.to_local(p.position()), p.pressure});
  }
  return points;
}

/// Largest distance between the shape's surface and a fit of its points, over the points, relative to height.
inline double refit_error(const DualShape& shape) {
  const auto points = local_points(shape);
  const auto refit = geometry::fit_polynomial_surface(points, {.degree = shape.fit->surface.degree()});
  EXPECT_TRUE(refit.ok());
  double apart = 0;
  double height = 0;
  for (const auto& p : points) {
    const double f = shape.fit->surface.value(p.position.x(), p.position.y());
    apart = std::max(apart, std::abs(refit->surface.value(p.position.x(), p.position.y()) - f));
    height = std::max(height, std::abs(f));
  }
  return apart / height;
}

inline ApplyResult must(const Document& document, const v1::Operation& operation) {
  auto result = apply(document, operation);
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().describe());
  return result ? std::move(*result) : ApplyResult{};
}

inline double height_over(const DualShape& shape, const Vec3& world) {
  const Vec3 local = shape.fit->frame.to_local(world);
  return local.z() - shape.fit->surface.value(local.x(), local.y());
}

/// Two tiles beside each other, "left" about x = -0.05 and "right" about x = 0.05.
inline Document two_tiles() {
  return fitted("right", random_points(120, 22, 0.05), 2, fitted("left", random_points(80, 21, -0.05)));
}

}  // namespace handloft::model::test
