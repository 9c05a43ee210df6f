#pragma once
// What the panels say (V7), as values: made of the newest state of everything, without any graphics, so that
// it is tested without them. The panels draw it and answer with requests (panel_requests.h).

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client-hmd/desktop/desktop_state.h"
#include "client-hmd/hud/history_trail.h"
#include "client-hmd/hud/view_choices.h"
#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/render/colours.h"
#include "client-hmd/view/tracking_feed.h"

namespace handloft::client {

/// All that panels are told of; references outlive the call.
struct PanelFacts {
  const ModelState& model;
  const TrackingStatus& tracking;
  bool tracking_wanted = false;
  std::optional<Duration> lag;     ///< As model_lag().
  double latency_ms = 0.0;         ///< Capture to client, median; 0: unknown.
  double frames_per_second = 0.0;  ///< 0: unknown.
  DesktopState desktop;
  ViewChoices view;
  ColourScheme colours = ColourScheme::normal;
  std::span<const KeyHelp> keys;
};

enum class Tone { plain, good, caution, bad };

/// A sign, so that the tone is not told by colour alone, and words.
struct StateWords {
  std::string_view sign;
  std::string words;
  Tone tone = Tone::plain;
};

struct Person {
  std::string name;
  std::uint32_t colour = 0;  ///< sRGB
  std::string doing;         ///< "laying points"; empty: nothing.
  std::string role = {};     ///< "editor"; empty: not told.
};

struct CommandButton {
  PaletteCommand command = PaletteCommand::fit;
  std::string_view label;
  std::string_view sign;
  std::string shortcut;
  std::string reason;  ///< Why not now, in words; empty: it can be done.
};

struct CommandSection {
  std::string_view title;
  std::vector<CommandButton> buttons;
};

struct ShapeRow {
  std::string id;
  std::string name;
  std::string_view sign;
  std::string_view kind;  ///< "shape", "reference", "sculpted surface", "CAD model"
  std::string details;    ///< "1,204 points · RMS 0.31 mm"
  std::string by;         ///< Who changes it just now; empty: nobody.
  Representation representation = Representation::points;
  bool representable = false;  ///< Has points and a surface to choose from.
  bool selectable = false;     ///< Gestures can act on it.
  bool selected = false;
  bool target = false;
};

/// Comments that begin a thread, with what was answered (U6).
struct CommentRow {
  std::string id;
  int number = 0;  ///< Of its pin in the picture; 0: resolved.
  std::string text;
  std::string about;  ///< "Ann on seat"
  std::uint32_t colour = 0;
  bool resolved = false;
  std::vector<std::string> replies;  ///< "Bo: yes"
};

struct Gauge {
  std::string_view label;
  double value = 0.0;   ///< 0..1
  std::string words;    ///< "62 %"
  bool active = false;  ///< Pressing.
};

struct PanelContents {
  std::vector<StateWords> states;   ///< Of model, tracking and hand, the most important first.
  std::vector<StateWords> figures;  ///< Lag, latency, frames, revision.
  std::vector<Person> people;       ///< Others who are here.
  std::string_view tool_words;
  std::string_view hint;
  std::optional<Gauge> pressure, range;
  std::string gesture;  ///< Of a tracked hand; empty: there is none.
  std::string drawing;  ///< What a pointing hand draws; empty: not told.
  bool symmetry = false;
  std::vector<CommandSection> sections;
  std::vector<ShapeRow> shapes;
  Alternatives alternatives;
  HistoryRows history;
  bool has_scene = false;
  std::vector<CommentRow> comments;  ///< Open ones first, in the order of making.
  std::vector<NamedVersion> versions;
  std::optional<VersionDifference> difference;  ///< The last that was asked for.
  bool is_owner = false;                        ///< May delete versions.
  bool can_edit = false;                        ///< Joined as an editor, and connected.
  bool can_comment = false;                     ///< The same, or as a commenter.
};

PanelContents panel_contents(const PanelFacts& facts, const HistoryTrail& trail);

/// Why a command cannot be given now; empty: it can.
std::string why_not(PaletteCommand command, const PanelFacts& facts);

/// The section that a command's button is in, by its title; empty for "More", which only turns the table's
/// page.
std::string_view section_of(PaletteCommand command);

/// What a command does, in one sentence, for the help and for tips.
std::string_view command_help(PaletteCommand command);

}  // namespace handloft::client
