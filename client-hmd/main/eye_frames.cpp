#include "client-hmd/main/eye_frames.h"

#include "client-hmd/view/late_turn.h"

namespace handloft::client {

Frame frame_of_eye(const Frame& middle, const EyeOptics& optics, const EyeFrameOptions& options) {
  Frame frame = middle;
  const RigidPose head = middle.head ? middle.head->world_from_head : middle.eye.world_from_eye;
  frame.eye.world_from_eye = compose(head, optics.head_from_eye);
  frame.margin_px = middle.head ? margin_for_turn(optics.shown, options.largest_turn_rad) : 0;
  frame.eye.pinhole = widened(optics.shown, frame.margin_px);
  if (frame.film) {
    const RigidPose& camera = middle.eye.world_from_eye;
    frame.film->camera_from_eye =
        glm::mat3(film_seen_from(frame.eye.world_from_eye, camera, options.film_depth_m));
  }
  const glm::vec2 corner(
      overlay_corner(optics, options.overlay_width_px, options.overlay_height_px, options.overlay_depth_m));
  for (OverlayPanel& panel : frame.overlay.panels) panel.position += corner;
  for (OverlayText& text : frame.overlay.texts) text.position += corner;
  return frame;
}

}  // namespace handloft::client
