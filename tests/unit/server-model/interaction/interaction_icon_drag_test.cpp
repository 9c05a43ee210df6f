// A closed hand drags icons of sculpted surfaces (D6, D13, D15, D19, step 4).

#include <cstdint>
#include <limits>

#include "tests/unit/server-model/interaction/sculpt_fixture.h"

namespace handloft::interaction {
namespace {

class IconDragTest : public SculptTest {
 protected:
  void SetUp() override {
    SculptTest::SetUp();
    add_icon("p", {{0, 0, sheet_z}});
    before_ = hash();
    steps_ = steps();
  }
  std::string before_;
  std::size_t steps_ = 0;
};

TEST_F(IconDragTest, D6_a_fist_takes_the_nearest_icon_along_and_the_surface_follows_every_frame) {
  const Vector3d grip(0.01, 0.0, 0.12);
  for (int i = 0; i <= 10; ++i) {
    send(script_.closed(grip + Vector3d(0, 0, 0.003 * i)));
    EXPECT_NEAR(height(seen(), 0, 0), 0.003 * i, 1e-9) << "also while it is in the air";
    EXPECT_EQ(height(sheet(), 0, 0), 0);
  }
  EXPECT_EQ(hash(), before_);
  EXPECT_EQ(interaction_.activity(0).tool, "dragging icon \"p\"");
  EXPECT_EQ(interaction_.activity(0).entity, "sheet");
  EXPECT_TRUE(marked("p", IconMark::Kind::held));
  rest();
  EXPECT_EQ(steps(), steps_ + 1);
  EXPECT_NEAR(height(sheet(), 0, 0), 0.03, 1e-9);
  EXPECT_LT((icon("p").translation - Vector3d(0, 0, 0.03)).norm(), 1e-12);
  EXPECT_EQ(interaction_.selected_icon(), (IconName{"sheet", "p"}));
  EXPECT_EQ(interaction_.active_shape(), "sheet");
  EXPECT_TRUE(no_marks()) << "the hand has left it";
}

TEST_F(IconDragTest, what_an_open_or_pointing_hand_is_near_is_the_target) {
  send(script_.resting({0.0, 0.01, 0.13}));
  EXPECT_TRUE(marked("p", IconMark::Kind::target));
  EXPECT_EQ(interaction_.targets(), std::vector<std::string>{"sheet"});
  send(script_.resting({0.0, 0.01, 0.3}));
  EXPECT_TRUE(no_marks());
  EXPECT_TRUE(send(script_.pointing({0.0, 0.0, 0.12}, false)).scene_changed);
  EXPECT_TRUE(marked("p", IconMark::Kind::target));
  send(script_.closed({0.0, 0.0, 0.12}));
  EXPECT_TRUE(marked("p", IconMark::Kind::held));
  for (int i = 0; i < 12; ++i) send(script_.empty());
  EXPECT_TRUE(no_marks());
}

TEST_F(IconDragTest, what_was_highlighted_is_picked_though_closing_moves_the_fingertips) {
  add_icon("q", {{0.05, 0, sheet_z}});
  send(script_.resting({0.015, 0, 0.12}));
  ASSERT_TRUE(marked("p", IconMark::Kind::target));
  send(script_.closed({0.035, 0, 0.12}));  // nearer to q now
  EXPECT_TRUE(marked("p", IconMark::Kind::held));
  rest();
  send(script_.resting({0, 0, 0.5}));
  send(script_.closed({0.035, 0, 0.12}));  // a hand that comes as a fist
  EXPECT_TRUE(marked("q", IconMark::Kind::held));
}

TEST_F(IconDragTest, a_lost_hand_leaves_no_trace) {
  for (int i = 0; i <= 5; ++i) send(script_.closed({0, 0, 0.12 + 0.004 * i}));
  ASSERT_TRUE(model_.has_provisional());
  for (int i = 0; i < 4; ++i) send(script_.empty());
  EXPECT_TRUE(model_.has_provisional()) << "within the grace period";
  for (int i = 0; i < 8; ++i) send(script_.empty());
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(hash(), before_);
  EXPECT_EQ(steps(), steps_);
  EXPECT_EQ(interaction_.activity(0).tool, "hand lost");
  EXPECT_TRUE(no_marks());
}

TEST_F(IconDragTest, a_fist_that_only_picks_does_not_nudge) {
  for (int i = 0; i < 5; ++i) send(script_.closed({0.0005 * (i % 2), 0, 0.12}));
  rest();
  EXPECT_EQ(hash(), before_);
  EXPECT_EQ(interaction_.selected_icon().icon, "p");
}

TEST_F(IconDragTest, D13_others_than_driving_ones_are_only_selected) {
  for (const auto& [state, id] : {std::pair{v1::ICON_PASSIVE, "passive"}, {v1::ICON_SLEEPING, "sleeping"}}) {
    add_icon(id, {{0.12, 0.1, sheet_z}}, v1::ICON_POINT, state);
    const std::string then = hash();
    send(script_.closed({0.12, 0.1, 0.11}));
    EXPECT_THAT(interaction_.activity(0).tool, HasSubstr(std::string("selected icon \"") + id));
    for (int i = 0; i < 5; ++i) send(script_.closed({0.12, 0.1, 0.11 + 0.005 * i}));
    EXPECT_FALSE(marked(id, IconMark::Kind::held));
    rest();
    EXPECT_EQ(hash(), then);
    EXPECT_EQ(interaction_.selected_icon().icon, id);
    touch(PaletteCommand::delete_icon);
    EXPECT_FALSE(has_icon(id));
  }
  add_icon("mouse", {{0.12, 0.1, sheet_z}}, v1::ICON_POINT, v1::ICON_DRIVING, {"spacemouse"});
  const std::string then = hash();
  for (int i = 0; i < 5; ++i) send(script_.closed({0.12, 0.1, 0.11 + 0.005 * i}));
  rest();
  EXPECT_EQ(hash(), then) << "D17: the hand is not among its sensors";
}

TEST_F(IconDragTest, D8_the_icon_turns_as_the_fist_turns) {
  v1::Operation normal;
  normal.mutable_change_icon()->set_entity("sheet");
  normal.mutable_change_icon()->set_icon("p");
  normal.mutable_change_icon()->set_property(v1::ICON_NORMAL);
  submit(normal);
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.4, Vector3d::UnitX()));
  send(script_.closed({0, 0, 0.12}));
  send(test::turned(script_.closed({0, 0, 0.12}), turn));
  rest();
  const Vector3d now = sheet()->surface->normal(0.2, 0.15);
  EXPECT_LT((now - turn * Vector3d::UnitZ()).norm(), 1e-9);
}

TEST_F(IconDragTest, two_drags_add_up_each_from_where_the_hand_closed) {
  for (int k = 0; k < 2; ++k) {
    const double from = 0.11 + 0.01 * k;
    send(script_.closed({0.0, 0.0, from}));
    send(script_.closed({0.0, 0.0, from + 0.01}));
    rest();
  }
  EXPECT_NEAR(height(sheet(), 0, 0), 0.02, 1e-9);
  EXPECT_EQ(steps(), steps_ + 2);
}

TEST_F(IconDragTest, A25_the_way_between_does_not_matter_only_where_the_hand_opens) {
  // Ten frames and two: the same document to the bit (X2).
  std::vector<std::string> hashes;
  for (const int frames : {10, 2}) {
    send(script_.closed({0, 0, 0.12}));
    for (int i = 1; i <= frames; ++i) send(script_.closed({0.02 * i / frames, 0, 0.12 + 0.015 * i / frames}));
    send(script_.closed({0.02, 0, 0.135}));
    rest();
    hashes.push_back(hash());
    touch(PaletteCommand::undo);
    EXPECT_EQ(hash(), before_);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST_F(IconDragTest, D20_a_refused_frame_keeps_the_last_good_one_and_says_so) {
  // Two icons at the same place: pulled apart they contradict each other.
  add_icon("q", {{0, 0, sheet_z}});
  const std::size_t steps_before = steps();
  send(script_.resting({0, 0, 0.12}));
  const std::string held = interaction_.icon_marks().at(0).name.icon;
  send(script_.closed({0, 0, 0.12}));
  send(script_.closed({0, 0, 0.14}));
  EXPECT_THAT(interaction_.activity(0).tool, HasSubstr("icon \"" + held + "\" stays: "));
  EXPECT_NEAR(height(seen(), 0, 0), 0, 1e-12);
  rest();
  EXPECT_EQ(steps(), steps_before) << "nothing was accepted, so there is nothing to undo";
  EXPECT_EQ(height(sheet(), 0, 0), 0);
  EXPECT_FALSE(model_.has_provisional());
}

TEST_F(IconDragTest, D20_curves_that_contradict_at_many_places_are_named_once) {
  add_icon("along", {{-0.1, 0.08, sheet_z}, {0.1, 0.08, sheet_z}}, v1::ICON_CURVE);
  add_icon("again", {{-0.1, 0.08, sheet_z}, {0.1, 0.08, sheet_z}}, v1::ICON_CURVE);
  v1::Operation pull;
  pull.mutable_drag_icon()->set_entity("sheet");
  pull.mutable_drag_icon()->set_icon("along");
  pull.mutable_drag_icon()->mutable_translation()->set_z(0.02);
  const auto refused = model_.submit(pull);
  ASSERT_FALSE(refused);
  const std::string& words = refused.error().message;
  const std::string off = "(off by";
  EXPECT_THAT(words, HasSubstr("icon \"again\" " + off));
  std::size_t named = 0;
  for (std::size_t at = words.find(off); at != std::string::npos; at = words.find(off, at + 1)) ++named;
  EXPECT_EQ(named, 2U) << words;
}

TEST_F(IconDragTest, a_refused_frame_after_good_ones_commits_the_last_good_one) {
  send(script_.closed({0, 0, 0.12}));
  send(script_.closed({0, 0, 0.13}));
  const double good = height(seen(), 0, 0);
  ASSERT_NEAR(good, 0.01, 1e-9);
  // While the hand holds it somebody else pins the same place where it was.
  add_icon("pin", {{0, 0, sheet_z}}, v1::ICON_POINT, v1::ICON_PASSIVE);
  send(script_.closed({0, 0, 0.14}));
  EXPECT_THAT(interaction_.activity(0).tool, HasSubstr("stays"));
  rest();
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(height(sheet(), 0, 0), 0) << "the base takes no such drag any more";
}

TEST_F(IconDragTest, A15_a_curve_goes_along_whole_or_bends_by_the_potentiometer) {
  add_icon("c", {{-0.1, 0.08, sheet_z}, {0.1, 0.08, sheet_z}}, v1::ICON_CURVE);
  const std::string then = hash();
  const Vector3d grip(0.09, 0.08, 0.11);  // near its end
  send(script_.closed(grip, 0.5, 1.0));
  send(script_.closed(grip + Vector3d(0, 0, 0.01), 0.5, 1.0));
  rest();
  EXPECT_NEAR(height(sheet(), -0.1, 0.08), 0.01, 5e-6);
  EXPECT_NEAR(height(sheet(), 0.1, 0.08), 0.01, 5e-6);
  touch(PaletteCommand::undo);
  ASSERT_EQ(hash(), then);
  send(script_.closed(grip, 0.5, 0.25));
  send(script_.closed(grip + Vector3d(0, 0, 0.01), 0.5, 0.25));
  EXPECT_EQ(interaction_.activity(0).tool, "bending icon \"c\"");
  rest();
  ASSERT_EQ(icon("c").bends.size(), 1U);
  EXPECT_NEAR(icon("c").bends[0].held_at, 0.95, 1e-3);
  EXPECT_NEAR(icon("c").bends[0].reach_m, 0.25 * 0.2, 1e-4);
  EXPECT_NEAR(height(sheet(), 0.09, 0.08), 0.01, 1e-3) << "where it is held";
  EXPECT_LT(std::abs(height(sheet(), -0.1, 0.08)), 1e-3) << "beyond the reach";
}

TEST_F(IconDragTest, two_hands_drag_two_icons_and_never_the_same) {
  add_icon("q", {{0.1, 0, sheet_z}});
  const auto both = [&](double a, double b) {
    send(test::with_second_hand(script_.closed({0, 0, 0.12 + a}), script_.closed({0.1, 0, 0.12 + b})));
  };
  both(0, 0);
  both(0.01, -0.02);
  EXPECT_TRUE(marked("p", IconMark::Kind::held));
  EXPECT_TRUE(marked("q", IconMark::Kind::held));
  send(test::with_second_hand(script_.resting(), script_.resting()));
  EXPECT_EQ(steps(), steps_ + 3) << "an icon and two drags";
  EXPECT_NEAR(height(sheet(), 0, 0), 0.01, 1e-9);
  EXPECT_NEAR(height(sheet(), 0.1, 0), -0.02, 1e-9);
  // Both at p: the second hand finds it taken.
  const std::string then = hash();
  send(test::with_second_hand(script_.closed({0, 0, 0.12}), script_.closed({0, 0.03, 0.12})));
  EXPECT_EQ(interaction_.icon_marks().size(), 1U);
  EXPECT_THAT(interaction_.activity(1).tool, ::testing::Not(HasSubstr("icon")));
  send(test::with_second_hand(script_.resting(), script_.resting()));
  EXPECT_EQ(hash(), then);
}

TEST_F(IconDragTest, a_peer_that_deletes_the_icon_ends_the_drag_without_harm) {
  send(script_.closed({0, 0, 0.12}));
  send(script_.closed({0, 0, 0.13}));
  v1::Operation gone;
  gone.mutable_delete_icon()->set_entity("sheet");
  gone.mutable_delete_icon()->set_icon("p");
  submit(gone);
  const std::string then = hash();
  send(script_.closed({0, 0, 0.14}));
  rest();
  EXPECT_EQ(hash(), then);
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_TRUE(interaction_.selected_icon().empty());
}

TEST_F(IconDragTest, a_fist_far_from_icons_pushes_shapes_as_ever) {
  make_plate("plate", {0.5, 0, 0.1});
  for (int i = 0; i <= 8; ++i) send(script_.closed({0.5, 0, 0.16 - 0.01 * i}));
  EXPECT_EQ(interaction_.activity(0).tool, "pushing");
  rest();
  EXPECT_EQ(hash() == before_, false);
  EXPECT_EQ(height(sheet(), 0, 0), 0);
}

// The glove tells of a fist before it has folded and after it has begun to unfold: meanwhile the fingertips'
// mean goes where the hand does not. Frames are 33 ms apart.
class FoldingFist : public IconDragTest {
 protected:
  static constexpr double folded[] = {1.2, 1.1, 1.05, 1.0};

  /// Closes, goes along `way`, stays, and unfolds; the last frames still tell of a fist.
  void drag(const Vector3d& way) {
    double frames = 0.5;
    for (const double times : folded) send(test::since(test::opened(script_.closed(grip), times), frames++));
    for (int i = 1; i <= 10; ++i) send(test::since(script_.closed(grip + way * i / 10.0), frames++));
    for (int i = 0; i < 6; ++i) send(test::since(script_.closed(grip + way), frames++));
    for (const double times : {1.05, 1.1, 1.2})
      send(test::since(test::opened(script_.closed(grip + way), times), frames++));
  }
  const Vector3d grip = Vector3d(0, 0, 0.12);
};

TEST_F(FoldingFist, D19_fingers_that_fold_and_unfold_move_no_icon) {
  const Vector3d way(0.01, 0, 0.03);
  drag(way);
  EXPECT_GT((seen()->find_icon("p")->translation - way).norm(), 3e-3) << "negative control: the mean moves";
  send(test::since(script_.resting(grip + way), 0.5));
  EXPECT_EQ(steps(), steps_ + 1);
  EXPECT_LT((icon("p").translation - way).norm(), 1e-12);
}

TEST_F(FoldingFist, D19_a_fist_that_goes_nowhere_leaves_no_step) {
  drag(Vector3d::Zero());
  EXPECT_GT(seen()->find_icon("p")->translation.norm(), 2e-3) << "negative control: it looks like a drag";
  send(test::since(script_.resting(grip), 0.5));
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(steps(), steps_);
  EXPECT_EQ(hash(), before_);
  EXPECT_EQ(interaction_.selected_icon().icon, "p") << "but it is selected";
}

TEST_F(FoldingFist, D19_pads_that_leave_the_palm_one_by_one_let_go_at_the_first) {
  const Vector3d way(0, 0.01, 0.02);
  drag(way);
  v1::TrackingFrame between = script_.closed(grip + way);
  between.mutable_hands(0)->set_gesture(v1::GESTURE_UNKNOWN);
  send(test::since(between, 0.5));
  send(test::since(test::opened(script_.resting(grip + way), 1.4), 0.25));
  EXPECT_LT((icon("p").translation - way).norm(), 1e-12);
}

TEST_F(IconDragTest, T14_times_that_cannot_be_are_none) {
  for (const std::int64_t ns : {std::numeric_limits<std::int64_t>::min(), std::int64_t{-1},
                                std::numeric_limits<std::int64_t>::max()}) {
    const std::string then = hash();
    for (int i = 0; i <= 10; ++i) {
      v1::TrackingFrame frame = script_.closed({0, 0, 0.12 + 0.002 * i});
      frame.mutable_hands(0)->set_gesture_since_ns(ns);
      send(frame);
    }
    v1::TrackingFrame open = script_.resting({0, 0, 0.14});
    open.mutable_hands(0)->set_gesture_since_ns(ns);
    send(open);
    EXPECT_FALSE(model_.has_provisional());
    EXPECT_EQ(hash() == then, ns > 0) << "a fist that closes for ever has not folded";
  }
}

TEST_F(FoldingFist, of_a_hand_that_comes_back_the_whole_way_counts) {
  drag(Vector3d(0, 0, 0.02));
  v1::TrackingFrame between = script_.closed(grip);
  between.mutable_hands(0)->set_gesture(v1::GESTURE_UNKNOWN);
  send(test::since(between, 0.5));
  double frames = 0.5;
  for (int i = 0; i < 12; ++i) send(test::since(script_.closed(grip + Vector3d(0, 0, 0.03)), frames++));
  send(test::since(script_.resting(grip), 0.5));
  EXPECT_EQ(steps(), steps_ + 1);
  EXPECT_LT((icon("p").translation - Vector3d(0, 0, 0.03)).norm(), 1e-12);
}

}  // namespace
}  // namespace handloft::interaction
