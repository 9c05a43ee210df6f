// The palette's labels are legible and inside their cells (V7).

#include "client-hmd/render/palette_label.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "client-hmd/render/font_atlas.h"
#include "common/base/table_palette.h"

namespace handloft::client {
namespace {

float half_an_em(std::string_view text) {
  return 0.5F * static_cast<float>(text.size());
}

TEST(PaletteLabel, BreaksWhereTheTextIsLargest) {
  const PaletteLabel one = fit_label("Fit", {0.045F, 0.02F}, half_an_em);
  ASSERT_EQ(one.lines.size(), 1U);
  EXPECT_FLOAT_EQ(one.height_m, LabelRoom{}.largest_m);
  const PaletteLabel two = fit_label("Points / surface", {0.045F, 0.02F}, half_an_em);
  ASSERT_EQ(two.lines.size(), 2U);
  EXPECT_EQ(two.lines[0], "Points /");
  EXPECT_EQ(two.lines[1], "surface");
  EXPECT_GT(two.height_m, fit_label("Points-/-surface", {0.045F, 0.02F}, half_an_em).height_m);
}

TEST(PaletteLabel, NeverLeavesItsRoomWhateverTheLabel) {
  const LabelRoom room{0.045F, 0.02F};
  for (const std::string_view label :
       {"", " ", "a", "a b c d e f", "oneverylongwordwithoutanybreak at all", "  double  spaces  "}) {
    const PaletteLabel fitted = fit_label(label, room, half_an_em);
    ASSERT_FALSE(fitted.lines.empty());
    for (const std::string& line : fitted.lines) {
      EXPECT_LE(half_an_em(line) * fitted.height_m, room.width_m * 1.0001F) << label;
    }
    const float high =
        (static_cast<float>(fitted.lines.size() - 1) * label_line_spacing + 1.0F) * fitted.height_m;
    EXPECT_LE(high, room.height_m * 1.0001F) << label;
  }
}

TEST(PaletteLabel, EveryCellOfTheTableIsLegibleAtArmsLength_V7) {
  std::string all;
  for (const PaletteCell& cell : table_palette) all.append(cell.label).append(cell.sign);
  const Result<FontAtlas> font = FontAtlas::load("DejaVu Sans", 32, all);
  ASSERT_TRUE(font.ok()) << font.error().describe();
  double smallest_px = 1e9;
  for (const PaletteCell& cell : table_palette) {
    const auto w = static_cast<float>(cell.width_m);
    const auto h = static_cast<float>(cell.height_m);
    const PaletteLabel label =
        fit_label(cell.label, label_room(w, h), [&](std::string_view text) { return font->measure(text); });
    // Seen from the designer's eyes over the table's near edge, in a picture 1280 x 720 over a head camera of
    // 640 x 480 (the simulated rig's): it is enlarged twice. Only the line of sight matters to the height.
    constexpr double eye_y_m = -0.36, eye_z_m = 0.46, focal_px = 2 * 590.0, capital_share = 0.729;
    const double distance_m = std::hypot(cell.centre_x_m, cell.centre_y_m - eye_y_m, eye_z_m);
    const double capital_m = capital_share * double{label_stretch} * double{label.height_m};
    // A letter lies along y: what of it is across the line of sight.
    const double along = (cell.centre_y_m - eye_y_m) / distance_m;
    const double capital_px = focal_px * capital_m * std::sqrt(1 - along * along) / distance_m;
    EXPECT_GE(capital_px, 12.0) << cell.label;
    smallest_px = std::min(smallest_px, capital_px);
    EXPECT_FALSE(cell.sign.empty()) << cell.label;
    for (const char32_t character : decode_utf8(std::string(cell.label) + std::string(cell.sign))) {
      EXPECT_TRUE(font->has(character)) << cell.label << " lacks " << static_cast<std::uint32_t>(character);
    }
  }
  RecordProperty("smallest_capital_px", std::to_string(smallest_px));
  EXPECT_LE(label_bottom_share, 0.5F) << "inside the cell";
  EXPECT_GE(sign_baseline_share - sign_share, -0.5F);
  EXPECT_LE(sign_baseline_share, label_top_share) << "the sign is above the label";
}

}  // namespace
}  // namespace handloft::client
