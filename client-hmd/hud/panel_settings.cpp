// The right column's pages of settings and of help.

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "client-hmd/hud/panel_parts.h"
#include "client-hmd/hud/words.h"

namespace handloft::client {
namespace {

struct SchemeWords {
  ColourScheme scheme;
  std::string_view label, help;
};
constexpr std::array<SchemeWords, 3> schemes{{
    {ColourScheme::normal, "Normal", "Light and calm."},
    {ColourScheme::colour_blind_safe, "Colour-blind safe", "Told apart without red, green or blue cones."},
    {ColourScheme::high_contrast, "High contrast", "White on black, strong lines."},
}};

void swatches(PanelParts& parts, ColourScheme scheme) {
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const float size = 0.95F * parts.em, step = 1.2F * parts.em;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  float x = from.x + 0.2F * parts.em;
  for (const std::uint32_t user : scene_colours(scheme).users) {
    list.AddCircleFilled({x + 0.5F * size, from.y + 0.5F * size}, 0.5F * size, colour(user), 24);
    list.AddCircle({x + 0.5F * size, from.y + 0.5F * size}, 0.5F * size, colour(parts.theme.ink, 0.5F), 24);
    x += step;
  }
  ImGui::Dummy({x - from.x, size});
}

void draw_text_size(PanelParts& parts) {
  HudSettings& settings = parts.memory.settings;
  heading(parts, "Size of text");
  const float button = panel_sizes.button * parts.em;
  const std::string at_least = settings.text_percent <= smallest_text_percent ? "It cannot be smaller" : "";
  const std::string at_most = settings.text_percent >= largest_text_percent ? "It cannot be larger" : "";
  int percent = settings.text_percent;
  if (text_button(parts, "text-smaller", "−", ButtonLook::plain, button, at_least))
    percent -= text_percent_step;
  ImGui::SameLine();
  const float middle = ImGui::GetContentRegionAvail().x - button - ImGui::GetStyle().ItemSpacing.x;
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImGui::Dummy({middle, button});
  const std::string text = fmt::format("{} %", settings.text_percent);
  ImFont* bold = parts.gui.fonts().bold;
  const float width = bold->CalcTextSizeA(bold->FontSize, 1e6F, 0.0F, text.c_str()).x;
  ImGui::GetWindowDrawList()->AddText(
      bold, bold->FontSize, {at.x + 0.5F * (middle - width), at.y + 0.5F * (button - bold->FontSize)},
      colour(parts.theme.ink), text.c_str());
  ImGui::SameLine();
  if (text_button(parts, "text-larger", "+", ButtonLook::plain, button, at_most))
    percent += text_percent_step;
  percent = std::clamp(percent, smallest_text_percent, largest_text_percent);
  if (percent == settings.text_percent) return;
  settings.text_percent = percent;
  parts.settings_changed();
}

void draw_colours(PanelParts& parts) {
  heading(parts, "Colours");
  for (const SchemeWords& scheme : schemes) {
    const bool chosen = parts.memory.settings.colours == scheme.scheme;
    const std::string name = "colours:" + std::string(colour_scheme_name(scheme.scheme));
    if (choice_row(parts, name, scheme.label, chosen ? Chosen::yes : Chosen::no) && !chosen) {
      parts.memory.settings.colours = scheme.scheme;
      parts.settings_changed();
    }
    if (chosen) {
      ImGui::Indent(1.7F * parts.em);
      small_words(parts, scheme.help, parts.theme.faint_ink);
      swatches(parts, scheme.scheme);
      ImGui::Unindent(1.7F * parts.em);
    }
  }
}

struct Entry {
  std::string title;
  std::string words;
  std::string keys;
};

void help_entry(PanelParts& parts, const Entry& entry) {
  const GuiFonts& fonts = parts.gui.fonts();
  const float width = ImGui::GetContentRegionAvail().x;
  const auto measure = [](ImFont* font, const std::string& text, float wrap) {
    return text.empty()
               ? ImVec2(0.0F, 0.0F)
               : font->CalcTextSizeA(font->FontSize, 1e6F, wrap, text.data(), text.data() + text.size());
  };
  const float keys_room = 0.42F * width;
  const ImVec2 keys = measure(fonts.small, entry.keys, keys_room);
  const float key_box = entry.keys.empty() ? 0.0F : keys.x + 0.7F * parts.em;
  const float title_room = width - key_box - 0.5F * parts.em;
  const ImVec2 title = measure(fonts.text, entry.title, title_room);
  const ImVec2 from = ImGui::GetCursorScreenPos();
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddText(fonts.text, fonts.text->FontSize, from, colour(parts.theme.ink), entry.title.data(),
               entry.title.data() + entry.title.size(), title_room);
  const float box_height = keys.y + 0.3F * parts.em;
  if (!entry.keys.empty()) {
    const ImVec2 box{from.x + width - key_box, from.y - 0.1F * parts.em};
    list.AddRectFilled(box, {from.x + width, box.y + box_height}, colour(parts.theme.raised),
                       0.3F * parts.em);
    list.AddRect(box, {from.x + width, box.y + box_height}, colour(parts.theme.line), 0.3F * parts.em);
    list.AddText(fonts.small, fonts.small->FontSize, {box.x + 0.35F * parts.em, box.y + 0.15F * parts.em},
                 colour(parts.theme.ink), entry.keys.data(), entry.keys.data() + entry.keys.size(),
                 keys_room);
  }
  ImGui::Dummy({width, std::max(title.y, entry.keys.empty() ? 0.0F : box_height)});
  small_words(parts, entry.words, parts.theme.faint_ink);
  gap(parts, 0.15F);
}

bool matches(const Entry& entry, std::string_view search) {
  return contains_words(entry.title, search) || contains_words(entry.words, search) ||
         contains_words(entry.keys, search);
}

}  // namespace

void draw_settings_page(PanelParts& parts) {
  draw_text_size(parts);
  gap(parts, 0.5F);
  draw_colours(parts);
  gap(parts, 0.5F);
  heading(parts, "Guided tour");
  small_words(parts, "Five steps from an empty table to a file.", parts.theme.faint_ink);
  if (text_button(parts, "tour:repeat", "Take the tour", ButtonLook::plain,
                  ImGui::GetContentRegionAvail().x)) {
    parts.memory.tour.repeat();
    parts.memory.tour.remember(parts.memory.settings);
    parts.settings_changed();
  }
}

void draw_help_page(PanelParts& parts) {
  text_field(parts, "help-search", "Search keys and commands", parts.memory.search);
  gap(parts, 0.2F);
  std::vector<Entry> keys, commands;
  for (const KeyHelp& key : parts.facts.keys)
    keys.push_back({std::string(key.words), {}, std::string(key.keys)});
  keys.push_back({"Open this help", {}, "F1"});
  keys.push_back({"Work the panels with Tab, arrows and Enter; Escape ends it", {}, "F6"});
  for (const CommandSection& section : parts.contents.sections) {
    for (const CommandButton& button : section.buttons) {
      commands.push_back({std::string(button.sign) + "  " + std::string(button.label),
                          std::string(command_help(button.command)), button.shortcut});
    }
  }
  std::size_t found = 0;
  const auto list = [&](std::string_view title, const std::vector<Entry>& entries) {
    bool titled = false;
    for (const Entry& entry : entries) {
      if (!matches(entry, parts.memory.search)) continue;
      if (!titled) {
        heading(parts, title);
        titled = true;
      }
      help_entry(parts, entry);
      ++found;
    }
    if (titled) gap(parts, 0.4F);
  };
  list("Keys", keys);
  list("Commands", commands);
  if (found == 0) words(parts, "Nothing of that name.", parts.theme.faint_ink);
  if (parts.memory.search.empty() && text_button(parts, "tour:repeat-help", "Take the tour",
                                                 ButtonLook::primary, ImGui::GetContentRegionAvail().x)) {
    parts.memory.tour.repeat();
    parts.memory.tour.remember(parts.memory.settings);
    parts.settings_changed();
  }
}

}  // namespace handloft::client
