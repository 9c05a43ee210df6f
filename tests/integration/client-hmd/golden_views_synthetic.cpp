// Views of scenes that need no server: shadings, gestures, ghosts, film, and what is hard to blend.

#include <cmath>

#include "client-hmd/main/scene_extent.h"
#include "tests/integration/client-hmd/blend_scenes.h"
#include "tests/integration/client-hmd/film_scene.h"
#include "tests/integration/client-hmd/ghost_scene.h"
#include "tests/integration/client-hmd/golden_designs.h"
#include "tests/integration/client-hmd/golden_view.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client::test {
namespace {

OrbitCamera near_camera(double azimuth_rad = -1.2, double elevation_rad = 0.5, double distance_m = 0.30) {
  OrbitCamera camera;
  camera.target = {0.0, 0.0, 0.045};
  camera.azimuth_rad = azimuth_rad;
  camera.elevation_rad = elevation_rad;
  camera.distance_m = distance_m;
  return camera;
}

Frame near_frame(Representation representation) {
  return frame_from(synthetic_scene(representation), near_camera());
}

std::shared_ptr<const SceneCurve> line_over_shell(CurveKind kind, double y = 0.005) {
  auto line = std::make_shared<SceneCurve>();
  line->kind = kind;
  for (int i = 0; i <= 60; ++i) {
    const double u = i / 60.0;
    line->points.push_back(kind == CurveKind::boundary
                               ? forwards(0.07 * std::cos(5.6 * u), 0.045 * std::sin(5.6 * u), 0.06)
                               : forwards(0.1 * u - 0.05, y, 0.052 + 0.012 * std::sin(3.0 * u)));
  }
  return line;
}

DiskHint disk_at(const glm::vec3& centre, float range) {
  return {centre, glm::normalize(glm::vec3(0.2F, -0.1F, -1.0F)), 0.022F, range, std::nullopt};
}

std::shared_ptr<const Scene> targeted() {
  return changed(*synthetic_scene(), "top", [](Entity& top) { top.target = true; });
}

/// The last stroke is still in the air; `by` a client.
std::shared_ptr<const Scene> in_the_air(std::uint64_t by) {
  return changed(*synthetic_scene(Representation::points), "top", [by](Entity& top) {
    top.provisional = true;
    top.provisional_by = by;
    top.settled_points -= 80;
  });
}

}  // namespace

Frame frame_from(std::shared_ptr<const Scene> scene, const OrbitCamera& camera) {
  Frame frame;
  frame.scene = std::move(scene);
  frame.eye = camera.eye(view_width_px, view_height_px);
  return frame;
}

Frame usual_frame(std::shared_ptr<const Scene> scene) {
  return frame_from(std::move(scene), OrbitCamera());
}

Frame fitted_frame(std::shared_ptr<const Scene> scene, double azimuth_rad, double elevation_rad) {
  OrbitCamera camera;
  camera.azimuth_rad = azimuth_rad;
  camera.elevation_rad = elevation_rad;
  camera.fit(visible_places(*scene), view_width_px, view_height_px, {0.05, 0.05});
  return frame_from(std::move(scene), camera);
}

std::vector<GoldenView> synthetic_views() {
  const auto shaded = [](Shading shading) {
    return [shading] {
      Frame frame = near_frame(Representation::surface);
      frame.shading = shading;
      return frame;
    };
  };
  return {
      {"synthetic_points", [] { return near_frame(Representation::points); }},
      {"synthetic_surface", [] { return near_frame(Representation::surface); }},
      {"synthetic_both", [] { return near_frame(Representation::both); }},
      {"synthetic_car_paint", shaded(Shading::car_paint)},
      {"synthetic_silver", shaded(Shading::silver)},
      {"synthetic_zebra", shaded(Shading::zebra)},
      {"synthetic_wires",
       [] {
         Frame frame = near_frame(Representation::surface);
         frame.overlays.wires = true;
         return frame;
       }},
      {"synthetic_isophotes",
       [] {
         Frame frame = near_frame(Representation::surface);
         frame.overlays.isophotes = true;
         return frame;
       }},
      {"synthetic_top", [] { return frame_from(synthetic_scene(), near_camera(-1.5708, 1.5, 0.35)); }},
      {"synthetic_in_the_room", [] { return usual_frame(synthetic_scene()); }},
      {"empty_table", [] { return usual_frame(nullptr); }},
      {"palette_second_page",
       [] {
         Frame frame = usual_frame(nullptr);
         frame.palette_page = 2;
         frame.touched = PaletteCommand::redo;
         return frame;
       }},
      {.name = "synthetic_pair",
       .frame = [] { return near_frame(Representation::both); },
       .eye_distance_m = 0.064},
  };
}

std::vector<GoldenView> gesture_views() {
  const auto with_disk = [](float range) {
    return [range] {
      Frame frame = frame_from(targeted(), near_camera());
      frame.disks = {disk_at({0.01F, 0.0F, 0.062F}, range)};
      return frame;
    };
  };
  const auto with_curve = [](CurveKind kind) {
    return [kind] {
      Frame frame = near_frame(Representation::surface);
      frame.air_curves = {line_over_shell(kind)};
      return frame;
    };
  };
  return {
      {"gestures_disk", with_disk(0.4F)},
      {"gestures_profile", with_curve(CurveKind::profile)},
      {"gestures_boundary", with_curve(CurveKind::boundary)},
      {"gestures_kinds",
       [] {
         Frame frame = frame_from(nullptr, near_camera(-1.4, 0.7, 0.25));
         frame.air_curves = {line_over_shell(CurveKind::profile, -0.03),
                             line_over_shell(CurveKind::curve, 0.0), line_over_shell(CurveKind::boundary)};
         return frame;
       }},
      {"gestures_symmetry",
       [] {
         Frame frame = near_frame(Representation::points);
         frame.symmetry = SymmetryHint{};
         return frame;
       }},
      {"gestures_in_the_air", [] { return frame_from(in_the_air(0), near_camera()); }},
      {"gestures_cursor",
       [] {
         Frame frame = near_frame(Representation::both);
         frame.fingers = {{{0.03F, -0.03F, 0.075F}, {0.70F, 0.03F, 0.04F}, 1.0F},
                          {{0.0F, -0.05F, 0.075F}, {0.02F, 0.50F, 0.06F}, 0.5F},
                          {{-0.03F, -0.02F, 0.08F}, {0.03F, 0.07F, 0.70F}, 1.0F}};
         frame.pressure = PressureMark{{0.0F, -0.03F, 0.075F}, 0.6F, true};
         return frame;
       }},
      {"curves_behind_the_shell",
       [] {
         Frame frame = near_frame(Representation::surface);
         auto line = std::make_shared<SceneCurve>();
         for (int i = 0; i <= 40; ++i)
           line->points.push_back({-0.08F + 0.004F * static_cast<float>(i), 0.02F, 0.03F});
         frame.air_curves = {line};
         return frame;
       }},
  };
}

std::vector<GoldenView> ghost_views() {
  const auto with = [](std::vector<GhostHint> ghosts, std::shared_ptr<const Scene> scene) {
    return [ghosts = std::move(ghosts), scene = std::move(scene)] {
      OrbitCamera camera;
      camera.target = {0.02, 0.03, 0.08};
      camera.distance_m = 0.62;
      camera.azimuth_rad = -1.3;
      camera.elevation_rad = 0.45;
      Frame frame = frame_from(scene, camera);
      frame.ghosts = ghosts;
      return frame;
    };
  };
  GhostHint drawing = anna();
  drawing.doing = "drawing a profile";
  drawing.posture = HandPosture::pointing;
  drawing.curve = line_over_shell(CurveKind::profile);
  GhostHint pushing = bo();
  pushing.disk = disk_at({-0.05F, -0.015F, 0.08F}, 0.5F);
  GhostHint laying = anna();
  laying.client_id = 2;
  laying.entity = "top";
  GhostHint fading = bo();
  fading.opacity = 0.4F;
  GhostHint unsure = anna();
  for (auto& tip : unsure.tips) tip->certainty = 0.4F;
  unsure.tips[4].reset();
  unsure.tips[0].reset();
  GhostHint before = bo();
  before.tips = tips_at({0.0F, -0.02F, 0.075F});
  before.posture = HandPosture::open;
  before.name = "Cem";
  before.doing = "";
  before.colour = {0.35F, 0.05F, 0.40F};
  // Held by somebody whose hand is not to be seen, with a comment of somebody else's on it (U1, U6).
  const auto held = [](ColourScheme colours) {
    return [colours] {
      Frame frame = near_frame(Representation::surface);
      frame.colours = colours;
      frame.holders.push_back({"top", "Mira", linear_rgb(user_colour(3, colours))});
      frame.pins.push_back({{0.02F, -0.01F, 0.047F}, 1, linear_rgb(user_colour(4, colours))});
      return frame;
    };
  };
  return {
      {"held_by_somebody", held(ColourScheme::normal)},
      {"held_by_somebody_colour_blind_safe", held(ColourScheme::colour_blind_safe)},
      {"held_by_somebody_high_contrast", held(ColourScheme::high_contrast)},
      {"ghosts_two", with({anna(), bo()}, synthetic_scene())},
      {"ghosts_drawing", with({drawing}, synthetic_scene(Representation::surface))},
      {"ghosts_pushing", with({pushing}, synthetic_scene(Representation::points))},
      {"ghosts_gesture_in_the_air", with({laying}, in_the_air(2))},
      {"ghosts_fading", with({anna(), fading}, nullptr)},
      {"ghosts_unsure", with({unsure}, nullptr)},
      {"ghosts_before_the_shell", with({before}, synthetic_scene())},
      {.name = "ghosts_peeled",
       .frame = with({before, anna()}, synthetic_scene()),
       .transparency = Transparency::depth_peeling},
  };
}

std::vector<GoldenView> film_views() {
  const auto filmed = [](const glm::vec3& tips, Representation representation, HandOcclusion occlusion) {
    return [=] {
      Frame frame =
          filmed_frame(synthetic_scene(representation), filmed_hand_at(tips), view_width_px, view_height_px);
      frame.hand_occlusion = occlusion;
      return frame;
    };
  };
  const glm::vec3 over(0.005F, -0.01F, 0.09F), under(0.005F, 0.02F, 0.012F);
  return {
      {"film_hand_hides", filmed(over, Representation::both, HandOcclusion::on)},
      {"film_hand_hides_points", filmed(over, Representation::points, HandOcclusion::on)},
      {"film_hand_does_not_hide", filmed(over, Representation::both, HandOcclusion::off)},
      {"film_hand_is_behind", filmed(under, Representation::both, HandOcclusion::on)},
      {"film_hand_unsure",
       [over] {
         FilmedHand hand = filmed_hand_at(over);
         for (auto& tip : hand.tips) tip->certainty = 0.25F;
         return filmed_frame(synthetic_scene(), hand, view_width_px, view_height_px);
       }},
  };
}

std::vector<GoldenView> transparency_views() {
  std::vector<GoldenView> views;
  for (const BlendScene& scene : blend_scenes()) {
    const auto frame = [scene] {
      Frame one = scene.frame;
      one.eye = scene.camera.eye(view_width_px, view_height_px);
      return one;
    };
    views.push_back({"blend_" + scene.name, frame});
  }
  return views;
}

}  // namespace handloft::client::test
