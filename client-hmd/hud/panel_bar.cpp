// The bar above the work: how the connections are, who is here, and the doors to the right column's pages.

#include <algorithm>
#include <array>

#include "client-hmd/hud/panel_parts.h"
#include "client-hmd/hud/words.h"

namespace handloft::client {
namespace {

struct PageWords {
  PanelPage page;
  std::string_view name, label, sign;
};
constexpr std::array<PageWords, 4> pages{{{PanelPage::scene, "scene", "Scene", "◠"},
                                          {PanelPage::view, "view", "View", "◐"},
                                          {PanelPage::settings, "settings", "Settings", "⚙"},
                                          {PanelPage::help, "help", "Help", "?"}}};

constexpr std::size_t longest_name = 18;

float width_of(ImFont* font, std::string_view text) {
  return font->CalcTextSizeA(font->FontSize, 1e6F, 0.0F, text.data(), text.data() + text.size()).x;
}

void put_words(PanelParts& parts, ImFont* font, std::string_view text, std::uint32_t ink) {
  ImGui::PushFont(font);
  ImGui::PushStyleColor(ImGuiCol_Text, colour(ink));
  ImGui::TextUnformatted(text.data(), text.data() + text.size());
  ImGui::PopStyleColor();
  ImGui::PopFont();
  (void)parts;
}

/// A sign in its tone and words; nothing when `right_end` would be passed. False: it did not fit.
bool put_state(PanelParts& parts, const StateWords& state, float right_end) {
  ImFont* font = parts.gui.fonts().text;
  const float sign = state.sign.empty() ? 0.0F : width_of(font, state.sign) + 0.35F * parts.em;
  if (ImGui::GetCursorScreenPos().x + sign + width_of(font, state.words) > right_end) return false;
  const std::uint32_t ink = tone_ink(parts.theme, state.tone);
  if (!state.sign.empty()) {
    put_words(parts, font, state.sign, ink);
    ImGui::SameLine(0.0F, 0.35F * parts.em);
  }
  put_words(parts, font, state.words,
            state.tone == Tone::plain  ? parts.theme.faint_ink
            : state.tone == Tone::good ? parts.theme.ink
                                       : ink);
  ImGui::SameLine(0.0F, 1.1F * parts.em);
  return true;
}

bool put_person(PanelParts& parts, const Person& person, float right_end) {
  ImFont* font = parts.gui.fonts().text;
  const std::string name = shortened(person.name, longest_name);
  const float diameter = 0.72F * parts.em;
  if (ImGui::GetCursorScreenPos().x + diameter + 0.4F * parts.em + width_of(font, name) > right_end)
    return false;
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const ImVec2 centre{at.x + 0.5F * diameter, at.y + 0.5F * font->FontSize};
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddCircleFilled(centre, 0.5F * diameter, colour(person.colour), 24);
  list.AddCircle(centre, 0.5F * diameter, colour(parts.theme.ink, 0.55F), 24);
  ImGui::Dummy({diameter, font->FontSize});
  ImGui::SameLine(0.0F, 0.4F * parts.em);
  put_words(parts, font, name, parts.theme.ink);
  if (ImGui::IsItemHovered() && !(person.doing.empty() && person.role.empty())) {
    const std::string role = person.role.empty() || person.doing.empty() ? person.role : person.role + ": ";
    tip(parts, person.name, role + person.doing, {});
  }
  ImGui::SameLine(0.0F, 1.0F * parts.em);
  return true;
}

/// The page's button: sign and word, or the sign alone where there is little room.
void put_page(PanelParts& parts, const PageWords& page, float width, bool with_word) {
  const bool open = parts.layout.right_open && parts.memory.page == page.page;
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const float height = 1.9F * parts.em;
  const bool pressed = ImGui::InvisibleButton(("page:" + std::string(page.name)).c_str(), {width, height});
  note_place(parts, "page:" + std::string(page.name));
  const bool hovered = ImGui::IsItemHovered();
  const ImVec2 to{from.x + width, from.y + height};
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const float rounding = ImGui::GetStyle().FrameRounding;
  if (open || hovered)
    list.AddRectFilled(from, to, colour(open ? parts.theme.accent : parts.theme.hovered), rounding);
  if (ImGui::IsItemFocused() && ImGui::GetIO().NavVisible) {
    list.AddRect(from, to, colour(parts.theme.accent), rounding, 0, 0.14F * parts.em);
  }
  ImFont* font = parts.gui.fonts().text;
  const std::string_view text = with_word ? page.label : page.sign;
  const float text_width = width_of(font, text);
  list.AddText(
      font, font->FontSize, {0.5F * (from.x + to.x - text_width), 0.5F * (from.y + to.y - font->FontSize)},
      colour(open ? parts.theme.on_accent : parts.theme.ink), text.data(), text.data() + text.size());
  if (!with_word) tip(parts, page.label, {}, {});
  ImGui::SameLine(0.0F, 0.2F * parts.em);
  if (!pressed) return;
  parts.memory.settings.right_open = !open;
  if (!open) {
    parts.memory.page = page.page;
    parts.memory.preferred = Side::right;
  }
  parts.settings_changed();
}

}  // namespace

void draw_bar(PanelParts& parts) {
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0.9F * parts.em, 0.4F * parts.em));
  begin_panel(parts, "bar", parts.layout.bar, Scrolling::none);
  const float top = ImGui::GetCursorPosY();
  const float right = parts.layout.bar.corner.x + parts.layout.bar.size.x - 0.4F * parts.em;
  ImFont* font = parts.gui.fonts().text;

  float with_words = 0.0F;
  for (const PageWords& page : pages) with_words += width_of(font, page.label) + 1.4F * parts.em;
  const bool roomy = with_words < 0.5F * parts.layout.bar.size.x;
  float doors = 0.0F;
  for (const PageWords& page : pages) {
    doors += (roomy ? width_of(font, page.label) + 1.2F * parts.em : 2.0F * parts.em) + 0.2F * parts.em;
  }
  const float states_end = right - doors - 0.6F * parts.em;

  ImGui::SetCursorPosY(top + 0.45F * parts.em);
  // States before people before figures: what does not fit is left out from the end.
  bool fits = true;
  for (const StateWords& state : parts.contents.states) fits = fits && put_state(parts, state, states_end);
  if (!parts.contents.figures.empty() && parts.contents.figures.front().tone == Tone::bad) {
    fits = fits && put_state(parts, parts.contents.figures.front(), states_end);
  }
  for (const Person& person : parts.contents.people) fits = fits && put_person(parts, person, states_end);
  for (const StateWords& figure : parts.contents.figures) {
    if (figure.tone != Tone::bad) fits = fits && put_state(parts, figure, states_end);
  }

  ImGui::SetCursorScreenPos({right - doors, parts.layout.bar.corner.y + 0.4F * parts.em});
  for (const PageWords& page : pages) {
    put_page(parts, page, roomy ? width_of(font, page.label) + 1.2F * parts.em : 2.0F * parts.em, roomy);
  }
  end_panel(parts, "bar");
  ImGui::PopStyleVar();
}

}  // namespace handloft::client
