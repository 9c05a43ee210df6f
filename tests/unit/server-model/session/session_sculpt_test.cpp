// Sculpting through the model's thread (D13 to D19): what viewers get of icons while a hand or a 3D mouse
// works with them, what presence says of it, and what the glove lets the hand feel.

#include <gmock/gmock.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server-model/session/model_actor.h"
#include "server-model/session/presence.h"
#include "server-model/stream/icons.h"
#include "tests/support/hand_script.h"
#include "tests/support/test_data.h"

namespace handloft::session {
namespace {

using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr double sheet_z = 0.1;
/// As far apart as no hand reaches.
const Vector3d hold_at(-0.12, 0.0, sheet_z), slope_at(0.0, 0.08, sheet_z), up_at(0.12, 0.0, sheet_z),
    pull_at(0.0, -0.08, sheet_z), asleep_at(0.12, 0.1, sheet_z);

void set_vec3(v1::Vec3& to, const Vector3d& from) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}
Vector3d vec3(const v1::Vec3& from) {
  return {from.x(), from.y(), from.z()};
}

/// One icon of each kind that D17 tells apart.
model::Model sculpted_sheet() {
  model::Model model;
  v1::Operation sheet;
  v1::CreateSculptSurface& create = *sheet.mutable_create_sculpt_surface();
  create.set_id("sheet");
  set_vec3(*create.mutable_rectangle()->mutable_pose()->mutable_position(), {0, 0, sheet_z});
  create.mutable_rectangle()->set_width_m(0.4);
  create.mutable_rectangle()->set_depth_m(0.3);
  create.set_control_u(12);
  create.set_control_v(10);
  EXPECT_TRUE(model.submit(sheet).ok());
  const auto add = [&](const char* id, const Vector3d& place, v1::IconProperty property,
                       v1::IconRole role = v1::ICON_CONSTRAINT, v1::IconState state = v1::ICON_DRIVING) {
    v1::Operation operation;
    v1::AddIcon& icon = *operation.mutable_add_icon();
    icon.set_entity("sheet");
    icon.set_id(id);
    set_vec3(*icon.add_places(), place);
    if (role == v1::ICON_CONSTRAINT) icon.set_property(property);
    icon.set_role(role);
    icon.set_state(state);
    icon.add_sensors("hand");
    icon.add_sensors("spacemouse");
    const auto added = model.submit(operation);
    EXPECT_TRUE(added.ok()) << added.error().describe();
  };
  add("hold", hold_at, v1::ICON_POSITION);
  add("slope", slope_at, v1::ICON_TANGENT_U);
  add("up", up_at, v1::ICON_NORMAL);
  add("pull", pull_at, v1::ICON_POSITION, v1::ICON_LOAD);
  add("asleep", asleep_at, v1::ICON_POSITION, v1::ICON_CONSTRAINT, v1::ICON_SLEEPING);
  return model;
}

class ActorSculptTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ActorEvents events;
    // On the model's thread; read after state(), which waits for its turn there.
    events.on_presence = [this](const v1::Presence& presence) { presence_ = presence; };
    actor_.emplace(sculpted_sheet(), ActorOptions(), events, clock_, Logger("test", LogLevel::off));
    actor_->set_feel([this](const v1::GloveFeedback& feedback) { felt_.push_back(feedback); });
  }
  void send(const v1::TrackingFrame& frame) {
    actor_->push_frame(frame);
    (void)actor_->state();
  }
  void rest(const Vector3d& at = {0, 0, 0.5}) { send(script_.resting(at)); }
  void touch(PaletteCommand command) {
    const PaletteCell& cell = palette_cell_of(command);
    while (!is_on_page(cell, page_)) {
      const PaletteCell& more = palette_cell_of(PaletteCommand::next_page);
      send(script_.touching(more.centre_x_m, more.centre_y_m));
      rest();
      page_ = palette_page_after(page_);
    }
    send(script_.touching(cell.centre_x_m, cell.centre_y_m));
    rest();
  }
  /// What a viewer that joins now is sent of the sheet.
  std::map<std::string, v1::Icon> icons() const {
    v1::EntityState state;
    stream::write_icons(actor_->scene()->entities.at("sheet"), state);
    EXPECT_TRUE(state.icons_shown());
    std::map<std::string, v1::Icon> icons;
    for (const v1::Icon& icon : state.icons()) icons[icon.id()] = icon;
    return icons;
  }
  std::string targets() const {
    return which([](const v1::Icon& icon) { return icon.target(); });
  }
  std::string held() const {
    return which([](const v1::Icon& icon) { return icon.held(); });
  }
  std::size_t operations() const { return actor_->scene()->sequence; }
  /// Strengths, in order.
  std::vector<double> felt() const {
    std::vector<double> strengths;
    for (const v1::GloveFeedback& each : felt_) {
      EXPECT_LE(each.vibration_ms(), 60U);
      strengths.push_back(each.vibration());
    }
    return strengths;
  }
  static double strength(interaction::Pulse pulse) { return glove_feedback(pulse).vibration(); }

  ManualClock clock_;
  test::HandScript script_;
  v1::Presence presence_;
  std::vector<v1::GloveFeedback> felt_;
  int page_ = first_palette_page;
  std::optional<ModelActor> actor_;

 private:
  template <typename Is>
  std::string which(const Is& is) const {
    std::string names;
    for (const auto& [id, icon] : icons()) {
      if (is(icon)) names += id;
    }
    return names;
  }
};

TEST_F(ActorSculptTest, D17_viewers_get_the_icons_in_the_papers_colours_and_shapes) {
  rest();
  const auto icons = this->icons();
  ASSERT_EQ(icons.size(), 5U);
  const auto channel = [&](const char* id, int shift) { return icons.at(id).colour_rgba() >> shift & 0xFFU; };
  const auto red = [&](const char* id) { return channel(id, 24); };
  const auto green = [&](const char* id) { return channel(id, 16); };
  const auto blue = [&](const char* id) { return channel(id, 8); };
  EXPECT_GT(red("hold"), 2 * green("hold"));
  EXPECT_GT(green("pull"), 2 * red("pull"));
  EXPECT_GT(red("slope"), 2 * blue("slope"));
  EXPECT_GT(green("slope"), 2 * blue("slope")) << "yellow";
  EXPECT_EQ(icons.at("slope").label(), "R");
  EXPECT_EQ(icons.at("hold").label(), "");
  EXPECT_LT(std::max({red("asleep"), green("asleep"), blue("asleep")}) -
                std::min({red("asleep"), green("asleep"), blue("asleep")}),
            16U)
      << "grey";
  EXPECT_LT((vec3(icons.at("up").direction()) - Vector3d::UnitZ()).norm(), 1e-9) << "an arrow";
  EXPECT_LT((vec3(icons.at("slope").direction()) - Vector3d::UnitX()).norm(), 1e-9);
  EXPECT_FALSE(icons.at("hold").has_direction());
  EXPECT_LT((vec3(icons.at("pull").place()) - pull_at).norm(), 1e-9);
}

TEST_F(ActorSculptTest, D19_the_nearest_icon_is_marked_then_held_then_moved) {
  rest();
  EXPECT_EQ(targets(), "");
  rest(hold_at + Vector3d(0, 0, 0.03));
  EXPECT_EQ(targets(), "hold");
  rest(up_at + Vector3d(0.01, 0, 0.03));
  EXPECT_EQ(targets(), "up") << "the nearest, and no other any more";
  rest(hold_at + Vector3d(0, 0, 0.06));
  EXPECT_EQ(targets(), "") << "negative control: out of reach";
  rest(hold_at + Vector3d(0, 0, 0.03));
  const std::size_t before = operations();
  send(script_.closed(hold_at + Vector3d(0, 0, 0.03)));
  EXPECT_EQ(held(), "hold");
  EXPECT_EQ(targets(), "");
  const Vector3d way(0.01, -0.02, 0.03);
  for (int i = 1; i <= 10; ++i) send(script_.closed(hold_at + Vector3d(0, 0, 0.03) + way * i / 10.0));
  EXPECT_TRUE(actor_->scene()->entities.at("sheet").provisional);
  EXPECT_LT((vec3(icons().at("hold").place()) - hold_at - way).norm(), 1e-9) << "seen while it is dragged";
  EXPECT_EQ(operations(), before);
  EXPECT_THAT(presence_.tool(), HasSubstr("dragging icon \"hold\""));
  rest();
  EXPECT_EQ(operations(), before + 1);
  EXPECT_EQ(held(), "");
  EXPECT_LT((vec3(icons().at("hold").place()) - hold_at - way).norm(), 1e-9);
}

TEST_F(ActorSculptTest, D18_presence_says_what_is_selected_and_what_new_icons_get) {
  rest();
  EXPECT_EQ(presence_.mode(), "profile") << "no surface is active yet";
  send(script_.closed(pull_at + Vector3d(0, 0, 0.02)));
  rest();
  EXPECT_EQ(presence_.mode(), "icon \"pull\": driving point, load");
  touch(PaletteCommand::icon_stiffness);
  EXPECT_THAT(presence_.mode(), StartsWith("icon \"pull\": driving point, load of "));
  EXPECT_THAT(presence_.mode(), HasSubstr(" N/m"));
  touch(PaletteCommand::icon_state);
  EXPECT_THAT(presence_.mode(), StartsWith("icon \"pull\": passive point, load"));
  touch(PaletteCommand::icon_role);
  EXPECT_EQ(presence_.mode(), "icon \"pull\": passive point, position constraint");
  EXPECT_EQ(icons().at("pull").role(), v1::ICON_CONSTRAINT);
  touch(PaletteCommand::icon_property);
  EXPECT_EQ(presence_.mode(), "icon \"pull\": passive point, R constraint");
  touch(PaletteCommand::delete_icon);
  EXPECT_EQ(presence_.mode(), "new icons: points and curves, position constraints");
  EXPECT_EQ(icons().size(), 4U);
  touch(PaletteCommand::icon_role);
  EXPECT_EQ(presence_.mode(), "new icons: points and curves, loads");
  touch(PaletteCommand::icon_pen);
  EXPECT_EQ(presence_.mode(), "new icons: regions, loads");
  touch(PaletteCommand::move);
  EXPECT_EQ(presence_.mode(), "move");
}

TEST_F(ActorSculptTest, D19_the_3d_mouse_drives_the_selected_icon_along_the_worlds_axes) {
  send(script_.closed(hold_at + Vector3d(0, 0, 0.02)));
  rest();
  constexpr int frames = 30;
  const Vector3d pushes[] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};  // right, away, up
  Vector3d at = vec3(icons().at("hold").place());
  for (const Vector3d& push : pushes) {
    for (int i = 0; i < frames; ++i) {
      v1::TrackingFrame frame = script_.resting({0, 0, 0.5});
      set_vec3(*frame.mutable_space_mouse()->mutable_translation(), 0.5 * push);
      send(frame);
    }
    EXPECT_EQ(held(), "hold");
    for (int i = 0; i < frames; ++i) rest();
    EXPECT_EQ(held(), "");
    const Vector3d way = vec3(icons().at("hold").place()) - at;
    at += way;
    EXPECT_GT(way.dot(push), 0.01) << push.transpose();
    EXPECT_LT((way - way.dot(push) * push).norm(), 1e-9) << push.transpose();
  }
  EXPECT_LT((vec3(icons().at("slope").place()) - slope_at).norm(), 0.1) << "others only follow the surface";
}

TEST_F(ActorSculptTest, the_glove_tells_of_picking_letting_go_and_refusals) {
  rest(hold_at);
  EXPECT_THAT(felt(), IsEmpty()) << "to be near is nothing yet";
  send(script_.closed(hold_at));
  EXPECT_THAT(felt(), ElementsAre(strength(interaction::Pulse::picked)));
  for (int i = 1; i <= 5; ++i) send(script_.closed(hold_at + Vector3d(0, 0, 0.004 * i)));
  EXPECT_EQ(felt().size(), 1U) << "not while it drags";
  rest();
  EXPECT_THAT(felt(),
              ElementsAre(strength(interaction::Pulse::picked), strength(interaction::Pulse::released)));
  touch(PaletteCommand::icon_stiffness);  // of what is no load
  EXPECT_EQ(felt().size(), 3U);
  EXPECT_EQ(felt().back(), strength(interaction::Pulse::refused));
  rest();
  EXPECT_EQ(felt().size(), 3U) << "told once";
  // A refusal is felt more than what was done, and none of them long.
  EXPECT_GT(strength(interaction::Pulse::refused), strength(interaction::Pulse::picked));
  EXPECT_GT(strength(interaction::Pulse::picked), strength(interaction::Pulse::released));
  EXPECT_GT(strength(interaction::Pulse::released), 0.0);
}

TEST_F(ActorSculptTest, with_move_on_a_fist_takes_the_nearest_sculpted_surface_along) {
  touch(PaletteCommand::move);
  rest(hold_at + Vector3d(0, 0, 0.03));
  EXPECT_EQ(targets(), "") << "no icon is picked";
  const std::map<std::string, v1::Icon> before = icons();
  const Vector3d way(0.02, 0.01, 0.05);
  send(script_.closed(hold_at + Vector3d(0, 0, 0.03)));
  for (int i = 1; i <= 5; ++i) send(script_.closed(hold_at + Vector3d(0, 0, 0.03) + way * i / 5.0));
  EXPECT_EQ(presence_.entity(), "sheet");
  rest();
  for (const auto& [id, icon] : icons()) {
    EXPECT_LT((vec3(icon.place()) - vec3(before.at(id).place()) - way).norm(), 1e-9) << id;
  }
}

}  // namespace
}  // namespace handloft::session
