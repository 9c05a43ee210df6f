// Over the work's middle: the tour's card below, what happened above, and a few words beside the cursor.

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "client-hmd/hud/panel_parts.h"

namespace handloft::client {
namespace {

constexpr float card_width = 26.0F, notice_width = 27.0F;  ///< In heights of the text, at most.
constexpr ImGuiWindowFlags card_flags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                        ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                                        ImGuiWindowFlags_NoFocusOnAppearing;

/// Dots for the steps: done, present, to come; they differ in size and fill, not in colour alone.
void draw_steps(PanelParts& parts, int present) {
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const float step = 1.1F * parts.em, radius = 0.3F * parts.em;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  for (int i = 0; i < tour_steps; ++i) {
    const ImVec2 centre{from.x + radius + step * static_cast<float>(i), from.y + 0.5F * parts.em};
    if (i < present) list.AddCircleFilled(centre, radius, colour(parts.theme.good_ink), 20);
    if (i == present) list.AddCircleFilled(centre, 1.25F * radius, colour(parts.theme.accent), 20);
    if (i > present)
      list.AddCircle(centre, 0.85F * radius, colour(parts.theme.disabled_ink), 20, 0.1F * parts.em);
  }
  ImGui::Dummy({step * tour_steps, parts.em});
}

void begin_card(PanelParts& parts, const char* name, float pivot_y, float y, float width) {
  const PixelRect& middle = parts.layout.middle;
  ImGui::SetNextWindowPos({middle.middle().x, y}, ImGuiCond_Always, {0.5F, pivot_y});
  ImGui::SetNextWindowSizeConstraints({width, 0.0F}, {width, middle.size.y});
  ImGui::Begin(name, nullptr, card_flags);
}

void end_card(PanelParts& parts) {
  const ImVec2 at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
  parts.places["card:tour"] = {{at.x, at.y}, {size.x, size.y}};
  ImGui::End();
}

void tour_changed(PanelParts& parts) {
  parts.memory.tour.remember(parts.memory.settings);
  parts.settings_changed();
}

void draw_tour_card(PanelParts& parts) {
  Tour& tour = parts.memory.tour;
  const PixelRect& middle = parts.layout.middle;
  const float width = std::min(card_width * parts.em, middle.size.x);
  begin_card(parts, "tour", 1.0F, middle.corner.y + middle.size.y, width);
  if (tour.state() == Tour::State::finished) {
    heading(parts, "✓  You know your way now");
    words(parts,
          "Points, surface, push, trim, export: everything else builds on these. The help finds the rest.",
          parts.theme.ink);
    if (text_button(parts, "tour:dismiss", "Good", ButtonLook::primary)) tour.dismiss();
    end_card(parts);
    return;
  }
  const TourText& text = tour_text(tour.step());
  heading(parts, fmt::format("{} of {}   {}", tour.step_number() + 1, tour_steps, text.title));
  words(parts, text.task, parts.theme.ink);
  if (middle.size.y > 24.0F * parts.em) small_words(parts, text.why, parts.theme.faint_ink);
  draw_steps(parts, tour.step_number());
  if (text_button(parts, "tour:skip", "Next", ButtonLook::plain)) {
    tour.skip_step();
    tour_changed(parts);
  }
  ImGui::SameLine();
  if (text_button(parts, "tour:end", "End the tour", ButtonLook::plain)) {
    tour.end();
    tour_changed(parts);
  }
  end_card(parts);
}

void draw_cursor_hint(PanelParts& parts) {
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const PixelRect& middle = parts.layout.middle;
  if (!middle.contains({mouse.x, mouse.y}) || ImGui::IsWindowHovered(ImGuiHoveredFlags_AnyWindow)) return;
  const std::string_view hint = tour_text(parts.memory.tour.step()).hint;
  ImFont* font = parts.gui.fonts().small;
  const ImVec2 size = font->CalcTextSizeA(font->FontSize, 1e6F, 0.0F, hint.data(), hint.data() + hint.size());
  const ImVec2 pad{0.5F * parts.em, 0.25F * parts.em};
  const float width = size.x + 2.0F * pad.x, height = size.y + 2.0F * pad.y;
  // To the right of the pointer and below it, but inside of the middle.
  const float x = std::clamp(mouse.x + 1.4F * parts.em, middle.corner.x,
                             std::max(middle.corner.x, middle.corner.x + middle.size.x - width));
  const float y = std::clamp(mouse.y + 1.2F * parts.em, middle.corner.y,
                             std::max(middle.corner.y, middle.corner.y + middle.size.y - height));
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  list.AddRectFilled({x, y}, {x + width, y + height}, colour(parts.theme.accent, 0.95F), 0.5F * height);
  list.AddText(font, font->FontSize, {x + pad.x, y + pad.y}, colour(parts.theme.on_accent), hint.data(),
               hint.data() + hint.size());
}

std::string_view notice_sign(NoticeKind kind) {
  switch (kind) {
    case NoticeKind::done:
      return "✓";
    case NoticeKind::refused:
      return "✖";
    case NoticeKind::warning:
      return "⚠";
  }
  return "";
}

std::uint32_t notice_ink(const Theme& theme, NoticeKind kind) {
  switch (kind) {
    case NoticeKind::done:
      return theme.good_ink;
    case NoticeKind::refused:
      return theme.bad_ink;
    case NoticeKind::warning:
      return theme.caution_ink;
  }
  return theme.ink;
}

}  // namespace

void draw_tour(PanelParts& parts) {
  const Tour::State state = parts.memory.tour.state();
  if (state == Tour::State::running || state == Tour::State::finished) draw_tour_card(parts);
  if (state == Tour::State::running) draw_cursor_hint(parts);
}

void draw_notices(PanelParts& parts) {
  const PixelRect& middle = parts.layout.middle;
  const float width = std::min(notice_width * parts.em, middle.size.x);
  float y = middle.corner.y;
  const std::vector<Notice> notices = parts.memory.notices.visible(parts.now);
  std::optional<std::size_t> dismissed;
  for (std::size_t i = 0; i < notices.size(); ++i) {
    const Notice& notice = notices[i];
    if (y > middle.corner.y + 0.6F * middle.size.y) break;  // The work stays free.
    const std::string name = "notice" + std::to_string(i);
    ImGui::PushStyleVar(ImGuiStyleVar_Alpha, notice.opacity);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0.8F * parts.em, 0.55F * parts.em));
    begin_card(parts, name.c_str(), 0.0F, y, width);
    const ImVec2 at = ImGui::GetWindowPos();
    const std::uint32_t ink = notice_ink(parts.theme, notice.kind);
    const std::string_view sign = notice_sign(notice.kind);
    ImGui::PushStyleColor(ImGuiCol_Text, colour(ink));
    ImGui::TextUnformatted(sign.data(), sign.data() + sign.size());
    ImGui::PopStyleColor();
    ImGui::SameLine(0.0F, 0.6F * parts.em);
    words(parts, notice.times > 1 ? fmt::format("{}  ({} times)", notice.words, notice.times) : notice.words,
          parts.theme.ink);
    const ImVec2 size = ImGui::GetWindowSize();
    parts.places["notice:" + std::to_string(i)] = {{at.x, at.y}, {size.x, size.y}};
    if (ImGui::IsWindowHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) dismissed = i;
    ImGui::End();
    ImGui::PopStyleVar(2);
    y += size.y + 0.35F * parts.em;
  }
  if (dismissed) parts.memory.notices.dismiss(*dismissed, parts.now);
}

}  // namespace handloft::client
