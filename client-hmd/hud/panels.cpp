#include "client-hmd/hud/panels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "client-hmd/hud/panel_parts.h"

namespace handloft::client {
namespace {

/// The handle of a folded column.
void draw_handle(PanelParts& parts, Side side) {
  const bool left = side == Side::left;
  const char* name = left ? "left-handle" : "right-handle";
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0.0F, 0.0F));
  const PixelRect& place = left ? parts.layout.left : parts.layout.right;
  begin_panel(parts, name, place, Scrolling::none);
  const bool pressed = ImGui::InvisibleButton(name, {place.size.x, place.size.y});
  note_place(parts, left ? "open:left" : "open:right");
  const ImVec2 c{place.middle().x, place.middle().y};
  const float r = 0.32F * parts.em * (left ? 1.0F : -1.0F);
  const ImU32 ink = colour(ImGui::IsItemHovered() ? parts.theme.accent : parts.theme.ink);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddLine({c.x - 0.5F * r, c.y - std::abs(r)}, {c.x + 0.5F * r, c.y}, ink, 0.14F * parts.em);
  list.AddLine({c.x + 0.5F * r, c.y}, {c.x - 0.5F * r, c.y + std::abs(r)}, ink, 0.14F * parts.em);
  tip(parts, left ? "Tools and commands" : "Scene, view, settings, help", {}, {});
  end_panel(parts, name);
  ImGui::PopStyleVar();
  if (!pressed) return;
  (left ? parts.memory.settings.left_open : parts.memory.settings.right_open) = true;
  parts.memory.preferred = side;
  parts.settings_changed();
}

void draw_right(PanelParts& parts) {
  begin_panel(parts, "right", parts.layout.right, Scrolling::vertical);
  if (parts.memory.page != PanelPage::help) draw_fold(parts, Side::right);
  switch (parts.memory.page) {
    case PanelPage::scene:
      draw_scene_page(parts);
      break;
    case PanelPage::view:
      draw_view_page(parts);
      break;
    case PanelPage::settings:
      draw_settings_page(parts);
      break;
    case PanelPage::help:
      draw_help_page(parts);
      break;
  }
  end_panel(parts, "right");
}

}  // namespace

/// The small cross at the upper corner of an open column that folds it away.
void draw_fold(PanelParts& parts, Side side) {
  const bool left = side == Side::left;
  const float size = 1.5F * parts.em;
  const ImVec2 before = ImGui::GetCursorPos();
  const float right = ImGui::GetWindowContentRegionMax().x;
  ImGui::SetCursorPos({right - size, before.y - 0.25F * parts.em});
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const std::string name = left ? "fold:left" : "fold:right";
  const bool pressed = ImGui::InvisibleButton(name.c_str(), {size, size});
  note_place(parts, name);
  const bool hovered = ImGui::IsItemHovered();
  const ImVec2 c{from.x + 0.5F * size, from.y + 0.5F * size};
  ImDrawList& list = *ImGui::GetWindowDrawList();
  if (hovered) list.AddCircleFilled(c, 0.5F * size, colour(parts.theme.hovered), 24);
  const float r = 0.26F * parts.em * (left ? -1.0F : 1.0F);
  const ImU32 ink = colour(parts.theme.faint_ink);
  list.AddLine({c.x - 0.5F * r, c.y - std::abs(r)}, {c.x + 0.5F * r, c.y}, ink, 0.13F * parts.em);
  list.AddLine({c.x + 0.5F * r, c.y}, {c.x - 0.5F * r, c.y + std::abs(r)}, ink, 0.13F * parts.em);
  tip(parts, "Fold away", {}, {});
  ImGui::SetCursorPos(before);
  if (!pressed) return;
  (left ? parts.memory.settings.left_open : parts.memory.settings.right_open) = false;
  parts.settings_changed();
}

struct Panels::Implementation {
  std::unique_ptr<Gui> gui;
  PanelMemory memory;
  HistoryTrail trail;
  PanelLayout layout;
  std::map<std::string, PixelRect, std::less<>> places;
  std::vector<PixelRect> covered;     ///< In the frame before.
  std::vector<PanelRequest> waiting;  ///< From outside of draw().
  std::optional<TimePoint> drawn_at;
  std::array<bool, 3> captured{};   ///< Buttons that went down over a panel.
  std::array<bool, 3> elsewhere{};  ///< Buttons that went down over the work.
  glm::dvec2 pointer{-1.0};
  bool keyboard = false;  ///< Keys work the panels (F6).

  bool covers(const glm::dvec2& at) const {
    return std::any_of(covered.begin(), covered.end(),
                       [&at](const PixelRect& rect) { return rect.contains(glm::vec2(at)); });
  }
  bool handle_key(const InputEvent& event, const KeyChanged& key);
  bool handle(const InputEvent& event);
  void draw_all(PanelParts& parts);
  void note_covered();
  void set_keyboard(bool on) {
    keyboard = on;
    gui->navigate_by_keys(on);
  }
};

bool Panels::Implementation::handle_key(const InputEvent& event, const KeyChanged& key) {
  const bool text = gui->takes_text();
  if (key.key == "F1" || key.key == "F6") {
    if (key.down && !key.repeat) {
      if (key.key == "F1") {
        const bool open = memory.page == PanelPage::help && layout.right_open;
        memory.page = PanelPage::help;
        memory.preferred = Side::right;
        memory.settings.right_open = !open;
        waiting.emplace_back(ChangeSettings{memory.settings});
      } else {
        set_keyboard(!keyboard);
      }
    }
    return true;
  }
  if (key.key == "Escape" && keyboard && !text) {
    if (key.down) set_keyboard(false);
    return true;
  }
  // Releases go to both: nobody may believe that a key is still held.
  if (text || keyboard || !key.down) gui->add(event);
  return (text || keyboard) && key.down;
}

bool Panels::Implementation::handle(const InputEvent& event) {
  if (const auto* key = std::get_if<KeyChanged>(&event.what)) return handle_key(event, *key);
  if (const auto* button = std::get_if<ButtonChanged>(&event.what)) {
    const auto index = static_cast<std::size_t>(button->button);
    pointer = button->at_px;
    if (button->down) {
      const bool ours = covers(button->at_px);
      (ours ? captured : elsewhere)[index] = true;
      // A press over the work takes the keyboard away from fields of text.
      gui->add(event);
      return ours;
    }
    gui->add(event);
    const bool ours = captured[index];
    captured[index] = elsewhere[index] = false;
    return ours;
  }
  if (const auto* moved = std::get_if<PointerMoved>(&event.what)) {
    pointer = moved->at_px;
    gui->add(event);
    const auto any = [](const std::array<bool, 3>& buttons) {
      return std::any_of(buttons.begin(), buttons.end(), [](bool down) { return down; });
    };
    if (any(elsewhere)) return false;
    return any(captured) || covers(moved->at_px);
  }
  if (std::holds_alternative<WheelTurned>(event.what)) {
    if (!covers(pointer)) return false;
    gui->add(event);
    return true;
  }
  if (std::holds_alternative<FocusLost>(event.what)) {
    captured = {};
    elsewhere = {};
    gui->add(event);
  }
  return false;
}

void Panels::Implementation::draw_all(PanelParts& parts) {
  draw_bar(parts);
  if (layout.left_open) {
    draw_tools(parts);
  } else {
    draw_handle(parts, Side::left);
  }
  if (layout.right_open) {
    draw_right(parts);
  } else {
    draw_handle(parts, Side::right);
  }
  draw_tour(parts);
  draw_notices(parts);
}

void Panels::Implementation::note_covered() {
  covered.clear();
  for (const auto& [name, place] : places) {
    if (name.starts_with("panel:") || name.starts_with("notice:") || name == "card:tour")
      covered.push_back(place);
  }
}

Panels::Panels(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
Panels::~Panels() = default;

Result<std::unique_ptr<Panels>> Panels::create(const HudSettings& settings) {
  Result<std::unique_ptr<Gui>> gui = Gui::create();
  if (!gui) return gui.error();
  auto parts = std::make_unique<Implementation>();
  parts->gui = std::move(*gui);
  parts->memory.settings = settings;
  parts->memory.tour = Tour(settings);
  return std::unique_ptr<Panels>(new Panels(std::move(parts)));
}

bool Panels::handle(const InputEvent& event) {
  return implementation_->handle(event);
}

void Panels::tell(NoticeKind kind, std::string words, TimePoint now) {
  implementation_->memory.notices.tell(kind, std::move(words), now);
}

void Panels::tell_export(std::string words, TimePoint now) {
  ++implementation_->memory.exports;
  tell(NoticeKind::done, std::move(words), now);
}

Result<std::vector<PanelRequest>> Panels::draw(const PanelFacts& facts, const PanelFrame& frame) {
  Implementation& own = *implementation_;
  PanelMemory& memory = own.memory;
  own.trail.follow(*facts.model.scene);
  std::vector<PanelRequest> requests = std::exchange(own.waiting, {});
  if (facts.model.snapshots > 0 && facts.model.connected && facts.desktop.available) {
    const int before = memory.tour.step_number();
    const Tour::State was = memory.tour.state();
    memory.tour.look(tour_sight(*facts.model.scene, memory.exports));
    if (memory.tour.step_number() != before ||
        (was == Tour::State::running) != (memory.tour.state() == was)) {
      memory.tour.remember(memory.settings);
      requests.emplace_back(ChangeSettings{memory.settings});
    }
  }
  if (memory.seeker.step(*facts.model.scene, frame.now)) {
    requests.emplace_back(DesktopCommand{DesktopAction::command, PaletteCommand::select_next, {}});
  }

  const float text_px = panel_text_px(frame.height_px, frame.content_scale, memory.settings.text_percent);
  own.layout = panel_layout({frame.width_px, frame.height_px, text_px, memory.settings.left_open,
                             memory.settings.right_open, memory.preferred});
  const Theme& colours = theme(memory.settings.colours);
  const double seconds = own.drawn_at ? to_seconds(frame.now - *own.drawn_at) : 1.0 / 60.0;
  own.drawn_at = frame.now;
  if (const Status begun = own.gui->begin({frame.width_px, frame.height_px, text_px, seconds}, colours);
      !begun) {
    return begun.error();
  }
  own.places.clear();
  PanelFacts told = facts;
  told.colours = memory.settings.colours;
  const PanelContents contents = panel_contents(told, own.trail);
  PanelParts parts{*own.gui,   colours,   text_px, told,     contents,
                   own.layout, frame.now, memory,  requests, own.places};
  own.draw_all(parts);
  own.gui->end(frame.target);
  own.note_covered();
  return requests;
}

bool Panels::has_more_input() const {
  return implementation_->gui->has_more_input();
}

const HudSettings& Panels::settings() const {
  return implementation_->memory.settings;
}

const Tour& Panels::tour() const {
  return implementation_->memory.tour;
}

const PanelLayout& Panels::layout() const {
  return implementation_->layout;
}

PanelPage Panels::page() const {
  return implementation_->memory.page;
}

void Panels::open(PanelPage page) {
  implementation_->memory.page = page;
  implementation_->memory.preferred = Side::right;
  implementation_->memory.settings.right_open = true;
}

void Panels::repeat_tour() {
  implementation_->memory.tour.repeat();
}

std::optional<PixelRect> Panels::place_of(std::string_view widget) const {
  const auto found = implementation_->places.find(widget);
  return found == implementation_->places.end() ? std::nullopt : std::optional(found->second);
}

bool Panels::covers(const glm::dvec2& at_px) const {
  return implementation_->covers(at_px);
}

}  // namespace handloft::client
