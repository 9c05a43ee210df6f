// The palette's labels are legible and inside their cells (V7).

#include "client-hmd/render/palette_label.h"

#include <gtest/gtest.h>

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
  EXPECT_FLOAT_EQ(one.height_m, 0.009F);
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
  for (const PaletteCell& cell : table_palette) {
    const auto w = static_cast<float>(cell.width_m);
    const auto h = static_cast<float>(cell.height_m);
    const PaletteLabel label = fit_label(cell.label, {0.92F * w, 0.39F * h},
                                         [&](std::string_view text) { return font->measure(text); });
    // 7 mm at 0.7 m are 0.57 degrees: about the largest print of a newspaper's text at reading distance.
    EXPECT_GE(label.height_m, 0.007F) << cell.label;
    EXPECT_FALSE(cell.sign.empty()) << cell.label;
    for (const char32_t character : decode_utf8(std::string(cell.label) + std::string(cell.sign))) {
      EXPECT_TRUE(font->has(character)) << cell.label << " lacks " << static_cast<std::uint32_t>(character);
    }
  }
}

}  // namespace
}  // namespace handloft::client
