// Pictures from the real renderer on EGL, mostly with Mesa's software driver: against a golden one, against
// each other, and against the mathematics of the camera.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "client-hmd/hud/hud.h"
#include "tests/integration/client-hmd/rendering_fixture.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client {
namespace {

using test::Rendering;

/// Mean position of the pixels for which `is_marked` holds, top left pixel's centre at (0, 0).
glm::dvec2 centroid(const Image& image, const std::function<bool(const std::uint8_t*)>& is_marked) {
  glm::dvec2 sum(0.0);
  int count = 0;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      if (!is_marked(&image.rgba[4 * static_cast<std::size_t>(y * image.width_px + x)])) continue;
      sum += glm::dvec2(x, y);
      ++count;
    }
  }
  EXPECT_GT(count, 0);
  return sum / static_cast<double>(std::max(count, 1));
}

bool is_red(const std::uint8_t* p) {
  return p[0] > 120 && p[1] < 90 && p[2] < 90;
}
bool is_green(const std::uint8_t* p) {
  return p[1] > 120 && p[0] < 100 && p[2] < 100;
}

TEST_F(Rendering, MatchesTheGoldenPicture) {
  Frame frame = frame_of(test::synthetic_scene());
  frame.fingers = {{{0.03F, -0.05F, 0.07F}, {0.7F, 0.06F, 0.05F}, 1.0F},
                   {{0.0F, -0.06F, 0.07F}, {0.1F, 0.5F, 0.1F}, 0.5F}};
  frame.pressure = PressureMark{{0.015F, -0.055F, 0.07F}, 0.6F, true};
  frame.touched = PaletteCommand::fit;
  RenderOptions still;
  still.supersampling = 2;
  const Image picture = draw(frame, still);
  expect_golden(picture, "client_scene");
}

TEST_F(Rendering, ShowsEveryChangeOfTheScene) {
  const Image both = draw(frame_of(test::synthetic_scene()));
  const Image again = draw(frame_of(test::synthetic_scene()));
  EXPECT_EQ(both.rgba, again.rgba) << "the same scene is the same picture, to the bit";
  const Image surface = draw(frame_of(test::synthetic_scene(Representation::surface)));
  const Image points = draw(frame_of(test::synthetic_scene(Representation::points)));
  const Image empty = draw(frame_of(nullptr));
  EXPECT_GT(*mean_absolute_difference(both, surface), 0.1);
  EXPECT_GT(*mean_absolute_difference(both, points), 0.5);
  EXPECT_GT(*mean_absolute_difference(points, empty), 0.3);
  EXPECT_EQ(draw(frame_of(test::synthetic_scene())).rgba, both.rgba) << "nothing of the others stays behind";

  Frame second_page = frame_of(nullptr);
  second_page.palette_page = 2;
  EXPECT_GT(*mean_absolute_difference(draw(second_page), empty), 0.02) << "other cells are there";
  Frame touched = frame_of(nullptr);
  touched.touched = PaletteCommand::redo;
  EXPECT_GT(*mean_absolute_difference(draw(touched), empty), 0.02);
}

TEST_F(Rendering, WeightedBlendingIsCloseToDepthPeeling_V2) {
  RenderOptions peeled;
  peeled.transparency = Transparency::depth_peeling;
  for (const Representation representation : {Representation::points, Representation::both}) {
    const Frame frame = frame_of(test::synthetic_scene(representation));
    const Image reference = draw(frame, peeled);
    const Image blended = draw(frame);
    const double difference = *mean_absolute_difference(blended, reference);
    const double similarity = *structural_similarity(blended, reference);
    RecordProperty("mean_absolute_difference", std::to_string(difference));
    RecordProperty("structural_similarity", std::to_string(similarity));
    EXPECT_LT(difference, 1.0);
    EXPECT_GT(similarity, 0.98);
    EXPECT_GT(difference, 0.0) << "two ways, or the comparison is void";
  }
}

TEST_F(Rendering, BlendingDoesNotDependOnTheOrderOfPoints_V2) {
  auto scene = std::make_shared<Scene>(*test::synthetic_scene(Representation::points));
  auto entity = std::make_shared<Entity>(*scene->entities.at("top"));
  auto reversed = std::make_shared<PointSet>(*entity->points);
  std::reverse(reversed->points.begin(), reversed->points.end());
  entity->points = reversed;
  scene->entities["top"] = entity;
  const Image one = draw(frame_of(test::synthetic_scene(Representation::points)));
  const Image other = draw(frame_of(scene));
  EXPECT_LT(*mean_absolute_difference(one, other), 0.02) << "half floats round a little";
}

TEST_F(Rendering, OnePointHasTheOpacityOfItsShells_A3) {
  // A single large point in front of the backdrop: its middle must be as opaque as the staircase says.
  auto scene = std::make_shared<Scene>();
  auto entity = std::make_shared<Entity>();
  auto set = std::make_shared<PointSet>();
  set->styles = {test::fuzzy_style(0.6)};
  set->styles[0].shell_alpha = {0.5F, 0.0F, 0.0F, 0.0F, 0.0F};  // One shell, so that the whole disc is alike.
  set->points = {{{0.075F, -0.012F, 0.2F}, 0}};
  entity->id = "p";
  entity->points = set;
  entity->settled_points = 1;
  scene->entities["p"] = entity;
  Frame frame = frame_of(scene, 320, 240);
  OrbitCamera camera;
  camera.target = {0.075, -0.012, 0.2};
  camera.distance_m = 0.1;
  frame.eye = camera.eye(320, 240);
  const Image with = draw(frame);
  frame.scene = nullptr;
  const Image without = draw(frame);
  const std::size_t middle = 4 * (120 * 320 + 160);
  const auto linear = [](std::uint8_t v) { return std::pow((v / 255.0 + 0.055) / 1.055, 2.4); };
  // ink = (0.012, 0.055, 0.17) at 50 % over what was there.
  EXPECT_NEAR(linear(with.rgba[middle]), 0.5 * linear(without.rgba[middle]) + 0.5 * 0.012, 0.02);
  EXPECT_NEAR(linear(with.rgba[middle + 2]), 0.5 * linear(without.rgba[middle + 2]) + 0.5 * 0.17, 0.02);
}

TEST_F(Rendering, DrawsAMarkerOnItsFilmedImage_V1) {
  // A camera with distortion films a small red disc; a green fingertip stands at the same place in space.
  Pinhole camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 590.0;
  camera.cx_px = 320.6;
  camera.cy_px = 238.7;
  camera.distortion = {-0.118, 0.037, 0.0003, 0.0002, 0.0};
  const RigidPose world_from_camera{{0.02, -0.45, 0.40},
                                    glm::angleAxis(-2.3, glm::normalize(glm::dvec3(1.0, 0.03, -0.02)))};
  for (const glm::dvec3 in_camera :
       {glm::dvec3(0.0, 0.0, 0.5), glm::dvec3(0.15, 0.08, 0.5), glm::dvec3(-0.15, 0.02, 0.45)}) {
    auto film = std::make_shared<Image>(Image{640, 480, std::vector<std::uint8_t>(4 * 640 * 480, 0)});
    const glm::dvec2 seen = project(camera, in_camera);
    for (int y = 0; y < 480; ++y) {
      for (int x = 0; x < 640; ++x) {
        if (glm::distance(seen, glm::dvec2(x, y)) <= 4.0) {
          film->rgba[4 * static_cast<std::size_t>(y * 640 + x)] = 255;
        }
      }
    }
    Frame frame;
    frame.eye.world_from_eye = eye_from_camera_axes(world_from_camera);
    frame.eye.pinhole = covering_pinhole(camera, 960, 540);
    static std::uint64_t serial = 0;
    frame.film = FilmedPicture{film, ++serial, camera};
    const glm::dvec2 filmed = centroid(draw(frame), is_red);

    const glm::dvec3 world = world_from_camera.position + world_from_camera.orientation * in_camera;
    frame.film->image = std::make_shared<Image>(Image{640, 480, std::vector<std::uint8_t>(4 * 640 * 480, 0)});
    frame.film->serial = ++serial;
    frame.fingers = {{glm::vec3(world), {0.05F, 0.75F, 0.05F}, 1.0F}};
    const glm::dvec2 drawn = centroid(draw(frame), is_green);
    EXPECT_LT(glm::distance(filmed, drawn), 1.0)
        << filmed.x << "," << filmed.y << " " << drawn.x << "," << drawn.y;
  }
}

/// The shell with a reference that is the same shell, moved by `offset_m` upwards; `distance_m` of a vertex
/// at a place. Nothing else is to be seen of the shape.
std::shared_ptr<const Scene> compared_scene(float offset_m,
                                            const std::function<float(const Vec3f&)>& distance_m) {
  auto scene = std::make_shared<Scene>(*test::synthetic_scene(Representation::surface));
  auto shape = std::make_shared<Entity>(*scene->entities.at("top"));
  auto distances = std::make_shared<std::vector<float>>();
  for (const SurfaceVertex& vertex : shape->surface->vertices)
    distances->push_back(distance_m(vertex.position));
  shape->distances_m = distances;
  shape->selected = false;
  scene->entities["top"] = shape;
  auto mesh = std::make_shared<SurfaceMesh>(*shape->surface);
  for (SurfaceVertex& vertex : mesh->vertices) {
    vertex.position.z += offset_m;
    vertex.opacity = vertex.opacity > 0.5F ? 1.0F : 0.0F;
  }
  auto board = std::make_shared<Entity>();
  board->id = board->name = "board";
  board->kind = EntityKind::reference;
  board->representation = Representation::surface;
  board->surface = mesh;
  scene->entities["board"] = board;
  return scene;
}

bool is_blue(const std::uint8_t* p) {
  return p[2] > p[0] + 40 && p[2] > p[1] + 15;
}
bool is_orange(const std::uint8_t* p) {
  return p[0] > p[2] + 60 && p[0] > p[1] + 20 && p[1] > p[2] + 5;
}
/// Nearly without colour.
bool is_grey(const std::uint8_t* p) {
  return std::abs(p[0] - p[1]) < 25 && std::abs(p[1] - p[2]) < 25;
}

int count_if(const Image& image, const std::function<bool(const std::uint8_t*)>& is_marked) {
  int count = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) count += is_marked(&image.rgba[i]) ? 1 : 0;
  return count;
}

TEST_F(Rendering, ColoursShapesByTheirDistances_A28) {
  // The reference is beneath the table: not to be seen. From -6 mm on the left to 6 mm on the right.
  const auto scene = compared_scene(-0.1F, [](const Vec3f& place) { return 0.2F * place.x; });
  Frame frame = frame_of(scene, 960, 540);
  const Image plain = draw(frame);
  EXPECT_EQ(count_if(plain, is_orange), 0) << "off by default";

  frame.distances = DistanceScale{};
  HudStatus status;
  status.model_connected = status.has_scene = true;
  status.shapes = status.surfaces = status.references = status.compared = 1;
  status.distances = frame.distances;
  status.alternatives = {"flat", {"main", "flat"}};
  const Image bare = draw(frame);
  const glm::dvec2 negative = centroid(bare, [](const std::uint8_t* p) { return is_blue(p); });
  const glm::dvec2 positive = centroid(bare, [](const std::uint8_t* p) { return is_orange(p); });
  EXPECT_LT(negative.x + 40.0, positive.x) << negative.x << " " << positive.x;
  EXPECT_NEAR(negative.y, positive.y, 30.0);

  frame.overlay =
      layout_hud(status, 960, 540, [this](std::string_view text) { return renderer_->measure_text(text); });
  RenderOptions still;
  still.supersampling = 2;
  expect_golden(draw(frame, still), "client_distances");
}

TEST_F(Rendering, DistancesAreClampedAtTheRangeAndGreyAtNought_A28) {
  const auto constant = [this](float distance_m, float range_m) {
    Frame frame = frame_of(compared_scene(-0.1F, [distance_m](const Vec3f&) { return distance_m; }));
    frame.distances = DistanceScale{range_m};
    return draw(frame);
  };
  const Image low = constant(-0.005F, 0.005F);
  const Image nought = constant(0.0F, 0.005F);
  const Image high = constant(0.005F, 0.005F);
  const std::size_t middle = 4 * (112 * 480 + 222);
  EXPECT_TRUE(is_blue(&low.rgba[middle]));
  EXPECT_TRUE(is_grey(&nought.rgba[middle]));
  EXPECT_TRUE(is_orange(&high.rgba[middle]));
  EXPECT_GT(nought.rgba[middle], 150) << "light";
  EXPECT_EQ(constant(-0.5F, 0.005F).rgba, low.rgba) << "beyond is as at the end";
  EXPECT_EQ(constant(0.010F, 0.010F).rgba, high.rgba) << "the range is the unit";
  EXPECT_GT(*mean_absolute_difference(constant(0.0025F, 0.005F), high), 0.5);
}

TEST_F(Rendering, ReferencesAreMutedAndFadeWhileDistancesAreShown_A28) {
  // The reference is over the shape and hides it.
  const auto inside = compared_scene(0.004F, [](const Vec3f&) { return -0.004F; });
  Frame frame = frame_of(inside);
  const Image hidden = draw(frame);
  const Image shape_alone = draw(frame_of(test::synthetic_scene(Representation::surface)));
  const std::size_t middle = 4 * (112 * 480 + 222);
  EXPECT_TRUE(is_grey(&hidden.rgba[middle])) << "dull";
  EXPECT_GT(*mean_absolute_difference(hidden, shape_alone), 0.5);
  // Matt: no pixel of it is as bright as a shape's reflections.
  const auto brightest = [](const Image& image) {
    int most = 0;
    for (int y = 95; y < 115; ++y) {
      for (int x = 205; x < 240; ++x) {
        most = std::max<int>(most, image.rgba[4 * static_cast<std::size_t>(y * image.width_px + x) + 1]);
      }
    }
    return most;
  };
  EXPECT_LT(brightest(hidden) + 20, brightest(shape_alone));

  EXPECT_FALSE(is_blue(&hidden.rgba[middle]));
  frame.distances = DistanceScale{};
  const Image faded = draw(frame);
  EXPECT_TRUE(is_blue(&faded.rgba[middle])) << "a shape inside of its reference is seen";
  // A later scene without distances, in the same renderer, has none left over.
  auto unmeasured = std::make_shared<Scene>(*inside);
  auto shape = std::make_shared<Entity>(*unmeasured->entities.at("top"));
  shape->distances_m = nullptr;
  unmeasured->entities["top"] = shape;
  frame.scene = unmeasured;
  EXPECT_FALSE(is_blue(&draw(frame).rgba[middle]));
}

TEST_F(Rendering, RefusesImpossiblePictures) {
  Frame frame = frame_of(nullptr);
  frame.eye.pinhole.width_px = 0;
  EXPECT_FALSE(renderer_->draw_to_image(frame, {}).ok());
  Frame huge = frame_of(nullptr, 16384, 16384);
  RenderOptions four;
  four.supersampling = 4;
  const Result<Image> refused = renderer_->draw_to_image(huge, four);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(draw(frame_of(nullptr)).width_px, 480) << "and goes on";
}

}  // namespace
}  // namespace handloft::client

#if defined(__SANITIZE_ADDRESS__)
#define HANDLOFT_LEAKS_ARE_LOOKED_FOR
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define HANDLOFT_LEAKS_ARE_LOOKED_FOR
#endif
#endif
#ifdef HANDLOFT_LEAKS_ARE_LOOKED_FOR
/// The graphics driver is loaded and unloaded with memory of its own still held, in a module that then has no
/// name to suppress by; so this program is checked for everything but leaks.
extern "C" int __lsan_is_turned_off();
extern "C" int __lsan_is_turned_off() {
  return 1;
}
#endif
