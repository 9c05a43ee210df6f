// What the desktop's hand streams, given to the server's own interaction (A25, V6): each tool makes the
// operation that it is for, where the cursor was, to well below a millimetre. Nothing of the server is
// imitated here.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "client-hmd/desktop/hand_stream.h"
#include "server-model/interaction/interaction.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::client {
namespace {

using Eigen::Vector3d;
using ::testing::IsEmpty;
using namespace std::chrono_literals;

constexpr double exactly_m = 1e-9;

Vector3d eigen(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}

class DesktopHand : public ::testing::Test {
 protected:
  /// Gives the server all that the hand has to say.
  void deliver() {
    for (HandMessage& message : hand_.take()) {
      if (const auto* command = std::get_if<PaletteCommand>(&message)) {
        touch(*command);
        continue;
      }
      const auto& frame = std::get<v1::TrackingFrame>(message);
      EXPECT_GT(frame.capture_time_ns(), last_ns_) << "times go back";
      last_ns_ = frame.capture_time_ns();
      take(interaction_.on_frame(frame));
    }
  }
  /// A command as the server has it from a HandCommand (PROTOCOL.md).
  void touch(PaletteCommand command) {
    commands_.push_back(command);
    interaction::FrameOutcome outcome;
    const interaction::CommandAnswer answer = interaction_.command(0, command, outcome);
    EXPECT_EQ(answer.refusal, "") << answer.words;
    take(outcome);
  }
  void take(interaction::FrameOutcome outcome) {
    for (const std::string& problem : outcome.problems) problems_.push_back(problem);
    for (model::Submitted& submitted : outcome.submitted) done_.push_back(submitted.effective);
  }
  TimePoint later(Duration by) { return now_ += by; }
  TimePoint next() { return later(8ms); }

  void hover(const glm::dvec3& at) {
    hand_.hover(next(), at, touch_);
    hand_.flush(later(20ms));
    deliver();
  }
  /// Presses at the first place, goes through the others, lets go at the last.
  void stroke(DesktopTool tool, const std::vector<glm::dvec3>& path, const glm::dvec3& direction = {0, 0, 1},
              HandStream::Ending ending = HandStream::Ending::whole) {
    hand_.begin(tool, next(), path.front(), direction, touch_);
    for (std::size_t i = 1; i < path.size(); ++i) hand_.move(next(), path[i], touch_);
    hand_.end(next(), path.back(), touch_, ending);
    deliver();
  }
  static std::vector<glm::dvec3> line(const glm::dvec3& from, const glm::dvec3& to, int steps) {
    std::vector<glm::dvec3> path;
    for (int i = 0; i <= steps; ++i) path.push_back(from + (to - from) * (static_cast<double>(i) / steps));
    return path;
  }
  void submit(const v1::Operation& operation) {
    const auto submitted = model_.submit(operation);
    ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
  }
  /// 21 x 21 points over 0.1 m x 0.1 m at z = 0.1, fitted, both shown.
  void make_plate(const std::string& id = "plate", const glm::dvec3& centre = {0, 0, 0.1}) {
    v1::Operation operation;
    operation.mutable_add_points()->set_entity(id);
    operation.mutable_add_points()->mutable_create()->set_name(id);
    for (int i = -10; i <= 10; ++i) {
      for (int k = -10; k <= 10; ++k) {
        v1::Point& point = *operation.mutable_add_points()->add_points();
        point.mutable_position()->set_x(centre.x + 0.005 * i);
        point.mutable_position()->set_y(centre.y + 0.005 * k);
        point.mutable_position()->set_z(centre.z);
        point.set_pressure(0.6);
      }
    }
    submit(operation);
    v1::Operation fit;
    fit.mutable_fit()->set_entity(id);
    fit.mutable_fit()->set_show(v1::REPRESENTATION_BOTH);
    submit(fit);
  }
  void make_sheet() {
    v1::Operation operation;
    v1::CreateSculptSurface& create = *operation.mutable_create_sculpt_surface();
    create.set_id("sheet");
    create.mutable_rectangle()->mutable_pose()->mutable_position()->set_z(0.1);
    create.mutable_rectangle()->set_width_m(0.4);
    create.mutable_rectangle()->set_depth_m(0.3);
    create.set_control_u(14);
    create.set_control_v(12);
    submit(operation);
  }
  model::SculptPtr sheet() const { return model::as_sculpt(model_.document().find("sheet")); }
  const model::DualShape& shape(const std::string& id) { return *model_.document().find_dual(id); }
  const v1::Operation& last() const { return done_.back(); }

  model::Model model_;
  interaction::Interaction interaction_{model_};
  HandStream hand_;
  HandTouch touch_;
  TimePoint now_ = from_ns(1'000'000'000);
  std::int64_t last_ns_ = 0;
  std::vector<std::string> problems_;
  std::vector<v1::Operation> done_;
  std::vector<PaletteCommand> commands_;
};

TEST_F(DesktopHand, LaysPointsWhereTheCursorWentWithItsPressure_A1) {
  touch_.pressure = 0.75;
  hover({0.0, 0.0, 0.05});
  const auto path = line({-0.05, 0.0, 0.05}, {0.05, 0.02, 0.06}, 20);
  stroke(DesktopTool::lay, path);
  ASSERT_EQ(done_.size(), 1U);
  const v1::AddPoints& add = last().add_points();
  ASSERT_EQ(add.points_size(), 21);
  for (int i = 0; i < add.points_size(); ++i) {
    const v1::Vec3& at = add.points(i).position();
    EXPECT_NEAR((Vector3d(at.x(), at.y(), at.z()) - eigen(path[static_cast<std::size_t>(i)])).norm(), 0.0,
                exactly_m);
    EXPECT_EQ(add.points(i).pressure(), 0.75);
  }
  EXPECT_THAT(problems_, IsEmpty());
  EXPECT_THAT(commands_, IsEmpty());
}

TEST_F(DesktopHand, ATapLaysOnePoint) {
  stroke(DesktopTool::lay, {{0.01, 0.02, 0.03}});
  ASSERT_EQ(done_.size(), 1U);
  EXPECT_EQ(last().add_points().points_size(), 1);
}

TEST_F(DesktopHand, PointsAreAMillimetreApartHoweverFastTheMouseReports) {
  stroke(DesktopTool::lay, line({0.0, 0.0, 0.05}, {0.1, 0.0, 0.05}, 5000));
  ASSERT_EQ(done_.size(), 1U);
  const v1::AddPoints& add = last().add_points();
  EXPECT_LE(add.points_size(), 102);
  EXPECT_GE(add.points_size(), 95);
  EXPECT_NEAR(add.points(add.points_size() - 1).position().x(), 0.1, exactly_m);
}

TEST_F(DesktopHand, AMouseThatReportsEverythingStaysBelowWhatTheServerTakes) {
  // 20 s at 1000 reports a second, 2 mm each: the server takes 240 frames a second, and 480 at once.
  hand_.begin(DesktopTool::lay, next(), {0, 0, 0.05}, {0, 0, 1}, touch_);
  for (int i = 1; i <= 20000; ++i) hand_.move(later(1ms), {0.002 * (i % 200), 0, 0.05}, touch_);
  EXPECT_LE(hand_.take().size(), 400U + 20U * 200U + 2U);
}

TEST_F(DesktopHand, PushesPointsToWhereTheCursorIs_A14) {
  make_plate();
  touch_.pressure = 0.2;  // 16 mm
  touch_.potentiometer = 0.0;
  // From below, 12 mm before it, to 10 mm above.
  std::vector<glm::dvec3> path{{0, 0, 0.088}};
  for (const glm::dvec3& at : line({0, 0, 0.1}, {0, 0, 0.11}, 10)) path.push_back(at);
  stroke(DesktopTool::push, path);
  ASSERT_EQ(done_.size(), 1U);
  ASSERT_TRUE(last().has_push_points());
  double highest = 0;
  int moved = 0;
  for (const model::DualPoint& point : shape("plate").points) {
    highest = std::max(highest, point.position().z());
    const double away = std::hypot(point.position().x(), point.position().y());
    if (away < 0.0155) {
      EXPECT_NEAR(point.position().z(), 0.11, 1e-6) << away;
      ++moved;
    } else if (away > 0.0165) {
      EXPECT_NEAR(point.position().z(), 0.1, 1e-6) << away;
    }
  }
  EXPECT_GT(moved, 20);
  EXPECT_NEAR(highest, 0.11, 1e-6);
  EXPECT_THAT(problems_, IsEmpty());
}

TEST_F(DesktopHand, PushesFromAboveToo) {
  make_plate();
  touch_.potentiometer = 0.0;
  std::vector<glm::dvec3> path{{0, 0, 0.112}};
  for (const glm::dvec3& at : line({0, 0, 0.1}, {0, 0, 0.093}, 7)) path.push_back(at);
  stroke(DesktopTool::push, path);
  ASSERT_EQ(done_.size(), 1U);
  double lowest = 1;
  for (const model::DualPoint& point : shape("plate").points) lowest = std::min(lowest, point.position().z());
  EXPECT_NEAR(lowest, 0.093, 1e-6);
}

TEST_F(DesktopHand, TheRangeOfAPushIsThePotentiometers_A16) {
  make_plate();
  touch_.potentiometer = 0.4;
  std::vector<glm::dvec3> path{{0, 0, 0.088}, {0, 0, 0.105}};
  stroke(DesktopTool::push, path);
  ASSERT_EQ(done_.size(), 1U);
  EXPECT_DOUBLE_EQ(last().push_points().range(), 0.4);
}

TEST_F(DesktopHand, DrawsAProfileThroughTheCursorsPlaces_A19) {
  make_plate();
  const auto path = line({-0.05, 0.0, 0.11}, {0.05, 0.0, 0.11}, 30);
  stroke(DesktopTool::draw, path);
  ASSERT_EQ(done_.size(), 1U);
  ASSERT_TRUE(last().has_modify_profile());
  const v1::ProfileCurve& curve = last().modify_profile().curves(0);
  for (int i = 0; i < curve.points_size(); ++i) {
    EXPECT_NEAR(curve.points(i).position().z(), 0.11, exactly_m);
    EXPECT_NEAR(curve.points(i).position().y(), 0.0, exactly_m);
  }
  EXPECT_NEAR(curve.points(0).position().x(), -0.05, exactly_m);
  EXPECT_NEAR(curve.points(curve.points_size() - 1).position().x(), 0.05, exactly_m);
  EXPECT_THAT(problems_, IsEmpty());
}

TEST_F(DesktopHand, SeveralStrokesAreOneChangeWhileThePenStaysInHand_A19) {
  make_plate();
  stroke(DesktopTool::draw, line({-0.05, 0.02, 0.11}, {0.05, 0.02, 0.11}, 30), {0, 0, 1},
         HandStream::Ending::more);
  EXPECT_THAT(done_, IsEmpty());
  EXPECT_TRUE(hand_.pen_in_hand());
  hover({0.0, 0.0, 0.12});
  EXPECT_THAT(done_, IsEmpty());
  stroke(DesktopTool::draw, line({-0.05, -0.02, 0.11}, {0.05, -0.02, 0.11}, 30));
  ASSERT_EQ(done_.size(), 1U);
  EXPECT_EQ(last().modify_profile().curves_size(), 2);
}

TEST_F(DesktopHand, ATapOfTheThumbDividesAStroke_A21) {
  make_plate("one", {-0.08, 0, 0.1});
  make_plate("two", {0.08, 0, 0.1});
  hand_.begin(DesktopTool::draw, next(), {-0.12, 0, 0.105}, {0, 0, 1}, touch_);
  for (const glm::dvec3& at : line({-0.12, 0, 0.105}, {0.0, 0, 0.105}, 60)) hand_.move(next(), at, touch_);
  hand_.tap_thumb(next());
  for (const glm::dvec3& at : line({0.0, 0, 0.105}, {0.12, 0, 0.105}, 60)) hand_.move(next(), at, touch_);
  hand_.end(next(), {0.12, 0, 0.105}, touch_);
  deliver();
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  const v1::ProfileCurve& curve = last().modify_profile().curves(0);
  ASSERT_EQ(curve.split_at_size(), 1);
  EXPECT_NEAR(curve.split_at(0), 0.5, 0.01);
  EXPECT_EQ(curve.split_entities(0), "one");
  EXPECT_EQ(curve.split_entities(1), "two");
}

TEST_F(DesktopHand, TrimsByAClosedCurveAndDrawsProfilesAgainAfterwards_A24) {
  make_plate();
  std::vector<glm::dvec3> circle;
  for (int i = 0; i <= 60; ++i) {
    const double angle = 2 * M_PI * i / 60;
    circle.emplace_back(0.03 * std::cos(angle), 0.03 * std::sin(angle), 0.1);
  }
  stroke(DesktopTool::trim, circle);
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  ASSERT_TRUE(last().has_set_boundary());
  for (const v1::Vec3& at : last().set_boundary().curve()) {
    EXPECT_NEAR(std::hypot(at.x(), at.y()), 0.03, 1e-4);
  }
  stroke(DesktopTool::draw, line({-0.05, 0.0, 0.11}, {0.05, 0.0, 0.11}, 30));
  ASSERT_EQ(done_.size(), 2U);
  EXPECT_TRUE(last().has_modify_profile());
}

TEST_F(DesktopHand, MovesAShapeExactlyAsFarAsTheCursorWent_A28) {
  make_plate();
  const glm::dvec3 from(0.02, 0.01, 0.1);
  for (const double way_m : {0.0015, 0.0204, 0.2}) {
    done_.clear();
    stroke(DesktopTool::move, line(from, from + glm::dvec3(way_m, 0, 0), 40));
    ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
    ASSERT_TRUE(last().has_transform());
    const v1::TransformEntities& move = last().transform();
    EXPECT_NEAR(move.translation().x(), way_m, exactly_m);
    EXPECT_NEAR(std::hypot(move.translation().y(), move.translation().z()), 0.0, exactly_m);
    EXPECT_NEAR(move.rotation().w(), 1.0, 1e-12);
    EXPECT_NEAR(move.scale(), 1.0, 1e-12);
    v1::Operation undo;
    undo.mutable_undo();
    submit(undo);
  }
}

TEST_F(DesktopHand, TurnsAShapeByTheAngleThatWasAsked_A28) {
  make_plate();
  const glm::dvec3 at(0.0, 0.0, 0.1);
  for (const double angle : {0.02, 0.06, 0.1308996938995747, 0.8, 2.5}) {
    done_.clear();
    hand_.begin(DesktopTool::move, next(), at, {0, 0, 1}, touch_);
    hand_.turn(next(), glm::angleAxis(angle, glm::dvec3(0, 0, 1)));
    hand_.flush(later(200ms));
    hand_.end(next(), at, touch_);
    deliver();
    ASSERT_EQ(done_.size(), 1U) << angle << testing::PrintToString(problems_);
    const v1::Quaternion& turned = last().transform().rotation();
    EXPECT_NEAR(2 * std::atan2(turned.z(), turned.w()), angle, 1e-6) << angle;
    EXPECT_NEAR(std::hypot(turned.x(), turned.y()), 0.0, 1e-6);
    v1::Operation undo;
    undo.mutable_undo();
    submit(undo);
  }
}

TEST_F(DesktopHand, ScalesAShapeByThePotentiometersTurn_A28) {
  make_plate();
  touch_.potentiometer = 0.5;
  hand_.begin(DesktopTool::move, next(), {0, 0, 0.1}, {0, 0, 1}, touch_);
  touch_.potentiometer = 0.5 + 0.03 + 0.25;  // The slack, and an octave's half.
  hand_.move(later(200ms), {0, 0, 0.1}, touch_);
  hand_.flush(next());
  hand_.end(next(), {0, 0, 0.1}, touch_);
  deliver();
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  EXPECT_NEAR(last().transform().scale(), std::sqrt(2.0), 1e-9);
}

TEST_F(DesktopHand, PushesAfterAMoveAreNoMoves) {
  make_plate();
  stroke(DesktopTool::move, line({0, 0, 0.1}, {0.01, 0, 0.1}, 10));
  stroke(DesktopTool::push, {{0.01, 0, 0.088}, {0.01, 0, 0.105}});
  ASSERT_EQ(done_.size(), 2U);
  EXPECT_TRUE(done_[0].has_transform());
  EXPECT_TRUE(done_[1].has_push_points());
}

TEST_F(DesktopHand, AddsIconsWhereItTapsAndDrawsAndSpans_D6) {
  make_sheet();
  stroke(DesktopTool::draw, {{0.05, 0.02, 0.1}});
  stroke(DesktopTool::draw, line({-0.1, -0.05, 0.1}, {0.1, -0.05, 0.1}, 60));
  stroke(DesktopTool::region, line({-0.1, 0.05, 0.1}, {-0.05, 0.1, 0.1}, 30));
  ASSERT_EQ(done_.size(), 3U) << testing::PrintToString(problems_);
  const auto& icons = *sheet()->icons;
  ASSERT_EQ(icons.size(), 3U);
  EXPECT_EQ(icons[0].shape, model::IconShape::point);
  EXPECT_NEAR((icons[0].place - Vector3d(0.05, 0.02, 0.1)).norm(), 0.0, 1e-6);
  EXPECT_EQ(icons[1].shape, model::IconShape::curve);
  EXPECT_EQ(icons[2].shape, model::IconShape::region);
  EXPECT_NEAR((icons[2].place - Vector3d(-0.075, 0.075, 0.1)).norm(), 0.0, 1e-3);
  // The next tap is a point again.
  stroke(DesktopTool::draw, {{-0.05, -0.1, 0.1}});
  EXPECT_EQ(sheet()->icons->back().shape, model::IconShape::point);
}

TEST_F(DesktopHand, DragsAnIconByTheCursorsWay_D19) {
  make_sheet();
  stroke(DesktopTool::draw, {{0.0, 0.0, 0.1}});
  hover({0.0, 0.0, 0.1});
  done_.clear();
  stroke(DesktopTool::push, line({0, 0, 0.1}, {0, 0, 0.13}, 30));
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  ASSERT_TRUE(last().has_drag_icon());
  EXPECT_NEAR(last().drag_icon().translation().z(), 0.03, exactly_m);
  EXPECT_NEAR((sheet()->icons->front().place - Vector3d(0, 0, 0.13)).norm(), 0.0, 1e-8);
}

TEST_F(DesktopHand, TurnsATangentByItsIcon_D7) {
  make_sheet();
  stroke(DesktopTool::draw, {{0.0, 0.0, 0.1}});
  touch(PaletteCommand::icon_property);  // Of the selected icon: the tangent along u.
  ASSERT_EQ(sheet()->icons->front().property, model::IconProperty::tangent_u);
  done_.clear();
  hand_.begin(DesktopTool::push, next(), {0, 0, 0.1}, {0, 0, 1}, touch_);
  hand_.turn(next(), glm::angleAxis(-0.2, glm::dvec3(0, 1, 0)));
  hand_.flush(later(200ms));
  hand_.end(next(), {0, 0, 0.1}, touch_);
  deliver();
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  ASSERT_TRUE(last().has_drag_icon());
  const v1::Quaternion& turned = last().drag_icon().rotation();
  EXPECT_NEAR(2 * std::atan2(turned.y(), turned.w()), -0.2, 1e-6);
}

TEST_F(DesktopHand, BendsACurveWhereItIsHeldByThePotentiometer_D19) {
  make_sheet();
  stroke(DesktopTool::draw, line({-0.1, 0.0, 0.1}, {0.1, 0.0, 0.1}, 60));
  done_.clear();
  touch_.potentiometer = 0.3;
  stroke(DesktopTool::push, line({0.05, 0, 0.1}, {0.05, 0, 0.12}, 30));
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  ASSERT_TRUE(last().has_drag_icon());
  EXPECT_NEAR(last().drag_icon().held_at(), 0.75, 1e-3);
  EXPECT_NEAR(last().drag_icon().reach_m(), 0.3 * 0.2, 1e-3);
}

TEST_F(DesktopHand, WhatIsCancelledLeavesNoTrace) {
  make_plate();
  const std::size_t steps = model_.history().undo_steps();
  for (const DesktopTool tool : {DesktopTool::lay, DesktopTool::push, DesktopTool::draw, DesktopTool::move}) {
    hand_.begin(tool, next(), {0, 0, 0.1}, {0, 0, 1}, touch_);
    for (const glm::dvec3& at : line({0, 0, 0.1}, {0.03, 0, 0.12}, 20)) hand_.move(next(), at, touch_);
    hand_.cancel(next());
    EXPECT_FALSE(hand_.working());
    // Until the server has given it up; what is begun meanwhile is nothing.
    hand_.begin(tool, next(), {0, 0, 0.1}, {0, 0, 1}, touch_);
    EXPECT_FALSE(hand_.working());
    for (int i = 0; i < 40; ++i) hand_.flush(next());
    deliver();
    EXPECT_EQ(model_.history().undo_steps(), steps);
    hover({0.0, 0.0, 0.2});
    EXPECT_EQ(model_.history().undo_steps(), steps);
  }
  // And the hand goes on working.
  stroke(DesktopTool::lay, {{0, 0, 0.05}});
  EXPECT_EQ(model_.history().undo_steps(), steps + 1);
}

TEST_F(DesktopHand, NoNumberIsNoHand_NegativeControl) {
  HandPose pose;
  pose.cursor.x = std::nan("");
  EXPECT_EQ(hand_frame(pose, 1).hands_size(), 0);
  pose.cursor = {100.0, 0.0, 0.0};
  EXPECT_EQ(hand_frame(pose, 1).hands_size(), 0);
  pose.cursor = {0.0, 0.0, 0.1};
  pose.pressure = std::nan("");
  pose.potentiometer = 7.0;
  pose.direction = glm::dvec3(0.0);
  interaction::Interaction fresh(model_);
  EXPECT_THAT(fresh.on_frame(hand_frame(pose, 1)).problems, IsEmpty());
}

}  // namespace
}  // namespace handloft::client
