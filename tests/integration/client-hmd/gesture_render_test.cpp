// What hangs in the air while a hand works (A12, A13, A16, A18, A24, A25), in pictures of the real renderer.

#include <gtest/gtest.h>

#include <cmath>

#include "client-hmd/hud/hud.h"
#include "tests/integration/client-hmd/rendering_fixture.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client {
namespace {

class GestureRendering : public test::Rendering {
 protected:
  static constexpr int width = 480, height = 270;

  double difference(const Frame& a, const Frame& b) { return *mean_absolute_difference(draw(a), draw(b)); }

  static DiskHint disk(float range = 0.4F) {
    return {{0.01F, 0.0F, 0.062F}, glm::normalize(glm::vec3(0.2F, -0.1F, -1.0F)), 0.022F, range};
  }

  /// A stroke over the shell, or a loop round it.
  static std::shared_ptr<const SceneCurve> curve(CurveKind kind) {
    auto line = std::make_shared<SceneCurve>();
    line->kind = kind;
    for (int i = 0; i <= 60; ++i) {
      const double u = i / 60.0;
      line->points.push_back(kind == CurveKind::boundary
                                 ? test::forwards(0.07 * std::cos(5.6 * u), 0.045 * std::sin(5.6 * u), 0.06)
                                 : test::forwards(0.1 * u - 0.05, 0.005, 0.052 + 0.012 * std::sin(3.0 * u)));
    }
    return line;
  }
};

TEST_F(GestureRendering, MatchesTheGoldenPicture) {
  auto scene = std::make_shared<Scene>(*test::synthetic_scene());
  auto target = std::make_shared<Entity>(*scene->entities.at("top"));
  target->target = true;
  scene->entities["top"] = target;
  Frame frame = frame_of(scene, 960, 540);
  frame.disks = {disk()};
  frame.air_curves = {curve(CurveKind::profile), curve(CurveKind::boundary)};
  frame.symmetry = SymmetryHint{};
  HudStatus status;
  status.model_connected = status.has_scene = true;
  status.hand = HandStatus{v1::GESTURE_CLOSED, 0.4, false, true, 80};
  status.tool = "pushing";
  status.range = 0.4F;
  status.shapes = 1;
  status.target = "top";
  frame.overlay =
      layout_hud(status, 960, 540, [this](std::string_view text) { return renderer_->measure_text(text); });
  RenderOptions still;
  still.supersampling = 2;
  expect_golden(draw(frame, still), "client_gestures");
}

TEST_F(GestureRendering, TheDiskShowsItsPlaceRadiusNormalAndRange_A13_A16) {
  const Frame none = frame_of(nullptr, width, height);
  const auto with = [&](DiskHint hint) {
    Frame frame = none;
    frame.disks = {hint};
    return frame;
  };
  const Frame usual = with(disk());
  EXPECT_GT(difference(usual, none), 0.2);
  EXPECT_EQ(draw(usual).rgba, draw(usual).rgba);
  DiskHint larger = disk(), turned = disk(), elsewhere = disk();
  larger.radius_m *= 1.5F;
  turned.normal = -turned.normal;
  elsewhere.centre.x += 0.02F;
  EXPECT_GT(difference(usual, with(larger)), 0.1);
  EXPECT_GT(difference(usual, with(turned)), 0.01) << "the arrow says on which side it pushes";
  EXPECT_GT(difference(usual, with(elsewhere)), 0.1);
  // The gauge grows with the range, evenly.
  const double quarter = difference(with(disk(0.0F)), with(disk(0.25F)));
  const double half = difference(with(disk(0.0F)), with(disk(0.5F)));
  const double full = difference(with(disk(0.0F)), with(disk(1.0F)));
  EXPECT_GT(quarter, 0.01);
  EXPECT_NEAR(half / full, 0.5, 0.12);
  EXPECT_GT(half, quarter);
}

TEST_F(GestureRendering, ADiskInsideAShapeShinesThrough_A13) {
  Frame shape = frame_of(test::synthetic_scene(Representation::surface), width, height);
  Frame inside = shape;
  DiskHint below = disk();
  below.centre.z = 0.02F;  // Under the shell, which is opaque.
  inside.disks = {below};
  Frame alone = frame_of(nullptr, width, height);
  Frame free_disk = alone;
  free_disk.disks = {below};
  const double faint = difference(inside, shape);
  EXPECT_GT(faint, 0.02);
  EXPECT_LT(faint, 0.8 * difference(free_disk, alone));
}

/// Its pixels without their colours.
Image grey(Image image) {
  for (std::size_t i = 0; i + 3 < image.rgba.size(); i += 4) {
    const double y = 0.2126 * image.rgba[i] + 0.7152 * image.rgba[i + 1] + 0.0722 * image.rgba[i + 2];
    image.rgba[i] = image.rgba[i + 1] = image.rgba[i + 2] = static_cast<std::uint8_t>(y);
  }
  return image;
}

TEST_F(GestureRendering, KindsOfCurvesDifferWithoutColour_A18_A24) {
  // The same line as each kind, in one and the same colour.
  const auto drawn = [&](CurveKind kind) {
    auto line = std::make_shared<SceneCurve>(*curve(CurveKind::profile));
    line->kind = kind;
    line->closed = true;  // So that no boundary shows how it would be closed.
    line->colour_rgba = 0x802010FF;
    Frame frame = frame_of(nullptr, width, height);
    frame.air_curves = {line};
    OrbitCamera near;
    near.target = {0.0, 0.0, 0.05};
    near.distance_m = 0.35;
    frame.eye = near.eye(width, height);
    return grey(draw(frame));
  };
  const Image plain = drawn(CurveKind::curve), profile = drawn(CurveKind::profile),
              boundary = drawn(CurveKind::boundary);
  EXPECT_GT(*mean_absolute_difference(plain, profile), 0.05);
  EXPECT_GT(*mean_absolute_difference(plain, boundary), 0.05);
  EXPECT_GT(*mean_absolute_difference(profile, boundary), 0.05);
}

TEST_F(GestureRendering, BracketsTellTheTarget_A25) {
  const std::shared_ptr<const Scene> scene = test::synthetic_scene();
  auto marked = std::make_shared<Scene>(*scene);
  auto entity = std::make_shared<Entity>(*scene->entities.at("top"));
  entity->target = true;
  marked->entities["top"] = entity;
  const double shown = difference(frame_of(marked, width, height), frame_of(scene, width, height));
  EXPECT_GT(shown, 0.1);
  EXPECT_LT(shown, 5.0) << "the shape itself stays as it is";
}

TEST_F(GestureRendering, TheSymmetryPlaneIsTheOneTold_A12) {
  const auto with = [&](const glm::vec3& origin, const glm::vec3& normal) {
    Frame frame = frame_of(nullptr, width, height);
    frame.symmetry = SymmetryHint{origin, glm::normalize(normal)};
    return frame;
  };
  const Frame usual = with({}, {1, 0, 0});
  EXPECT_GT(difference(usual, frame_of(nullptr, width, height)), 0.05);
  EXPECT_GT(difference(usual, with({0.04F, 0, 0}, {1, 0, 0})), 0.05);
  EXPECT_GT(difference(usual, with({}, {1, 1, 0})), 0.05);
  EXPECT_GT(difference(usual, with({0, 0, 0.05F}, {0, 0, 1})), 0.05) << "a plane that lies";
  EXPECT_LT(difference(usual, with({0, 3.0F, 7.0F}, {1, 0, 0})), 0.005)
      << "an origin far along the same plane";
}

}  // namespace
}  // namespace handloft::client
