// The net of control points behind a surface, with hand values, and gestures of several hands seen at once.

#include "server-model/model/control_net.h"

#include <cstring>
#include <string>
#include <vector>

#include "server-model/geometry/bezier_patch.h"
#include "server-model/model/sculpt_shape.h"
#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

Result<v1::QueryResult> ask_net(const Model& model, const std::string& id, std::uint32_t max_points = 0) {
  v1::Query query;
  query.mutable_control_net()->set_entity(id);
  query.mutable_control_net()->set_max_points(max_points);
  return model.query(query);
}

std::vector<geometry::Vec3> points_of(const v1::ControlNetResult& net) {
  std::vector<geometry::Vec3> points(net.points().size() / (3 * sizeof(float)));
  for (std::size_t i = 0; i < points.size(); ++i) {
    float xyz[3];
    std::memcpy(xyz, net.points().data() + i * sizeof(xyz), sizeof(xyz));
    points[i] = {xyz[0], xyz[1], xyz[2]};
  }
  return points;
}

Model with_saddle() {
  Model model;
  for (const auto& operation : {create("top"), add("top", saddle_points()), fit("top")}) {
    EXPECT_TRUE(model.submit(operation).ok());
  }
  return model;
}

TEST(ControlNet, V3_of_a_fit_is_the_patch_over_its_footprint_in_the_world) {
  const Model model = with_saddle();
  const auto result = ask_net(model, "top");
  ASSERT_TRUE(result.ok()) << result.error().describe();
  const v1::ControlNetResult& net = result->control_net();
  EXPECT_EQ(net.entity(), "top");
  EXPECT_EQ(net.sequence(), model.sequence());
  ASSERT_EQ(net.rows(), 3U);
  ASSERT_EQ(net.columns(), 3U);
  const auto points = points_of(net);
  ASSERT_EQ(points.size(), 9U);
  // A patch passes through its corners, and they lie on z = 0.01 + 2 x^2 - y^2.
  for (const std::size_t corner : {0U, 2U, 6U, 8U}) {
    const geometry::Vec3& p = points[corner];
    EXPECT_NEAR(p.z(), 0.01 + 2 * p.x() * p.x() - p.y() * p.y(), 1e-7);
  }
  // Seen from above, a row is straight.
  EXPECT_NEAR((points[1] - points[0]).cross(points[2] - points[1]).z(), 0.0, 1e-9);
  EXPECT_GT((points[6] - points[0]).norm(), 1e-3);
  // ends.
  geometry::BezierPatch patch{2, points};
  const geometry::Vec3 middle = patch.evaluate(0.5, 0.5);
  EXPECT_NEAR(middle.z(), 0.01 + 2 * middle.x() * middle.x() - middle.y() * middle.y(), 1e-7);
}

TEST(ControlNet, V3_of_a_sculpted_surface_is_its_own) {
  Model model;
  v1::Operation make;
  v1::CreateSculptSurface& sheet = *make.mutable_create_sculpt_surface();
  sheet.set_id("sheet");
  sheet.mutable_rectangle()->set_width_m(0.2);
  sheet.mutable_rectangle()->set_depth_m(0.1);
  sheet.set_control_u(7);
  sheet.set_control_v(5);
  ASSERT_TRUE(model.submit(make).ok());
  const auto result = ask_net(model, "sheet");
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->control_net().rows(), 7U);
  EXPECT_EQ(result->control_net().columns(), 5U);
  const auto points = points_of(result->control_net());
  const SculptPtr shape = as_sculpt(model.document().find("sheet"));
  ASSERT_EQ(points.size(), shape->surface->control.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((points[i] - shape->surface->control[i]).norm(), 1e-7);
  }
}

TEST(ControlNet, refuses_what_has_none_and_what_is_too_large_by_name) {
  Model model = with_saddle();
  ASSERT_TRUE(model.submit(create("bare")).ok());
  EXPECT_EQ(ask_net(model, "nothing").error().code, ErrorCode::not_found);
  EXPECT_EQ(ask_net(model, "nothing").error().field, "control_net.entity");
  EXPECT_EQ(ask_net(model, "bare").error().code, ErrorCode::failed_precondition);
  EXPECT_TRUE(ask_net(model, "top", 9).ok());
  const auto large = ask_net(model, "top", 8);
  ASSERT_FALSE(large.ok());
  EXPECT_EQ(large.error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(large.error().field, "control_net.max_points");
  v1::Operation make;
  make.mutable_create_sculpt_surface()->set_id("fine");
  make.mutable_create_sculpt_surface()->mutable_rectangle()->set_width_m(0.2);
  make.mutable_create_sculpt_surface()->mutable_rectangle()->set_depth_m(0.2);
  make.mutable_create_sculpt_surface()->set_control_u(101);
  make.mutable_create_sculpt_surface()->set_control_v(100);
  ASSERT_TRUE(model.submit(make).ok());
  EXPECT_EQ(ask_net(model, "fine").error().code, ErrorCode::resource_exhausted) << "10,000 without a limit";
  EXPECT_TRUE(ask_net(model, "fine", 10'100).ok());
}

v1::Operation stroke_of(std::uint64_t client, double y) {
  v1::Operation operation;
  operation.set_client_id(client);
  operation.mutable_add_points()->set_entity("top");
  for (int i = 0; i < 3; ++i) {
    v1::Point& point = *operation.mutable_add_points()->add_points();
    point.mutable_position()->set_x(0.01 * i);
    point.mutable_position()->set_y(y);
    point.set_pressure(0.5);
  }
  return operation;
}

TEST(Provisional, U1_two_strokes_in_the_air_on_one_shape_are_both_seen_and_both_kept) {
  Model model = with_saddle();
  const std::size_t before = model.document().find_dual("top")->points.size();
  const auto one = model.begin_provisional(stroke_of(4, 0.01));
  const auto two = model.begin_provisional(stroke_of(7, 0.02));
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_EQ(model.preview().find_dual("top")->points.size(), before + 6);
  EXPECT_EQ(model.provisional_by("top"), 7U) << "the later one";
  EXPECT_EQ(model.provisional_by("other"), std::nullopt);
  ASSERT_TRUE(model.commit_provisional(*two).ok());
  EXPECT_EQ(model.provisional_by("top"), 4U);
  EXPECT_EQ(model.preview().find_dual("top")->points.size(), before + 6);
  ASSERT_TRUE(model.commit_provisional(*one).ok());
  EXPECT_EQ(model.document().find_dual("top")->points.size(), before + 6);
  EXPECT_EQ(model.document().find_dual("top")->stroke_count, 3U);
}

TEST(Provisional, U1_looking_at_two_strokes_that_fit_live_twice_is_seeing_the_same_surface) {
  Model model = with_saddle();
  v1::Operation one = stroke_of(4, 0.01);
  one.mutable_add_points()->set_refit(true);
  v1::Operation two = stroke_of(7, 0.02);
  two.mutable_add_points()->set_refit(true);
  ASSERT_TRUE(model.begin_provisional(one).ok() && model.begin_provisional(two).ok());
  const DualPtr seen = model.preview().find_dual("top");
  EXPECT_EQ(seen->points.size(), 36U);
  // Else its mesh would be made anew for ever.
  EXPECT_EQ(seen->fit, model.preview().find_dual("top")->fit);
  EXPECT_NE(seen->fit, model.document().find_dual("top")->fit) << "it follows the first of them";
}

TEST(Provisional, U1_points_come_on_top_of_what_another_gesture_does_with_the_shape) {
  Model model = with_saddle();
  const std::size_t before = model.document().find_dual("top")->points.size();
  const auto laid = model.begin_provisional(stroke_of(4, 0.01));
  v1::Operation move;
  move.set_client_id(5);
  move.mutable_transform()->add_entities("top");
  move.mutable_transform()->mutable_translation()->set_z(0.5);
  const auto moved = model.begin_provisional(move);
  ASSERT_TRUE(laid.ok() && moved.ok());
  const DualPtr seen = model.preview().find_dual("top");
  ASSERT_EQ(seen->points.size(), before + 3);
  EXPECT_GT(seen->points[0].z, 0.4) << "moved";
  EXPECT_EQ(seen->points[before].z, 0.0) << "and laid where the hand is";
}

}  // namespace
}  // namespace handloft::model
