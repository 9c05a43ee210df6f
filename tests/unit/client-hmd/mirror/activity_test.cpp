// What somebody says of a hand is checked before it is drawn (A13, A16, A18, A12).

#include "client-hmd/mirror/activity.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "client-hmd/mirror/read_curve.h"

namespace handloft::client {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

std::string packed(const std::vector<std::array<float, 3>>& points) {
  return {reinterpret_cast<const char*>(points.data()), points.size() * sizeof(points[0])};
}

v1::Presence pushing() {
  v1::Presence presence;
  presence.set_name("hand");
  presence.set_tool("pushing");
  presence.set_entity("shape-1");
  presence.set_mode("boundary");
  presence.set_range(0.25);
  presence.set_falloff(v1::FALLOFF_SMOOTH);
  presence.set_palette_page(2);
  presence.set_symmetry(true);
  presence.mutable_symmetry_plane()->mutable_origin()->set_x(0.02);
  presence.mutable_symmetry_plane()->mutable_normal()->set_y(-2.0);
  v1::DiskPose& disk = *presence.mutable_disk();
  disk.mutable_centre()->set_z(0.1);
  disk.mutable_normal()->set_z(-0.5);
  disk.set_radius_m(0.03);
  v1::Polyline& curve = *presence.mutable_curve();
  curve.set_points(packed({{0, 0, 0}, {0.1F, 0, 0}}));
  curve.set_kind(v1::Polyline::BOUNDARY);
  return presence;
}

TEST(Activity, ReadsAllThatHangsInTheAir) {
  const Result<Activity> activity = read_activity(pushing());
  ASSERT_TRUE(activity.ok()) << activity.error().describe();
  EXPECT_EQ(activity->tool, "pushing");
  EXPECT_EQ(activity->mode, "boundary");
  EXPECT_FLOAT_EQ(activity->range, 0.25F);
  EXPECT_TRUE(activity->smooth_falloff);
  EXPECT_EQ(activity->palette_page, 2U);
  ASSERT_TRUE(activity->disk);
  EXPECT_EQ(activity->disk->normal, (Vec3f{0, 0, -1})) << "normalised on receipt";
  EXPECT_FLOAT_EQ(activity->disk->radius_m, 0.03F);
  ASSERT_TRUE(activity->symmetry_plane);
  EXPECT_EQ(activity->symmetry_plane->normal, (Vec3f{0, -1, 0}));
  ASSERT_NE(activity->curve, nullptr);
  EXPECT_EQ(activity->curve->kind, CurveKind::boundary);
  EXPECT_EQ(activity->curve->points.size(), 2U);
}

TEST(Activity, AnIdleHandHasNothingInTheAir) {
  const Result<Activity> activity = read_activity(v1::Presence{});
  ASSERT_TRUE(activity.ok());
  EXPECT_FALSE(activity->disk || activity->symmetry_plane);
  EXPECT_EQ(activity->curve, nullptr);
}

TEST(Activity, CutsLongWords) {
  v1::Presence presence;
  presence.set_tool(std::string(10'000, 'x'));
  EXPECT_EQ(read_activity(presence)->tool.size(), ActivityLimits{}.max_text_bytes);
}

struct Spoiler {
  const char* field;
  void (*spoil)(v1::Presence&);
};
class SpoiledActivity : public testing::TestWithParam<Spoiler> {};

TEST_P(SpoiledActivity, IsRefusedByName) {
  v1::Presence presence = pushing();
  GetParam().spoil(presence);
  const Result<Activity> refused = read_activity(presence);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().field, GetParam().field);
}

INSTANTIATE_TEST_SUITE_P(
    All, SpoiledActivity,
    testing::Values(
        Spoiler{"disk.centre", [](v1::Presence& p) { p.mutable_disk()->mutable_centre()->set_y(nan); }},
        Spoiler{"disk.centre", [](v1::Presence& p) { p.mutable_disk()->mutable_centre()->set_y(1e30); }},
        Spoiler{"disk.normal", [](v1::Presence& p) { p.mutable_disk()->mutable_normal()->set_x(nan); }},
        Spoiler{"disk.normal", [](v1::Presence& p) { p.mutable_disk()->mutable_normal()->set_x(infinite); }},
        Spoiler{"disk.normal", [](v1::Presence& p) { p.mutable_disk()->clear_normal(); }},
        Spoiler{"disk.radius_m", [](v1::Presence& p) { p.mutable_disk()->set_radius_m(nan); }},
        Spoiler{"disk.radius_m", [](v1::Presence& p) { p.mutable_disk()->set_radius_m(-0.01); }},
        Spoiler{"disk.radius_m", [](v1::Presence& p) { p.mutable_disk()->set_radius_m(30.0); }},
        Spoiler{"range", [](v1::Presence& p) { p.set_range(nan); }},
        Spoiler{"range", [](v1::Presence& p) { p.set_range(1.5); }},
        Spoiler{"symmetry_plane.normal", [](v1::Presence& p) { p.mutable_symmetry_plane()->clear_normal(); }},
        Spoiler{"symmetry_plane.origin",
                [](v1::Presence& p) { p.mutable_symmetry_plane()->mutable_origin()->set_z(-infinite); }},
        Spoiler{"curve.points", [](v1::Presence& p) { p.mutable_curve()->mutable_points()->append("x"); }},
        Spoiler{"curve.points",
                [](v1::Presence& p) {
                  p.mutable_curve()->set_points(packed({{0, std::numeric_limits<float>::quiet_NaN(), 0}}));
                }},
        Spoiler{"curve.points",
                [](v1::Presence& p) { p.mutable_curve()->set_points(std::string(12 * 100'001, '\0')); }},
        Spoiler{"curve.kind",
                [](v1::Presence& p) { p.mutable_curve()->set_kind(static_cast<v1::Polyline::Kind>(7)); }}));

}  // namespace
}  // namespace handloft::client
