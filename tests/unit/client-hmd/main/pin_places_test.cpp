// Pins of comments are on what is to be seen of their shape (U6).

#include "client-hmd/main/pin_places.h"

#include <gtest/gtest.h>

namespace handloft::client {
namespace {

/// A dome over the square of +-0.1 m, `height` in the middle, or a plate at that height.
enum class Form { dome, plate };
std::shared_ptr<Entity> sheet(Form form, float height, int steps = 20) {
  auto mesh = std::make_shared<SurfaceMesh>();
  for (int j = 0; j <= steps; ++j) {
    for (int i = 0; i <= steps; ++i) {
      const float x = -0.1F + 0.2F * static_cast<float>(i) / static_cast<float>(steps);
      const float y = -0.1F + 0.2F * static_cast<float>(j) / static_cast<float>(steps);
      const float z =
          form == Form::plate ? height : height * (1.0F - 100.0F * x * x) * (1.0F - 100.0F * y * y);
      mesh->vertices.push_back({{x, y, z}, {0.0F, 0.0F, 1.0F}, 1.0F});
    }
  }
  const auto row = static_cast<std::uint32_t>(steps + 1);
  for (std::uint32_t j = 0; j + 1 < row; ++j) {
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t a = j * row + i, b = a + 1, c = a + row, d = c + 1;
      for (const std::uint32_t index : {a, b, d, a, d, c}) mesh->indices.push_back(index);
    }
  }
  auto entity = std::make_shared<Entity>();
  entity->id = "top";
  entity->surface = mesh;
  entity->representation = Representation::surface;
  return entity;
}

void expect_near(const glm::vec3& found, const glm::vec3& expected, float tolerance = 1e-5F) {
  EXPECT_LT(glm::distance(found, expected), tolerance)
      << found.x << " " << found.y << " " << found.z << ", expected " << expected.x << " " << expected.y
      << " " << expected.z;
}

TEST(PinPlaces, LieOnTheSurfaceInsteadOfWithin_U6) {
  // The middle of a dome's box is under it.
  const glm::vec3 shown = shown_pin_place(*sheet(Form::dome, 0.04F), {0.0F, 0.0F, 0.02F});
  expect_near(shown, {0.0F, 0.0F, 0.04F}, 0.002F);  // Facets of 10 mm.
  // Between the vertices, too: exactly on the plate.
  expect_near(shown_pin_place(*sheet(Form::plate, 0.05F), {0.0123F, 0.0345F, 0.04F}),
              {0.0123F, 0.0345F, 0.05F});
}

TEST(PinPlaces, LeaveDeepShapesAtTheTop_U6) {
  // 0.5 m high: its middle is not near its surface, measured by half of a tenth of its box.
  const glm::vec3 shown =
      shown_pin_place(*sheet(Form::dome, 0.5F), {0.0F, 0.0F, 0.25F}, {.near_share = 0.05F});
  expect_near(shown, {0.0F, 0.0F, 0.5F});
}

TEST(PinPlaces, FollowASurfaceThatIsPushed_U6) {
  PinPlaces pins;
  Scene scene;
  PinnedComment comment;
  comment.id = "c";
  comment.entity = "top";
  comment.x = 0.02F;
  comment.y = 0.03F;
  comment.z = 0.05F;
  comment.placed = true;
  expect_near(pins.place_of(comment), {0.02F, 0.03F, 0.05F});
  scene.comments = std::make_shared<const std::vector<PinnedComment>>(std::vector{comment});
  for (const float height : {0.05F, 0.055F, 0.08F, 0.03F}) {
    scene.entities["top"] = sheet(Form::plate, height);
    pins.follow(scene);
    expect_near(pins.place_of(comment), {0.02F, 0.03F, height});
  }
  scene.entities.clear();
  pins.follow(scene);
  expect_near(pins.place_of(comment), {0.02F, 0.03F, 0.05F});
}

TEST(PinPlaces, LeaveWhatIsMeantBesideTheShape) {
  const glm::vec3 far{0.0F, 0.0F, 0.9F};
  expect_near(shown_pin_place(*sheet(Form::plate, 0.05F), far), far);
  Entity nothing;
  expect_near(shown_pin_place(nothing, far), far);
  // What is faded out beyond the trim is not there.
  auto mesh = std::make_shared<SurfaceMesh>(*sheet(Form::plate, 0.05F)->surface);
  for (SurfaceVertex& vertex : mesh->vertices) vertex.opacity = 0.2F;
  Entity faint = *sheet(Form::plate, 0.05F);
  faint.surface = mesh;
  const glm::vec3 near{0.0F, 0.0F, 0.051F};
  expect_near(shown_pin_place(faint, near), near);
}

TEST(PinPlaces, LieOnPointsWhereThereIsNoSurface) {
  auto points = std::make_shared<PointSet>();
  points->points = {{{0.0F, 0.0F, 0.05F}, 0}, {{0.1F, 0.0F, 0.05F}, 0}, {{0.1F, 0.1F, 0.06F}, 0}};
  Entity cloud;
  cloud.points = points;
  expect_near(shown_pin_place(cloud, {0.09F, 0.01F, 0.05F}), {0.1F, 0.0F, 0.05F});
}

TEST(PinPlaces, LookAtSoMuchAFrame) {
  Scene scene;
  std::vector<PinnedComment> comments;
  for (int i = 0; i < 5; ++i) {
    PinnedComment comment;
    comment.id = std::to_string(i);
    comment.entity = "top";
    comment.z = 0.04F;
    comment.placed = true;
    comments.push_back(comment);
  }
  scene.comments = std::make_shared<const std::vector<PinnedComment>>(comments);
  scene.entities["top"] = sheet(Form::plate, 0.05F);
  PinPlaces pins({.most_a_frame = 441 + 1});  // Two searches begin.
  for (const int known : {2, 4, 5, 5}) {
    pins.follow(scene);
    int found = 0;
    for (const PinnedComment& comment : comments) found += pins.place_of(comment).z > 0.045F ? 1 : 0;
    EXPECT_EQ(found, known);
  }
}

}  // namespace
}  // namespace handloft::client
