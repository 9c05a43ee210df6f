// Icons of sculpted surfaces (D17) and stripes that judge them, in pictures of the real renderer.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/integration/client-hmd/rendering_fixture.h"

namespace handloft::client {
namespace {

constexpr int side = 48;
constexpr float half_width_m = 0.12F;

float height(float x, float y) {
  return 0.06F + 0.03F * std::exp(-200.0F * (x * x + y * y)) + 0.012F * std::sin(20.0F * x);
}

Vec3f on_surface(float x, float y) {
  return {x, y, height(x, y)};
}

std::shared_ptr<const SurfaceMesh> bump() {
  auto mesh = std::make_shared<SurfaceMesh>();
  const auto at = [](int i) { return half_width_m * (2.0F * static_cast<float>(i) / side - 1.0F); };
  constexpr float step = 1e-3F;
  for (int i = 0; i <= side; ++i) {
    for (int j = 0; j <= side; ++j) {
      const float x = at(i), y = at(j);
      const glm::vec3 normal = glm::normalize(glm::vec3(
          height(x - step, y) - height(x + step, y), height(x, y - step) - height(x, y + step), 2.0F * step));
      mesh->vertices.push_back({on_surface(x, y), {normal.x, normal.y, normal.z}, 1.0F});
    }
  }
  for (std::uint32_t i = 0; i < side; ++i) {
    for (std::uint32_t j = 0; j < side; ++j) {
      const std::uint32_t a = i * (side + 1) + j, b = a + side + 1;
      mesh->indices.insert(mesh->indices.end(), {a, b, b + 1, a, b + 1, a + 1});
    }
  }
  return mesh;
}

SceneIcon icon(const std::string& id, float x, float y, std::uint32_t colour) {
  SceneIcon one;
  one.id = id;
  one.place = on_surface(x, y);
  one.colour_rgba = colour;
  return one;
}

constexpr std::uint32_t red = 0xD8372AFF, green = 0x2FA84FFF, yellow = 0xF2C31BFF, grey = 0x8C9199FF;

std::vector<SceneIcon> every_kind() {
  std::vector<SceneIcon> icons{icon("top", 0.0F, 0.0F, red),          icon("pull", 0.06F, 0.05F, green),
                               icon("slope", -0.05F, -0.03F, yellow), icon("up", 0.05F, -0.04F, red),
                               icon("off", -0.06F, 0.06F, grey),      icon("line", -0.08F, -0.08F, red),
                               icon("patch", 0.08F, 0.08F, green),    icon("keep", -0.02F, 0.05F, red)};
  icons[2].property = IconProperty::derivative;
  icons[2].direction = Vec3f{0.8F, 0.0F, 0.6F};
  icons[2].label = "R";
  icons[3].property = IconProperty::normal;
  icons[3].direction = Vec3f{0.0F, 0.0F, 1.0F};
  icons[4].state = IconState::sleeping;
  icons[5].shape = IconShape::curve;
  for (int i = 0; i <= 40; ++i)
    icons[5].outline.push_back(on_surface(0.004F * static_cast<float>(i) - 0.08F, -0.08F));
  icons[6].shape = IconShape::region;
  for (const auto& [x, y] :
       {std::pair{0.07F, 0.07F}, {0.1F, 0.07F}, {0.1F, 0.1F}, {0.07F, 0.1F}, {0.07F, 0.07F}})
    icons[6].outline.push_back(on_surface(x, y));
  icons[7].state = IconState::passive;
  return icons;
}

std::shared_ptr<const Scene> hood(std::vector<SceneIcon> icons) {
  auto entity = std::make_shared<Entity>();
  entity->id = entity->name = "hood";
  entity->kind = EntityKind::sculpt_surface;
  entity->representation = Representation::surface;
  entity->surface = bump();
  entity->icons = std::make_shared<const std::vector<SceneIcon>>(std::move(icons));
  auto scene = std::make_shared<Scene>();
  scene->entities["hood"] = entity;
  return scene;
}

class IconRendering : public test::Rendering {
 protected:
  double difference(const Frame& a, const Frame& b) { return *mean_absolute_difference(draw(a), draw(b)); }
};

TEST_F(IconRendering, MatchesTheGoldenPicture_D17) {
  std::vector<SceneIcon> icons = every_kind();
  icons[0].held = true;
  icons[1].target = true;
  RenderOptions still;
  still.supersampling = 2;
  expect_golden(draw(frame_of(hood(icons), 960, 540), still), "client_icons");
}

TEST_F(IconRendering, EveryKindLooksUnlikeTheOthers_D17) {
  const Frame none = frame_of(hood({}));
  const auto with = [&](const std::function<void(SceneIcon&)>& change) {
    SceneIcon one = icon("one", 0.03F, 0.0F, red);
    change(one);
    return frame_of(hood({one}));
  };
  const Frame usual = with([](SceneIcon&) {});
  constexpr double visible = 0.005;  // Of 255, over a picture of which a ball is a thousandth.
  EXPECT_GT(difference(usual, none), visible);
  EXPECT_EQ(draw(usual).rgba, draw(usual).rgba);
  EXPECT_GT(difference(usual, with([](SceneIcon& i) { i.colour_rgba = green; })), visible);
  EXPECT_GT(difference(usual, with([](SceneIcon& i) { i.direction = Vec3f{0, 0, 1}; })), visible);
  EXPECT_GT(difference(usual, with([](SceneIcon& i) { i.label = "R2"; })), visible);
  EXPECT_GT(
      difference(with([](SceneIcon& i) { i.label = "R2"; }), with([](SceneIcon& i) { i.label = "V2"; })),
      0.0005);
  EXPECT_GT(difference(usual, with([](SceneIcon& i) { i.target = true; })), visible);
  EXPECT_GT(difference(usual, with([](SceneIcon& i) { i.held = true; })), visible);
  EXPECT_GT(difference(usual, with([](SceneIcon& i) { i.state = IconState::passive; })), 0.001);
  EXPECT_GT(difference(usual, with([](SceneIcon& i) {
                         i.outline = {on_surface(0, 0), on_surface(0.05F, 0)};
                       })),
            visible);
}

TEST_F(IconRendering, AnIconInsideOrBehindASurfaceIsHidden) {
  const Frame none = frame_of(hood({}));
  SceneIcon below = icon("below", 0.0F, 0.0F, red);
  below.place.z = 0.03F;
  below.label = "R";
  EXPECT_LT(difference(frame_of(hood({below})), none), 0.05)
      << "but for what is seen beneath the sheet's edge";
}

TEST_F(IconRendering, StripesMatchTheGoldenPicture) {
  Frame frame = frame_of(hood({}), 960, 540);
  frame.shading = Shading::zebra;
  RenderOptions still;
  still.supersampling = 2;
  expect_golden(draw(frame, still), "client_zebra");
}

TEST_F(IconRendering, StripesShowADentThatIsHardToSee) {
  const auto scene = hood({});
  auto dented = std::make_shared<SurfaceMesh>(*scene->entities.at("hood")->surface);
  for (SurfaceVertex& v : dented->vertices) {
    // As a tenth of a millimetre over two centimetres turns normals.
    const float r2 = v.position.x * v.position.x + v.position.y * v.position.y;
    v.normal.x += 40.0F * 1e-4F * 2.0F * v.position.x / 4e-4F * std::exp(-r2 / 4e-4F) * 0.1F;
  }
  auto entity = std::make_shared<Entity>(*scene->entities.at("hood"));
  entity->surface = dented;
  auto other = std::make_shared<Scene>(*scene);
  other->entities["hood"] = entity;
  Frame before = frame_of(scene), after = frame_of(other);
  const double in_studio = difference(before, after);
  before.shading = after.shading = Shading::zebra;
  EXPECT_GT(difference(before, after), 2.0 * in_studio);
}

}  // namespace
}  // namespace handloft::client
