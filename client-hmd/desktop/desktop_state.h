#pragma once
// What mouse, keyboard and pen are at, for whoever shows it (V7), and what buttons on the screen may ask for:
// the link between the desktop's hand and the panels.

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/table_palette.h"

namespace handloft::client {

/// What the left button does: the glove's gestures (A25).
enum class DesktopTool {
  lay,     ///< An open hand, pressing: lays points.
  push,    ///< A closed hand: pushes points; near an icon, drags it.
  draw,    ///< Pointing, pressing: profiles; on a sculpted surface icons.
  trim,    ///< Pointing, pressing, in the mode of boundaries: a closed curve.
  move,    ///< A closed hand with "Move" on: takes a whole shape along.
  region,  ///< Pointing on a sculpted surface: two corners of a region.
};
inline constexpr std::size_t desktop_tools = 6;

/// The work plane's directions. All pass through its anchor.
enum class PlaneKind {
  table,   ///< Level.
  front,   ///< Upright, facing the designer: normal along y.
  side,    ///< Upright, normal along x.
  screen,  ///< Parallel to the screen.
};

/// Everything that keys and buttons may ask for besides the pointer's own work.
enum class DesktopAction {
  // Tools, in the order of DesktopTool.
  tool_lay,
  tool_push,
  tool_draw,
  tool_trim,
  tool_move,
  tool_region,
  // The hand.
  pressure_up,
  pressure_down,
  range_up,
  range_down,
  turn_left,  ///< About the direction of its drag, or the work plane's normal.
  turn_right,
  lean_left,  ///< About the view's axes.
  lean_right,
  lean_up,
  lean_down,
  tap_thumb,  ///< Divides the stroke that is being drawn (A21).
  cancel,     ///< Takes back what is in the air.
  // The cursor.
  next_plane,
  plane_here,  ///< The work plane passes through what is under the pointer.
  plane_nearer,
  plane_farther,
  toggle_stick,  ///< The cursor lies on what is under the pointer.
  toggle_snap,   ///< It catches points and ends of curves.
  toggle_along,  ///< Drags go along the normal.
  // The view.
  view_designer,
  view_front,
  view_top,
  view_side,
  frame_all,
  frame_selected,
  toggle_head,
  toggle_distances,
  toggle_zebra,
  next_light,  ///< Studio, clay, car paint, ..., the curvature's colours.
  next_lines,  ///< Wires, control net, isophotes over surfaces.
  save_picture,
  toggle_help,
  close,
  // The model.
  command,    ///< DesktopCommand::command.
  export_to,  ///< DesktopCommand::path.
};

/// One request, from a key or a button of a panel.
struct DesktopCommand {
  DesktopAction action = DesktopAction::cancel;
  PaletteCommand command = PaletteCommand::fit;  ///< With DesktopAction::command.
  std::string path;                              ///< With DesktopAction::export_to, as the server sees it.
};

/// A line of the help: which keys do what.
struct KeyHelp {
  std::string_view keys;
  std::string_view words;
};

struct DesktopState {
  bool available = false;  ///< There is a hand: joined as an editor, and the model server is there.
  DesktopTool tool = DesktopTool::lay;
  std::string_view tool_words;  ///< "Lay points"
  std::string_view hint;        ///< What the pointer does with it, one sentence.
  bool working = false;         ///< A gesture is in the air.
  double pressure = 0.5;        ///< 0..1, as it is or would be now (A1).
  bool pressure_from_pen = false;
  double range = 0.3;            ///< 0..1: of pushes (A16), of a curve's bend, or a moved shape's size.
  std::string_view range_words;  ///< "range", "bend", "size"
  double disk_radius_m = 0.0;    ///< With the tool that pushes: as its disk would be (A13).
  PlaneKind plane = PlaneKind::table;
  std::string_view plane_words;  ///< "level", "front", ...
  glm::dvec3 plane_origin{0.0};  ///< Where it is drawn: under the cursor or about the anchor.
  glm::dvec3 plane_normal{0.0, 0.0, 1.0};
  bool sticks = false;  ///< Of this tool.
  bool snaps = false;
  bool along_normal = false;                ///< Of this tool's drags.
  std::optional<glm::dvec3> cursor;         ///< World, metres; nullopt: the pointer is elsewhere.
  glm::dvec3 cursor_normal{0.0, 0.0, 1.0};  ///< Unit: of what it lies on.
  std::string cursor_words;                 ///< "x -12.0  y 40.5  z 50.0 mm"
  std::string over;                         ///< Name of the shape under the pointer; empty: none.
  bool on_shape = false;                    ///< The cursor lies on it; else on the work plane.
  bool snapped = false;                     ///< To a point, a curve's end or an icon.
  std::uint64_t refusals = 0;               ///< So many so far.
  std::string refusal;                      ///< The last thing that was refused, in words, for some seconds.
  /// What became of the last thing that was done, where there is more to tell: the file of an export.
  std::string note;
};

}  // namespace handloft::client
