// What somebody says of a hand is checked before it is drawn (A13, A16, A18, A12).

#include "client-hmd/mirror/activity.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "client-hmd/mirror/read_curve.h"
#include "common/codec/fingertips.h"

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
  codec::Fingertips tips;
  for (std::size_t i = 0; i < tips.size(); ++i) {
    tips[i].state = i == 0 ? v1::TRACKING_PREDICTED : v1::TRACKING_SINGLE;
    tips[i].position_m = {0.02 * static_cast<double>(i), 0.05, 0.1};
    tips[i].velocity_m_s = {0.0F, 0.3F, 0.0F};
  }
  tips[4].state = v1::TRACKING_LOST;
  codec::pack_fingertips(tips, *presence.mutable_hand());
  presence.mutable_hand()->set_gesture(v1::GESTURE_CLOSED);
  presence.mutable_hand()->set_pressure(0.5);
  v1::HeadState& head = *presence.mutable_head();
  head.set_state(v1::TRACKING_TRACKED);
  head.mutable_world_from_head()->mutable_position()->set_z(0.5);
  head.mutable_world_from_head()->mutable_orientation()->set_w(2.0);
  head.mutable_linear_velocity()->set_x(0.1);
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

TEST(Activity, ReadsWhereHandAndHeadAre_U1) {
  const Result<Activity> activity = read_activity(pushing());
  ASSERT_TRUE(activity.ok());
  ASSERT_TRUE(activity->hand);
  EXPECT_EQ(activity->hand->posture, HandPosture::closed);
  EXPECT_FLOAT_EQ(activity->hand->pressure, 0.5F);
  EXPECT_EQ(activity->hand->tips[0].state, TipState::predicted);
  EXPECT_EQ(activity->hand->tips[2].state, TipState::seen);
  EXPECT_EQ(activity->hand->tips[2].place, (Vec3f{0.04F, 0.05F, 0.1F}));
  EXPECT_EQ(activity->hand->tips[2].velocity, (Vec3f{0, 0.3F, 0}));
  EXPECT_EQ(activity->hand->tips[4].state, TipState::lost);
  ASSERT_TRUE(activity->head);
  EXPECT_EQ(activity->head->place, (Vec3f{0, 0, 0.5F}));
  EXPECT_FLOAT_EQ(activity->head->orientation[0], 1.0F) << "normalised on receipt";
}

TEST(Activity, WhatIsLostIsNotRead_T6) {
  v1::Presence presence = pushing();
  presence.mutable_head()->set_state(v1::TRACKING_LOST);
  presence.mutable_head()->mutable_world_from_head()->mutable_position()->set_x(nan);
  codec::pack_fingertips({}, *presence.mutable_hand());
  const Result<Activity> activity = read_activity(presence);
  ASSERT_TRUE(activity.ok()) << activity.error().describe();
  EXPECT_FALSE(activity->hand);
  EXPECT_FALSE(activity->head);
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
        Spoiler{"hand.fingertip_positions",
                [](v1::Presence& p) { p.mutable_hand()->set_fingertip_positions(4, nan); }},
        Spoiler{"hand.fingertip_positions",
                [](v1::Presence& p) { p.mutable_hand()->set_fingertip_positions(4, 1e9); }},
        Spoiler{"hand.fingertip_positions",
                [](v1::Presence& p) { p.mutable_hand()->add_fingertip_positions(0.0); }},
        Spoiler{"hand.fingertip_velocities",
                [](v1::Presence& p) { p.mutable_hand()->set_fingertip_velocities(0, 1e6F); }},
        Spoiler{"hand.pressure", [](v1::Presence& p) { p.mutable_hand()->set_pressure(nan); }},
        Spoiler{"head.position",
                [](v1::Presence& p) {
                  p.mutable_head()->mutable_world_from_head()->mutable_position()->set_y(infinite);
                }},
        Spoiler{"head.orientation",
                [](v1::Presence& p) { p.mutable_head()->mutable_world_from_head()->clear_orientation(); }},
        Spoiler{"head.orientation",
                [](v1::Presence& p) {
                  p.mutable_head()->mutable_world_from_head()->mutable_orientation()->set_y(nan);
                }},
        Spoiler{"head.linear_velocity",
                [](v1::Presence& p) { p.mutable_head()->mutable_linear_velocity()->set_z(nan); }},
        Spoiler{"head.angular_velocity",
                [](v1::Presence& p) { p.mutable_head()->mutable_angular_velocity()->set_z(1e9); }},
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
