// What viewers are told of a hand, and what its "Export" writes.

#include <gmock/gmock.h>

#include <unistd.h>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "server-model/session/palette_export.h"
#include "server-model/session/presence.h"
#include "tests/support/hand_script.h"

namespace handloft::session {
namespace {

using ::testing::HasSubstr;

void lay_plate(model::Model& model) {
  v1::Operation operation;
  v1::AddPoints& add = *operation.mutable_add_points();
  add.set_entity("plate");
  add.mutable_create();
  for (int i = -4; i <= 4; ++i) {
    for (int k = -4; k <= 4; ++k) {
      v1::Point& point = *add.add_points();
      point.mutable_position()->set_x(0.01 * i);
      point.mutable_position()->set_y(0.01 * k);
      point.mutable_position()->set_z(0.1 + 1e-4 * i * k);
      point.set_pressure(0.5);
    }
  }
  ASSERT_TRUE(model.submit(operation).ok());
  v1::Operation fit;
  fit.mutable_fit()->set_entity("plate");
  ASSERT_TRUE(model.submit(fit).ok());
}

TEST(HandPresence, A13_tells_the_disk_and_the_range_of_a_closed_hand) {
  model::Model model;
  interaction::Interaction interaction(model);
  test::HandScript script;
  const v1::TrackingFrame frame = script.closed({0.1, 0.2, 0.3}, 1.0, 0.25);
  interaction.on_frame(frame);
  const v1::Presence presence = hand_presence(frame, 0, interaction);
  ASSERT_TRUE(presence.has_disk());
  EXPECT_NEAR(presence.disk().centre().z(), 0.3, 1e-12);
  EXPECT_NEAR(presence.disk().radius_m(), 0.06, 1e-12);
  EXPECT_EQ(presence.range(), 0.25);
  EXPECT_EQ(presence.mode(), "profile");
  EXPECT_FALSE(presence.has_symmetry_plane());
  const v1::TrackingFrame open = script.resting();
  interaction.on_frame(open);
  EXPECT_FALSE(hand_presence(open, 0, interaction).has_disk());
  EXPECT_FALSE(hand_presence(open, 1, interaction).has_hand()) << "a hand that the frame does not have";
}

TEST(HandPresence, A19_tells_the_curve_that_is_drawn_with_fewer_points_when_it_is_long) {
  model::Model model;
  lay_plate(model);
  interaction::Interaction interaction(model);
  test::HandScript script;
  v1::TrackingFrame frame;
  for (int i = 0; i < 1500; ++i) {
    frame = script.pointing({0.0001 * (i % 300), 0.0, 0.11});
    interaction.on_frame(frame);
    if (i != 9) continue;
    const std::string points = hand_presence(frame, 0, interaction).curve().points();
    ASSERT_EQ(points.size(), 10 * 3 * sizeof(float));
    float x = 0;
    std::memcpy(&x, points.data() + 9 * 3 * sizeof(float), sizeof(x));
    EXPECT_FLOAT_EQ(x, 0.0009F);
  }
  const v1::Presence presence = hand_presence(frame, 0, interaction);
  EXPECT_GT(presence.curve().points().size(), 500 * 3 * sizeof(float));
  EXPECT_LE(presence.curve().points().size(), 1024 * 3 * sizeof(float));
  EXPECT_EQ(presence.curve().kind(), v1::Polyline::PROFILE);
}

TEST(HandPresence, A12_tells_the_symmetry_plane) {
  model::Model model;
  interaction::Interaction interaction(model);
  test::HandScript script;
  const PaletteCell& cell = palette_cell_of(PaletteCommand::symmetry);
  const v1::TrackingFrame frame = script.touching(cell.centre_x_m, cell.centre_y_m);
  interaction.on_frame(frame);
  const v1::Presence presence = hand_presence(frame, 0, interaction);
  EXPECT_TRUE(presence.symmetry());
  EXPECT_EQ(presence.symmetry_plane().normal().x(), 1.0);
}

TEST(CleanPresence, S1_lets_no_number_pass_that_is_none) {
  v1::Presence presence;
  presence.mutable_disk()->set_radius_m(std::numeric_limits<double>::quiet_NaN());
  presence.mutable_symmetry_plane()->mutable_origin()->set_x(std::numeric_limits<double>::infinity());
  presence.set_range(std::numeric_limits<double>::quiet_NaN());
  presence.mutable_curve()->set_points(std::string("\0\0\xc0\x7f", 4) + std::string(8, '\0'));  // a NaN
  const v1::Presence clean = clean_presence(presence);
  EXPECT_FALSE(clean.has_disk());
  EXPECT_FALSE(clean.has_symmetry_plane());
  EXPECT_FALSE(clean.has_curve());
  EXPECT_EQ(clean.range(), 0.0);
  presence.mutable_curve()->set_points(std::string(13, '\0'));  // no whole points
  EXPECT_FALSE(clean_presence(presence).has_curve());
  presence.mutable_curve()->set_points(std::string(12 * 2000, '\0'));
  EXPECT_FALSE(clean_presence(presence).has_curve());
  presence.mutable_curve()->set_points(std::string(12 * 1024, '\0'));  // negative control
  EXPECT_TRUE(clean_presence(presence).has_curve());
}

TEST(PaletteExport, writes_beside_what_is_there_and_says_why_not) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("handloft-palette-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  model::Model model;
  const auto refused = model::export_from_palette(model.document(), folder);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("nothing to export"));
  lay_plate(model);
  std::ofstream(folder / "main-1.step") << "mine";
  const auto exported = model::export_from_palette(model.document(), folder);
  ASSERT_TRUE(exported.ok()) << exported.error().describe();
  EXPECT_EQ(exported->path.filename(), "main-2.step");
  EXPECT_GT(fs::file_size(folder / "main-2.step"), 1000U);
  EXPECT_EQ(fs::file_size(folder / "main-1.step"), 4U);
  v1::Operation alternative;
  alternative.mutable_new_alternative()->set_name("../with wings");
  ASSERT_TRUE(model.submit(alternative).ok());
  const auto named = model::export_from_palette(model.document(), folder);
  ASSERT_TRUE(named.ok());
  EXPECT_EQ(named->path.filename(), "___with_wings-1.step");
  EXPECT_TRUE(fs::exists(folder / "___with_wings-1.step"));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace handloft::session
