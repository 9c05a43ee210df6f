#pragma once
// A model with an interaction on it, and what tests of gestures do again and again.

#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <vector>

#include "server-model/interaction/interaction.h"
#include "server-model/model/canonical.h"
#include "tests/support/hand_script.h"

namespace handloft::interaction {

using Eigen::Vector3d;
using test::HandScript;
using ::testing::HasSubstr;

class GestureTest : public ::testing::Test {
 protected:
  FrameOutcome send(const v1::TrackingFrame& frame) {
    FrameOutcome outcome = interaction_.on_frame(frame);
    for (const std::string& problem : outcome.problems) problems_.push_back(problem);
    return outcome;
  }
  void send(int count, const v1::TrackingFrame& like) {
    for (int i = 0; i < count; ++i) {
      v1::TrackingFrame frame = like;
      const v1::TrackingFrame next = script_.empty();
      frame.set_capture_time_ns(next.capture_time_ns());
      send(frame);
    }
  }
  FrameOutcome rest() { return send(script_.resting({0.0, 0.0, 0.5})); }
  FrameOutcome touch(PaletteCommand command, double potentiometer = 0.0) {
    const PaletteCell& cell = palette_cell_of(command);
    while (!is_on_page(cell, interaction_.modes().palette_page)) touch(PaletteCommand::next_page);
    FrameOutcome outcome = send(
        HandScript::with_potentiometer(script_.touching(cell.centre_x_m, cell.centre_y_m), potentiometer));
    for (int i = 0; i < 3; ++i)
      send(HandScript::with_potentiometer(script_.touching(cell.centre_x_m, cell.centre_y_m), potentiometer));
    rest();
    return outcome;
  }
  /// A shape of 11 x 11 points over 0.1 m x 0.1 m about `centre`, slightly curved; not part of the gestures'
  /// own history as far as tests look at it.
  void make_plate(const std::string& id, const Vector3d& centre, bool fitted = true) {
    v1::Operation operation;
    v1::AddPoints& add = *operation.mutable_add_points();
    add.set_entity(id);
    add.mutable_create()->set_name(id);
    for (int i = -5; i <= 5; ++i) {
      for (int k = -5; k <= 5; ++k) {
        v1::Point& point = *add.add_points();
        const double x = 0.01 * i;
        const double y = 0.01 * k;
        set_vec3(*point.mutable_position(),
                 centre + Vector3d(x, y, 1.5 * x * x - y * y + 1e-4 * ((7 * i + 3 * k) % 5)));
        point.set_pressure(0.6);
      }
    }
    ASSERT_TRUE(model_.submit(operation).ok());
    if (!fitted) return;
    v1::Operation fit;
    fit.mutable_fit()->set_entity(id);
    fit.mutable_fit()->set_show(v1::REPRESENTATION_BOTH);
    ASSERT_TRUE(model_.submit(fit).ok());
  }
  std::string hash() const { return model::document_hash(model_.document()); }
  const model::DualShape& shape(const std::string& id) { return *model_.document().find_dual(id); }
  model::DualPtr preview(const std::string& id) { return model_.preview().find_dual(id); }
  /// The largest distance that a point of the shape has moved from where it was.
  static double largest_move(const model::DualShape& before, const model::DualShape& after) {
    double largest = 0;
    for (std::size_t i = 0; i < before.points.size() && i < after.points.size(); ++i) {
      largest = std::max(largest, (after.points[i].position() - before.points[i].position()).norm());
    }
    return largest;
  }

  model::Model model_;
  Interaction interaction_{model_};
  HandScript script_;
  std::vector<std::string> problems_;
};

}  // namespace handloft::interaction
