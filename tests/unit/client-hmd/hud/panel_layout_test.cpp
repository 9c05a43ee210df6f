// Panels leave room for the work, from small windows to 4K and with text of any size (V7).

#include "client-hmd/hud/panel_layout.h"

#include <gtest/gtest.h>

#include <limits>

#include "client-hmd/hud/settings.h"

namespace handloft::client {
namespace {

bool overlap(const PixelRect& a, const PixelRect& b) {
  return a.corner.x < b.corner.x + b.size.x - 0.01F && b.corner.x < a.corner.x + a.size.x - 0.01F &&
         a.corner.y < b.corner.y + b.size.y - 0.01F && b.corner.y < a.corner.y + a.size.y - 0.01F;
}

TEST(PanelLayout, LeavesRoomForTheWorkAtAnySize_V7) {
  constexpr std::pair<int, int> sizes[] = {{800, 500},   {1024, 768},  {1280, 720},
                                           {1920, 1080}, {2560, 1440}, {3840, 2160}};
  for (const auto& [width, height] : sizes) {
    for (int percent = smallest_text_percent; percent <= largest_text_percent; percent += 10) {
      const PanelLayout layout =
          panel_layout({width, height, panel_text_px(height, 1.0F, percent), true, true, Side::left});
      const auto w = static_cast<float>(width), h = static_cast<float>(height);
      for (const PixelRect& rect : {layout.bar, layout.left, layout.right, layout.middle}) {
        EXPECT_GE(rect.corner.x, 0.0F);
        EXPECT_GE(rect.corner.y, 0.0F);
        EXPECT_LE(rect.corner.x + rect.size.x, w + 0.01F);
        EXPECT_LE(rect.corner.y + rect.size.y, h + 0.01F);
      }
      EXPECT_FALSE(overlap(layout.left, layout.right));
      EXPECT_FALSE(overlap(layout.bar, layout.left));
      EXPECT_FALSE(overlap(layout.middle, layout.left));
      EXPECT_FALSE(overlap(layout.middle, layout.right));
      EXPECT_GE(layout.middle.size.x, 0.28F * w) << width << " at " << percent << " %";
    }
  }
}

TEST(PanelLayout, FoldsWhatDoesNotFitAndKeepsWhatWasOpenedLast) {
  const PanelLayout left = panel_layout({800, 500, 15.0F, true, true, Side::left});
  EXPECT_TRUE(left.left_open);
  EXPECT_FALSE(left.right_open);
  const PanelLayout right = panel_layout({800, 500, 15.0F, true, true, Side::right});
  EXPECT_FALSE(right.left_open);
  EXPECT_TRUE(right.right_open);
  const PanelLayout both = panel_layout({1280, 720, 15.0F, true, true, Side::left});
  EXPECT_TRUE(both.left_open && both.right_open);
  const PanelLayout none = panel_layout({1280, 720, 15.0F, false, false, Side::left});
  EXPECT_GT(none.middle.size.x, 0.9F * 1280.0F);
  EXPECT_EQ(none.left.corner.x, 0.0F) << "the handle lies at the edge";
}

TEST(PanelLayout, SurvivesSizesThatAreNone) {
  for (const int size : {0, -5, 1}) {
    const PanelLayout layout = panel_layout({size, size, 15.0F, true, true, Side::left});
    EXPECT_GE(layout.middle.size.x, 1.0F);
    EXPECT_GE(layout.middle.size.y, 1.0F);
  }
}

TEST(PanelLayout, HasTextThatFollowsDensityHeightAndSetting) {
  EXPECT_EQ(panel_text_px(720, 1.0F, 100), 15.0F);
  EXPECT_EQ(panel_text_px(720, 2.0F, 100), 30.0F);
  EXPECT_EQ(panel_text_px(2160, 1.0F, 100), 30.0F) << "as large on a large picture";
  EXPECT_EQ(panel_text_px(720, 1.0F, 80), 12.0F);
  EXPECT_EQ(panel_text_px(720, 1.0F, 250), 38.0F);
  EXPECT_EQ(panel_text_px(720, std::numeric_limits<float>::quiet_NaN(), 100), 15.0F);
  EXPECT_EQ(panel_text_px(720, 0.0F, 9999), panel_text_px(720, 0.5F, 250));
}

}  // namespace
}  // namespace handloft::client
