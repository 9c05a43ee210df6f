#include "client-hmd/hud/table_card.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client-hmd/hud/theme.h"
#include "client-hmd/hud/words.h"

namespace handloft::client {
namespace {

struct Word {
  std::string text;
  std::uint32_t ink = 0;
};

/// Lays lines out from the top, in metres of the sheet.
class Card {
 public:
  Card(const Theme& theme, const TableCardPlace& place, const std::function<float(std::string_view)>& measure)
      : theme_(theme), place_(place), measure_(measure), pen_y_(padding() + place.text_m) {}

  float padding() const { return 1.0F * place_.text_m; }
  float step() const { return 1.62F * place_.text_m; }

  /// Words side by side; what would pass the right edge is cut, and then left out.
  void line(const std::vector<Word>& words, float from = 0.0F, float to = 1.0F) {
    const float inner = place_.width_m - 2.0F * padding();
    const float end = padding() + to * inner;
    float x = padding() + from * inner;
    for (const Word& word : words) {
      const std::string text = fitted(word.text, end - x);
      if (text.empty()) break;
      overlay_.texts.push_back({text, {x, pen_y_}, place_.text_m, linear(word.ink), TextAlign::left});
      x += measure_(text) * place_.text_m + 0.85F * place_.text_m;
    }
  }
  void next() { pen_y_ += step(); }

  void gauge(std::string_view label, double value, std::uint32_t fill, float from, float to) {
    const float inner = place_.width_m - 2.0F * padding();
    const float left = padding() + from * inner, right = padding() + to * inner;
    const double share = std::isfinite(value) ? std::clamp(value, 0.0, 1.0) : 0.0;
    const std::string percent = fmt::format("{:.0f} %", 100.0 * share);
    line({{std::string(label), theme_.faint_ink}}, from, to);
    const float percent_width = measure_("100 %") * place_.text_m;
    overlay_.texts.push_back({percent, {right, pen_y_}, place_.text_m, linear(theme_.ink), TextAlign::right});
    const float bar_left = left + (measure_(label) + 0.6F) * place_.text_m;
    const float bar_right = right - percent_width - 0.5F * place_.text_m;
    if (bar_right <= bar_left) return;
    const float height = 0.5F * place_.text_m;
    const float y = pen_y_ - 0.36F * place_.text_m - 0.5F * height;
    const float width = bar_right - bar_left;
    overlay_.panels.push_back({{bar_left, y}, {width, height}, 0.5F * height, linear(theme_.line)});
    const float filled = std::max(height, static_cast<float>(share) * width);
    if (share > 0.0)
      overlay_.panels.push_back({{bar_left, y}, {filled, height}, 0.5F * height, linear(fill)});
  }

  /// A dot before a name.
  void person(const std::string& name, std::uint32_t colour, float& x) {
    const float inner = place_.width_m - padding();
    const float dot = 0.7F * place_.text_m;
    const std::string text = fitted(name, inner - x - 1.4F * dot);
    if (text.empty()) return;
    const float y = pen_y_ - 0.36F * place_.text_m - 0.5F * dot;
    const float rim = 0.08F * place_.text_m;
    overlay_.panels.push_back(
        {{x - rim, y - rim}, {dot + 2.0F * rim, dot + 2.0F * rim}, dot, linear(theme_.ink)});
    overlay_.panels.push_back({{x, y}, {dot, dot}, 0.5F * dot, linear(colour)});
    x += 1.45F * dot;
    overlay_.texts.push_back({text, {x, pen_y_}, place_.text_m, linear(theme_.ink), TextAlign::left});
    x += measure_(text) * place_.text_m + place_.text_m;
  }

  SpaceSheet sheet() {
    const float height = pen_y_ - step() + 0.35F * place_.text_m + padding();
    const float rim = 0.0009F;
    const OverlayPanel border{{0.0F, 0.0F}, {place_.width_m, height}, 0.008F, linear(theme_.line)};
    const OverlayPanel face{{rim, rim},
                            {place_.width_m - 2.0F * rim, height - 2.0F * rim},
                            0.0075F,
                            linear(theme_.ground, 0.96F)};
    overlay_.panels.insert(overlay_.panels.begin(), {border, face});
    SpaceSheet sheet;
    sheet.right = {1.0F, 0.0F, 0.0F};
    sheet.down = {0.0F, -std::cos(place_.tilt_rad), -std::sin(place_.tilt_rad)};
    sheet.origin = place_.lower_left - height * sheet.down;
    sheet.overlay = std::move(overlay_);
    return sheet;
  }

 private:
  /// This goes into the lit picture.
  static glm::vec4 linear(std::uint32_t srgb, float opacity = 1.0F) { return {linear_rgb(srgb), opacity}; }

  std::string fitted(const std::string& text, float room) const {
    if (measure_(text) * place_.text_m <= room) return text;
    constexpr std::size_t shortest = 4;  // A name of three letters and an ellipsis says nothing.
    for (std::size_t bytes = std::min<std::size_t>(text.size(), 96); bytes >= shortest; --bytes) {
      const std::string cut = shortened(text, bytes);
      if (measure_(cut) * place_.text_m <= room) return cut;
    }
    return {};
  }

  const Theme& theme_;
  const TableCardPlace& place_;
  const std::function<float(std::string_view)>& measure_;
  float pen_y_;
  Overlay overlay_;
};

void add_connections(const HudStatus& status, const Theme& theme, Card& card) {
  std::vector<Word> words;
  if (!status.has_scene) {
    words = {{"○", theme.caution_ink}, {"Connecting", theme.ink}};
  } else if (!status.model_connected) {
    words = {{"○", theme.bad_ink}, {"Reconnecting", theme.bad_ink}};
  } else {
    words = {{"●", theme.good_ink}, {"Live", theme.ink}};
  }
  if (status.tracking_wanted) {
    words.push_back(status.tracking_connected ? Word{"Tracking", theme.faint_ink}
                                              : Word{"⚠ No tracking", theme.caution_ink});
  }
  if (status.lag && *status.lag > lag_threshold) {
    words.push_back({fmt::format("⚠ {:.1f} s behind", to_seconds(*status.lag)), theme.bad_ink});
  } else if (status.latency_ms) {
    words.push_back({fmt::format("{:.0f} ms", *status.latency_ms), theme.faint_ink});
  }
  card.line(words);
}

void add_hand(const HudStatus& status, const Theme& theme, Card& card) {
  std::vector<Word> words{
      {std::string(gesture_words(status.hand ? status.hand->gesture : v1::GESTURE_UNKNOWN)), theme.ink}};
  if (!status.tool.empty()) words.push_back({status.tool, theme.accent});
  if (!status.mode.empty()) words.push_back({"draws " + status.mode, theme.faint_ink});
  if (status.symmetry) words.push_back({"◐ mirrored", theme.faint_ink});
  card.line(words);
}

void add_model(const HudStatus& status, const Theme& theme, Card& card) {
  std::vector<Word> words;
  if (!status.icon.empty()) {
    words.push_back({(status.icon_held ? "drags " : "aims at ") + status.icon, theme.accent});
  } else if (!status.target.empty()) {
    words.push_back({"acts on " + status.target, theme.accent});
  }
  if (!status.selected.empty()) {
    words.push_back({status.selected, theme.ink});
    if (status.representation)
      words.push_back({std::string(representation_words(*status.representation)), theme.faint_ink});
  }
  words.push_back({plural(status.shapes, "shape"), theme.faint_ink});
  if (status.history.undo_steps > 0)
    words.push_back({fmt::format("↶ {}", status.history.undo_steps), theme.ink});
  if (status.history.redo_steps > 0)
    words.push_back({fmt::format("↷ {}", status.history.redo_steps), theme.ink});
  if (status.alternatives.names.size() > 1)
    words.push_back({"⎇ " + status.alternatives.present, theme.faint_ink});
  card.line(words);
}

}  // namespace

TableCardPlace table_card_place(double focal_px) {
  constexpr double usual_focal_px = 1080.0;  // Capitals of the usual card have their 12 pixels.
  constexpr double largest_text = 2.4, largest_width = 1.6;
  TableCardPlace place;
  if (!std::isfinite(focal_px) || focal_px <= 0.0) return place;
  const double scale = usual_focal_px / focal_px;
  const auto text = static_cast<float>(std::clamp(scale, 1.0, largest_text));
  const auto width = static_cast<float>(std::clamp(scale, 1.0, largest_width));
  const float middle = place.lower_left.x + 0.5F * place.width_m;
  place.text_m *= text;
  place.width_m *= width;
  place.lower_left.x = middle - 0.5F * place.width_m;
  return place;
}

SpaceSheet table_card(const HudStatus& status, ColourScheme colours,
                      const std::function<float(std::string_view)>& measure, const TableCardPlace& place) {
  const Theme& look = theme(colours);
  const SceneColours& scene = scene_colours(colours);
  Card card(look, place, measure);
  add_connections(status, look, card);
  card.next();
  add_hand(status, look, card);
  card.next();
  if (status.hand) {
    constexpr float middle = 0.5F, gutter = 0.03F;
    card.gauge("Pressure", status.hand->pressure, status.hand->pressing ? scene.pressing : scene.resting,
               0.0F, middle - gutter);
    card.gauge("Range", status.range.value_or(0.0F), scene.resting, middle + gutter, 1.0F);
    card.next();
  }
  add_model(status, look, card);
  card.next();
  if (!status.others.empty()) {
    float x = card.padding();
    for (std::size_t i = 0; i < status.others.size(); ++i) {
      const std::uint64_t id = i < status.other_ids.size() ? status.other_ids[i] : 0;
      card.person(status.others[i], user_colour(id, colours), x);
    }
    card.next();
  }
  return card.sheet();
}

}  // namespace handloft::client
