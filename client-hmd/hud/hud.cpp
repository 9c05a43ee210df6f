#include "client-hmd/hud/hud.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client-hmd/hud/words.h"

namespace handloft::client {
namespace {

// sRGB, as the overlay is drawn after the encoding.
constexpr glm::vec4 paper{0.985F, 0.985F, 0.99F, 0.80F};
constexpr glm::vec4 ink{0.11F, 0.14F, 0.19F, 1.0F};
constexpr glm::vec4 faint_ink{0.36F, 0.40F, 0.46F, 1.0F};
constexpr glm::vec4 good{0.13F, 0.60F, 0.37F, 1.0F};
constexpr glm::vec4 warning_ink{0.80F, 0.35F, 0.03F, 1.0F};
constexpr glm::vec4 track{0.11F, 0.14F, 0.19F, 0.14F};
constexpr glm::vec4 pressing_bar{0.91F, 0.40F, 0.16F, 1.0F};
constexpr glm::vec4 resting_bar{0.36F, 0.45F, 0.56F, 1.0F};

constexpr std::size_t longest_icon = 24;

struct Words {
  std::string text;
  glm::vec4 colour;
};

/// One line of words in a panel at a corner of the picture.
class Layout {
 public:
  Layout(int width_px, int height_px, const std::function<float(std::string_view)>& measure)
      : measure_(measure),
        width_(static_cast<float>(width_px)),
        height_(static_cast<float>(height_px)),
        text_(std::clamp(height_ / 45.0F, 10.0F, 40.0F)) {}

  float text_height() const { return text_; }
  float line_height() const { return 2.1F * text_; }
  float margin() const { return 1.1F * text_; }
  float measure(std::string_view text) const { return measure_(text) * text_; }

  float words_width(const std::vector<Words>& words) const {
    float sum = 0.0F;
    for (const Words& word : words) sum += measure_(word.text) * text_;
    return sum + gap() * static_cast<float>(std::max<std::size_t>(words.size(), 1) - 1);
  }

  /// A panel with `words` and, behind them, `extra_width` left free; returns where the free room begins.
  /// `row`: so many lines from the edge.
  glm::vec2 line(const std::vector<Words>& words, bool right, bool bottom, float extra_width = 0.0F,
                 int row = 0) {
    const float inner = words_width(words) + (extra_width > 0.0F ? gap() + extra_width : 0.0F);
    const float panel_width = inner + 2.0F * padding();
    const float x = right ? width_ - margin() - panel_width : margin();
    const float from_edge = margin() + static_cast<float>(row) * 1.25F * line_height();
    const float y = bottom ? height_ - from_edge - line_height() : from_edge;
    overlay.panels.push_back({{x, y}, {panel_width, line_height()}, line_height() / 2.0F, paper});
    float pen = x + padding();
    const float baseline = y + 0.5F * line_height() + 0.36F * text_;
    for (const Words& word : words) {
      overlay.texts.push_back({word.text, {pen, baseline}, text_, word.colour, TextAlign::left});
      pen += measure_(word.text) * text_ + gap();
    }
    return {pen, y + 0.5F * line_height()};
  }

  Overlay overlay;

 private:
  float gap() const { return 0.9F * text_; }
  float padding() const { return 1.1F * text_; }

  const std::function<float(std::string_view)>& measure_;
  float width_, height_, text_;
};

std::vector<Words> connection_words(const HudStatus& status) {
  if (!status.has_scene) return {{"○", warning_ink}, {"Connecting to the model", ink}};
  if (!status.model_connected) return {{"○", warning_ink}, {"Reconnecting", warning_ink}};
  if (status.tracking_wanted && !status.tracking_connected) return {{"○", warning_ink}, {"No tracking", ink}};
  return {{"●", good}, {"Live", ink}};
}

/// As the lit scene has it, encoded.
glm::vec4 legend_colour(ColourScheme scheme, float share) {
  const DivergingRamp& ramp = scene_colours(scheme).distance;
  const float at = std::abs(share);
  const std::uint32_t end = share < 0.0F ? ramp.negative : ramp.positive;
  const glm::vec3 linear = glm::mix(linear_rgb(ramp.nought), linear_rgb(end), at);
  glm::vec4 encoded(1.0F);
  for (int i = 0; i < 3; ++i) {
    encoded[i] =
        linear[i] <= 0.0031308F ? 12.92F * linear[i] : 1.055F * std::pow(linear[i], 1.0F / 2.4F) - 0.055F;
  }
  return encoded;
}

/// What the colours of distances mean: a bar from the one end to the other, and the range in words.
void add_legend(const HudStatus& status, Layout& layout, int row) {
  if (status.references == 0 || status.compared == 0) {
    const char* reason = status.references == 0 ? "no reference" : "not measured yet";
    layout.line({{"Distance", faint_ink}, {reason, ink}}, true, false, 0.0F, row);
    return;
  }
  constexpr int steps = 16;
  const std::string range = fmt::format("{:.3g} mm", 1e3F * status.distances->range_m);
  const std::string highest = "+" + range;
  const float gap = 0.6F * layout.text_height();
  const float bar_width = 8.0F * layout.text_height();
  const float bar_height = 0.8F * layout.text_height();
  const glm::vec2 free = layout.line({{"Distance to the reference", faint_ink}, {"−" + range, ink}}, true,
                                     false, bar_width + gap + layout.measure(highest), row);
  for (int i = 0; i < steps; ++i) {
    const float share = 2.0F * (static_cast<float>(i) + 0.5F) / steps - 1.0F;
    const glm::vec2 corner{free.x + bar_width * static_cast<float>(i) / steps, free.y - bar_height / 2.0F};
    layout.overlay.panels.push_back(
        {corner, {bar_width / steps, bar_height}, 0.0F, legend_colour(status.colours, share)});
  }
  layout.overlay.texts.push_back({highest,
                                  {free.x + bar_width + gap, free.y + 0.36F * layout.text_height()},
                                  layout.text_height(),
                                  ink,
                                  TextAlign::left});
}

}  // namespace

std::optional<Duration> model_lag(const TrackingStatus& tracking, const ModelState& model, TimePoint now) {
  if (!tracking.connected || tracking.frames == 0 || !model.has_capture_time) return std::nullopt;
  // A source that has paused makes nobody late.
  if (tracking.end_of_recording || now - tracking.received_at > lag_threshold) return std::nullopt;
  return std::max(tracking.capture_time - model.capture_time, Duration::zero());
}

std::string_view gesture_words(v1::Gesture gesture) {
  switch (gesture) {
    case v1::GESTURE_OPEN:
      return "Open hand";
    case v1::GESTURE_CLOSED:
      return "Closed hand";
    case v1::GESTURE_POINTING:
      return "Pointing";
    case v1::GESTURE_ON_TABLE:
      return "Hand on table";
    default:
      return "No hand";
  }
}

Overlay layout_hud(const HudStatus& status, int width_px, int height_px,
                   const std::function<float(std::string_view)>& measure) {
  Layout layout(width_px, height_px, measure);

  std::vector<Words> top_left = connection_words(status);
  for (const std::string& name : status.others) top_left.push_back({name, faint_ink});
  layout.line(top_left, false, false);

  const bool lags = status.lag && *status.lag > lag_threshold;
  const bool tells_time = lags || status.latency_ms;
  if (lags) {
    layout.line({{fmt::format("⚠ Model {:.1f} s behind", to_seconds(*status.lag)), warning_ink}}, true,
                false);
  } else if (status.latency_ms) {
    layout.line({{"Capture to client", faint_ink}, {fmt::format("{:.0f} ms", *status.latency_ms), ink}}, true,
                false);
  }

  if (status.hand) {
    std::vector<Words> words{{std::string(gesture_words(status.hand->gesture)), ink}};
    if (!status.tool.empty())
      words.push_back({status.tool, pressing_bar * glm::vec4(0.85F, 0.85F, 0.85F, 1.0F)});
    if (!status.mode.empty() && status.hand->gesture == v1::GESTURE_POINTING) {
      words.push_back({"draws " + status.mode, ink});
    }
    if (status.range) {
      words.push_back(
          {fmt::format("Range {:.0f} %, {} falloff", 100.0F * std::clamp(*status.range, 0.0F, 1.0F),
                       status.smooth_falloff ? "smooth" : "literal"),
           ink});
    }
    if (status.symmetry) words.push_back({"◐ mirrored", faint_ink});
    const float bar_width = 6.0F * layout.text_height();
    const float bar_height = 0.42F * layout.text_height();
    const glm::vec2 free = layout.line(words, false, true, bar_width);
    const glm::vec2 corner{free.x, free.y - bar_height / 2.0F};
    layout.overlay.panels.push_back({corner, {bar_width, bar_height}, bar_height / 2.0F, track});
    const float filled = bar_width * static_cast<float>(std::clamp(status.hand->pressure, 0.0, 1.0));
    if (filled > bar_height) {
      layout.overlay.panels.push_back({corner,
                                       {filled, bar_height},
                                       bar_height / 2.0F,
                                       status.hand->pressing ? pressing_bar : resting_bar});
    }
  }

  std::vector<Words> model;
  if (!status.selected.empty()) {
    model.push_back({status.selected, ink});
    if (status.representation)
      model.push_back({std::string(representation_words(*status.representation)), faint_ink});
  }
  if (!status.target.empty())
    model.push_back({"acts on " + status.target, pressing_bar * glm::vec4(0.85F, 0.85F, 0.85F, 1.0F)});
  if (!status.icon.empty()) {
    model.push_back({(status.icon_held ? "drags " : "aims at ") + shortened(status.icon, longest_icon),
                     pressing_bar * glm::vec4(0.85F, 0.85F, 0.85F, 1.0F)});
  }
  model.push_back({plural(status.shapes, "shape"), faint_ink});
  model.push_back({plural(status.surfaces, "surface"), faint_ink});
  if (status.references > 0) model.push_back({plural(status.references, "reference"), faint_ink});
  if (status.icons > 0) model.push_back({plural(status.icons, "icon"), faint_ink});
  model.push_back({plural(status.points, "point"), faint_ink});
  if (status.history.undo_steps > 0) model.push_back({fmt::format("↶ {}", status.history.undo_steps), ink});
  if (status.history.redo_steps > 0) model.push_back({fmt::format("↷ {}", status.history.redo_steps), ink});
  if (!status.has_scene) return std::move(layout.overlay);
  layout.line(model, true, true);
  // The palette is below in most views, so these are above, under what is told of time.
  int row = tells_time ? 1 : 0;
  const std::vector<std::string>& names = status.alternatives.names;
  if (names.size() > 1) {
    constexpr std::size_t longest_name = 40;
    const auto present = std::find(names.begin(), names.end(), status.alternatives.present);
    const auto number = std::min<std::ptrdiff_t>(present - names.begin() + 1, std::ssize(names));
    layout.line({{"Alternative", faint_ink},
                 {shortened(status.alternatives.present, longest_name), ink},
                 {fmt::format("{} of {}", number, names.size()), faint_ink}},
                true, false, 0.0F, row++);
  }
  if (status.distances) add_legend(status, layout, row);
  return std::move(layout.overlay);
}

Overlay layout_legends(const HudStatus& status, const glm::vec2& corner_px, const glm::vec2& size_px,
                       const std::function<float(std::string_view)>& measure) {
  Layout layout(static_cast<int>(size_px.x), static_cast<int>(size_px.y), measure);
  if (status.distances && status.has_scene) add_legend(status, layout, 0);
  for (OverlayPanel& panel : layout.overlay.panels) panel.position += corner_px;
  for (OverlayText& text : layout.overlay.texts) text.position += corner_px;
  return std::move(layout.overlay);
}

}  // namespace handloft::client
