#include <fmt/core.h>

#include "client-hmd/desktop/desktop.h"
#include "client-hmd/desktop/tool_words.h"

namespace handloft::client {

void Desktop::on_frame(TimePoint now, const DesktopWorld& world) {
  const Eye eye = world.camera.eye(world.size.width_px, world.size.height_px);
  const bool looks = options_.hand && pointer_inside_ && world.camera_moves && !taken_.pointer;
  if (!work_) {
    cursor_.reset();
    if (looks && holding_ == Holding::nothing)
      cursor_ = find_cursor(cursor_settings_, tool_, picker_, world.scene, eye, pointer_px_);
    if (cursor_ && connection_.connected) {
      stream_.hover(now, cursor_->at, touch());
    } else if (connection_.connected && holding_ == Holding::nothing) {
      stream_.leave(now);
    }
  }
  if (connection_.connected) stream_.flush(now);
  tell(now, world);
}

void Desktop::tell(TimePoint now, const DesktopWorld& world) {
  const Eye eye = world.camera.eye(world.size.width_px, world.size.height_px);
  if (refusal_until_ && now >= *refusal_until_) {
    refusal_until_.reset();
    state_.refusal.clear();
  }
  if (note_until_ && now >= *note_until_) {
    note_until_.reset();
    state_.note.clear();
  }
  state_.available = options_.hand && connection_.connected;
  state_.tool = tool_;
  state_.working = work_.has_value() || stream_.pen_in_hand();
  state_.pressure = pressure();
  state_.pressure_from_pen = pen_pressure_ > 0.0;
  state_.range = potentiometer();
  const bool icon = work_ ? work_->holds_icon() : cursor_ && cursor_->over && !cursor_->over->icon.empty();
  state_.range_words = tool_ == DesktopTool::move           ? "size"
                       : tool_ == DesktopTool::push && icon ? "bend"
                                                            : "range";
  state_.tool_words = words_of(tool_);
  state_.hint = corner_picked_ ? "Click the region's other corner." : hint_of(tool_, icon);
  state_.disk_radius_m = tool_ == DesktopTool::push && !icon ? disk_radius_m(state_.pressure) : 0.0;
  state_.plane = cursor_settings_.plane;
  state_.plane_words = words_of(cursor_settings_.plane);
  const WorkPlane plane =
      work_ ? work_->plane() : work_plane(cursor_settings_.plane, cursor_settings_.anchor, eye);
  state_.plane_origin = plane.origin;
  state_.plane_normal = plane.normal;
  // Also without anything under the pointer it is told what would be with something.
  Picked fitted;
  state_.sticks =
      sticks_to(cursor_settings_, tool_, cursor_ && cursor_->over ? cursor_->over : std::optional(fitted));
  state_.snaps = cursor_settings_.snaps;
  state_.along_normal = along_normal();
  state_.cursor = work_ ? std::optional(work_->at()) : cursor_ ? std::optional(cursor_->at) : std::nullopt;
  state_.cursor_normal = work_ ? work_->axis() : cursor_ ? cursor_->normal : plane.normal;
  state_.cursor_words.clear();
  if (state_.cursor) {
    const glm::dvec3 mm = *state_.cursor * 1e3;
    state_.cursor_words = fmt::format("x {:.1f}  y {:.1f}  z {:.1f} mm", mm.x, mm.y, mm.z);
  }
  state_.over = cursor_ && cursor_->over ? cursor_->over->name : "";
  state_.on_shape = cursor_ && cursor_->on_shape;
  state_.snapped = cursor_ && cursor_->snapped;
}

}  // namespace handloft::client
