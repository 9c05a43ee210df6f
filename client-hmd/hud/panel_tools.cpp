// The left column: what the pointer does, how hard and how far, and every command of the palette.

#include <algorithm>
#include <array>

#include "client-hmd/hud/panel_parts.h"
#include "client-hmd/hud/shortcuts.h"

namespace handloft::client {
namespace {

struct ToolWords {
  DesktopTool tool;
  DesktopAction action;
  std::string_view name, sign, label, help;
};
constexpr std::array<ToolWords, desktop_tools> tools{{
    {DesktopTool::lay, DesktopAction::tool_lay, "lay", "∴", "Lay points", "Hold the left button and paint."},
    {DesktopTool::push, DesktopAction::tool_push, "push", "◉", "Push",
     "Drag against points or a surface; near an icon, drag it."},
    {DesktopTool::draw, DesktopAction::tool_draw, "draw", "∿", "Draw",
     "Draw a profile that the surface follows; on a sculpted surface, icons."},
    {DesktopTool::trim, DesktopAction::tool_trim, "trim", "✂", "Trim",
     "Draw a closed line: what is outside of it goes."},
    {DesktopTool::move, DesktopAction::tool_move, "move", "✥", "Move", "Take a whole shape along."},
    {DesktopTool::region, DesktopAction::tool_region, "region", "▱", "Region",
     "Two corners on a sculpted surface."},
}};

/// Tiles in a row: three, fewer where the text is large for the window.
int tile_columns(const PanelParts& parts) {
  constexpr int most = 3;
  constexpr float narrowest = 4.3F;  ///< For one word of a label.
  const float room = ImGui::GetContentRegionAvail().x / (narrowest * parts.em);
  return std::clamp(static_cast<int>(room), 1, most);
}

constexpr float tile_height = 4.1F;  ///< Of a sign over two lines.

void draw_tool_tiles(PanelParts& parts) {
  heading(parts, "Tools");
  const int columns = tile_columns(parts);
  const ImVec2 size{tile_width(columns), tile_height * 0.84F * parts.em};
  const std::string reason = parts.contents.can_edit ? "" : "You are watching";
  int column = 0;
  for (const ToolWords& tool : tools) {
    if (column++ % columns != 0) ImGui::SameLine();
    const bool chosen = parts.contents.can_edit && parts.facts.desktop.tool == tool.tool;
    const TileWords tile_words{tool.sign, tool.label, shortcut_of(tool.action), std::string(tool.help),
                               reason};
    if (tile(parts, "tool:" + std::string(tool.name), tile_words, chosen ? Chosen::yes : Chosen::no, size)) {
      parts.act(tool.action);
    }
  }
}

/// Sections that are of no use yet are folded at first.
bool open_at_first(std::string_view title, const PanelContents& contents) {
  if (title != "Icons" && title != "Sculpt") return true;
  for (const ShapeRow& row : contents.shapes) {
    if (row.kind == "Sculpted surface") return true;
  }
  return false;
}

bool section_head(PanelParts& parts, std::string_view title) {
  bool& open =
      parts.memory.open_sections.try_emplace(std::string(title), open_at_first(title, parts.contents))
          .first->second;
  const float width = ImGui::GetContentRegionAvail().x, height = 1.7F * parts.em;
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const std::string name = "section:" + std::string(title);
  if (ImGui::InvisibleButton(name.c_str(), {width, height})) open = !open;
  note_place(parts, name);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const bool lit = ImGui::IsItemHovered() || (ImGui::IsItemFocused() && ImGui::GetIO().NavVisible);
  ImFont* bold = parts.gui.fonts().bold;
  const float y = from.y + 0.5F * (height - bold->FontSize);
  list.AddText(bold, bold->FontSize, {from.x, y}, colour(lit ? parts.theme.accent : parts.theme.ink),
               title.data(), title.data() + title.size());
  // A chevron: down when open.
  const float r = 0.22F * parts.em;
  const ImVec2 c{from.x + width - 0.6F * parts.em, from.y + 0.5F * height};
  const ImU32 ink = colour(parts.theme.faint_ink);
  const float thick = 0.12F * parts.em;
  if (open) {
    list.AddLine({c.x - r, c.y - 0.5F * r}, {c.x, c.y + 0.5F * r}, ink, thick);
    list.AddLine({c.x, c.y + 0.5F * r}, {c.x + r, c.y - 0.5F * r}, ink, thick);
  } else {
    list.AddLine({c.x - 0.5F * r, c.y - r}, {c.x + 0.5F * r, c.y}, ink, thick);
    list.AddLine({c.x + 0.5F * r, c.y}, {c.x - 0.5F * r, c.y + r}, ink, thick);
  }
  return open;
}

void draw_commands(PanelParts& parts, const CommandSection& section) {
  if (!section_head(parts, section.title)) return;
  const int columns = tile_columns(parts);
  const ImVec2 size{tile_width(columns), tile_height * parts.em};
  int column = 0;
  for (const CommandButton& button : section.buttons) {
    if (column++ % columns != 0) ImGui::SameLine();
    const bool on = button.command == PaletteCommand::symmetry && parts.contents.symmetry;
    const TileWords tile_words{button.sign, button.label, button.shortcut,
                               std::string(command_help(button.command)), button.reason};
    const std::string name = "command:" + std::string(palette_command_name(button.command));
    if (tile(parts, name, tile_words, on ? Chosen::yes : Chosen::no, size)) parts.give(button.command);
  }
}

}  // namespace

void draw_tools(PanelParts& parts) {
  begin_panel(parts, "left", parts.layout.left, Scrolling::vertical);
  draw_fold(parts, Side::left);
  draw_tool_tiles(parts);
  if (!parts.contents.hint.empty()) small_words(parts, parts.contents.hint, parts.theme.faint_ink);
  gap(parts, 0.1F);
  if (parts.contents.pressure) gauge_row(parts, *parts.contents.pressure);
  if (parts.contents.range) gauge_row(parts, *parts.contents.range);
  if (!parts.contents.gesture.empty()) {
    std::string hand = parts.contents.gesture;
    if (!parts.contents.drawing.empty()) hand += " · draws " + parts.contents.drawing;
    small_words(parts, hand, parts.theme.ink);
  }
  for (const CommandSection& section : parts.contents.sections) draw_commands(parts, section);
  end_panel(parts, "left");
}

}  // namespace handloft::client
