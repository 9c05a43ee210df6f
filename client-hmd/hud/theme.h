#pragma once
// How panels look: one calm ground, one accent, words that are always readable (WCAG 2.1, 1.4.3: at least
// 4.5 to 1, tested), and sizes that are multiples of the text's height, so that everything grows with it.

#include <cstdint>

#include "client-hmd/render/colours.h"

namespace handloft::client {

/// Opaque sRGB, 0x00RRGGBB. An ink is for words on every ground unless it says otherwise.
struct Theme {
  std::uint32_t ground = 0;        ///< Of panels.
  std::uint32_t raised = 0;        ///< Of buttons and fields.
  std::uint32_t hovered = 0;       ///< Under the pointer.
  std::uint32_t line = 0;          ///< Between groups, and round buttons: no words.
  std::uint32_t ink = 0;           ///< Words.
  std::uint32_t faint_ink = 0;     ///< What is said beside: shortcuts, units.
  std::uint32_t disabled_ink = 0;  ///< What cannot be done now; still readable, as its reason is.
  std::uint32_t accent = 0;        ///< What is chosen: a fill.
  std::uint32_t accent_hovered = 0;
  std::uint32_t on_accent = 0;  ///< Words on the accent.
  std::uint32_t chosen = 0;     ///< Ground of a chosen row, under `ink` and `faint_ink`.
  std::uint32_t good_ink = 0, caution_ink = 0, bad_ink = 0;  ///< Words and signs of states.
  float ground_opacity = 0.95F;  ///< Panels let a hint of the work through; words do not.
};

const Theme& theme(ColourScheme scheme);

/// What words on grounds must have.
inline constexpr double smallest_text_contrast = 4.5;

/// Lengths in heights of the text.
struct PanelSizes {
  float text_px = 15.0F;  ///< At 100 % on a monitor of usual density.
  float column = 17.5F;   ///< Width of a column.
  float margin = 0.7F;    ///< From the window's edges, and between panels.
  float padding = 0.85F;  ///< Inside of panels.
  float rounding = 0.6F;  ///< Of panels; buttons have a little less.
  float button = 2.1F;    ///< Height: never below 24 px at 100 % (WCAG 2.2, 2.5.8).
};

inline constexpr PanelSizes panel_sizes;

}  // namespace handloft::client
