// The right column's first page: what there is, its alternatives, and what was done.

#include <array>

#include "client-hmd/hud/panel_parts.h"
#include "client-hmd/hud/words.h"

namespace handloft::client {
namespace {

constexpr std::array<std::string_view, 3> representations{"Points", "Surface", "Both"};

/// A row of the list; true: it was pressed.
bool shape_line(PanelParts& parts, const ShapeRow& row) {
  const GuiFonts& fonts = parts.gui.fonts();
  const float width = ImGui::GetContentRegionAvail().x;
  const float height = 3.1F * parts.em;
  const ImVec2 from = ImGui::GetCursorScreenPos(), to{from.x + width, from.y + height};
  const std::string name = "shape:" + row.id;
  const bool pressed = ImGui::InvisibleButton(name.c_str(), {width, height});
  note_place(parts, name);
  const Theme& theme = parts.theme;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const float rounding = ImGui::GetStyle().FrameRounding;
  const bool hovered = ImGui::IsItemHovered();
  if (row.selected || hovered) {
    list.AddRectFilled(
        from, to, colour(row.selected ? theme.chosen : theme.hovered, row.selected ? 1.0F : 0.6F), rounding);
  }
  if (row.selected) {  // A bar at its edge, too: not told by its ground alone.
    list.AddRectFilled({from.x, from.y + 0.45F * parts.em},
                       {from.x + 0.22F * parts.em, to.y - 0.45F * parts.em}, colour(theme.accent),
                       0.11F * parts.em);
  }
  if (ImGui::IsItemFocused() && ImGui::GetIO().NavVisible)
    list.AddRect(from, to, colour(theme.accent), rounding, 0, 0.14F * parts.em);
  const float left = from.x + 0.65F * parts.em;
  const float sign_height = 1.3F * parts.em;
  list.AddText(fonts.sign, sign_height, {left, from.y + 0.5F * (height - sign_height)},
               colour(theme.faint_ink), row.sign.data(), row.sign.data() + row.sign.size());
  const float text = left + 1.9F * parts.em;
  const ImVec4 clip{text, from.y, to.x - 0.3F * parts.em, to.y};
  std::string below = row.by.empty() ? row.details : "changed by " + row.by;
  if (row.target && !row.selected) below += below.empty() ? "under the hand" : " · under the hand";
  ImFont* font = row.selected ? fonts.bold : fonts.text;
  list.AddText(font, font->FontSize, {text, from.y + (below.empty() ? 1.05F : 0.38F) * parts.em},
               colour(theme.ink), row.name.data(), row.name.data() + row.name.size(), 0.0F, &clip);
  list.AddText(fonts.small, fonts.small->FontSize, {text, from.y + 1.65F * parts.em},
               colour(row.by.empty() ? theme.faint_ink : theme.caution_ink), below.data(),
               below.data() + below.size(), 0.0F, &clip);
  if (hovered && !row.selectable) tip(parts, row.name, row.kind, "Gestures do not change it.");
  return pressed;
}

void begin_renaming(PanelParts& parts, const ShapeRow& row) {
  parts.memory.renaming = row.id;
  parts.memory.name = row.name;
  parts.memory.name_focused = false;
}

void draw_renaming(PanelParts& parts, const ShapeRow& row) {
  if (!parts.memory.name_focused) ImGui::SetKeyboardFocusHere();
  text_field(parts, "name:" + row.id, "Name", parts.memory.name);
  parts.memory.name_focused = true;
  const bool enter =
      ImGui::IsItemDeactivatedAfterEdit() && !ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape));
  const float width = tile_width(2);
  const bool keep = text_button(parts, "name-keep", "Rename", ButtonLook::primary, width);
  ImGui::SameLine();
  const bool leave = text_button(parts, "name-leave", "Leave", ButtonLook::plain, width);
  const bool entered = enter && ImGui::IsKeyDown(ImGui::GetKeyIndex(ImGuiKey_Enter));
  if ((keep || entered) && !parts.memory.name.empty() && parts.memory.name != row.name) {
    parts.ask(RenameShape{row.id, parts.memory.name});
  }
  if (keep || leave || entered) parts.memory.renaming.clear();
}

void draw_details(PanelParts& parts, const ShapeRow& row) {
  if (parts.memory.renaming == row.id) {
    draw_renaming(parts, row);
    return;
  }
  const std::string watching = parts.contents.can_edit ? "" : "You are watching";
  if (row.representable) {
    if (const auto chosen =
            segments(parts, "show", representations, static_cast<std::size_t>(row.representation));
        chosen && parts.contents.can_edit) {
      parts.ask(ShowShape{row.id, static_cast<Representation>(*chosen)});
    }
  }
  const float width = tile_width(2);
  if (text_button(parts, "rename", "Rename", ButtonLook::plain, width, watching)) begin_renaming(parts, row);
  ImGui::SameLine();
  if (text_button(parts, "delete", "✖ Delete", ButtonLook::plain, width, watching))
    parts.ask(DeleteShape{row.id});
}

void draw_shapes(PanelParts& parts) {
  heading(parts, "Shapes");
  if (parts.contents.shapes.empty()) {
    words(parts,
          parts.contents.has_scene ? "The table is empty. Choose Lay points and paint a patch over it."
                                   : "Waiting for the model server.",
          parts.theme.faint_ink);
    return;
  }
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(ImGui::GetStyle().ItemSpacing.x, 0.18F * parts.em));
  for (const ShapeRow& row : parts.contents.shapes) {
    ImGui::PushID(row.id.c_str());
    if (shape_line(parts, row) && row.selectable && !row.selected && parts.contents.can_edit)
      parts.memory.seeker.seek(row.id);
    if (row.selected) {
      gap(parts, 0.1F);
      draw_details(parts, row);
      gap(parts, 0.3F);
    }
    ImGui::PopID();
  }
  ImGui::PopStyleVar();
}

void draw_alternatives(PanelParts& parts) {
  const Alternatives& alternatives = parts.contents.alternatives;
  heading(parts, "Alternatives");
  const std::string watching = parts.contents.can_edit ? "" : "You are watching";
  if (alternatives.names.size() > 1) {
    for (const std::string& name : alternatives.names) {
      const bool present = name == alternatives.present;
      if (choice_row(parts, "alternative:" + name, name, present ? Chosen::yes : Chosen::no) && !present &&
          parts.contents.can_edit) {
        parts.ask(SwitchAlternative{name});
      }
    }
  } else {
    small_words(parts, "Try something else on a copy; this one stays as it is.", parts.theme.faint_ink);
  }
  if (text_button(parts, "new-alternative", "New alternative", ButtonLook::plain,
                  ImGui::GetContentRegionAvail().x, watching)) {
    parts.give(PaletteCommand::new_alternative);
  }
}

void history_line(PanelParts& parts, const std::string& text, std::uint32_t ink) {
  const GuiFonts& fonts = parts.gui.fonts();
  const float width = ImGui::GetContentRegionAvail().x;
  const ImVec2 from = ImGui::GetCursorScreenPos();
  ImGui::Dummy({width, 1.25F * parts.em});
  const ImVec4 clip{from.x, from.y, from.x + width, from.y + 1.25F * parts.em};
  ImGui::GetWindowDrawList()->AddText(fonts.small, fonts.small->FontSize, {from.x + 0.2F * parts.em, from.y},
                                      colour(ink), text.data(), text.data() + text.size(), 0.0F, &clip);
}

void draw_history(PanelParts& parts) {
  const HistoryRows& history = parts.contents.history;
  heading(parts, "History");
  const float width = tile_width(2);
  const auto button = [&](const char* name, const char* label, PaletteCommand command) {
    if (text_button(parts, name, label, ButtonLook::plain, width, why_not(command, parts.facts)))
      parts.give(command);
  };
  button("undo", "↶ Undo", PaletteCommand::undo);
  ImGui::SameLine();
  button("redo", "↷ Redo", PaletteCommand::redo);
  // Steps that redo would take lie above the present, the latest of the past right below it.
  if (history.redo_steps > history.redo.size()) {
    history_line(parts, "↷  " + grouped(history.redo_steps - history.redo.size()) + " more",
                 parts.theme.disabled_ink);
  }
  for (std::size_t i = history.redo.size(); i-- > 0;)
    history_line(parts, "↷  " + history.redo[i], parts.theme.disabled_ink);
  if (!history.redo.empty()) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::GetWindowDrawList()->AddLine(at, {at.x + ImGui::GetContentRegionAvail().x, at.y},
                                        colour(parts.theme.accent), 0.12F * parts.em);
    gap(parts, 0.15F);
  }
  for (const std::string& name : history.undo) history_line(parts, "↶  " + name, parts.theme.ink);
  if (history.undo_steps > history.undo.size()) {
    history_line(parts, "↶  " + grouped(history.undo_steps - history.undo.size()) + " before",
                 parts.theme.faint_ink);
  }
  if (history.undo_steps == 0 && history.redo_steps == 0)
    small_words(parts, "Nothing was done yet.", parts.theme.faint_ink);
}

}  // namespace

void draw_scene_page(PanelParts& parts) {
  draw_shapes(parts);
  gap(parts, 0.5F);
  draw_history(parts);
  gap(parts, 0.5F);
  draw_versions(parts);
  gap(parts, 0.5F);
  draw_alternatives(parts);
  gap(parts, 0.5F);
  draw_comments(parts);
}

}  // namespace handloft::client
