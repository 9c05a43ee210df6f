#pragma once
// What the files of the panels share: the state of one frame, and the widgets that all panels are made of.
// Widgets note where they are under a name, for tests and for whoever points at them.

#include <imgui.h>

#include <initializer_list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client-hmd/hud/gui.h"
#include "client-hmd/hud/panels.h"
#include "client-hmd/hud/selection_seeker.h"

namespace handloft::client {

/// What lasts from frame to frame.
struct PanelMemory {
  HudSettings settings;
  Tour tour{HudSettings{}};
  Notices notices;
  std::uint64_t exports = 0;  ///< Files written since the start.
  SelectionSeeker seeker;
  PanelPage page = PanelPage::scene;
  Side preferred = Side::left;
  std::string search;    ///< Of the help.
  std::string renaming;  ///< Id of the shape whose name is being typed; empty: none.
  std::string name;      ///< As typed so far.
  bool name_focused = false;
  std::string comment;   ///< As typed so far.
  std::string replying;  ///< Id of the comment that is being answered; empty: none.
  std::string reply;
  std::string version;           ///< As typed so far.
  std::string opened_version;    ///< Whose buttons are shown; empty: none's.
  std::string compared_version;  ///< Whose difference is shown; empty: none's.
  std::map<std::string, bool> open_sections;
  std::map<std::string, float> heights;  ///< That panels would fill, as of the frame before.
};

/// One frame of panels.
struct PanelParts {
  Gui& gui;
  const Theme& theme;
  float em;  ///< Height of the text in pixels.
  const PanelFacts& facts;
  const PanelContents& contents;
  const PanelLayout& layout;
  TimePoint now;
  PanelMemory& memory;
  std::vector<PanelRequest>& requests;
  std::map<std::string, PixelRect, std::less<>>& places;

  void ask(PanelRequest&& request);
  void give(PaletteCommand command) { ask(DesktopCommand{DesktopAction::command, command, {}}); }
  void act(DesktopAction action) { ask(DesktopCommand{action, {}, {}}); }
  void settings_changed() { ask(ChangeSettings{memory.settings}); }
};

ImU32 colour(std::uint32_t srgb, float opacity = 1.0F);
std::uint32_t tone_ink(const Theme& theme, Tone tone);

/// A panel in `place` that casts a soft shadow; one that scrolls is no higher than what it holds.
enum class Scrolling { none, vertical };
void begin_panel(PanelParts& parts, const char* name, const PixelRect& place, Scrolling scrolling);
void end_panel(PanelParts& parts, const char* name);

/// Notes the last item's place.
void note_place(PanelParts& parts, std::string name);

void heading(PanelParts& parts, std::string_view words);
void words(PanelParts& parts, std::string_view text, std::uint32_t ink);        ///< Wrapped.
void small_words(PanelParts& parts, std::string_view text, std::uint32_t ink);  ///< Wrapped.
void gap(const PanelParts& parts, float lines);

/// A button as the table's palette has them: a sign over a label. Empty `reason`: can be pressed.
struct TileWords {
  std::string_view sign, label;
  std::string shortcut, help, reason;
};
enum class Chosen { no, yes };
bool tile(PanelParts& parts, const std::string& name, const TileWords& tile_words, Chosen chosen,
          ImVec2 size);
/// Width of a tile when `columns` of them share a row of the panel.
float tile_width(int columns);

enum class ButtonLook { plain, primary };
bool text_button(PanelParts& parts, const std::string& name, std::string_view label, ButtonLook look,
                 float width = 0.0F, const std::string& reason = {});
/// A row of choices of which one is taken; the new one, when another was pressed.
std::optional<std::size_t> segments(PanelParts& parts, const std::string& name,
                                    std::span<const std::string_view> labels, std::size_t chosen);
/// A line with a switch at its end. True: it was pressed.
bool toggle(PanelParts& parts, const std::string& name, std::string_view label, bool on);
/// A line of a list, with a mark before it when it is chosen. True: it was pressed.
bool choice_row(PanelParts& parts, const std::string& name, std::string_view label, Chosen chosen);
void gauge_row(PanelParts& parts, const Gauge& gauge);
/// A field of one line; true while its text changes.
bool text_field(PanelParts& parts, const std::string& name, const char* hint, std::string& text);
/// Help beside whatever the pointer rests on, after a moment.
void tip(PanelParts& parts, std::string_view title, std::string_view help, const std::string& reason);

// Each in a file of its own.
void draw_bar(PanelParts& parts);
void draw_tools(PanelParts& parts);
/// The corner's mark that folds a column away; within its panel, before anything else.
void draw_fold(PanelParts& parts, Side side);
void draw_scene_page(PanelParts& parts);
void draw_comments(PanelParts& parts);
void draw_versions(PanelParts& parts);
void draw_view_page(PanelParts& parts);
void draw_settings_page(PanelParts& parts);
void draw_help_page(PanelParts& parts);
void draw_tour(PanelParts& parts);
void draw_notices(PanelParts& parts);

}  // namespace handloft::client
