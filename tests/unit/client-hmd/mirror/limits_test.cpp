// Limits of the whole mirrored scene (F2): thousands of modest messages fill no memory, and what is refused
// is said in words.

#include "client-hmd/mirror/limits.h"

#include <gtest/gtest.h>

#include "client-hmd/mirror/scene_mirror.h"
#include "tests/unit/client-hmd/mirror/scene_messages.h"

namespace handloft::client {
namespace {

/// One more entity, as the caller fills it in.
v1::SceneDelta one_more(std::uint64_t number) {
  v1::SceneDelta message;
  message.set_epoch(7);
  message.set_sequence(2 + number);
  message.add_changed()->set_id("e" + std::to_string(number));
  return message;
}

/// Applies messages until one is refused; returns the error, and how many went in.
struct Refusal {
  Error error;
  std::size_t applied = 0;
};
template <typename Fill>
Refusal fill_until_refused(const MirrorLimits& limits, Fill fill) {
  SceneMirror mirror(limits);
  v1::SceneSnapshot empty;
  empty.set_epoch(7);
  EXPECT_TRUE(mirror.apply(empty).ok());
  for (std::size_t i = 0; i < 1000; ++i) {
    v1::SceneDelta message = one_more(i);
    fill(*message.mutable_changed(0));
    const std::shared_ptr<const Scene> before = mirror.scene();
    const Status status = mirror.apply(message);
    if (status.ok()) continue;
    EXPECT_EQ(mirror.scene(), before) << "a refused message leaves all as it was";
    return {status.error(), i};
  }
  ADD_FAILURE() << "never refused";
  return {};
}

TEST(MirrorLimits, HoldForTheWholeSceneOverAnyNumberOfMessages_F2) {
  const auto points = fill_until_refused(
      {.max_points = 100}, [](v1::EntityState& state) { *state.mutable_points() = test::cloud(0, 30); });
  EXPECT_EQ(points.applied, 3U);
  EXPECT_EQ(points.error.code, ErrorCode::resource_exhausted);
  EXPECT_EQ(points.error.field, "changed[0].points.total");

  const auto surfaces = [](v1::EntityState& state) {
    *state.mutable_surface() = test::triangle();
    state.set_surface_shown(true);
  };
  EXPECT_EQ(fill_until_refused({.max_vertices = 10}, surfaces).applied, 3U);
  EXPECT_EQ(fill_until_refused({.max_indices = 10}, surfaces).applied, 3U);

  const auto curves = [](v1::EntityState& state) {
    state.set_curves_shown(true);
    state.add_curves()->set_points(test::packed({0, 0, 0, 1, 1, 1}));
  };
  EXPECT_EQ(fill_until_refused({.max_curves = 4}, curves).applied, 4U);
  EXPECT_EQ(fill_until_refused({.max_curve_points = 9}, curves).applied, 4U);

  const auto icons = [](v1::EntityState& state) {
    state.set_kind("sculpt_surface");
    state.set_icons_shown(true);
    for (const char* id : {"a", "b"}) {
      v1::Icon& icon = *state.add_icons();
      icon.set_id(id);
      icon.set_role(v1::ICON_CONSTRAINT);
      icon.set_outline(test::packed({0, 0, 0}));
    }
  };
  EXPECT_EQ(fill_until_refused({.max_icons = 9}, icons).applied, 4U);
  EXPECT_EQ(fill_until_refused({.max_curve_points = 9}, icons).applied, 4U) << "outlines count as curves";

  const auto nothing = [](v1::EntityState&) {};
  EXPECT_EQ(fill_until_refused({.max_entities = 5}, nothing).applied, 5U);
}

TEST(MirrorLimits, AreToldInWords) {
  SceneSize size;
  size.icons = 12;
  const Status refused = check_size(size, {.max_icons = 11});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().describe(),
            "resource_exhausted: icons: the scene would have 12, a viewer holds 11 at most");
  EXPECT_TRUE(check_size(size, {.max_icons = 12}).ok());
}

TEST(MirrorLimits, StylesOfManyCloudsAreLimitedTogether) {
  double pressure = 0.0;
  const auto cloud = [&pressure](v1::EntityState& state) {
    *state.mutable_points() = test::cloud(0, 1, pressure += 0.001);
  };
  EXPECT_EQ(fill_until_refused({.max_styles = 7}, cloud).applied, 7U);
}

TEST(MirrorLimits, WhatGoesMakesRoom) {
  SceneMirror mirror(MirrorLimits{.max_points = 50});
  ASSERT_TRUE(mirror.apply(test::snapshot(40)).ok());
  v1::SceneDelta more = one_more(1);
  *more.mutable_changed(0)->mutable_points() = test::cloud(0, 30);
  EXPECT_FALSE(mirror.apply(more).ok());
  more.add_removed("top");
  EXPECT_TRUE(mirror.apply(more).ok()) << "in the same message";
  // An entity that is replaced frees what it held.
  v1::SceneDelta again = one_more(1);
  again.mutable_changed(0)->set_revision(1);
  *again.mutable_changed(0)->mutable_points() = test::cloud(0, 45);
  again.set_sequence(9);
  EXPECT_TRUE(mirror.apply(again).ok());
}

TEST(MirrorLimits, AnEntityComesOnceInAMessage) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(test::snapshot()).ok());
  v1::SceneDelta twice = test::delta();
  *twice.add_changed() = twice.changed(0);
  twice.mutable_changed(1)->set_revision(3);
  const Status refused = mirror.apply(twice);
  ASSERT_FALSE(refused.ok()) << "each costs a copy of what is held";
  EXPECT_EQ(refused.error().field, "changed[1].id");
}

TEST(MirrorLimits, SizesAddUp) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(test::snapshot(5)).ok());
  const SceneSize one = size_of(*mirror.scene()->entities.at("top"));
  EXPECT_EQ(one, size_of(*mirror.scene()));
  EXPECT_EQ(one.points, 5U);
  EXPECT_EQ(one.vertices, 3U);
  SceneSize two = one;
  two += one;
  EXPECT_EQ(two.indices, 6U);
  two -= one;
  EXPECT_EQ(two, one);
}

}  // namespace
}  // namespace handloft::client
