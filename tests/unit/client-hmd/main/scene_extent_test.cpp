// What a picture of the whole scene must hold.

#include "client-hmd/main/scene_extent.h"

#include <gtest/gtest.h>

#include "client-hmd/main/view_state.h"

namespace handloft::client {
namespace {

std::shared_ptr<Entity> entity(Representation representation) {
  auto made = std::make_shared<Entity>();
  made->representation = representation;
  auto points = std::make_shared<PointSet>();
  points->points = {{{1, 0, 0}, 0}, {{2, 0, 0}, 0}};
  made->points = points;
  auto surface = std::make_shared<SurfaceMesh>();
  surface->vertices = {
      {{0, 3, 0}, {0, 0, 1}, 1.0F}, {{0, 4, 0}, {0, 0, 1}, 0.6F}, {{0, 9, 0}, {0, 0, 1}, 0.2F}};
  made->surface = surface;
  return made;
}

std::size_t count(Representation representation) {
  Scene scene;
  scene.entities["a"] = entity(representation);
  return visible_places(scene).size();
}

TEST(SceneExtent, HoldsWhatIsShown_A26) {
  EXPECT_EQ(visible_places(Scene{}).size(), 0U);
  EXPECT_EQ(count(Representation::points), 2U);
  EXPECT_EQ(count(Representation::surface), 2U) << "not the faint rim";
  EXPECT_EQ(count(Representation::both), 4U);
  Scene scene;
  scene.entities["a"] = entity(Representation::points);
  auto curved = std::make_shared<Entity>();
  curved->curves = std::make_shared<const std::vector<SceneCurve>>(
      std::vector<SceneCurve>{SceneCurve{{{0, 0, 7}}, true, 0, CurveKind::boundary}});
  scene.entities["b"] = curved;
  const auto places = visible_places(scene);
  ASSERT_EQ(places.size(), 3U);
  EXPECT_EQ(places.back(), glm::dvec3(0, 0, 7));
}

TEST(SceneExtent, HoldsIconsWithTheirArrowsAndOutlines_D17) {
  auto sculpted = std::make_shared<Entity>();
  SceneIcon normal;
  normal.place = {1, 2, 3};
  normal.direction = Vec3f{0, 0, 1};
  SceneIcon curve;
  curve.outline = {{5, 0, 0}, {6, 0, 0}};
  sculpted->icons = std::make_shared<const std::vector<SceneIcon>>(std::vector<SceneIcon>{normal, curve});
  Scene scene;
  scene.entities["a"] = sculpted;
  glm::dvec3 upper(0), lower(9);
  for (const glm::dvec3& place : visible_places(scene)) {
    upper = glm::max(upper, place);
    lower = glm::min(lower, place);
  }
  EXPECT_GT(upper.z, 3.04) << "the arrow's tip";
  EXPECT_LT(upper.z, 3.06);
  EXPECT_GT(upper.y, 2.001) << "the ball about the place";
  EXPECT_EQ(upper.x, 6.0) << "a curve's end";
}

TEST(FitView, AHeadsetShowsTheSceneStraightAheadAndNotBeforeOnesNose_V4) {
  auto scene = std::make_shared<Scene>();
  scene->entities["a"] = entity(Representation::points);  // A metre long, two metres to the right.
  ModelState model;
  model.scene = scene;
  model.snapshots = 1;
  HmdOptions options;
  options.view = ViewChoice::fit;
  EyeOptics eye;
  eye.shown = {960, 1080, 480.0, 480.0, 479.5, 539.5, {}};  // 90 by 97 degrees.
  ViewState plain(options), headset(options);
  fit_view(plain, model, 960, 1080, Fitting::follow);
  fit_view(headset, model, 960, 1080, Fitting::follow, eye);
  EXPECT_LT(headset.orbit.distance_m, 0.5 * plain.orbit.distance_m) << "or it would be tiny";
  EXPECT_EQ(headset.orbit.fov_y_rad, plain.orbit.fov_y_rad) << "the window's own";

  auto points = std::make_shared<PointSet>();
  points->points = {{{0, 0, 0}, 0}, {{0.01F, 0, 0}, 0}};
  auto small = std::make_shared<Entity>();
  small->representation = Representation::points;
  small->points = points;
  scene = std::make_shared<Scene>();
  scene->entities["a"] = small;
  model.scene = scene;
  fit_view(headset, model, 960, 1080, Fitting::follow, eye);
  EXPECT_NEAR(headset.orbit.distance_m, 0.35, 1e-9);
}

}  // namespace
}  // namespace handloft::client
