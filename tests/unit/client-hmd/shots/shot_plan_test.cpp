// Turntables and plans, settled for a scene.

#include "client-hmd/shots/shot_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/constants.hpp>

#include "client-hmd/view/pinhole.h"

namespace handloft::client {
namespace {

/// The corners of a long box that stands away from the origin.
std::vector<glm::dvec3> box() {
  std::vector<glm::dvec3> corners;
  for (const double x : {0.1, 0.3}) {
    for (const double y : {-0.05, 0.01}) {
      for (const double z : {0.0, 0.08}) corners.emplace_back(x, y, z);
    }
  }
  return corners;
}

TEST(Turntable, GoesRoundTheSceneAtConstantSpeedWithoutASeam_V8) {
  TurntableOptions options;
  options.frames = 48;
  const ShotPlan plan = turntable_plan(options);
  EXPECT_EQ(plan.frames(), 48U);
  const Result<Shot> shot = Shot::settle(plan, box());
  ASSERT_TRUE(shot.ok()) << shot.error().describe();
  const double step = glm::two_pi<double>() / 48;
  for (std::size_t i = 0; i < 48; ++i) {
    const OrbitCamera camera = shot->view(i).camera;
    EXPECT_LT(glm::distance(camera.target, glm::dvec3(0.2, -0.02, 0.04)), 1e-12) << "the box's middle";
    EXPECT_EQ(camera.distance_m, shot->view(0).camera.distance_m);
    const double next = i + 1 < 48 ? shot->view(i + 1).camera.azimuth_rad
                                   : shot->view(0).camera.azimuth_rad + glm::two_pi<double>();
    EXPECT_NEAR(next - camera.azimuth_rad, step, 1e-9) << i;
  }
}

TEST(Turntable, HasAllOfTheSceneInEveryPictureAndNoMoreRoomThanItNeeds) {
  for (const double elevation : {0.0, 0.44, 1.2}) {
    TurntableOptions options;
    options.elevation_rad = elevation;
    const ShotPlan plan = turntable_plan(options);
    const Result<Shot> shot = Shot::settle(plan, box());
    ASSERT_TRUE(shot.ok());
    double outermost = 0.0;
    for (std::size_t i = 0; i < plan.frames(); ++i) {
      const Eye eye = shot->view(i).camera.eye(plan.width_px, plan.height_px);
      for (const glm::dvec3& place : box()) {
        const glm::dvec4 in_eye = eye.eye_from_world() * glm::dvec4(place, 1.0);
        ASSERT_LT(in_eye.z, 0.0);
        const double x = eye.pinhole.fx_px * in_eye.x / -in_eye.z / (plan.width_px / 2.0);
        const double y = eye.pinhole.fy_px * in_eye.y / -in_eye.z / (plan.height_px / 2.0);
        outermost = std::max({outermost, std::abs(x), std::abs(y)});
      }
    }
    EXPECT_LT(outermost, 0.881) << elevation;
    EXPECT_GT(outermost, 0.86) << "near enough: a margin of 6 % on either side";
  }
}

TEST(Turntable, AtAGivenDistanceIsThere) {
  TurntableOptions options;
  options.distance_m = 1.5;
  options.elevation_rad = 0.2;
  const Result<Shot> shot = Shot::settle(turntable_plan(options), box());
  ASSERT_TRUE(shot.ok());
  EXPECT_EQ(shot->view(7).camera.elevation_rad, 0.2);
  EXPECT_NEAR(shot->view(7).camera.distance_m, 1.5, 1e-12);
}

TEST(Turntable, OfNothingIsAnError) {
  const Result<Shot> shot = Shot::settle(turntable_plan({}), {});
  ASSERT_FALSE(shot.ok());
  EXPECT_EQ(shot.error().code, ErrorCode::failed_precondition);
}

TEST(Plans, ChangeWhatIsShownFromTheirTimesOn) {
  ShotPlan plan;
  plan.rate_hz = 10;
  PlannedKey key;
  key.target = glm::dvec3(0.0);
  key.place = glm::dvec3(0, -1, 1);
  plan.keys = {key, key};
  plan.keys[1].time_s = 1.0;
  plan.changes = {{0.3, Representation::points, std::nullopt}, {0.6, std::nullopt, Shading::zebra}};
  EXPECT_EQ(plan.frames(), 11U) << "both ends";
  const Result<Shot> shot = Shot::settle(plan, {});
  ASSERT_TRUE(shot.ok()) << "nothing of it depends on the scene";
  EXPECT_FALSE(shot->view(2).show);
  EXPECT_EQ(shot->view(3).show, Representation::points) << "0.3 s, rounding notwithstanding";
  EXPECT_FALSE(shot->view(5).shading);
  EXPECT_EQ(shot->view(6).show, Representation::points) << "as it was";
  EXPECT_EQ(shot->view(6).shading, Shading::zebra);
}

TEST(Plans, ShowShapesOtherwiseWhereTheyCanBe) {
  auto scene = std::make_shared<Scene>();
  const auto add = [&scene](const char* id, EntityKind kind, bool points, bool surface) {
    auto entity = std::make_shared<Entity>();
    entity->kind = kind;
    entity->representation = Representation::both;
    if (points) entity->points = std::make_shared<PointSet>();
    if (surface) entity->surface = std::make_shared<SurfaceMesh>();
    scene->entities[id] = entity;
  };
  add("whole", EntityKind::dual_shape, true, true);
  add("bare", EntityKind::dual_shape, true, false);
  add("board", EntityKind::reference, false, true);
  const auto shown = shown_as(scene, Representation::surface);
  EXPECT_EQ(shown->entities.at("whole")->representation, Representation::surface);
  EXPECT_EQ(shown->entities.at("whole")->surface, scene->entities.at("whole")->surface)
      << "nothing is copied";
  EXPECT_EQ(shown->entities.at("bare"), scene->entities.at("bare")) << "it would vanish";
  EXPECT_EQ(shown->entities.at("board"), scene->entities.at("board"));
  EXPECT_EQ(scene->entities.at("whole")->representation, Representation::both);
}

}  // namespace
}  // namespace handloft::client
