// A pointing hand adds icons to a sculpted surface (D6, D9, D11).

#include "server-model/interaction/drawn_curve.h"
#include "tests/unit/server-model/interaction/sculpt_fixture.h"

namespace handloft::interaction {
namespace {

class IconPenTest : public SculptTest {
 protected:
  void hover(const Vector3d& tip) { send(script_.pointing(tip, false)); }
  void tap(const Vector3d& tip, int frames = 4) {
    hover(tip);
    for (int i = 0; i < frames; ++i) send(script_.pointing(tip + Vector3d(0.0008 * (i % 2), 0, 0)));
    hover(tip);
  }
  /// A bow over 12 cm, in so many frames.
  void draw_bow(int frames, double noise_m = 0) {
    hover({-0.06, 0, 0.102});
    for (int i = 0; i <= frames; ++i) {
      const double t = static_cast<double>(i) / frames;
      const double y = 0.03 * std::sin(M_PI * t) + noise_m * (i % 2 == 0 ? 1 : -1);
      send(script_.pointing({-0.06 + 0.12 * t, y, 0.102}));
    }
    hover({0.06, 0, 0.102});
  }
};

TEST_F(IconPenTest, D6_a_tap_adds_a_point_where_the_fingertip_came_down) {
  const std::size_t before = steps();
  hover({0.05, 0.02, 0.104});
  send(script_.pointing({0.05, 0.02, 0.104}));
  EXPECT_EQ(interaction_.activity(0).tool, "adding a point icon");
  ASSERT_EQ(seen()->icons->size(), 1U) << "seen while it presses";
  EXPECT_TRUE(sheet()->icons->empty());
  hover({0.05, 0.02, 0.104});
  EXPECT_EQ(steps(), before + 1) << "as soon as it lets go, not when the hand stops pointing";
  const model::SculptIcon& added = sheet()->icons->at(0);
  EXPECT_EQ(added.shape, model::IconShape::point);
  EXPECT_LT((added.place - Vector3d(0.05, 0.02, 0.1)).norm(), 1e-9);
  EXPECT_EQ(added.sensors, (std::vector<std::string>{"hand", "spacemouse"}));
  EXPECT_EQ(interaction_.selected_icon().icon, added.id);
  EXPECT_NEAR(height(sheet(), 0.05, 0.02), 0, 1e-15) << "it begins at the surface as it is";
  tap({-0.05, 0.02, 0.104});
  EXPECT_EQ(sheet()->icons->size(), 2U) << "the hand need not stop pointing in between";
}

TEST_F(IconPenTest, a_tap_on_an_icon_selects_that_one) {
  tap({0.05, 0.02, 0.104});
  tap({-0.05, 0.02, 0.104});
  const std::string then = hash();
  tap({0.052, 0.02, 0.104});
  EXPECT_EQ(hash(), then);
  EXPECT_EQ(interaction_.selected_icon().icon, sheet()->icons->at(0).id);
}

TEST_F(IconPenTest, D9_a_drawn_line_adds_a_curve) {
  const std::size_t before = steps();
  draw_bow(40);
  ASSERT_EQ(sheet()->icons->size(), 1U);
  EXPECT_EQ(steps(), before + 1);
  const model::SculptIcon& curve = sheet()->icons->at(0);
  EXPECT_EQ(curve.shape, model::IconShape::curve);
  EXPECT_GE(curve.parameters.size(), 5U);
  EXPECT_LE(curve.parameters.size(), 30U) << "thinned";
  for (const auto& uv : curve.parameters) {
    const double x = uv.x() - 0.2;
    EXPECT_NEAR(uv.y() - 0.15, 0.03 * std::cos(M_PI * x / 0.12), 0.002);
  }
  EXPECT_NEAR(curve.parameters.front().x(), 0.14, 1e-9) << "the ends stay";
  EXPECT_NEAR(curve.parameters.back().x(), 0.26, 1e-9);
}

TEST_F(IconPenTest, D11_two_corners_make_a_region_by_taps_or_in_one_stroke) {
  touch(PaletteCommand::icon_pen);
  ASSERT_EQ(interaction_.modes().icon_pen, IconPen::region);
  tap({-0.05, -0.04, 0.103});
  EXPECT_TRUE(sheet()->icons->empty()) << "one corner is no region";
  EXPECT_EQ(interaction_.activity(0).tool, "a region: the other corner");
  hover({0.05, 0.2, 0.4});  // out of reach in between
  tap({0.05, 0.04, 0.103});
  ASSERT_EQ(sheet()->icons->size(), 1U);
  EXPECT_EQ(sheet()->icons->at(0).shape, model::IconShape::region);
  EXPECT_LT((sheet()->icons->at(0).parameters[0] - Eigen::Vector2d(0.15, 0.11)).norm(), 1e-3);
  EXPECT_LT((sheet()->icons->at(0).parameters[1] - Eigen::Vector2d(0.25, 0.19)).norm(), 1e-3);
  touch(PaletteCommand::undo);
  hover({-0.05, -0.04, 0.103});
  for (int i = 0; i <= 10; ++i) send(script_.pointing({-0.05 + 0.01 * i, -0.04 + 0.008 * i, 0.103}));
  ASSERT_EQ(seen()->icons->size(), 1U);
  hover({0.05, 0.04, 0.103});
  ASSERT_EQ(sheet()->icons->size(), 1U);
  EXPECT_LT((sheet()->icons->at(0).parameters[1] - Eigen::Vector2d(0.25, 0.19)).norm(), 1e-9);
}

TEST_F(IconPenTest, one_corner_alone_is_forgotten_when_the_hand_stops_pointing) {
  touch(PaletteCommand::icon_pen);
  const std::string then = hash();
  tap({-0.05, -0.04, 0.103});
  rest();
  tap({0.05, 0.04, 0.103});
  rest();
  EXPECT_EQ(hash(), then);
  EXPECT_FALSE(model_.has_provisional());
}

TEST_F(IconPenTest, a_lost_hand_leaves_no_icon) {
  const std::string then = hash();
  hover({-0.06, 0, 0.102});
  for (int i = 0; i <= 10; ++i) send(script_.pointing({-0.06 + 0.01 * i, 0, 0.102}));
  ASSERT_TRUE(model_.has_provisional());
  for (int i = 0; i < 12; ++i) send(script_.empty());
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(hash(), then);
  EXPECT_TRUE(interaction_.selected_icon().empty());
}

TEST_F(IconPenTest, new_icons_are_as_the_palette_says) {
  touch(PaletteCommand::icon_role);
  touch(PaletteCommand::icon_property);
  tap({0, 0, 0.103});
  EXPECT_EQ(sheet()->icons->at(0).role, model::IconRole::load);
  EXPECT_EQ(sheet()->icons->at(0).property, model::IconProperty::position) << "a load holds nothing";
  interaction_.select("");
  touch(PaletteCommand::icon_role);
  tap({0.08, 0.05, 0.103});
  EXPECT_EQ(sheet()->icons->at(1).role, model::IconRole::constraint);
  EXPECT_EQ(sheet()->icons->at(1).property, model::IconProperty::tangent_u);
}

TEST_F(IconPenTest, near_a_fitted_shape_pointing_draws_profiles_as_ever) {
  make_plate("plate", {0.5, 0, 0.1});
  const std::string then = hash();
  for (int i = 0; i <= 10; ++i) send(script_.pointing({0.46 + 0.008 * i, 0.0, 0.104}));
  EXPECT_EQ(interaction_.activity(0).tool, "drawing a profile");
  rest();
  EXPECT_NE(hash(), then);
  EXPECT_TRUE(sheet()->icons->empty());
  // And a selected shape is meant wherever the fingertip is.
  interaction_.select("plate");
  send(script_.pointing({0, 0, 0.104}));
  EXPECT_EQ(interaction_.activity(0).tool, "drawing a profile");
  rest();
  EXPECT_TRUE(sheet()->icons->empty());
}

TEST_F(IconPenTest, a_press_far_from_the_selected_surface_is_refused_in_words) {
  interaction_.select("sheet");
  const std::string then = hash();
  send(script_.pointing({0, 0, 0.4}));
  EXPECT_THAT(interaction_.activity(0).tool, HasSubstr("within reach"));
  rest();
  EXPECT_EQ(hash(), then);
}

TEST_F(IconPenTest, two_hands_add_an_icon_each) {
  const auto both = [&](bool pressing) {
    send(test::with_second_hand(script_.pointing({0.05, 0, 0.102}, pressing),
                                script_.pointing({-0.05, 0, 0.102}, pressing)));
  };
  both(false);
  both(true);
  both(true);
  both(false);
  ASSERT_EQ(sheet()->icons->size(), 2U);
  EXPECT_NE(sheet()->icons->at(0).id, sheet()->icons->at(1).id);
  EXPECT_NEAR(sheet()->icons->at(0).place.x(), 0.05, 1e-9);
  EXPECT_NEAR(sheet()->icons->at(1).place.x(), -0.05, 1e-9);
}

TEST_F(IconPenTest, an_open_hand_still_lays_points_while_a_surface_is_active) {
  tap({0, 0, 0.103});
  ASSERT_EQ(interaction_.active_shape(), "sheet");
  for (int i = 0; i < 5; ++i) send(script_.laying({0.01 * i, 0.3, 0.2}));
  rest();
  EXPECT_EQ(interaction_.activity(0).tool, "");
  ASSERT_NE(interaction_.active_shape(), "sheet");
  EXPECT_EQ(shape(interaction_.active_shape()).points.size(), 5U);
}

TEST(DrawnCurve, keeps_its_shape_whatever_the_rate_and_loses_its_tremble) {
  const auto bow = [](int frames, double noise) {
    std::vector<Vector3d> points;
    for (int i = 0; i <= frames; ++i) {
      const double t = static_cast<double>(i) / frames;
      const double off = i == 0 || i == frames ? 0 : noise * (i % 2 == 0 ? 1 : -1);
      points.emplace_back(0.15 * t, 0.04 * std::sin(M_PI * t) + off, 0);
    }
    return points;
  };
  const auto off_truth = [](const std::vector<Vector3d>& curve) {
    double most = 0;
    for (const Vector3d& p : curve)
      most = std::max(most, std::abs(p.y() - 0.04 * std::sin(M_PI * p.x() / 0.15)));
    return most;
  };
  const auto slow = smooth_and_thin(bow(200, 0));
  const auto quick = smooth_and_thin(bow(40, 0));
  EXPECT_LT(off_truth(slow), 0.001);
  EXPECT_LT(off_truth(quick), 0.001);
  EXPECT_LT(slow.size(), 20U);
  const auto trembling = bow(120, 0.001);
  EXPECT_GT(off_truth(trembling), 0.0009);
  EXPECT_LT(off_truth(smooth_and_thin(trembling)), 0.0008);
  EXPECT_EQ(smooth_and_thin(trembling).front(), trembling.front());
  EXPECT_EQ(smooth_and_thin(trembling).back(), trembling.back());
}

TEST(DrawnCurve, lines_points_and_nothing) {
  EXPECT_TRUE(smooth_and_thin({}).empty());
  EXPECT_EQ(smooth_and_thin({{1, 2, 3}}).size(), 1U);
  EXPECT_EQ(smooth_and_thin({{1, 2, 3}, {1, 2, 3}}).size(), 2U);
  std::vector<Vector3d> line;
  for (int i = 0; i <= 100; ++i) line.emplace_back(0.001 * i * i, 0.002 * i * i, 0);
  EXPECT_EQ(smooth_and_thin(line).size(), 2U);
  std::vector<Vector3d> far;
  for (int i = 0; i <= 1000; ++i) far.emplace_back(0.1 * i, std::sin(0.1 * i), std::cos(0.3 * i));
  EXPECT_LE(smooth_and_thin(far).size(), DrawnCurveOptions().max_places);
}

}  // namespace
}  // namespace handloft::interaction
