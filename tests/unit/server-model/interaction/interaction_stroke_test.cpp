// The open hand lays points (A1, A12, A25); gestures are provisional while they last (architecture idea 2).

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "server-model/interaction/interaction.h"
#include "server-model/model/canonical.h"
#include "tests/support/hand_script.h"

namespace handloft::interaction {
namespace {

using Eigen::Vector3d;
using test::HandScript;
using ::testing::HasSubstr;

class InteractionTest : public ::testing::Test {
 protected:
  FrameOutcome send(const v1::TrackingFrame& frame) { return interaction_.on_frame(frame); }
  void lay(int frames, const Vector3d& from = {0.0, 0.0, 0.1}) {
    for (int i = 0; i < frames; ++i) send(script_.laying(from + Vector3d(0.001 * i, 0.002 * i, 0.0)));
  }
  void touch(PaletteCommand command, int frames = 5) {
    for (const PaletteCell& cell : table_palette) {
      if (cell.command != command || !is_on_page(cell, first_palette_page)) continue;
      for (int i = 0; i < frames; ++i) send(script_.touching(cell.centre_x_m, cell.centre_y_m));
    }
    send(script_.resting());
  }
  const model::DualShape& shape(const std::string& id) { return *model_.document().find_dual(id); }

  model::Model model_;
  Interaction interaction_{model_};
  HandScript script_;
};

TEST_F(InteractionTest, A1_every_pressed_frame_lays_one_point) {
  lay(37);
  EXPECT_TRUE(model_.has_provisional());
  EXPECT_TRUE(model_.document().entities.empty()) << "a gesture in the air must not touch the document";
  send(script_.resting());
  ASSERT_EQ(model_.document().entities.size(), 1U);
  EXPECT_EQ(shape("shape-1").points.size(), 37U);
  EXPECT_EQ(shape("shape-1").stroke_count, 1U);
  EXPECT_EQ(model_.history().undo_steps(), 1U) << "the shape and its first stroke are one step";
}

TEST_F(InteractionTest, A1_a_point_is_the_mean_of_the_fingertips_with_the_pressure_as_its_weight) {
  const Vector3d centre(0.0123, -0.0456, 0.0789);
  const double level = 512.0 / 1023.0;
  send(script_.laying(centre, level));
  send(script_.resting());
  const model::DualPoint point = shape("shape-1").points[0];
  EXPECT_NEAR((point.position() - centre).norm(), 0.0, 1e-15);
  EXPECT_EQ(point.pressure, level);
  EXPECT_EQ(point.time_ns, 1'000'000'000 + HandScript::frame_ns);
}

TEST_F(InteractionTest, every_gesture_is_a_stroke_of_the_active_shape_and_one_step_to_undo) {
  for (int stroke = 0; stroke < 3; ++stroke) {
    lay(10, {0.0, 0.01 * stroke, 0.1});
    send(script_.resting());
  }
  EXPECT_EQ(shape("shape-1").stroke_count, 3U);
  EXPECT_EQ(shape("shape-1").points.size(), 30U);
  EXPECT_EQ(model_.history().undo_steps(), 3U);
}

TEST_F(InteractionTest, a_change_of_gesture_ends_the_stroke) {
  lay(4);
  send(script_.hand({0, 0, 0.1}, v1::GESTURE_CLOSED, true, 0.5));
  EXPECT_EQ(shape("shape-1").points.size(), 4U);
  EXPECT_EQ(model_.history().undo_steps(), 1U);
  EXPECT_EQ(interaction_.activity(0).tool, "pushing") << "and begins what the closed hand does";
}

TEST_F(InteractionTest, a_short_dropout_costs_no_points_but_its_own) {
  lay(5);
  for (int i = 0; i < 6; ++i) send(script_.empty());  // 200 ms
  EXPECT_TRUE(model_.has_provisional());
  lay(5);
  send(script_.resting());
  EXPECT_EQ(shape("shape-1").points.size(), 10U);
  EXPECT_EQ(shape("shape-1").stroke_count, 1U);
}

TEST_F(InteractionTest, a_lost_hand_cancels_its_gesture_without_a_trace) {
  lay(3);
  send(script_.resting());
  const std::string before = model::document_hash(model_.document());
  const std::uint64_t sequence = model_.sequence();
  lay(20);
  for (int i = 0; i < 10; ++i) send(script_.empty());  // 333 ms
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(model::document_hash(model_.document()), before);
  EXPECT_EQ(model_.sequence(), sequence);
  EXPECT_EQ(model_.history().undo_steps(), 1U);
  EXPECT_EQ(model_.history().redo_steps(), 0U);
  EXPECT_EQ(interaction_.statistics().strokes_cancelled, 1U);
}

TEST_F(InteractionTest, letting_go_while_unseen_keeps_the_stroke) {
  lay(8);
  v1::TrackingFrame unseen = script_.resting();
  for (int finger = 0; finger < 5; ++finger) unseen = test::without_finger(unseen, finger);
  send(unseen);  // the glove still tells that the pressure is gone
  EXPECT_EQ(shape("shape-1").points.size(), 8U);
}

TEST_F(InteractionTest, a_hidden_finger_does_not_pull_the_point) {
  lay(2);
  const Vector3d centre(0.02, 0.03, 0.12);
  send(test::without_finger(script_.laying(centre), 0));
  send(script_.resting());
  ASSERT_EQ(shape("shape-1").points.size(), 3U);
  EXPECT_NEAR((shape("shape-1").points[2].position() - centre).norm(), 0.0, 1e-12);
}

TEST_F(InteractionTest, no_point_before_all_fingers_were_seen_or_from_prediction_alone) {
  send(test::without_finger(script_.laying({0, 0, 0.1}), 1));
  EXPECT_FALSE(model_.has_provisional());
  v1::TrackingFrame predicted = script_.laying({0, 0, 0.1});
  for (int i = 0; i < 5; ++i) predicted.mutable_hands(0)->set_fingertip_states(i, v1::TRACKING_PREDICTED);
  send(predicted);
  EXPECT_FALSE(model_.has_provisional());
  send(script_.laying({0, 0, 0.1}));  // negative control: this one counts
  EXPECT_TRUE(model_.has_provisional());
}

TEST_F(InteractionTest, frames_with_nan_are_ignored_counted_and_named) {
  lay(3);
  v1::TrackingFrame bad = script_.laying({0, 0, 0.1});
  bad.mutable_hands(0)->set_fingertip_positions(7, std::numeric_limits<double>::quiet_NaN());
  const FrameOutcome outcome = send(bad);
  ASSERT_EQ(outcome.problems.size(), 1U);
  EXPECT_THAT(outcome.problems[0], HasSubstr("hands[0].fingertip_positions[7]"));
  bad = script_.laying({0, 0, 0.1}, 1.5);
  EXPECT_THAT(send(bad).problems.at(0), HasSubstr("hands[0].pressure"));
  send(script_.resting());
  EXPECT_EQ(interaction_.statistics().frames_ignored, 2U);
  EXPECT_EQ(shape("shape-1").points.size(), 3U);
}

TEST_F(InteractionTest, the_end_of_a_recording_keeps_the_stroke_in_the_air) {
  lay(6);
  v1::TrackingFrame last = script_.laying({0, 0, 0.1});
  last.set_end_of_recording(true);
  send(last);
  EXPECT_EQ(shape("shape-1").points.size(), 7U);
  EXPECT_FALSE(model_.has_provisional());
}

TEST_F(InteractionTest, somebody_elses_operation_does_not_break_the_stroke) {
  lay(5);
  v1::Operation other;
  other.mutable_create_dual_shape()->set_name("Theirs");  // takes the id that the stroke was going to
  ASSERT_TRUE(model_.submit(other).ok());
  lay(5);
  send(script_.resting());
  ASSERT_EQ(model_.document().entities.size(), 2U);
  EXPECT_EQ(shape("shape-1").points.size(), 0U);
  EXPECT_EQ(shape("shape-2").points.size(), 10U);
  EXPECT_EQ(interaction_.active_shape(), "shape-2");
}

TEST_F(InteractionTest, a_stroke_whose_shape_was_deleted_is_refused_with_a_reason_once) {
  lay(3);
  send(script_.resting());
  lay(3);
  v1::Operation remove;
  remove.mutable_delete_()->set_entity("shape-1");
  ASSERT_TRUE(model_.submit(remove).ok());
  std::size_t problems = 0;
  for (int i = 0; i < 5; ++i) problems += send(script_.laying({0, 0, 0.1})).problems.size();
  EXPECT_EQ(problems, 1U);
  send(script_.resting());
  EXPECT_TRUE(model_.document().entities.empty());
  EXPECT_EQ(interaction_.active_shape(), "");
}

TEST_F(InteractionTest, fit_shows_the_surface_and_representation_toggles_it) {
  for (int row = 0; row < 4; ++row) {
    for (int i = 0; i < 12; ++i) {
      const double x = 0.005 * i - 0.03;
      const double y = 0.01 * row - 0.015;
      send(script_.laying({x, y, 0.1 + 2.0 * x * x - y * y}));
    }
    send(script_.resting());
  }
  const std::size_t steps = model_.history().undo_steps();
  touch(PaletteCommand::fit);
  EXPECT_EQ(model_.history().undo_steps(), steps + 1) << "one touch, one step to undo";
  EXPECT_TRUE(shape("shape-1").fitted());
  EXPECT_EQ(shape("shape-1").representation, model::Representation::surface);
  EXPECT_EQ(interaction_.statistics().commands, 1U) << "one touch, one command, however long it lasts";
  touch(PaletteCommand::representation);
  EXPECT_EQ(shape("shape-1").representation, model::Representation::points);
  touch(PaletteCommand::representation);
  EXPECT_EQ(shape("shape-1").representation, model::Representation::surface);
}

TEST_F(InteractionTest, new_shape_starts_another_and_keeps_the_symmetry) {
  touch(PaletteCommand::symmetry);
  lay(3);
  send(script_.resting());
  touch(PaletteCommand::new_shape);
  EXPECT_EQ(interaction_.active_shape(), "");
  lay(2);
  send(script_.resting());
  EXPECT_EQ(shape("shape-1").points.size(), 6U) << "A12: each with its mirror image";
  EXPECT_EQ(shape("shape-2").points.size(), 4U);
  EXPECT_EQ(model_.history().undo_steps(), 2U);
}

TEST_F(InteractionTest, A12_symmetry_mirrors_in_x_first_in_one_shape_then_as_a_partner_then_not) {
  const Vector3d at(0.03, 0.01, 0.1);
  touch(PaletteCommand::symmetry);
  EXPECT_EQ(interaction_.activity(0).tool, "");
  send(script_.laying(at));
  send(script_.resting());
  ASSERT_EQ(shape("shape-1").points.size(), 2U);
  EXPECT_NEAR((shape("shape-1").points[1].position() - Vector3d(-0.03, 0.01, 0.1)).norm(), 0.0, 1e-15);
  touch(PaletteCommand::new_shape);
  touch(PaletteCommand::symmetry);
  EXPECT_EQ(interaction_.symmetry(), StrokeSymmetry::partner);
  send(script_.laying(at));
  send(script_.resting());
  EXPECT_EQ(shape("shape-2").points.size(), 1U);
  ASSERT_FALSE(shape("shape-2").partner.empty());
  EXPECT_EQ(shape(shape("shape-2").partner).points.size(), 1U);
  touch(PaletteCommand::new_shape);
  touch(PaletteCommand::symmetry);
  send(script_.laying(at));
  send(script_.resting());
  EXPECT_EQ(model_.document().entities.size(), 4U);
  EXPECT_EQ(interaction_.symmetry(), StrokeSymmetry::off);
}

TEST_F(InteractionTest, undo_and_redo_by_the_table) {
  lay(4);
  send(script_.resting());
  touch(PaletteCommand::undo);
  EXPECT_TRUE(model_.document().entities.empty());
  EXPECT_EQ(interaction_.active_shape(), "");
  touch(PaletteCommand::redo);
  EXPECT_EQ(interaction_.active_shape(), "shape-1");
  EXPECT_EQ(shape("shape-1").points.size(), 4U);
}

TEST_F(InteractionTest, a_refused_command_says_why_and_changes_nothing) {
  FrameOutcome outcome = send(script_.touching(0.17, -0.06));  // undo, with nothing to undo
  ASSERT_EQ(outcome.problems.size(), 1U);
  EXPECT_FALSE(outcome.scene_changed);
  EXPECT_THAT(interaction_.activity(0).tool, HasSubstr("refused"));
}

TEST_F(InteractionTest, a_touch_beside_the_cells_does_nothing) {
  send(script_.touching(0.0, 0.0));
  EXPECT_EQ(interaction_.statistics().commands, 0U);
}

/// A session with everything in it, for the test below.
std::string hash_of_session(double nudge) {
  model::Model model;
  Interaction interaction(model);
  HandScript script;
  for (int i = 0; i < 3; ++i) interaction.on_frame(script.touching(0.23, 0.0));
  for (int stroke = 0; stroke < 4; ++stroke) {
    for (int i = 0; i < 40; ++i) {
      const double x = 0.001 * i + nudge;
      v1::TrackingFrame frame = script.laying({x, 0.01 * stroke, 0.1 + x * x}, 0.3 + 0.01 * i);
      interaction.on_frame(i % 7 == 3 ? test::without_finger(frame, i % 5) : frame);
      if (i % 11 == 5) interaction.on_frame(script.empty());
    }
    interaction.on_frame(script.resting());
  }
  interaction.on_frame(script.touching(0.17, 0.06));
  return model::document_hash(model.document());
}

TEST(InteractionDeterminismTest, X2_the_same_frames_give_the_same_document_to_the_bit) {
  EXPECT_EQ(hash_of_session(0.0), hash_of_session(0.0));
  EXPECT_NE(hash_of_session(0.0), hash_of_session(1e-15));  // negative control
}

}  // namespace
}  // namespace handloft::interaction
