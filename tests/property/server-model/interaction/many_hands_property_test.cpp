// Several sources of hands on one model, whatever their frames and commands: nothing is lost, corrupt or left
// in the air, and what was done is a list of operations that gives the same model again (U1, A25, A28).

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
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

/// What one of the sources does next.
struct Act {
  enum class Kind { frames, command, leave };
  Kind kind = Kind::frames;
  std::size_t source = 0;
  int gesture = 0;
  int x = 0, y = 0, z = 0;  ///< mm
  int pressure = 0;         ///< percent
  int command = 0;
  int repeat = 1;
};

// Full-sized from the first case on: short sequences of zeros find nothing.
int in_range(int from, int below) {
  constexpr int full_size = 100;
  return *rc::gen::resize(full_size, rc::gen::inRange(from, below));
}

constexpr std::size_t source_count = 3;

std::vector<Act> any_acts() {
  std::vector<Act> acts(static_cast<std::size_t>(in_range(5, 60)));
  for (Act& act : acts) {
    const int kind = in_range(0, 20);
    act.kind = kind == 0 ? Act::Kind::leave : kind < 6 ? Act::Kind::command : Act::Kind::frames;
    act.source = static_cast<std::size_t>(in_range(0, static_cast<int>(source_count)));
    act.gesture = in_range(1, 4);
    // Near each other, so that they meet on the same shapes.
    act.x = in_range(-60, 60);
    act.y = in_range(-60, 60);
    act.z = in_range(60, 140);
    act.pressure = in_range(0, 101);
    act.command = in_range(0, static_cast<int>(table_palette.size()));
    act.repeat = in_range(1, 10);
  }
  return acts;
}

bool all_finite(const model::Document& document) {
  for (const auto& [id, entity] : document.entities) {
    if (const model::SculptPtr sculpted = model::as_sculpt(entity)) {
      for (const auto& point : sculpted->surface->control) {
        if (!point.allFinite()) return false;
      }
    }
    const model::DualPtr shape = model::as_dual(entity);
    if (!shape) continue;
    for (const model::DualPoint& point : shape->points) {
      if (!point.position().allFinite()) return false;
    }
    if (!shape->fit) continue;
    for (const double c : shape->fit->surface.scaled_coefficients()) {
      if (!std::isfinite(c)) return false;
    }
  }
  return true;
}

/// The sources, and the operations that came of them in their order.
class Table {
 public:
  explicit Table(const model::Document& start) : model_(start) {
    for (std::size_t i = 0; i < source_count; ++i) arrive(i);
  }
  void play(const std::vector<Act>& acts) {
    for (const Act& act : acts) {
      switch (act.kind) {
        case Act::Kind::frames:
          move(act);
          break;
        case Act::Kind::command: {
          FrameOutcome outcome;
          (void)sources_[act.source]->command(static_cast<std::size_t>(act.repeat % 2),
                                              table_palette[static_cast<std::size_t>(act.command)].command,
                                              outcome);
          keep(outcome);
          break;
        }
        case Act::Kind::leave:
          leave(act.source);
          arrive(act.source);
          break;
      }
    }
  }
  void leave(std::size_t source) {
    keep(sources_[source]->finish());
    sources_[source].reset();
  }
  model::Model& model() { return model_; }
  const Claims& claims() const { return *claims_; }
  const std::vector<v1::Operation>& done() const { return done_; }

 private:
  void arrive(std::size_t source) {
    sources_[source] = std::make_unique<Interaction>(model_, InteractionOptions{}, claims_, source);
    places_[source] = Vector3d(0, 0, 0.1);
  }
  void move(const Act& act) {
    const Vector3d from = places_[act.source];
    const Vector3d to = 1e-3 * Vector3d(act.x, act.y, act.z);
    for (int i = 1; i <= act.repeat; ++i) {
      const v1::TrackingFrame frame =
          script_.hand(from + (to - from) * i / act.repeat, static_cast<v1::Gesture>(act.gesture),
                       act.pressure > 30, 0.01 * act.pressure);
      keep(sources_[act.source]->on_frame(frame));
      RC_ASSERT(all_finite(model_.preview()));
    }
    places_[act.source] = to;
  }
  void keep(const FrameOutcome& outcome) {
    for (const model::Submitted& submitted : outcome.submitted) {
      if (submitted.sequence != 0) done_.push_back(submitted.effective);
    }
  }

  model::Model model_;
  ClaimsPtr claims_ = std::make_shared<Claims>();
  std::array<std::unique_ptr<Interaction>, source_count> sources_;
  std::array<Vector3d, source_count> places_;
  test::HandScript script_;
  std::vector<v1::Operation> done_;
};

model::Document with_sheet() {
  model::Model base;
  v1::Operation make;
  make.mutable_create_sculpt_surface()->set_id("sheet");
  auto& rectangle = *make.mutable_create_sculpt_surface()->mutable_rectangle();
  rectangle.mutable_pose()->mutable_position()->set_z(0.1);
  rectangle.set_width_m(0.2);
  rectangle.set_depth_m(0.2);
  make.mutable_create_sculpt_surface()->set_control_u(8);
  make.mutable_create_sculpt_surface()->set_control_v(8);
  EXPECT_TRUE(base.submit(make).ok());
  v1::Operation icon;
  icon.mutable_add_icon()->set_entity("sheet");
  icon.mutable_add_icon()->set_shape(v1::ICON_POINT);
  icon.mutable_add_icon()->set_role(v1::ICON_CONSTRAINT);
  icon.mutable_add_icon()->add_sensors("hand");
  set_vec3(*icon.mutable_add_icon()->add_places(), {0.03, 0.03, 0.1});
  EXPECT_TRUE(base.submit(icon).ok());
  return base.document();
}

/// Whoever made the newest step that stands takes it back: nobody has gone on from it.
void take_back_the_newest(model::Model& model) {
  const auto& entries = model.history().entries();
  const auto newest =
      std::find_if(entries.rbegin(), entries.rend(), [](const auto& entry) { return !entry.undone; });
  const model::History::StepPtr step = newest->step;
  // Who has taken back a switch may have left the alternative that others have worked in since. Their steps
  // wait until somebody works there again; that switch is then the newest step.
  const std::string& alternative = step->delta.alternative;
  if (!alternative.empty() && alternative != model.document().present_alternative()) {
    v1::Operation go_there;
    go_there.set_client_id(source_count);
    go_there.mutable_switch_alternative()->set_name(alternative);
    RC_ASSERT(model.submit(go_there).ok());
  }
  v1::Operation undo;
  undo.set_client_id(step->info.client_id);
  undo.mutable_undo();
  const auto undone = model.submit(undo);
  if (!undone) RC_FAIL(undone.error().describe());
}

void check_any_acts(const model::Document& start) {
  const auto acts = any_acts();
  Table table(start);
  table.play(acts);
  for (std::size_t i = 0; i < source_count; ++i) table.leave(i);
  RC_ASSERT(!table.model().has_provisional());
  RC_ASSERT(table.claims().icons.empty());
  RC_ASSERT(table.claims().shape_ids.empty());
  RC_ASSERT(all_finite(table.model().document()));
  // What was done, done again by nobody's hands.
  model::Model again(start);
  for (const v1::Operation& operation : table.done()) RC_ASSERT(again.submit(operation).ok());
  RC_ASSERT(model::document_hash(again.document()) == model::document_hash(table.model().document()));
  while (table.model().history().undo_steps() > 0) take_back_the_newest(table.model());
  // All but the ids, which stay used when several have worked.
  RC_ASSERT(model::difference(start, table.model().document()).empty());
}

TEST(ManyHandsProperty, U1_random_hands_and_commands_leave_a_model_that_a_replay_gives_again) {
  const model::Document empty;
  EXPECT_TRUE(rc::check([&] { check_any_acts(empty); }));
}

TEST(ManyHandsProperty, D19_the_same_about_a_sculpted_surface) {
  const model::Document sheet = with_sheet();
  EXPECT_TRUE(rc::check([&] { check_any_acts(sheet); }));
}

}  // namespace
}  // namespace handloft::interaction
