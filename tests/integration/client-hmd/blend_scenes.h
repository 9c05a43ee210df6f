#pragma once
// Scenes that are hard to blend in any order (V2), each with what weighted blending may differ from depth
// peeling, in 1/255 of the largest channel's difference: a mean over the pixels where anything transparent
// is, the 99th percentile of those, and the largest.

#include <cmath>
#include <string>
#include <vector>

#include "client-hmd/render/frame.h"
#include "client-hmd/view/orbit_camera.h"
#include "tests/integration/client-hmd/ghost_scene.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client::test {

struct BlendScene {
  std::string name;
  Frame frame;  ///< Its eye is `camera`'s, for a picture of any size.
  OrbitCamera camera;
  double most_mean = 1.0, most_p99 = 10.0, most_max = 60.0;
};

/// A fixed sequence of numbers in 0..1 (Knuth's linear congruential generator): pictures do not depend on a
/// library's.
class Numbers {
 public:
  float next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<float>(state_ >> 40U) / static_cast<float>(1U << 24U);
  }

 private:
  std::uint64_t state_ = 42;
};

inline std::shared_ptr<Entity> entity_named(const std::string& id) {
  auto entity = std::make_shared<Entity>();
  entity->id = entity->name = id;
  entity->representation = Representation::both;
  return entity;
}

inline std::shared_ptr<Scene> scene_with(const std::vector<std::shared_ptr<Entity>>& entities) {
  auto scene = std::make_shared<Scene>();
  scene->epoch = 1;
  for (const auto& entity : entities) {
    if (entity->points != nullptr)
      entity->settled_points = static_cast<std::uint32_t>(entity->points->points.size());
    scene->entities.emplace(entity->id, entity);
  }
  return scene;
}

/// `count` points of certainties `from`..`to` in a box about `middle`.
inline std::shared_ptr<PointSet> cloud(int count, const glm::vec3& middle, const glm::vec3& half, double from,
                                       double to) {
  auto set = std::make_shared<PointSet>();
  constexpr int levels = 16;
  for (int i = 0; i < levels; ++i) set->styles.push_back(fuzzy_style(from + (to - from) * i / (levels - 1)));
  Numbers numbers;
  for (int i = 0; i < count; ++i) {
    // Arguments are evaluated in any order: one after another they are drawn in this.
    const float z = numbers.next(), y = numbers.next(), x = numbers.next();
    const glm::vec3 share(x, y, z);
    const glm::vec3 p = middle + half * (2.0F * share - 1.0F);
    const auto style =
        std::min(static_cast<std::uint32_t>(numbers.next() * levels), std::uint32_t{levels - 1});
    set->points.push_back({{p.x, p.y, p.z}, style});
  }
  return set;
}

/// The shell, `up` higher, turned about the vertical, with its opacity times `share`.
inline std::shared_ptr<SurfaceMesh> moved_shell(float up, float turn_rad, float share) {
  auto mesh = std::make_shared<SurfaceMesh>(*shell_mesh());
  const float c = std::cos(turn_rad), s = std::sin(turn_rad);
  for (SurfaceVertex& vertex : mesh->vertices) {
    for (Vec3f* v : {&vertex.position, &vertex.normal}) *v = {c * v->x - s * v->y, s * v->x + c * v->y, v->z};
    vertex.position.z += up;
    vertex.opacity *= share;
  }
  return mesh;
}

inline std::vector<BlendScene> blend_scenes() {
  OrbitCamera near;
  near.target = {0.0, 0.0, 0.05};
  near.distance_m = 0.32;
  near.azimuth_rad = -1.2;
  near.elevation_rad = 0.45;
  std::vector<BlendScene> scenes;
  const auto add = [&](const std::string& name, const std::shared_ptr<const Scene>& scene, double mean,
                       double p99, double max) -> BlendScene& {
    BlendScene one;
    one.name = name;
    one.frame.scene = scene;
    one.camera = near;
    one.most_mean = mean;
    one.most_p99 = p99;
    one.most_max = max;
    scenes.push_back(std::move(one));
    return scenes.back();
  };

  auto dense = entity_named("dense");
  dense->points = cloud(900, {0.0F, 0.0F, 0.05F}, {0.07F, 0.05F, 0.03F}, 0.3, 0.95);
  add("points_dense", scene_with({dense}), 0.4, 3.0, 10.0);

  std::vector<std::shared_ptr<Entity>> shells;
  for (int i = 0; i < 3; ++i) {
    auto shell = entity_named("shell" + std::to_string(i));
    shell->surface = moved_shell(0.012F * static_cast<float>(i), 0.7F * static_cast<float>(i), 0.8F);
    shell->selected = i == 1;
    shells.push_back(shell);
  }
  add("falloff_surfaces", scene_with(shells), 0.8, 8.0, 40.0);

  GhostHint over = anna();
  over.tips = tips_at({0.02F, 0.02F, 0.08F}, -2.0F);
  GhostHint under = bo();
  under.tips = tips_at({-0.02F, -0.02F, 0.06F});
  under.posture = HandPosture::open;
  add("ghosts", scene_with({}), 0.3, 3.0, 60.0).frame.ghosts = {over, under};

  BlendScene& mixed = add("mixed", synthetic_scene(), 0.7, 8.0, 110.0);
  mixed.frame.ghosts = {over};
  mixed.frame.symmetry = SymmetryHint{};
  mixed.frame.fingers = {{{0.03F, -0.03F, 0.07F}, {0.7F, 0.06F, 0.05F}, 0.5F}};

  auto close = entity_named("close"), far = entity_named("far");
  close->points = cloud(60, {0.09F, -0.14F, 0.12F}, {0.03F, 0.02F, 0.02F}, 0.3, 0.6);
  far->points = cloud(1500, {-0.5F, 1.6F, 0.2F}, {0.6F, 0.5F, 0.15F}, 0.2, 0.6);
  auto between = entity_named("between");
  between->surface = moved_shell(0.0F, 0.0F, 0.7F);
  add("near_and_far", scene_with({close, far, between}), 0.2, 3.0, 10.0);

  auto faint = entity_named("faint"), firm = entity_named("firm");
  faint->points = cloud(500, {0.0F, 0.0F, 0.05F}, {0.06F, 0.04F, 0.03F}, 0.05, 0.12);
  firm->points = cloud(80, {0.0F, 0.0F, 0.05F}, {0.06F, 0.04F, 0.03F}, 0.80, 0.99);
  auto veil = entity_named("veil");
  veil->surface = moved_shell(0.02F, 0.3F, 0.12F);
  add("extreme_opacities", scene_with({faint, firm, veil}), 0.8, 8.0, 25.0);

  auto behind = entity_named("behind"), before = entity_named("before"), half = entity_named("half");
  behind->points = cloud(150, {0.0F, 0.0F, 0.01F}, {0.05F, 0.03F, 0.01F}, 0.3, 0.8);
  before->points = cloud(150, {0.0F, 0.0F, 0.075F}, {0.05F, 0.03F, 0.01F}, 0.3, 0.8);
  half->surface = moved_shell(0.0F, 0.0F, 0.45F);
  add("points_about_a_veil", scene_with({behind, before, half}), 1.8, 18.0, 45.0);
  return scenes;
}

}  // namespace handloft::client::test
