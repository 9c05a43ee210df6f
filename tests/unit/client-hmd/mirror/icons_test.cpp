// D17: icons of sculpted surfaces, and meshes that leave their triangles out, from servers good and bad.

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>

#include "client-hmd/mirror/scene_mirror.h"
#include "common/codec/mesh_codec.h"
#include "tests/unit/client-hmd/mirror/scene_messages.h"

namespace handloft::client {
namespace {

v1::Icon icon(const std::string& id) {
  v1::Icon message;
  message.set_id(id);
  message.set_role(v1::ICON_CONSTRAINT);
  message.set_property(v1::ICON_TANGENT_U);
  message.set_state(v1::ICON_DRIVING);
  message.mutable_place()->set_x(0.1);
  message.mutable_direction()->set_z(1);
  message.set_label("R");
  message.set_colour_rgba(0xF2C31BFF);
  message.set_target(true);
  return message;
}

v1::Icon line(std::size_t points) {
  v1::Icon message = icon("line");
  message.set_shape(v1::ICON_CURVE);
  message.clear_direction();
  message.set_outline(test::packed(std::vector<float>(3 * points, 0.25F)));
  return message;
}

v1::Mesh numbered(std::uint64_t topology, float side = 0.1F) {
  v1::Mesh mesh = test::triangle(side);
  mesh.set_topology(topology);
  return mesh;
}

v1::SceneSnapshot hood() {
  v1::SceneSnapshot message;
  message.set_epoch(7);
  message.set_sequence(1);
  v1::EntityState& state = *message.add_entities();
  state.set_id("hood");
  state.set_kind("sculpt_surface");
  state.set_revision(1);
  state.set_representation(v1::REPRESENTATION_SURFACE);
  state.set_surface_shown(true);
  *state.mutable_surface() = numbered(3);
  state.set_icons_shown(true);
  *state.add_icons() = icon("top");
  *state.add_icons() = line(5);
  return message;
}

v1::SceneDelta next() {
  v1::SceneDelta message;
  message.set_epoch(7);
  message.set_sequence(2);
  v1::EntityState& state = *message.add_changed();
  state.set_id("hood");
  state.set_kind("sculpt_surface");
  state.set_revision(2);
  state.set_representation(v1::REPRESENTATION_SURFACE);
  state.set_surface_shown(true);
  return message;
}

const Entity& held(const SceneMirror& mirror) {
  return *mirror.scene()->entities.at("hood");
}

TEST(Icons, AreHeldAsTheyCameUntilAWholeSetComes_D17) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(hood()).ok());
  EXPECT_EQ(held(mirror).kind, EntityKind::sculpt_surface);
  ASSERT_NE(held(mirror).icons, nullptr);
  ASSERT_EQ(held(mirror).icons->size(), 2U);
  const SceneIcon& top = held(mirror).icons->front();
  EXPECT_EQ(top.id, "top");
  EXPECT_EQ(top.property, IconProperty::derivative);
  EXPECT_EQ(top.label, "R");
  EXPECT_FALSE(top.load);
  EXPECT_TRUE(top.target);
  EXPECT_FLOAT_EQ(top.place.x, 0.1F);
  ASSERT_TRUE(top.direction);
  EXPECT_FLOAT_EQ(top.direction->z, 1.0F);
  EXPECT_EQ(held(mirror).icons->back().outline.size(), 5U);

  ASSERT_TRUE(mirror.apply(next()).ok());
  EXPECT_EQ(held(mirror).icons->size(), 2U) << "unchanged";
  v1::SceneDelta one = next();
  one.mutable_changed(0)->set_icons_shown(true);
  *one.mutable_changed(0)->add_icons() = icon("other");
  ASSERT_TRUE(mirror.apply(one).ok());
  ASSERT_EQ(held(mirror).icons->size(), 1U);
  v1::SceneDelta none = next();
  none.mutable_changed(0)->set_icons_shown(true);
  ASSERT_TRUE(mirror.apply(none).ok());
  EXPECT_EQ(held(mirror).icons, nullptr);
}

TEST(Icons, ThatCannotBeAreRefusedWithTheirField_D17) {
  const auto refused = [](const std::function<void(v1::Icon&)>& spoil) -> std::string {
    SceneMirror mirror(MirrorLimits{.max_curve_points = 6, .max_icons = 3});
    EXPECT_TRUE(mirror.apply(hood()).ok());
    v1::SceneDelta message = next();
    message.mutable_changed(0)->set_icons_shown(true);
    *message.mutable_changed(0)->add_icons() = line(5);
    v1::Icon& spoiled = *message.mutable_changed(0)->add_icons();
    spoiled = icon("spoiled");
    spoil(spoiled);
    const Status status = mirror.apply(message);
    EXPECT_EQ(held(mirror).icons->front().id, status.ok() ? "line" : "top");
    return status.ok() ? "accepted" : status.error().field;
  };
  const std::string at = "changed[0].icons[1].";
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused([](v1::Icon&) {}), "accepted") << "unspoiled, it is fine";
  EXPECT_EQ(refused([](v1::Icon& i) { i.clear_id(); }), at + "id");
  EXPECT_EQ(refused([](v1::Icon& i) { i.set_id(std::string(257, 'x')); }), at + "id");
  EXPECT_EQ(refused([](v1::Icon& i) { i.set_label(std::string(17, 'x')); }), at + "label");
  EXPECT_EQ(refused([](v1::Icon& i) { i.set_shape(static_cast<v1::IconShape>(9)); }), at + "shape");
  EXPECT_EQ(refused([](v1::Icon& i) { i.set_state(static_cast<v1::IconState>(9)); }), at + "state");
  EXPECT_EQ(refused([](v1::Icon& i) { i.set_role(static_cast<v1::IconRole>(-1)); }), at + "role");
  EXPECT_EQ(refused([](v1::Icon& i) { i.set_property(static_cast<v1::IconProperty>(9)); }), at + "property");
  EXPECT_EQ(refused([](v1::Icon& i) { i.mutable_place()->set_y(nan); }), at + "place");
  EXPECT_EQ(refused([](v1::Icon& i) { i.mutable_place()->set_y(1e30); }), at + "place");
  EXPECT_EQ(refused([](v1::Icon& i) { i.mutable_direction()->set_z(2); }), at + "direction");
  EXPECT_EQ(refused([](v1::Icon& i) { i.mutable_direction()->set_z(nan); }), at + "direction");
  EXPECT_EQ(refused([](v1::Icon& i) { i.set_outline("abc"); }), at + "outline");
  EXPECT_EQ(refused([](v1::Icon& i) { i.set_outline(line(2).outline()); }), at + "outline")
      << "6 points for all of them together";
  EXPECT_EQ(refused([](v1::Icon& i) {
              i.set_outline(test::packed({0, std::numeric_limits<float>::infinity(), 0}));
            }),
            at + "outline");

  SceneMirror few(MirrorLimits{.max_icons = 1});
  EXPECT_EQ(few.apply(hood()).error().field, "entities[0].icons");
}

TEST(Triangles, ThatAreLeftOutAreThoseThatAreHeld_D21) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(hood()).ok());
  v1::SceneDelta message = next();
  *message.mutable_changed(0)->mutable_surface() = numbered(3, 0.2F);
  message.mutable_changed(0)->mutable_surface()->clear_indices();
  ASSERT_TRUE(mirror.apply(message).ok());
  EXPECT_EQ(held(mirror).surface->indices.size(), 3U);
  EXPECT_NEAR(held(mirror).surface->vertices[1].position.x, 0.2F, 1e-5F);
  ASSERT_TRUE(mirror.apply(message).ok()) << "frame after frame";

  const auto refused = [&](const std::function<void(v1::Mesh&)>& spoil) {
    v1::SceneDelta spoiled = message;
    spoil(*spoiled.mutable_changed(0)->mutable_surface());
    const Status status = mirror.apply(spoiled);
    return status.ok() ? "accepted" : status.error().field;
  };
  const std::string field = "changed[0].surface.indices";
  EXPECT_EQ(refused([](v1::Mesh& mesh) { mesh.set_topology(4); }), field);
  EXPECT_EQ(refused([](v1::Mesh& mesh) { mesh.set_topology(0); }), field);
  EXPECT_EQ(refused([](v1::Mesh& mesh) { mesh.set_index_count(6); }), field);
  // Fewer vertices than the triangles that are held ask for.
  codec::MeshData two;
  two.positions = {{0, 0, 0}, {1, 0, 0}};
  two.normals = {{0, 0, 1}, {0, 0, 1}};
  two.opacity = {255, 255};
  v1::Mesh small = codec::encode_mesh(two).value();
  small.set_topology(3);
  small.set_index_count(3);
  EXPECT_EQ(refused([&](v1::Mesh& mesh) { mesh = small; }), "changed[0].surface.indices[2]");

  v1::SceneSnapshot late = hood();
  late.mutable_entities(0)->mutable_surface()->clear_indices();
  EXPECT_FALSE(mirror.apply(late).ok()) << "a snapshot brings everything";
}

}  // namespace
}  // namespace handloft::client
