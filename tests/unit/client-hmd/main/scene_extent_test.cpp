// What a picture of the whole scene must hold.

#include "client-hmd/main/scene_extent.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace handloft::client
