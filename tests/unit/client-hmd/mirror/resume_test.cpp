// A server that comes back (V5): what is the same stays the same object, so that nothing is uploaded again or
// flickers; what is being sent in pieces does not take the picture away meanwhile; and another server's
// numbers are not mistaken for this one's.

#include "client-hmd/mirror/resume.h"

#include <gtest/gtest.h>

#include "client-hmd/mirror/scene_mirror.h"
#include "tests/unit/client-hmd/mirror/scene_messages.h"

namespace handloft::client {
namespace {

using std::chrono::milliseconds;

const Entity& top(const SceneMirror& mirror) {
  return *mirror.scene()->entities.at("top");
}

v1::Mesh numbered(float side, std::uint64_t topology) {
  v1::Mesh mesh = test::triangle(side);
  mesh.set_topology(topology);
  return mesh;
}

/// The triangle the other way round: as many indices, but others.
v1::Mesh turned(std::uint64_t topology) {
  codec::MeshData mesh;
  mesh.positions = {{0, 0, 0.02F}, {0.1F, 0, 0.02F}, {0, 0.1F, 0.02F}};
  mesh.normals = {{0, 0, -1}, {0, 0, -1}, {0, 0, -1}};
  mesh.opacity = {255, 255, 255};
  mesh.indices = {0, 2, 1};
  v1::Mesh message = *codec::encode_mesh(mesh);
  message.set_topology(topology);
  return message;
}

TEST(ASceneThatComesAgain, SharesWhatIsTheSame_V5) {
  v1::SceneSnapshot message = test::compared_snapshot();
  v1::EntityState& state = *message.mutable_entities(0);
  state.set_curves_shown(true);
  state.add_curves()->set_points(test::packed({0, 0, 0, 1, 1, 1}));
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(message).ok());
  const Entity before = top(mirror);
  message.set_epoch(8);
  state.set_revision(99);
  ASSERT_TRUE(mirror.apply(message).ok());
  EXPECT_EQ(mirror.scene()->epoch, 8U);
  EXPECT_EQ(top(mirror).revision, 99U);
  EXPECT_EQ(top(mirror).points, before.points);
  EXPECT_EQ(top(mirror).surface, before.surface);
  EXPECT_EQ(top(mirror).distances_m, before.distances_m);
  EXPECT_EQ(top(mirror).curves, before.curves);

  state.mutable_points()->mutable_palette(0)->set_radius_m(0.005F);  // Another style only.
  *state.mutable_surface() = test::triangle(0.2F);
  ASSERT_TRUE(mirror.apply(message).ok());
  EXPECT_NE(top(mirror).points, before.points);
  EXPECT_NE(top(mirror).surface, before.surface);
  EXPECT_NE(top(mirror).distances_m, before.distances_m) << "they belong to another surface";
  EXPECT_EQ(top(mirror).curves, before.curves);
}

TEST(Triangles, OfTheSameNumberButOthersAreNotTakenForTheSame) {
  v1::SceneSnapshot message = test::snapshot();
  *message.mutable_entities(0)->mutable_surface() = numbered(0.1F, 7);
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(message).ok());
  const std::uint64_t first = top(mirror).surface->topology;
  EXPECT_NE(first, 0U);

  v1::SceneDelta dragged = test::delta();
  *dragged.mutable_changed(0)->mutable_surface() = numbered(0.2F, 7);
  ASSERT_TRUE(mirror.apply(dragged).ok());
  EXPECT_EQ(top(mirror).surface->topology, first) << "the same triangles, sent again";

  *dragged.mutable_changed(0)->mutable_surface() = turned(7);
  ASSERT_TRUE(mirror.apply(dragged).ok());
  EXPECT_NE(top(mirror).surface->topology, first)
      << "the graphics card must not draw with the former indices";
  const std::uint64_t second = top(mirror).surface->topology;

  // A server that was started again counts from one.
  message.set_epoch(8);
  ASSERT_TRUE(mirror.apply(message).ok());
  EXPECT_NE(top(mirror).surface->topology, second);
}

TEST(Triangles, OfAnotherServersNumberAreThatServers) {
  v1::SceneSnapshot message = test::snapshot();
  *message.mutable_entities(0)->mutable_surface() = numbered(0.1F, 7);
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(message).ok());
  message.set_epoch(8);
  *message.mutable_entities(0)->mutable_surface() = numbered(0.1F, 12);
  ASSERT_TRUE(mirror.apply(message).ok());
  v1::SceneDelta dragged = test::delta();
  dragged.set_epoch(8);
  *dragged.mutable_changed(0)->mutable_surface() = numbered(0.2F, 12);
  dragged.mutable_changed(0)->mutable_surface()->clear_indices();
  EXPECT_TRUE(mirror.apply(dragged).ok()) << "shared with what was shown, but known by the new number";
  dragged.mutable_changed(0)->mutable_surface()->set_topology(7);
  EXPECT_FALSE(mirror.apply(dragged).ok());
}

std::shared_ptr<const Scene> scene_of(std::uint32_t points, bool surface) {
  v1::SceneSnapshot message = test::snapshot(points);
  if (!surface) message.mutable_entities(0)->clear_surface();
  SceneMirror mirror;
  EXPECT_TRUE(mirror.apply(message).ok());
  return mirror.scene();
}

TEST(Resumption, KeepsThePictureUntilTheNewOneHasAsMuch_V5) {
  const TimePoint start = from_ns(1'000'000'000);
  const auto former = scene_of(10, true);
  const auto piece = scene_of(4, true);
  const auto bare = scene_of(10, false);
  const auto whole = scene_of(10, true);
  Resumption resumption;
  resumption.begin(start);
  EXPECT_EQ(resumption.choose(former, piece, start), former) << "a cloud in pieces";
  EXPECT_EQ(resumption.choose(former, bare, start + milliseconds(20)), former)
      << "tessellated a little later";
  EXPECT_EQ(resumption.choose(former, whole, start + milliseconds(40)), whole);
  EXPECT_EQ(resumption.choose(whole, piece, start + milliseconds(60)), piece)
      << "from then on, what goes is gone at once";
}

TEST(Resumption, ShowsWhatAServerLostWithinHalfASecond_V5) {
  const TimePoint start = from_ns(1'000'000'000);
  const auto former = scene_of(10, true);
  const auto empty = std::make_shared<const Scene>();
  Resumption resumption;
  resumption.begin(start);
  EXPECT_EQ(resumption.choose(former, empty, start + milliseconds(499)), former);
  EXPECT_EQ(resumption.choose(former, empty, start + milliseconds(500)), empty);
  EXPECT_LE(Resumption::longest, milliseconds(500));
  Resumption first;
  first.begin(start);
  EXPECT_EQ(first.choose(empty, former, start), former) << "the first scene of all is shown at once";
}

}  // namespace
}  // namespace handloft::client
