// Other users' hands and heads (U1), and our own in film (V1), in pictures of the real renderer.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/integration/client-hmd/film_scene.h"
#include "tests/integration/client-hmd/ghost_scene.h"
#include "tests/integration/client-hmd/rendering_fixture.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client {
namespace {

constexpr int width = 480, height = 300;

/// A large plate at the height `z`, opaque.
std::shared_ptr<const Scene> plate(float z) {
  auto mesh = std::make_shared<SurfaceMesh>();
  for (const auto& [x, y] : {std::pair{-0.6F, -0.6F}, {0.6F, -0.6F}, {-0.6F, 0.6F}, {0.6F, 0.6F}}) {
    mesh->vertices.push_back({{x, y, z}, {0.0F, 0.0F, 1.0F}, 1.0F});
  }
  mesh->indices = {0, 1, 2, 2, 1, 3};
  auto entity = std::make_shared<Entity>();
  entity->id = entity->name = "plate";
  entity->representation = Representation::surface;
  entity->surface = mesh;
  auto scene = std::make_shared<Scene>();
  scene->entities["plate"] = entity;
  return scene;
}

class GhostRendering : public test::Rendering {
 protected:
  Frame with(std::vector<GhostHint> ghosts, std::shared_ptr<const Scene> scene = nullptr) {
    Frame frame = frame_of(std::move(scene), width, height);
    frame.ghosts = std::move(ghosts);
    return frame;
  }
  double difference(const Frame& a, const Frame& b) { return *mean_absolute_difference(draw(a), draw(b)); }
};

TEST_F(GhostRendering, ShowsEveryoneInTheirColourUntilTheyFade_U1) {
  const Frame none = with({});
  EXPECT_GT(difference(with({test::anna()}), none), 0.3);
  EXPECT_GT(difference(with({test::anna(), test::bo()}), with({test::anna()})), 0.2);
  EXPECT_EQ(draw(with({test::anna()})).rgba, draw(with({test::anna()})).rgba);
  GhostHint green = test::anna();
  green.colour = {0.03F, 0.45F, 0.08F};
  EXPECT_GT(difference(with({green}), with({test::anna()})), 0.1);
  GhostHint faint = test::anna();
  faint.opacity = 0.5F;
  const double whole = difference(with({test::anna()}), none), half = difference(with({faint}), none);
  EXPECT_GT(half, 0.25 * whole);
  EXPECT_LT(half, 0.75 * whole);
  GhostHint gone = test::anna();
  gone.opacity = 0.0F;
  EXPECT_EQ(draw(with({gone})).rgba, draw(none).rgba) << "and leaves nothing";
}

TEST_F(GhostRendering, AHandUnderASurfaceIsHiddenByIt) {
  GhostHint below = test::anna();
  below.name = below.doing = "";
  below.head.reset();
  below.tips = test::tips_at({0.0F, -0.05F, 0.012F}, 1.57F);
  const double hidden = difference(with({below}, plate(0.06F)), with({}, plate(0.06F)));
  const double seen = difference(with({below}, plate(0.001F)), with({}, plate(0.001F)));
  EXPECT_GT(seen, 0.3);
  EXPECT_LT(hidden, 0.02 * seen);
}

TEST_F(GhostRendering, FramesWhatSomebodyWorksOnAndTintsTheGesture_U1) {
  const auto scene = test::synthetic_scene();
  GhostHint idle = test::bo(), working = test::bo();
  idle.entity = "";
  EXPECT_GT(difference(with({working}, scene), with({idle}, scene)), 0.05);
  working.entity = "no such thing";
  EXPECT_EQ(draw(with({working}, scene)).rgba, draw(with({idle}, scene)).rgba);

  auto flying = std::make_shared<Scene>(*test::synthetic_scene(Representation::points));
  auto top = std::make_shared<Entity>(*flying->entities.at("top"));
  top->provisional = true;
  top->provisional_by = idle.client_id;
  top->settled_points = 0;
  flying->entities["top"] = top;
  GhostHint somebody_else = idle;
  somebody_else.client_id = 99;
  EXPECT_GT(difference(with({idle}, flying), with({somebody_else}, flying)), 0.1)
      << "points in the user's colour";
}

TEST_F(GhostRendering, PointsThatGrowChangeAndShrinkAreDrawnAsIfTheyWereNew_A2) {
  const auto whole = test::synthetic_scene(Representation::points);
  const auto some = [&whole](std::size_t count, float moved) {
    auto scene = std::make_shared<Scene>(*whole);
    auto top = std::make_shared<Entity>(*whole->entities.at("top"));
    auto points = std::make_shared<PointSet>(*top->points);
    points->points.resize(count);
    points->points.front().position.z += moved;
    top->points = points;
    top->settled_points = static_cast<std::uint32_t>(count);
    scene->entities["top"] = top;
    return scene;
  };
  // In one renderer, one after another; each against a renderer that knows nothing.
  for (const auto& [count, moved] :
       {std::pair{std::size_t{40}, 0.0F}, {55, 0.0F}, {58, 0.0F}, {58, 0.01F}, {30, 0.01F}, {200, 0.0F}}) {
    const Image grown = draw(with({}, some(count, moved)));
    Result<std::unique_ptr<Renderer>> fresh = Renderer::create();
    ASSERT_TRUE(fresh.ok());
    const Result<Image> anew = (*fresh)->draw_to_image(with({}, some(count, moved)), {});
    ASSERT_TRUE(anew.ok());
    EXPECT_EQ(grown.rgba, anew->rgba) << count << " points";
  }
}

/// How many of the pixels in which the film shows the middle of the palm are those of `film` in `picture`.
struct InTheHand {
  int pixels = 0, as_filmed = 0;
  double share() const { return pixels == 0 ? 0.0 : static_cast<double>(as_filmed) / pixels; }
};

class HandInFilm : public GhostRendering {
 protected:
  static constexpr float hand_height_m = 0.09F;
  const FilmedHand hand_ = test::filmed_hand_at({0.0F, -0.03F, hand_height_m});

  Frame filmed(std::shared_ptr<const Scene> scene, HandOcclusion occlusion = HandOcclusion::on) {
    Frame frame = test::filmed_frame(std::move(scene), hand_, width, height);
    frame.hand_occlusion = occlusion;
    return frame;
  }

  /// Pixels in a radius about the palm and the fingers' middle joints, well inside of the hand's outline.
  InTheHand in_the_hand(const Image& picture, const Image& film) {
    InTheHand found;
    const Frame frame = filmed(nullptr);
    const HandShape shape =
        estimate_hand(hand_.tips, hand_.posture,
                      glm::vec3(frame.eye.world_from_eye.position) - glm::vec3(0.0F, 0.0F, 0.25F));
    for (const Bone& bone : shape.bones) {
      if (bone.to_certainty < 0.9F) continue;
      const glm::dvec4 in_eye =
          frame.eye.eye_from_world() * glm::dvec4(glm::dvec3(0.5F * (bone.from + bone.to)), 1.0);
      const Pinhole& pinhole = frame.eye.pinhole;
      const auto x = static_cast<int>(pinhole.cx_px + pinhole.fx_px * in_eye.x / -in_eye.z);
      const auto y = static_cast<int>(pinhole.cy_px - pinhole.fy_px * in_eye.y / -in_eye.z);
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (x + dx < 0 || y + dy < 0 || x + dx >= width || y + dy >= height) continue;
          const std::size_t at = 4 * static_cast<std::size_t>((y + dy) * width + x + dx);
          int most = 0;
          for (std::size_t c = 0; c < 3; ++c)
            most = std::max(most, std::abs(picture.rgba[at + c] - film.rgba[at + c]));
          ++found.pixels;
          found.as_filmed += most <= 4 ? 1 : 0;
        }
      }
    }
    return found;
  }
};

TEST_F(HandInFilm, HidesWhatIsBehindItAndNotWhatIsBefore_V1) {
  const Image film = draw(filmed(nullptr, HandOcclusion::off));
  const InTheHand behind = in_the_hand(draw(filmed(plate(0.02F))), film);
  ASSERT_GT(behind.pixels, 50);
  EXPECT_GT(behind.share(), 0.95) << "a plate under the hand is hidden by it";
  EXPECT_LT(in_the_hand(draw(filmed(plate(0.20F))), film).share(), 0.05) << "one before it hides the hand";
  EXPECT_LT(in_the_hand(draw(filmed(plate(0.02F), HandOcclusion::off)), film).share(), 0.05)
      << "switched off";
}

TEST_F(HandInFilm, FadesWhereTipsAreUnsure_T6) {
  const Image film = draw(filmed(nullptr, HandOcclusion::off));
  Frame frame = filmed(plate(0.02F));
  for (auto& tip : frame.filmed_hand->tips) tip->certainty = 0.1F;
  EXPECT_LT(in_the_hand(draw(frame), film).share(), 0.3);
}

TEST_F(HandInFilm, HidesPointsBehindItToo_A2) {
  const auto points = test::synthetic_scene(Representation::points);
  const Image film = draw(filmed(nullptr, HandOcclusion::off));
  const double on = in_the_hand(draw(filmed(points)), film).share();
  const double off = in_the_hand(draw(filmed(points, HandOcclusion::off)), film).share();
  EXPECT_GT(on, 0.95);
  EXPECT_LT(off, on - 0.1);
}

TEST_F(HandInFilm, WithoutFilmNothingIsHidden) {
  Frame studio = frame_of(plate(0.02F), width, height);
  Frame with_hand = studio;
  with_hand.filmed_hand = hand_;
  EXPECT_EQ(draw(studio).rgba, draw(with_hand).rgba);
}

}  // namespace
}  // namespace handloft::client
