// Views of the designs of tests/data/scripts: what model, stream and mirror make of them.

#include <gtest/gtest.h>

#include "tests/integration/client-hmd/ghost_scene.h"
#include "tests/integration/client-hmd/golden_designs.h"
#include "tests/integration/client-hmd/golden_view.h"

namespace handloft::client::test {
namespace {

std::shared_ptr<const Scene> scene_of(const Design& design) {
  Result<std::shared_ptr<const Scene>> scene = design_scene(design);
  if (scene) return *scene;
  ADD_FAILURE() << scene.error().describe();
  return std::make_shared<const Scene>();
}

/// From where a design looks best, angles in radians.
struct Direction {
  double azimuth_rad, elevation_rad;
};
constexpr Direction at_mouse{-0.95, 0.55}, at_seat{0.855, 0.30}, at_panel{1.29, 0.105}, at_hood{-1.15, 0.50};

std::function<Frame()> view(const Design& design, Representation representation, Direction from,
                            std::function<void(Frame&)> more = {}) {
  return [=] {
    Frame frame =
        fitted_frame(shown_as(*scene_of(design), representation), from.azimuth_rad, from.elevation_rad);
    if (more) more(frame);
    return frame;
  };
}

std::function<void(Frame&)> shaded(Shading shading) {
  return [shading](Frame& frame) { frame.shading = shading; };
}

void with_wires(Frame& frame) {
  frame.overlays.wires = true;
}

std::function<void(Frame&)> with_net(const Design& design) {
  return [design](Frame& frame) {
    frame.overlays.control_nets = true;
    const Result<ControlNets> nets = design_nets(design);
    ASSERT_TRUE(nets.ok()) << nets.error().describe();
    EXPECT_FALSE(nets->empty());
    frame.control_nets = *nets;
  };
}

}  // namespace

std::vector<GoldenView> mouse_views() {
  const Design mouse{
      .script = "computer_mouse", .more = {}, .selected = "top", .targets = {}, .in_the_air = {}};
  Design thumb_rest = mouse;
  thumb_rest.more = {R"({"switchAlternative": {"name": "thumb rest"}})"};
  Design aimed = mouse;
  aimed.targets = {"side"};
  Design laying = mouse;
  laying.in_the_air =
      R"({"addPoints": {"entity": "top", "points": [)"
      R"({"position": {"x": -0.02, "y": 0.0, "z": 0.05}, "pressure": 0.3}, {"position": {"x": -0.01, "y": 0.0, "z": 0.053}, "pressure": 0.5},)"
      R"({"position": {"x": 0.0, "y": 0.0, "z": 0.055}, "pressure": 0.7}, {"position": {"x": 0.01, "y": 0.0, "z": 0.053}, "pressure": 0.6},)"
      R"({"position": {"x": 0.02, "y": 0.0, "z": 0.05}, "pressure": 0.2}]}})";
  laying.by = 2;
  return {
      {"mouse_points", view(mouse, Representation::points, at_mouse)},
      {"mouse_surface", view(mouse, Representation::surface, at_mouse)},
      {"mouse_both", view(mouse, Representation::both, at_mouse)},
      {"mouse_zebra", view(mouse, Representation::surface, at_mouse, shaded(Shading::zebra))},
      {"mouse_distances", view(mouse, Representation::surface, at_mouse,
                               [](Frame& frame) { frame.distances = DistanceScale{0.01F}; })},
      {"mouse_from_behind", view(mouse, Representation::surface, {1.9, 0.4})},
      {"mouse_from_above", view(mouse, Representation::both, {-1.5708, 1.45})},
      {"mouse_thumb_rest", view(thumb_rest, Representation::surface, at_mouse)},
      {"mouse_side_aimed_at", view(aimed, Representation::surface, at_mouse)},
      {"mouse_anna_lays_points", view(laying, Representation::points, at_mouse,
                                      [](Frame& frame) {
                                        GhostHint ghost = anna();
                                        ghost.tips = tips_at({0.025F, 0.005F, 0.06F}, -2.2F);
                                        ghost.head.reset();
                                        frame.ghosts = {ghost};
                                      })},
      {.name = "mouse_pair",
       .frame = view(mouse, Representation::surface, at_mouse),
       .eye_distance_m = 0.064},
  };
}

std::vector<GoldenView> seat_views() {
  const Design seat{.script = "car_seat", .more = {}, .selected = "cushion", .targets = {}, .in_the_air = {}};
  return {
      {"seat_points", view(seat, Representation::points, at_seat)},
      {"seat_surface", view(seat, Representation::surface, at_seat)},
      {"seat_both", view(seat, Representation::both, at_seat)},
      {"seat_zebra", view(seat, Representation::surface, at_seat, shaded(Shading::zebra))},
      {"seat_clay", view(seat, Representation::surface, at_seat, shaded(Shading::clay))},
      {"seat_from_the_front", view(seat, Representation::surface, {1.5708, 0.15})},
  };
}

std::vector<GoldenView> panel_views() {
  const Design panel{
      .script = "car_side_panel", .more = {}, .selected = "panel", .targets = {}, .in_the_air = {}};
  return {
      {"panel_points", view(panel, Representation::points, at_panel)},
      {"panel_surface", view(panel, Representation::surface, at_panel)},
      {"panel_both", view(panel, Representation::both, at_panel)},
      {"panel_zebra", view(panel, Representation::surface, at_panel, shaded(Shading::zebra))},
      {"panel_car_paint", view(panel, Representation::surface, at_panel, shaded(Shading::car_paint))},
      {"panel_wires", view(panel, Representation::surface, at_panel, with_wires)},
  };
}

std::vector<GoldenView> sculpt_views() {
  const Design icons{.script = "hood_icons", .more = {}, .selected = "hood", .targets = {}, .in_the_air = {}};
  const Design hood{.script = "car_hood", .more = {}, .selected = "hood", .targets = {}, .in_the_air = {}};
  const Design saddle{
      .script = "bicycle_saddle", .more = {}, .selected = {}, .targets = {}, .in_the_air = {}};
  const auto held = [](Frame& frame) {
    frame.scene = changed(*frame.scene, "hood", [](Entity& entity) {
      auto marked = std::make_shared<std::vector<SceneIcon>>(*entity.icons);
      ASSERT_GE(marked->size(), 2U);
      marked->front().held = true;
      marked->back().target = true;
      entity.icons = marked;
    });
  };
  return {
      {"hood_icons", view(icons, Representation::surface, at_hood)},
      {"hood_icons_held", view(icons, Representation::surface, at_hood, held)},
      {"hood_icons_zebra", view(icons, Representation::surface, at_hood, shaded(Shading::zebra))},
      {"hood_net", view(icons, Representation::surface, at_hood, with_net(icons))},
      {"hood_committed", view(hood, Representation::surface, at_hood)},
      {"saddle_points", view(saddle, Representation::points, at_mouse)},
      {"saddle_surface", view(saddle, Representation::surface, at_mouse)},
  };
}

}  // namespace handloft::client::test
