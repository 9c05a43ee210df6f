#pragma once
// Where pictures go, and how many views a frame has (V4): a window with one view, a headset's screen with one
// for each eye, or nothing but memory. A backend for OpenXR would be a further implementation of this
// interface: it would name the views and the framebuffer, and wait for the frame.
//
// All calls from the thread of the frame loop, whose OpenGL context it makes current.

#include <memory>
#include <vector>

#include "client-hmd/desktop/window.h"
#include "client-hmd/view/pinhole.h"
#include "common/base/result.h"

namespace handloft::client {

/// Pixels of a picture's part, origin top left.
struct PixelArea {
  int x_px = 0;
  int y_px = 0;
  int width_px = 1;
  int height_px = 1;
};

/// One of the pictures that make up a frame.
struct View {
  PixelArea area;  ///< Of the whole canvas.
};

class Display {
 public:
  virtual ~Display() = default;

  /// Handles waiting events; moves `camera` as the mouse says. Never blocks.
  virtual WindowInput poll(OrbitCamera& camera) = 0;
  /// Of the whole canvas; at least 1.
  virtual int width_px() const = 0;
  virtual int height_px() const = 0;
  /// At least one; the first is the left eye's when there are two.
  virtual std::vector<View> views() const = 0;
  /// Shows what was drawn into framebuffer 0, at the next refresh.
  virtual void show() = 0;
  /// What panels and further input devices belong to; null when nobody looks.
  virtual Window* window() = 0;
};

}  // namespace handloft::client
