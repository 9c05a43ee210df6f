#pragma once
// Where the 3D cursor is (V6): on what is under the pointer, else on the work plane. Metres, world frame.

#include <array>
#include <optional>

#include "client-hmd/desktop/desktop_state.h"
#include "client-hmd/desktop/picker.h"
#include "client-hmd/desktop/work_plane.h"

namespace handloft::client {

/// Tools' own settings, one each.
template <typename T>
using PerTool = std::array<T, desktop_tools>;

template <typename T>
T& of_tool(PerTool<T>& settings, DesktopTool tool) {
  return settings[static_cast<std::size_t>(tool)];
}
template <typename T>
const T& of_tool(const PerTool<T>& settings, DesktopTool tool) {
  return settings[static_cast<std::size_t>(tool)];
}

struct CursorSettings {
  PlaneKind plane = PlaneKind::table;
  glm::dvec3 anchor{0.0, 0.0, 0.05};  ///< What the work plane passes through: a hand's height over the table.
  /// nullopt: as is best for the tool: points are laid in the air, the rest works on shapes; a profile is
  /// drawn through a fitted shape, not on it, for there it would change nothing.
  PerTool<std::optional<bool>> sticks{};
  bool snaps = false;
};

struct Cursor {
  glm::dvec3 at{0.0};
  glm::dvec3 normal{0.0, 0.0, 1.0};  ///< Of what it lies on, towards the viewer; unit.
  std::optional<Picked> over;        ///< What is under the pointer, also where it does not lie on it.
  bool snapped = false;              ///< To a point, a curve's end or an icon.
  bool on_shape = false;             ///< Else on the work plane.
};

/// Whether the tool's cursor lies on `over`.
bool sticks_to(const CursorSettings& settings, DesktopTool tool, const std::optional<Picked>& over);

/// nullopt: the pointer's ray meets nothing, not even a plane parallel to the screen.
std::optional<Cursor> find_cursor(const CursorSettings& settings, DesktopTool tool, Picker& picker,
                                  const Scene& scene, const Eye& eye, const glm::dvec2& at_px);

/// On the plane, or where the ray hardly meets it on the one parallel to the screen through its origin.
std::optional<glm::dvec3> on_plane(const WorkPlane& plane, const Eye& eye, const glm::dvec2& at_px);

}  // namespace handloft::client
