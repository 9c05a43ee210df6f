// The headset's status card says what there is to say, and can be read (V7).

#include "client-hmd/hud/table_card.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "client-hmd/render/font_atlas.h"
#include "common/base/table_palette.h"

namespace handloft::client {
namespace {

using testing::HasSubstr;

HudStatus busy() {
  HudStatus status;
  status.model_connected = status.has_scene = status.tracking_wanted = status.tracking_connected = true;
  status.latency_ms = 34.0;
  status.hand = HandStatus{v1::GESTURE_OPEN, 0.62, true, true, 80};
  status.tool = "laying points";
  status.range = 0.35F;
  status.selected = "Shell";
  status.representation = Representation::both;
  status.shapes = 2;
  status.history = {17, 2, "Push", "Fit", "", ""};
  status.others = {"Mira", "Jonas"};
  status.other_ids = {3, 4};
  return status;
}

class TableCard : public testing::Test {
 protected:
  TableCard() {
    Result<FontAtlas> font = FontAtlas::load("DejaVu Sans", 96, "⎇");
    EXPECT_TRUE(font.ok());
    font_ = std::move(*font);
  }
  SpaceSheet card(const HudStatus& status, const TableCardPlace& place = {}) const {
    return table_card(
        status, ColourScheme::normal, [this](std::string_view text) { return font_.measure(text); }, place);
  }
  std::string all_text(const HudStatus& status) const {
    std::string all;
    for (const OverlayText& text : card(status).overlay.texts) all += text.text + "|";
    return all;
  }
  FontAtlas font_;
};

TEST_F(TableCard, SaysWhatTheHandAndTheModelDo_V7) {
  const std::string words = all_text(busy());
  for (const char* part : {"Live", "Tracking", "34 ms", "Open hand", "laying points", "Pressure", "62 %",
                           "Range", "35 %", "Shell", "points + surface", "↶ 17", "↷ 2", "Mira", "Jonas"}) {
    EXPECT_THAT(words, HasSubstr(part));
  }
  HudStatus late = busy();
  late.lag = std::chrono::milliseconds(1300);
  late.model_connected = false;
  late.tracking_connected = false;
  EXPECT_THAT(all_text(late), HasSubstr("1.3 s behind"));
  EXPECT_THAT(all_text(late), HasSubstr("Reconnecting"));
  EXPECT_THAT(all_text(late), HasSubstr("No tracking"));
}

/// Height of the smallest capital on the way from the designer's eyes over the table's near edge, in pixels.
double smallest_capital_px(const SpaceSheet& sheet, const FontAtlas& font, double focal_px) {
  const glm::dvec3 normal = glm::normalize(glm::cross(glm::dvec3(sheet.down), glm::dvec3(sheet.right)));
  const glm::dvec3 eye(0.0, -0.36, 0.46);
  constexpr double capital_share = 0.729;
  double smallest_px = 1e9;
  for (const OverlayText& text : sheet.overlay.texts) {
    const double half = 0.5 * double{font.measure(text.text)} * double{text.height_px};
    const double side = text.align == TextAlign::right ? -half : half;
    const glm::dvec3 place = glm::dvec3(sheet.origin) +
                             (double{text.position.x} + side) * glm::dvec3(sheet.right) +
                             double{text.position.y} * glm::dvec3(sheet.down);
    const glm::dvec3 to_eye = eye - place;
    const double distance = glm::length(to_eye);
    const double along = std::abs(glm::dot(to_eye / distance, glm::dvec3(sheet.down)));
    smallest_px = std::min(smallest_px, focal_px * capital_share * double{text.height_px} *
                                            std::sqrt(1.0 - along * along) / distance);
    EXPECT_GT(glm::dot(normal, to_eye), 0.0) << "it faces the designer";
  }
  return smallest_px;
}

TEST_F(TableCard, IsLegibleFromTheDesignersPlace_V7) {
  // As the palette's test: through the simulated rig's head camera, enlarged twice.
  const double rig_px = smallest_capital_px(card(busy()), font_, 2 * 590.0);
  EXPECT_GE(rig_px, 12.0);
  RecordProperty("smallest_capital_px", std::to_string(rig_px));
  // And through the eyes of a headset: 90 degrees over 960 and over 2160 pixels.
  for (const double focal_px : {480.0, 700.0, 1080.0}) {
    EXPECT_GE(smallest_capital_px(card(busy(), table_card_place(focal_px)), font_, focal_px), 12.0)
        << focal_px;
  }
  const TableCardPlace usual;
  for (const double focal_px : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 5000.0}) {
    EXPECT_EQ(table_card_place(focal_px).text_m, usual.text_m) << focal_px;
  }
}

TEST_F(TableCard, KeepsItsWordsInsideAndThePaletteClear) {
  HudStatus crowded = busy();
  crowded.selected = std::string(300, 'W');
  crowded.tool = "dragging the icon of the sculpted surface of the housing";
  crowded.mode = "boundary";
  crowded.symmetry = true;
  crowded.others = std::vector<std::string>(30, "Somebody with a long name");
  for (const HudStatus& status : {busy(), crowded, HudStatus{}}) {
    const SpaceSheet sheet = card(status, table_card_place(480.0));
    ASSERT_FALSE(sheet.overlay.panels.empty());
    const glm::vec2 size = sheet.overlay.panels.front().size;
    for (const OverlayText& text : sheet.overlay.texts) {
      const float width = font_.measure(text.text) * text.height_px;
      const float left = text.align == TextAlign::right ? text.position.x - width : text.position.x;
      EXPECT_GE(left, 0.0F) << text.text;
      EXPECT_LE(left + width, size.x + 1e-4F) << text.text;
      EXPECT_LE(text.position.y, size.y) << text.text;
    }
    const glm::vec3 foot = sheet.origin + size.y * sheet.down;
    for (const PaletteCell& cell : table_palette) {
      EXPECT_GT(foot.y, static_cast<float>(cell.centre_y_m + 0.5 * cell.height_m)) << cell.label;
    }
    EXPECT_GT(foot.z, 0.0F);
  }
}

}  // namespace
}  // namespace handloft::client
