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
  float largest_m = 0.009F;  ///< Height of the text where it has all the room it wants.
};

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
