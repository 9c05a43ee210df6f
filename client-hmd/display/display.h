#pragma once
// Where pictures go, and how many views a frame has (V4): a window with one view, a headset's screen with one
// for each eye, or nothing but memory. A backend for OpenXR would be a further implementation of this
// interface: it would name the views and the framebuffer, and wait for the frame.
//
// All calls from the thread of the frame loop, whose OpenGL context it makes current.

#include <memory>
#include <optional>
#include <vector>

#include "client-hmd/desktop/window.h"
#include "client-hmd/render/offscreen_context.h"
#include "client-hmd/view/pinhole.h"
#include "client-hmd/view/stereo.h"
#include "common/base/clock.h"
#include "common/base/result.h"

namespace handloft::client {

/// One of the pictures that make up a frame.
struct View {
  PixelArea area;                   ///< Of the whole canvas.
  std::optional<EyeOptics> optics;  ///< None: a plain picture, through what camera the scene's viewer has.
};

class Display {
 public:
  virtual ~Display() = default;

  /// Handles waiting events; moves `camera` as the mouse says. Never blocks.
  virtual WindowInput poll(OrbitCamera& camera) = 0;
  /// Of the whole canvas; at least 1.
  virtual int width_px() const = 0;
  virtual int height_px() const = 0;
  /// Of a canvas of that size: at least one; the first is the left eye's when there are two.
  virtual std::vector<View> views(int width_px, int height_px) = 0;
  /// Whether anything of it can be seen: false for a window that is minimised or has no size.
  virtual bool visible() const { return true; }
  /// Shows what was drawn into framebuffer 0, at the next refresh.
  virtual void show() = 0;
  /// Time between refreshes; none: nothing refreshes.
  virtual std::optional<Duration> refresh_period() const { return std::nullopt; }
  /// What panels and further input devices belong to; null when nobody looks. Another one after renew().
  virtual Window* window() = 0;

  virtual GraphicsState graphics() = 0;
  /// A new context in place of a lost one, current. Everything that was made in the old one must have been
  /// let go of before. Errors: as when it was opened.
  virtual Status renew() = 0;
};

}  // namespace handloft::client
