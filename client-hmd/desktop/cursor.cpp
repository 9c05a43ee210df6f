#include "client-hmd/desktop/cursor.h"

namespace handloft::client {

bool sticks_to(const CursorSettings& settings, DesktopTool tool, const std::optional<Picked>& over) {
  if (!over) return false;
  if (const auto& wanted = of_tool(settings.sticks, tool)) return *wanted;
  switch (tool) {
    case DesktopTool::lay:
      return false;
    case DesktopTool::draw:
      return over->kind == EntityKind::sculpt_surface;
    case DesktopTool::push:
    case DesktopTool::trim:
    case DesktopTool::move:
    case DesktopTool::region:
      break;
  }
  return true;
}

std::optional<glm::dvec3> on_plane(const WorkPlane& plane, const Eye& eye, const glm::dvec2& at_px) {
  const Ray ray = ray_through(eye, at_px);
  if (const auto at = meet(ray, plane)) return at;
  return meet(ray, work_plane(PlaneKind::screen, plane.origin, eye));
}

std::optional<Cursor> find_cursor(const CursorSettings& settings, DesktopTool tool, Picker& picker,
                                  const Scene& scene, const Eye& eye, const glm::dvec2& at_px) {
  Cursor cursor;
  cursor.over = picker.pick(scene, eye, at_px);
  if (tool == DesktopTool::push) {
    if (auto icon = picker.pick_icon(scene, eye, at_px)) {
      cursor.at = icon->at;
      cursor.normal = icon->normal;
      cursor.over = std::move(icon);
      cursor.snapped = cursor.on_shape = true;
      return cursor;
    }
  }
  if (settings.snaps) {
    if (auto point = picker.snap(scene, eye, at_px)) {
      cursor.at = point->at;
      cursor.normal = cursor.over ? cursor.over->normal : point->normal;
      cursor.over = std::move(point);
      cursor.snapped = cursor.on_shape = true;
      return cursor;
    }
  }
  if (sticks_to(settings, tool, cursor.over)) {
    cursor.at = cursor.over->at;
    cursor.normal = cursor.over->normal;
    cursor.on_shape = true;
    return cursor;
  }
  const WorkPlane plane = work_plane(settings.plane, settings.anchor, eye);
  const auto at = on_plane(plane, eye, at_px);
  if (!at) return std::nullopt;
  cursor.at = *at;
  cursor.normal = plane.normal;
  return cursor;
}

}  // namespace handloft::client
