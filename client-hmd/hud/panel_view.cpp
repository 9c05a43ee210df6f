// The right column's page of what is seen and how: light, lines, distances, from where, the work plane.

#include <array>

#include "client-hmd/hud/panel_parts.h"

namespace handloft::client {
namespace {

struct ViewWords {
  DesktopAction action;
  std::string_view name, label;
};
constexpr std::array<ViewWords, 6> views{{{DesktopAction::view_designer, "designer", "Designer"},
                                          {DesktopAction::view_front, "front", "Front"},
                                          {DesktopAction::view_top, "top", "Top"},
                                          {DesktopAction::view_side, "side", "Side"},
                                          {DesktopAction::frame_all, "all", "All"},
                                          {DesktopAction::frame_selected, "selected", "Selected"}}};

void draw_surfaces(PanelParts& parts, ViewChoices& choices) {
  heading(parts, "Surfaces");
  for (const NamedChoice<Shading>& shading : shadings()) {
    const bool chosen = choices.shading == shading.choice;
    if (choice_row(parts, "shading:" + std::string(shading.name), shading.words,
                   chosen ? Chosen::yes : Chosen::no)) {
      choices.shading = shading.choice;
    }
    if (!chosen || shading.choice != Shading::curvature) continue;
    ImGui::Indent(1.2F * parts.em);
    for (const NamedChoice<CurvatureKind>& kind : curvature_kinds()) {
      const bool taken = choices.curvature == kind.choice;
      if (choice_row(parts, "curvature:" + std::string(kind.name), kind.words,
                     taken ? Chosen::yes : Chosen::no)) {
        choices.curvature = kind.choice;
      }
    }
    ImGui::Unindent(1.2F * parts.em);
  }
}

void draw_lines(PanelParts& parts, ViewChoices& choices) {
  heading(parts, "Lines over surfaces");
  const auto line = [&parts](const char* name, std::string_view label, bool& on) {
    if (toggle(parts, name, label, on)) on = !on;
  };
  line("overlay:net", "Control net", choices.overlays.control_nets);
  line("overlay:wires", "Triangles", choices.overlays.wires);
  line("overlay:isophotes", "Lines of equal light", choices.overlays.isophotes);
  line("distances", "Distance to references", choices.distances);
}

void draw_from_where(PanelParts& parts, ViewChoices& choices) {
  heading(parts, "Look from");
  constexpr int columns = 3;
  const float width = tile_width(columns);
  int column = 0;
  for (const ViewWords& view : views) {
    if (column++ % columns != 0) ImGui::SameLine();
    if (text_button(parts, "look:" + std::string(view.name), view.label, ButtonLook::plain, width))
      parts.act(view.action);
  }
  if (toggle(parts, "head", "Follow the tracked head", choices.follow_head))
    choices.follow_head = !choices.follow_head;
  small_words(parts, choices.display, parts.theme.faint_ink);
}

void draw_work_plane(PanelParts& parts) {
  const DesktopState& desktop = parts.facts.desktop;
  heading(parts, "Work plane");
  const std::string watching = parts.contents.can_edit ? "" : "You are watching";
  const float width = tile_width(2);
  const std::string label = "Turn: " + std::string(desktop.plane_words);
  if (text_button(parts, "plane-next", label, ButtonLook::plain, width, watching))
    parts.act(DesktopAction::next_plane);
  ImGui::SameLine();
  if (text_button(parts, "plane-here", "Put it here", ButtonLook::plain, width, watching))
    parts.act(DesktopAction::plane_here);
  if (toggle(parts, "stick", "Lie on shapes", desktop.sticks)) parts.act(DesktopAction::toggle_stick);
  if (toggle(parts, "snap", "Catch points and ends", desktop.snaps)) parts.act(DesktopAction::toggle_snap);
  if (toggle(parts, "along", "Drag along the normal", desktop.along_normal))
    parts.act(DesktopAction::toggle_along);
  if (!desktop.cursor_words.empty()) small_words(parts, desktop.cursor_words, parts.theme.faint_ink);
}

}  // namespace

void draw_view_page(PanelParts& parts) {
  ViewChoices choices = parts.facts.view;
  draw_surfaces(parts, choices);
  gap(parts, 0.4F);
  draw_lines(parts, choices);
  gap(parts, 0.4F);
  draw_from_where(parts, choices);
  gap(parts, 0.4F);
  draw_work_plane(parts);
  if (!(choices == parts.facts.view)) parts.ask(ChangeView{choices});
}

}  // namespace handloft::client
