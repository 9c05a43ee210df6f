#include "client-hmd/render/palette_label.h"

#include <algorithm>

namespace handloft::client {
namespace {

struct Candidate {
  PaletteLabel label;
  float widest = 0.0F;  ///< In heights.

  bool better_than(const Candidate& other) const {
    return label.height_m > other.label.height_m ||
           (label.height_m == other.label.height_m && label.lines.size() > 1 &&
            other.label.lines.size() > 1 && widest < other.widest);
  }
};

Candidate sized(std::vector<std::string> lines, const LabelRoom& room,
                const std::function<float(std::string_view)>& measure) {
  float widest = 0.0F;
  for (const std::string& line : lines) widest = std::max(widest, measure(line));
  const float high = room.height_m / (static_cast<float>(lines.size() - 1) * label_line_spacing + 1.0F);
  float height = std::min(room.largest_m, high);
  if (widest > 0.0F) height = std::min(height, room.width_m / widest);
  return {{std::move(lines), height}, widest};
}

}  // namespace

PaletteLabel fit_label(std::string_view label, const LabelRoom& room,
                       const std::function<float(std::string_view)>& measure) {
  Candidate best = sized({std::string(label)}, room, measure);
  for (std::size_t at = label.find(' '); at != std::string_view::npos; at = label.find(' ', at + 1)) {
    Candidate broken =
        sized({std::string(label.substr(0, at)), std::string(label.substr(at + 1))}, room, measure);
    if (broken.better_than(best)) best = std::move(broken);
  }
  return std::move(best.label);
}

}  // namespace handloft::client
