// What one frame shows, from states that were received (V1, V7, A12, A13, A28). Film, and poses between two
// frames of tracking, are tests of the renderer and of the histories.

#include "client-hmd/main/frame_composer.h"

#include <gmock/gmock.h>

#include <memory>
#include <string>

namespace handloft::client {
namespace {

using testing::HasSubstr;
using testing::Not;

float width_of(std::string_view text) {
  return 0.5F * static_cast<float>(text.size());
}

class ComposerTest : public ::testing::Test {
 protected:
  ComposerTest() {
    request_.width_px = 640;
    request_.height_px = 360;
    model_.connected = true;
    model_.snapshots = 1;
  }
  Frame compose() {
    model_.scene = std::make_shared<const Scene>(scene_);
    return compose_frame(request_, {std::make_shared<const ModelState>(model_), nullptr, nullptr}, width_of);
  }
  static std::string words(const Frame& frame) {
    std::string all;
    for (const OverlayText& text : frame.overlay.texts) all += text.text + "|";
    return all;
  }
  Activity& hand(std::uint64_t client_id = 0) {
    Activity& activity = model_.activities[{client_id, "hand"}];
    activity.client_id = client_id;
    activity.name = "hand";
    return activity;
  }
  Entity& add(const std::string& id) {
    auto entity = std::make_shared<Entity>();
    entity->id = id;
    entity->name = "Shape " + id;
    Entity& added = *entity;
    scene_.entities[id] = std::move(entity);
    return added;
  }

  FrameRequest request_;
  ModelState model_;
  Scene scene_;
};

TEST_F(ComposerTest, TellsWhoHoldsAShapeInThatUsersColour_U1_V7) {
  model_.own_client_id = 2;
  add("ours").leased_by = 2;
  add("nobodys");
  Entity& held = add("theirs");
  held.leased_by = 3;
  held.leased_by_name = "Mira";
  for (const ColourScheme scheme : colour_schemes) {
    request_.colours = scheme;
    const Frame frame = compose();
    ASSERT_EQ(frame.holders.size(), 1U);
    EXPECT_EQ(frame.holders[0].entity, "theirs");
    EXPECT_EQ(frame.holders[0].name, "Mira");
    EXPECT_EQ(frame.holders[0].colour, linear_rgb(user_colour(3, scheme)));
  }
  model_.connected = false;
  EXPECT_TRUE(compose().holders.empty()) << "what is no longer known is not told";
}

TEST_F(ComposerTest, LooksThroughTheOrbitCameraWhenThereIsNoHead) {
  request_.orbit.orbit(0.3, 0.1);
  for (const CameraMode mode : {CameraMode::orbit, CameraMode::head}) {
    request_.camera = mode;
    const Frame frame = compose();
    const Eye expected = request_.orbit.eye(640, 360);
    EXPECT_EQ(frame.eye.world_from_eye.position, expected.world_from_eye.position);
    EXPECT_EQ(frame.eye.pinhole.width_px, 640);
    EXPECT_FALSE(frame.film);
    EXPECT_TRUE(frame.fingers.empty()) << "nothing tracks a hand";
  }
}

TEST_F(ComposerTest, ShowsWhatHangsInTheAirWhileTheServerIsThere_A13) {
  hand().disk = DiskMark{{0.1F, 0.2F, 0.3F}, {0, 0, -1}, 0.02F};
  hand().range = 0.5F;
  hand().smooth_falloff = true;
  hand(7).curve =
      std::make_shared<const SceneCurve>(SceneCurve{{{0, 0, 0}, {1, 0, 0}}, false, 0, CurveKind::profile});
  Frame frame = compose();
  ASSERT_EQ(frame.disks.size(), 1U);
  EXPECT_EQ(frame.disks[0].centre, glm::vec3(0.1F, 0.2F, 0.3F));
  EXPECT_FLOAT_EQ(frame.disks[0].range, 0.5F);
  EXPECT_EQ(frame.air_curves.size(), 1U) << "of a peer as well";
  model_.connected = false;
  frame = compose();
  EXPECT_TRUE(frame.disks.empty()) << "no longer known";
  EXPECT_TRUE(frame.air_curves.empty());
  EXPECT_THAT(words(frame), HasSubstr("Reconnecting"));
}

TEST_F(ComposerTest, TheTableShowsThePageThatItsOwnServerTells) {
  EXPECT_EQ(compose().palette_page, first_palette_page);
  hand(7).palette_page = 2;
  EXPECT_EQ(compose().palette_page, first_palette_page) << "a peer's table is another one";
  hand().palette_page = 2;
  EXPECT_EQ(compose().palette_page, 2);
  for (const std::uint32_t nonsense : {0U, 1000U, 0xFFFFFFFFU}) {
    hand().palette_page = nonsense;
    EXPECT_EQ(compose().palette_page, first_palette_page) << nonsense;
  }
}

TEST_F(ComposerTest, CountsAndNamesWhatTheSceneHolds_V7_A28) {
  Entity& top = add("top");
  top.selected = true;
  auto points = std::make_shared<PointSet>();
  points->points.resize(12);
  top.points = points;
  top.surface = std::make_shared<const SurfaceMesh>();
  add("side").target = true;
  add("car").kind = EntityKind::reference;
  const std::string told = words(compose());
  EXPECT_THAT(told, HasSubstr("Shape top"));
  EXPECT_THAT(told, HasSubstr("2 shapes"));
  EXPECT_THAT(told, HasSubstr("12 points"));
  EXPECT_THAT(told, HasSubstr("acts on Shape side"));
  EXPECT_THAT(told, Not(HasSubstr("Distance")));
  request_.distances = DistanceScale{0.005F};
  const Frame compared = compose();
  ASSERT_TRUE(compared.distances);
  EXPECT_THAT(words(compared), HasSubstr("Distance"));
}

TEST_F(ComposerTest, WithoutAHandNoPlaneOfSymmetryStandsInTheWay_A12) {
  hand().symmetry = true;
  hand().symmetry_plane = PlaneMark{{0, 0, 0}, {1, 0, 0}};
  EXPECT_FALSE(compose().symmetry) << "a picture for nobody who draws";
}

TEST_F(ComposerTest, BeforeTheFirstSceneItSaysThatItConnects) {
  model_.snapshots = 0;
  model_.connected = false;
  EXPECT_THAT(words(compose()), HasSubstr("Connecting"));
}

}  // namespace
}  // namespace handloft::client
