// Whatever frames come, in whatever order: no crash, no NaN in the document, nothing left in the air at the
// end, and undo back to the bit-identical start (A25, A28).

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/base/table_palette.h"
#include "server-model/interaction/interaction.h"
#include "server-model/model/canonical.h"
#include "server-model/model/sculpt_shape.h"
#include "tests/support/hand_script.h"
#include "tests/support/property_cases.h"

namespace handloft::interaction {
namespace {

using Eigen::Vector3d;

/// A sanitized build takes a quarter of the cases.
[[maybe_unused]] const bool fewer = test::take_cases_if_sanitized(25);

/// A hand's frame as numbers that shrink well.
struct Move {
  int gesture = 0;          ///< 0..5: unknown, the four, and one that does not exist
  int x = 0, y = 0, z = 0;  ///< mm about a place over the table
  int pressure = 0;         ///< percent
  int dial = 0;             ///< percent
  int cell = 0;             ///< of the palette, when on the table
  int fault = 0;            ///< mostly none
  int repeat = 1;
};

// Full-sized from the first case on: short sequences of zeros find nothing.
int in_range(int from, int below) {
  constexpr int full_size = 100;
  return *rc::gen::resize(full_size, rc::gen::inRange(from, below));
}

Move any_move() {
  Move move;
  move.gesture = in_range(0, 6);
  move.x = in_range(-80, 80);
  move.y = in_range(-80, 80);
  move.z = in_range(40, 160);
  move.pressure = in_range(0, 101);
  move.dial = in_range(0, 101);
  move.cell = in_range(0, static_cast<int>(table_palette.size()));
  move.fault = in_range(0, 20);
  move.repeat = in_range(1, 12);
  return move;
}

std::vector<Move> any_moves() {
  std::vector<Move> moves(static_cast<std::size_t>(in_range(1, 40)));
  for (Move& move : moves) move = any_move();
  return moves;
}

void spoil(v1::TrackingFrame& frame, int fault) {
  v1::HandState& hand = *frame.mutable_hands(0);
  switch (fault) {
    case 0:
      hand.set_pressure(std::numeric_limits<double>::quiet_NaN());
      break;
    case 1:
      hand.set_fingertip_positions(7, std::numeric_limits<double>::infinity());
      break;
    case 2:
      frame.set_capture_time_ns(5);
      break;
    case 3:
      frame.clear_hands();
      break;
    case 4:
      for (int finger = 0; finger < 4; ++finger) frame = test::without_finger(frame, finger);
      break;
    case 5:
      hand.clear_fingertip_states();
      break;
    default:
      break;
  }
}

void play(Interaction& interaction, test::HandScript& script, const std::vector<Move>& moves) {
  Vector3d last(0, 0, 0.1);
  for (const Move& move : moves) {
    Vector3d to(1e-3 * move.x, 1e-3 * move.y, 1e-3 * move.z);
    if (move.gesture == v1::GESTURE_ON_TABLE) {
      const PaletteCell& cell = table_palette[static_cast<std::size_t>(move.cell)];
      to = Vector3d(cell.centre_x_m, cell.centre_y_m, 0);
    }
    for (int i = 1; i <= move.repeat; ++i) {
      const Vector3d at =
          move.gesture == v1::GESTURE_ON_TABLE ? to : Vector3d(last + (to - last) * i / move.repeat);
      v1::TrackingFrame frame = test::HandScript::with_potentiometer(
          script.hand(at, static_cast<v1::Gesture>(move.gesture), move.pressure > 20, 0.01 * move.pressure),
          0.01 * move.dial);
      if (move.fault % 7 == 6)
        frame = test::with_second_hand(frame, script.closed(-at + Vector3d(0, 0, 0.2)));
      set_vec3(*frame.mutable_space_mouse()->mutable_translation(), 0.01 * Vector3d(0, move.x, move.y));
      if (move.dial > 50) frame.clear_space_mouse();
      spoil(frame, move.fault);
      interaction.on_frame(frame);
    }
    last = to;
  }
}

bool all_finite(const model::Document& document) {
  for (const auto& [id, entity] : document.entities) {
    if (const model::SculptPtr sculpted = model::as_sculpt(entity)) {
      for (const auto& point : sculpted->surface->control) {
        if (!point.allFinite()) return false;
      }
      for (const model::SculptIcon& icon : *sculpted->icons) {
        if (!icon.place.allFinite()) return false;
      }
    }
    const model::DualPtr shape = model::as_dual(entity);
    if (!shape) continue;
    for (const model::DualPoint& point : shape->points) {
      if (!point.position().allFinite() || !std::isfinite(point.pressure)) return false;
    }
    if (!shape->fit) continue;
    for (const double c : shape->fit->surface.scaled_coefficients()) {
      if (!std::isfinite(c)) return false;
    }
  }
  return true;
}

TEST(InteractionProperty, A25_random_frames_leave_nothing_in_the_air_and_undo_to_the_start) {
  EXPECT_TRUE(rc::check([] {
    const auto moves = any_moves();
    model::Model model;
    const std::string start = model::document_hash(model.document());
    Interaction interaction(model);
    test::HandScript script;
    play(interaction, script, moves);
    RC_ASSERT(all_finite(model.preview()));
    interaction.finish();
    RC_ASSERT(!model.has_provisional());
    RC_ASSERT(interaction.targets().empty());
    RC_ASSERT(all_finite(model.document()));
    v1::Operation undo;
    undo.mutable_undo();
    while (model.history().undo_steps() > 0) RC_ASSERT(model.submit(undo).ok());
    RC_ASSERT(model::document_hash(model.document()) == start);
  }));
}

TEST(InteractionProperty, A25_a_hand_that_is_lost_in_the_end_leaves_no_gesture) {
  EXPECT_TRUE(rc::check([] {
    const auto moves = any_moves();
    model::Model model;
    Interaction interaction(model);
    test::HandScript script;
    play(interaction, script, moves);
    const std::string before = model::document_hash(model.document());
    std::size_t submitted = 0;
    for (int i = 0; i < 12; ++i) {  // 400 ms
      for (const model::Submitted& one : interaction.on_frame(script.empty()).submitted) {
        submitted += one.sequence != 0 ? 1 : 0;
      }
    }
    RC_ASSERT(!model.has_provisional());
    // The last state of a hand may have been unknown while it was seen: then its gesture was ended, not
    // cancelled.
    if (submitted == 0) RC_ASSERT(model::document_hash(model.document()) == before);
  }));
}

// A sheet in the midst of the hand's ways, with icons of each kind to run into.
TEST(InteractionProperty, D19_random_frames_about_a_sculpted_surface_undo_to_the_start) {
  model::Model base;
  v1::Operation make;
  v1::CreateSculptSurface& create = *make.mutable_create_sculpt_surface();
  create.set_id("sheet");
  create.mutable_rectangle()->mutable_pose()->mutable_position()->set_z(0.1);
  create.mutable_rectangle()->set_width_m(0.2);
  create.mutable_rectangle()->set_depth_m(0.2);
  create.set_control_u(8);
  create.set_control_v(8);
  ASSERT_TRUE(base.submit(make).ok());
  const auto add = [&](v1::IconShape shape, v1::IconRole role, const std::vector<Vector3d>& places) {
    v1::Operation operation;
    operation.mutable_add_icon()->set_entity("sheet");
    operation.mutable_add_icon()->set_shape(shape);
    operation.mutable_add_icon()->set_role(role);
    operation.mutable_add_icon()->add_sensors("hand");
    operation.mutable_add_icon()->add_sensors("spacemouse");
    for (const Vector3d& place : places) set_vec3(*operation.mutable_add_icon()->add_places(), place);
    ASSERT_TRUE(base.submit(operation).ok());
  };
  add(v1::ICON_POINT, v1::ICON_CONSTRAINT, {{0.05, 0.05, 0.1}});
  add(v1::ICON_POINT, v1::ICON_LOAD, {{-0.05, 0.05, 0.1}});
  add(v1::ICON_CURVE, v1::ICON_CONSTRAINT, {{-0.06, -0.05, 0.1}, {0.06, -0.05, 0.1}});
  add(v1::ICON_REGION, v1::ICON_LOAD, {{-0.02, -0.02, 0.1}, {0.02, 0.02, 0.1}});
  const model::Document start = base.document();
  const std::string start_hash = model::document_hash(start);
  EXPECT_TRUE(rc::check([&] {
    const auto moves = any_moves();
    model::Model model(start);
    Interaction interaction(model);
    test::HandScript script;
    play(interaction, script, moves);
    RC_ASSERT(all_finite(model.preview()));
    interaction.finish();
    RC_ASSERT(!model.has_provisional());
    RC_ASSERT(interaction.icon_marks().empty());
    RC_ASSERT(all_finite(model.document()));
    v1::Operation undo;
    undo.mutable_undo();
    while (model.history().undo_steps() > 0) RC_ASSERT(model.submit(undo).ok());
    RC_ASSERT(model::document_hash(model.document()) == start_hash);
  }));
}

}  // namespace
}  // namespace handloft::interaction
