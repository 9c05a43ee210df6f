#pragma once
// How a finished picture is shown: where, turned how far to the display time (V1), and through which lens
// (V4). Kept apart from the frame, because the turn is known only just before it is used.

#include <glm/glm.hpp>
#include <memory>

#include "client-hmd/render/frame.h"
#include "client-hmd/view/lens_mesh.h"

namespace handloft::client {

/// Which of a frame's pictures; a picture stays until another is drawn into its slot.
enum class PictureSlot { only = 0, left = 0, right = 1 };

struct Presentation {
  PixelArea area;  ///< Of the canvas, origin top left.
  int canvas_height_px = 1;
  /// Undistorted, without margin: without a lens of the area's size, and the overlay is laid out for it.
  Pinhole shown;
  glm::dmat3 drawn_from_shown{1.0};      ///< Homogeneous: pixel of the drawn picture from pixel of `shown`.
  std::shared_ptr<const LensMesh> lens;  ///< Null: shown as it is.
};

/// Without a turn.
Presentation whole_picture(const Frame& frame);

/// `drawn_from_shown` of a picture that was drawn with `margin_px`, for a head that has turned by `turn`
/// (world axes) since.
glm::dmat3 turned_to(const Frame& frame, const glm::dquat& turn);

}  // namespace handloft::client
