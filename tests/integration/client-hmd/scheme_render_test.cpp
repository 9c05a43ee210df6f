// The lit scene in every scheme of colours (V7), and comments' pins (U6), as golden pictures.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "client-hmd/hud/hud.h"
#include "tests/integration/client-hmd/rendering_fixture.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client {
namespace {

enum class Shown {
  curvature,  ///< With its legend.
  work,       ///< Distances with their legend, a control net, strokes in the air, what is selected.
};

struct SchemeView {
  ColourScheme scheme;
  Shown shown;
};

std::string name_of_view(const SchemeView& view) {
  std::string name(colour_scheme_name(view.scheme));
  for (char& c : name) c = c == '-' ? '_' : c;
  return name + (view.shown == Shown::curvature ? "_curvature" : "_work");
}

std::shared_ptr<const SceneCurve> stroke(CurveKind kind, float y) {
  auto curve = std::make_shared<SceneCurve>();
  curve->kind = kind;
  for (int i = 0; i <= 20; ++i) {
    const float t = static_cast<float>(i) / 20.0F;
    curve->points.push_back({-0.08F + 0.16F * t, y, 0.09F + 0.02F * std::sin(6.0F * t)});
  }
  return curve;
}

/// The shell, compared with what it could have been.
std::shared_ptr<const Scene> compared_shell() {
  auto scene = std::make_shared<Scene>(*test::synthetic_scene(Representation::surface));
  auto shell = std::make_shared<Entity>(*scene->entities.at("top"));
  auto distances = std::make_shared<std::vector<float>>();
  for (const SurfaceVertex& vertex : shell->surface->vertices)
    distances->push_back(0.12F * vertex.position.y);
  shell->distances_m = distances;
  scene->entities["top"] = shell;
  return scene;
}

std::shared_ptr<const ControlNet> net_over_shell() {
  auto net = std::make_shared<ControlNet>();
  net->rows = net->columns = 5;
  for (int j = 0; j < 5; ++j) {
    for (int i = 0; i < 5; ++i) {
      const double x = -0.05 + 0.025 * i, y = -0.03 + 0.015 * j;
      net->points.push_back(test::forwards(x, y, test::shell_height(x, y) + 0.006));
    }
  }
  return net;
}

class InAScheme : public test::Rendering, public testing::WithParamInterface<SchemeView> {
 protected:
  static constexpr int width = 640, height = 360;

  Image picture(const SchemeView& view) {
    Frame frame = frame_of(compared_shell(), width, height);
    OrbitCamera near;
    near.distance_m = 0.36;
    frame.eye = near.eye(width, height);
    frame.colours = view.scheme;
    HudStatus status;
    status.model_connected = status.has_scene = true;
    status.shapes = status.surfaces = 1;
    status.colours = view.scheme;
    if (view.shown == Shown::curvature) {
      frame.shading = Shading::curvature;
    } else {
      frame.distances = status.distances = DistanceScale{};
      status.references = status.compared = 1;
      frame.overlays.control_nets = true;
      frame.control_nets.emplace("top", net_over_shell());
      frame.air_curves = {stroke(CurveKind::profile, -0.05F), stroke(CurveKind::boundary, -0.07F)};
    }
    frame.overlay = layout_hud(status, width, height,
                               [this](std::string_view text) { return renderer_->measure_text(text); });
    return draw(frame);
  }
};

TEST_P(InAScheme, LooksAsItShall_V7) {
  expect_golden(picture(GetParam()), "client_scheme_" + name_of_view(GetParam()));
}

TEST_P(InAScheme, IsNoOtherScheme_V7) {
  for (const ColourScheme other : colour_schemes) {
    if (other == GetParam().scheme) continue;
    const double difference =
        *mean_absolute_difference(picture(GetParam()), picture({other, GetParam().shown}));
    EXPECT_GT(difference, 0.05) << colour_scheme_name(other);
  }
}

INSTANTIATE_TEST_SUITE_P(Schemes, InAScheme,
                         testing::Values(SchemeView{ColourScheme::normal, Shown::curvature},
                                         SchemeView{ColourScheme::normal, Shown::work},
                                         SchemeView{ColourScheme::colour_blind_safe, Shown::curvature},
                                         SchemeView{ColourScheme::colour_blind_safe, Shown::work},
                                         SchemeView{ColourScheme::high_contrast, Shown::curvature},
                                         SchemeView{ColourScheme::high_contrast, Shown::work}),
                         [](const auto& view) { return name_of_view(view.param); });

using PinRendering = test::Rendering;

TEST_F(PinRendering, PinsStandWhereCommentsAre_U6) {
  constexpr int width = 640, height = 360;
  Frame frame = frame_of(test::synthetic_scene(Representation::surface), width, height);
  OrbitCamera near;
  near.distance_m = 0.36;
  frame.eye = near.eye(width, height);
  const Image bare = draw(frame);
  frame.pins = {{{0.0F, 0.02F, 0.05F}, 1, linear_rgb(user_colour(3, ColourScheme::normal))},
                {{0.02F, -0.03F, 0.04F}, 12, linear_rgb(user_colour(4, ColourScheme::normal))}};
  const Image pinned = draw(frame);
  EXPECT_GT(*mean_absolute_difference(bare, pinned), 0.05);
  frame.pins = {{{0.0F, 0.0F, 5.0F}, 1, glm::vec3(0.5F)}};  // Behind the eye.
  EXPECT_LT(*mean_absolute_difference(bare, draw(frame)), 0.001);
  expect_golden(pinned, "client_pins");
}

}  // namespace
}  // namespace handloft::client
