#pragma once
// A palette cell's label, broken and sized so that it is as large as its cell allows: a designer reads it at
// arm's length. Pure: no OpenGL here.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace handloft::client {

struct LabelRoom {
  float width_m = 0.0F, height_m = 0.0F;
  float largest_m = 0.011F;  ///< Height of the text where it has all the room it wants.
};

/// Letters lie on the table and are seen at 35 to 50 degrees of it: stretched away from the designer, as
/// those on roads are, they have their natural shape for him and are as high as its labels can be.
inline constexpr float label_stretch = 1.45F;

/// How a cell is divided, from its middle, in shares of its height, down towards the designer.
inline constexpr float sign_baseline_share = -0.16F,
                       sign_share = 0.28F;  ///< The sign's line, and its height.
inline constexpr float label_top_share = -0.12F, label_bottom_share = 0.44F;
inline constexpr float label_width_share = 0.90F;  ///< Of the cell's width.

/// A label's room in a cell, as fit_label() wants it: before the stretch.
inline LabelRoom label_room(float cell_width_m, float cell_height_m) {
  return {label_width_share * cell_width_m,
          (label_bottom_share - label_top_share) * cell_height_m / label_stretch};
}

struct PaletteLabel {
  std::vector<std::string> lines;
  float height_m = 0.0F;  ///< Of the text, the same for all lines.
};

/// The break into at most two lines, between words, at which the text is largest. `measure`: width of a text
/// in multiples of its height.
PaletteLabel fit_label(std::string_view label, const LabelRoom& room,
                       const std::function<float(std::string_view)>& measure);

/// From one line's baseline to the next, in heights of the text.
inline constexpr float label_line_spacing = 1.15F;

}  // namespace handloft::client
