#pragma once
// A small scene that needs no server: a mouse-like shell as a polynomial over an ellipse with the opacity of
// A23, and the fuzzy points of a few strokes on it (A2, A3). Deterministic.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include "client-hmd/mirror/scene.h"

namespace handloft::client::test {

/// Radius and shells of a point of certainty rho, by A2 and A3: L = 12.7 mm, at least a fiftieth of it.
inline ShellStyle fuzzy_style(double rho) {
  constexpr double largest_m = 0.0127;
  const double radius = std::max(largest_m * (1.0 - rho), 0.02 * largest_m);
  ShellStyle style;
  style.radius_m = static_cast<float>(radius);
  double before = 0.0;
  for (int k = 5; k >= 1; --k) {  // Outer to inner.
    const double opacity = rho * (1.0 - (k - 0.5) / 5.0);
    style.shell_radius_m[static_cast<std::size_t>(5 - k)] = static_cast<float>(radius * k / 5.0);
    style.shell_alpha[static_cast<std::size_t>(5 - k)] =
        static_cast<float>((opacity - before) / (1.0 - before));
    before = opacity;
  }
  return style;
}

/// The shell's height over the table at (x, y), metres.
inline double shell_height(double x, double y) {
  return 0.042 + 0.06 * x - 6.0 * x * x - 9.0 * y * y - 40.0 * x * x * x;
}

/// A quarter turn: the mouse points along y, away from the designer.
inline Vec3f forwards(double x, double y, double z) {
  return {static_cast<float>(y), static_cast<float>(-x), static_cast<float>(z)};
}

inline std::shared_ptr<const SurfaceMesh> shell_mesh() {
  constexpr int n = 96;
  constexpr double rx = 0.055, ry = 0.032, border = 1.953;  // A23: opacity 1/255 at f = 1.953
  auto mesh = std::make_shared<SurfaceMesh>();
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const double s = border * (2.0 * i / n - 1.0), t = border * (2.0 * j / n - 1.0);
      const double x = rx * s, y = ry * t;
      const double dzdx = 0.06 - 12.0 * x - 120.0 * x * x, dzdy = -18.0 * y;
      const double length = std::sqrt(dzdx * dzdx + dzdy * dzdy + 1.0);
      const double f = s * s + t * t;  // superellipse of exponent 2
      const double opacity = std::exp(-std::pow(f, 6.0) / 10.0);
      mesh->vertices.push_back({forwards(x, y, shell_height(x, y)),
                                forwards(-dzdx / length, -dzdy / length, 1.0 / length),
                                static_cast<float>(opacity)});
    }
  }
  for (std::uint32_t j = 0; j < n; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      mesh->indices.insert(mesh->indices.end(), {a, b, c, c, b, d});
    }
  }
  return mesh;
}

inline std::shared_ptr<const PointSet> stroke_points() {
  auto set = std::make_shared<PointSet>();
  constexpr int levels = 16;
  for (int i = 0; i < levels; ++i) set->styles.push_back(fuzzy_style(0.25 + 0.72 * i / (levels - 1)));
  for (int stroke = 0; stroke < 5; ++stroke) {
    const double y = -0.024 + 0.012 * stroke;
    for (int i = 0; i < 40; ++i) {
      const double x = -0.05 + 0.1 * i / 39.0;
      // Pressure swells and fades along the stroke, and the hand trembles.
      const double swell = std::sin(3.14159265 * i / 39.0);
      const double tremble = 0.0015 * std::sin(1.7 * i + 2.1 * stroke);
      set->points.push_back({forwards(x, y + tremble, shell_height(x, y) + 0.002 + tremble),
                             static_cast<std::uint32_t>(swell * (levels - 1))});
    }
  }
  return set;
}

inline std::shared_ptr<const Scene> synthetic_scene(Representation representation = Representation::both) {
  auto entity = std::make_shared<Entity>();
  entity->id = entity->name = "top";
  entity->revision = 1;
  entity->selected = true;
  entity->representation = representation;
  entity->points = stroke_points();
  entity->settled_points = static_cast<std::uint32_t>(entity->points->points.size());
  entity->surface = shell_mesh();
  auto scene = std::make_shared<Scene>();
  scene->epoch = 1;
  scene->sequence = 3;
  scene->entities.emplace(entity->id, entity);
  return scene;
}

}  // namespace handloft::client::test
