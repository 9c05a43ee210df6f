#include "client-hmd/mirror/scene_mirror.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "tests/unit/client-hmd/mirror/scene_messages.h"

namespace handloft::client {
namespace {

using test::cloud;
using test::delta;
using test::snapshot;

const Entity& top(const SceneMirror& mirror) {
  return *mirror.scene()->entities.at("top");
}

TEST(SceneMirror, HoldsASnapshot) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  const Entity& entity = top(mirror);
  EXPECT_EQ(entity.name, "Top");
  ASSERT_EQ(entity.points->points.size(), 3U);
  EXPECT_NEAR(entity.points->points[2].position.x, 0.002F, 1e-6F);
  ASSERT_EQ(entity.points->styles.size(), 1U);
  EXPECT_FLOAT_EQ(entity.points->styles[0].shell_alpha[4], 0.20F);
  ASSERT_EQ(entity.surface->indices.size(), 3U);
  EXPECT_NEAR(entity.surface->vertices[entity.surface->indices[0]].opacity, 1.0F, 0.51F);
  EXPECT_EQ(mirror.scene()->history.undo_steps, 1U);
  EXPECT_EQ(mirror.statistics().applied, 1U);
}

TEST(SceneMirror, AppendsATailAndKeepsWhatIsAbsent) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  const std::shared_ptr<const SurfaceMesh> surface = top(mirror).surface;
  v1::SceneDelta message = delta();
  *message.mutable_changed(0)->mutable_points() = cloud(3, 2, 0.9);
  message.mutable_changed(0)->set_provisional(true);
  ASSERT_TRUE(mirror.apply(message).ok());
  EXPECT_EQ(top(mirror).points->points.size(), 5U);
  EXPECT_EQ(top(mirror).settled_points, 3U) << "two of them are a gesture in the air";
  EXPECT_EQ(top(mirror).surface, surface) << "absent means unchanged, and is shared";

  v1::SceneDelta settled = delta(3, 3);
  ASSERT_TRUE(mirror.apply(settled).ok());
  EXPECT_EQ(top(mirror).settled_points, 5U);
}

TEST(SceneMirror, ReplacesTheTailOfACancelledGesture) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(snapshot(5)).ok());
  v1::SceneDelta message = delta();
  *message.mutable_changed(0)->mutable_points() = cloud(3, 0);
  ASSERT_TRUE(mirror.apply(message).ok());
  EXPECT_EQ(top(mirror).points->points.size(), 3U);
}

TEST(SceneMirror, DropsASurfaceThatIsNoLongerShownAndRemovesEntities) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  v1::SceneDelta message = delta();
  message.mutable_changed(0)->set_surface_shown(false);
  ASSERT_TRUE(mirror.apply(message).ok());
  EXPECT_EQ(top(mirror).surface, nullptr);
  EXPECT_FALSE(top(mirror).shows_surface());

  v1::SceneDelta removal;
  removal.set_epoch(7);
  removal.set_sequence(3);
  removal.add_removed("top");
  removal.add_removed("never there");
  ASSERT_TRUE(mirror.apply(removal).ok());
  EXPECT_TRUE(mirror.scene()->entities.empty());
}

TEST(SceneMirror, HandsOutValuesThatLaterMessagesDoNotTouch) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  const std::shared_ptr<const Scene> before = mirror.scene();
  v1::SceneDelta message = delta();
  *message.mutable_changed(0)->mutable_points() = cloud(3, 1);
  ASSERT_TRUE(mirror.apply(message).ok());
  EXPECT_EQ(before->entities.at("top")->points->points.size(), 3U);
}

TEST(SceneMirror, PassesOverStatesOlderThanWhatItHolds) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  v1::SceneDelta newer = delta(5);
  ASSERT_TRUE(mirror.apply(newer).ok());
  v1::SceneDelta older = delta(4);
  older.mutable_changed(0)->set_name("old");
  ASSERT_TRUE(mirror.apply(older).ok());
  EXPECT_NE(top(mirror).name, "old");
  EXPECT_EQ(mirror.statistics().stale_entities, 1U);
}

TEST(SceneMirror, RefusesADeltaWithoutASnapshotOrOfAnotherEpoch) {
  SceneMirror mirror;
  Status early = mirror.apply(delta());
  ASSERT_FALSE(early.ok());
  EXPECT_EQ(early.error().code, ErrorCode::failed_precondition);
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  v1::SceneDelta other = delta();
  other.set_epoch(8);
  EXPECT_FALSE(mirror.apply(other).ok());
  v1::SceneDelta backwards = delta();
  backwards.set_sequence(0);
  EXPECT_FALSE(mirror.apply(backwards).ok());
  EXPECT_EQ(mirror.statistics().refused, 3U);
}

TEST(SceneMirror, KeepsCurvesUntilAWholeSetComes) {
  SceneMirror mirror;
  v1::SceneSnapshot first = snapshot();
  v1::EntityState& entity = *first.mutable_entities(0);
  entity.set_curves_shown(true);
  entity.set_target(true);
  entity.add_curves()->set_points(std::string(24, '\0'));
  entity.add_curves()->set_kind(v1::Polyline::PROFILE);
  ASSERT_TRUE(mirror.apply(first).ok());
  EXPECT_TRUE(top(mirror).target);
  ASSERT_EQ(top(mirror).curves->size(), 2U);
  EXPECT_EQ(top(mirror).curves->at(0).points.size(), 2U);
  EXPECT_EQ(top(mirror).curves->at(1).kind, CurveKind::profile);

  ASSERT_TRUE(mirror.apply(delta(2)).ok());
  EXPECT_EQ(top(mirror).curves->size(), 2U) << "unchanged";
  EXPECT_FALSE(top(mirror).target) << "told anew every time";
  v1::SceneDelta none = delta(3, 3);
  none.mutable_changed(0)->set_curves_shown(true);
  ASSERT_TRUE(mirror.apply(none).ok());
  EXPECT_EQ(top(mirror).curves, nullptr);
}

TEST(SceneMirror, HoldsReferencesDistancesAndAlternatives_A28) {
  SceneMirror mirror;
  const Status applied = mirror.apply(test::compared_snapshot());
  ASSERT_TRUE(applied.ok()) << applied.error().describe();
  EXPECT_EQ(top(mirror).kind, EntityKind::dual_shape);
  EXPECT_EQ(*top(mirror).distances_m, (std::vector<float>{-0.002F, 0.0F, 0.003F}));
  const Entity& board = *mirror.scene()->entities.at("board");
  EXPECT_EQ(board.kind, EntityKind::reference);
  EXPECT_TRUE(board.shows_surface());
  EXPECT_EQ(board.distances_m, nullptr);
  EXPECT_EQ(mirror.scene()->alternatives.present, "flat");
  EXPECT_EQ(mirror.scene()->alternatives.names, (std::vector<std::string>{"main", "flat"}));
}

TEST(SceneMirror, DistancesMayFollowTheirSurfaceAndGoWithIt_A28) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  EXPECT_EQ(top(mirror).distances_m, nullptr) << "not measured yet";
  v1::SceneDelta measured = delta(1, 2);  // The same revision: nothing but the distances is new.
  *measured.mutable_changed(0)->mutable_surface() = test::triangle();
  measured.mutable_changed(0)->set_distances(test::packed({0.001F, 0.002F, 0.003F}));
  ASSERT_TRUE(mirror.apply(measured).ok());
  ASSERT_NE(top(mirror).distances_m, nullptr);
  EXPECT_FLOAT_EQ(top(mirror).distances_m->at(1), 0.002F);

  ASSERT_TRUE(mirror.apply(delta(2, 3)).ok());
  EXPECT_NE(top(mirror).distances_m, nullptr) << "absent means unchanged";
  v1::SceneDelta another = delta(3, 4);
  *another.mutable_changed(0)->mutable_surface() = test::triangle(0.2F);
  ASSERT_TRUE(mirror.apply(another).ok());
  EXPECT_EQ(top(mirror).distances_m, nullptr) << "they belonged to the former surface";

  v1::SceneDelta again = delta(4, 5);
  *again.mutable_changed(0)->mutable_surface() = test::triangle();
  again.mutable_changed(0)->set_distances(test::packed({0.001F, 0.002F, 0.003F}));
  ASSERT_TRUE(mirror.apply(again).ok());
  v1::SceneDelta hidden = delta(5, 6);
  hidden.mutable_changed(0)->set_surface_shown(false);
  ASSERT_TRUE(mirror.apply(hidden).ok());
  EXPECT_EQ(top(mirror).distances_m, nullptr) << "none without a surface";
}

TEST(SceneMirror, KeepsAlternativesUntilOthersCome_A28) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(test::compared_snapshot()).ok());
  ASSERT_TRUE(mirror.apply(delta(2, 2)).ok());
  EXPECT_EQ(mirror.scene()->alternatives.present, "flat") << "absent means unchanged";
  v1::SceneDelta switched = delta(3, 3);
  switched.mutable_alternatives()->set_present("main");
  switched.mutable_alternatives()->add_names("main");
  ASSERT_TRUE(mirror.apply(switched).ok());
  EXPECT_EQ(mirror.scene()->alternatives.present, "main");
  EXPECT_EQ(mirror.scene()->alternatives.names.size(), 1U);
}

TEST(SceneMirror, RefusesAlternativesThatCannotBe_A28) {
  MirrorLimits limits;
  limits.max_alternatives = 4;
  const auto refused = [&limits](const std::function<void(v1::AlternativesState&)>& spoil) {
    SceneMirror mirror(limits);
    if (!mirror.apply(test::compared_snapshot()).ok()) return std::string("the snapshot");
    const std::shared_ptr<const Scene> before = mirror.scene();
    v1::SceneDelta message = delta(2, 2);
    *message.mutable_alternatives() = test::compared_snapshot().alternatives();
    spoil(*message.mutable_alternatives());
    const Status status = mirror.apply(message);
    v1::SceneSnapshot whole = test::compared_snapshot();
    spoil(*whole.mutable_alternatives());
    EXPECT_EQ(mirror.apply(whole).ok(), status.ok()) << "in a snapshot as in a delta";
    EXPECT_TRUE(status.ok() || mirror.scene() == before);
    return status.ok() ? std::string("accepted") : status.error().field;
  };
  EXPECT_EQ(refused([](v1::AlternativesState&) {}), "accepted") << "unspoiled, it is fine";
  EXPECT_EQ(refused([](v1::AlternativesState& s) { s.clear_names(), s.clear_present(); }), "accepted");
  EXPECT_EQ(refused([](v1::AlternativesState& s) { s.set_present("round"); }), "alternatives.present");
  EXPECT_EQ(refused([](v1::AlternativesState& s) { s.clear_names(); }), "alternatives.present");
  EXPECT_EQ(refused([](v1::AlternativesState& s) { s.add_names(std::string(257, 'x')); }),
            "alternatives.names");
  EXPECT_EQ(refused([](v1::AlternativesState& s) {
              for (int i = 0; i < 3; ++i) s.add_names("more");
            }),
            "alternatives.names");
}

/// Every way to spoil a good delta that we could think of.
struct Spoiler {
  const char* name;
  void (*spoil)(v1::EntityState&);
};

class HostileDelta : public testing::TestWithParam<Spoiler> {};

TEST_P(HostileDelta, IsRefusedWholeAndLeavesTheSceneAsItWas) {
  MirrorLimits limits;
  limits.max_points = 100;
  SceneMirror mirror(limits);
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  const std::shared_ptr<const Scene> before = mirror.scene();
  v1::SceneDelta message = delta();
  *message.mutable_changed(0)->mutable_points() = cloud(3, 2);
  // A good entity before the bad one must not get in either.
  v1::EntityState good = message.changed(0);
  good.set_id("good");
  *good.mutable_points() = cloud(0, 2);
  *message.add_changed() = good;
  message.mutable_changed()->SwapElements(0, 1);
  ASSERT_TRUE(SceneMirror(mirror).apply(message).ok()) << "unspoiled, it is fine";

  GetParam().spoil(*message.mutable_changed(1));
  const Status refused = mirror.apply(message);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().field.find("changed[1]"), std::string::npos) << refused.error().describe();
  EXPECT_EQ(mirror.scene(), before);
  EXPECT_EQ(mirror.statistics().refused, 1U);
}

constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    Ways, HostileDelta,
    testing::Values(
        Spoiler{"NoId", [](v1::EntityState& s) { s.clear_id(); }},
        Spoiler{"LongId", [](v1::EntityState& s) { s.set_id(std::string(10'000, 'x')); }},
        Spoiler{"LongName", [](v1::EntityState& s) { s.set_name(std::string(10'000, 'x')); }},
        Spoiler{"Representation",
                [](v1::EntityState& s) { s.set_representation(static_cast<v1::Representation>(99)); }},
        Spoiler{"TailBeyondWhatIsHeld", [](v1::EntityState& s) { *s.mutable_points() = cloud(50, 1); }},
        Spoiler{"TooManyPoints", [](v1::EntityState& s) { *s.mutable_points() = cloud(0, 101); }},
        Spoiler{"HugeTotal", [](v1::EntityState& s) { s.mutable_points()->set_total(4'000'000'000U); }},
        Spoiler{"ShortPositions",
                [](v1::EntityState& s) { s.mutable_points()->mutable_positions()->resize(7); }},
        Spoiler{"StyleBeyondPalette", [](v1::EntityState& s) { s.mutable_points()->clear_palette(); }},
        Spoiler{"NanOrigin", [](v1::EntityState& s) { s.mutable_points()->mutable_origin()->set_x(nan_f); }},
        Spoiler{"InfiniteStep",
                [](v1::EntityState& s) {
                  s.mutable_points()->set_step_m(std::numeric_limits<double>::infinity());
                }},
        Spoiler{
            "NanRadius",
            [](v1::EntityState& s) { s.mutable_points()->mutable_palette(0)->set_shell_radius_m(0, nan_f); }},
        Spoiler{"HugeRadius",
                [](v1::EntityState& s) { s.mutable_points()->mutable_palette(0)->set_radius_m(50.0F); }},
        Spoiler{"AlphaAboveOne",
                [](v1::EntityState& s) { s.mutable_points()->mutable_palette(0)->set_shell_alpha(2, 1.5F); }},
        Spoiler{"FourShells",
                [](v1::EntityState& s) {
                  s.mutable_points()->mutable_palette(0)->mutable_shell_alpha()->RemoveLast();
                }},
        Spoiler{"BrokenMesh",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.mutable_surface()->set_residuals("nonsense");
                }},
        Spoiler{"HugeMesh",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.mutable_surface()->set_vertex_count(4'000'000'000U);
                }},
        Spoiler{"BadIndices",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.mutable_surface()->set_vertex_count(2);
                }},
        Spoiler{"CurveOfSevenBytes", [](v1::EntityState& s) { s.add_curves()->set_points("1234567"); }},
        Spoiler{"CurveOfNan",
                [](v1::EntityState& s) {
                  const float bad[3] = {0.0F, nan_f, 0.0F};
                  s.add_curves()->set_points(bad, sizeof(bad));
                }},
        Spoiler{"UnknownKind", [](v1::EntityState& s) { s.set_kind("teapot"); }},
        Spoiler{"DistancesWithoutASurface",
                [](v1::EntityState& s) { s.set_distances(test::packed({0.0F, 0.0F, 0.0F})); }},
        Spoiler{"DistancesOfASurfaceNotShown",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.set_surface_shown(false);
                  s.set_distances(test::packed({0.0F, 0.0F, 0.0F}));
                }},
        Spoiler{"TooFewDistances",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.set_distances(test::packed({0.0F, 0.0F}));
                }},
        Spoiler{"TooManyDistances",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.set_distances(test::packed({0.0F, 0.0F, 0.0F, 0.0F}));
                }},
        Spoiler{"DistancesOfThirteenBytes",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.set_distances(test::packed({0.0F, 0.0F, 0.0F}) + "x");
                }},
        Spoiler{"NanDistance",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.set_distances(test::packed({0.0F, nan_f, 0.0F}));
                }},
        Spoiler{"InfiniteDistance",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.set_distances(test::packed({0.0F, 0.0F, -std::numeric_limits<float>::infinity()}));
                }},
        Spoiler{"HugeDistance",
                [](v1::EntityState& s) {
                  *s.mutable_surface() = test::triangle();
                  s.set_distances(test::packed({1e30F, 0.0F, 0.0F}));
                }},
        Spoiler{"NanResidual", [](v1::EntityState& s) { s.set_residual_rms_m(nan_f); }}),
    [](const testing::TestParamInfo<Spoiler>& way) { return way.param.name; });

TEST(SceneMirror, RefusesASnapshotWithAnEntityTwiceOrTooMany) {
  SceneMirror mirror;
  v1::SceneSnapshot twice = snapshot();
  *twice.add_entities() = twice.entities(0);
  EXPECT_FALSE(mirror.apply(twice).ok());

  MirrorLimits limits;
  limits.max_entities = 4;
  SceneMirror small(limits);
  v1::SceneSnapshot many;
  for (int i = 0; i < 5; ++i) many.add_entities()->set_id("e" + std::to_string(i));
  const Status refused = small.apply(many);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_TRUE(small.scene()->entities.empty());
}

TEST(SceneMirror, StylesOfManyTailsAreUnitedNotRepeated) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  for (std::uint32_t i = 0; i < 20; ++i) {
    v1::SceneDelta message = delta(2 + i, 2 + i);
    *message.mutable_changed(0)->mutable_points() = cloud(3 + i, 1);
    ASSERT_TRUE(mirror.apply(message).ok());
  }
  EXPECT_EQ(top(mirror).points->points.size(), 23U);
  EXPECT_EQ(top(mirror).points->styles.size(), 1U);
}

}  // namespace
}  // namespace handloft::client
