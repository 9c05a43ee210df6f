#pragma once
// A GLFW window (V4) that tells what mouse, keyboard and pen do as values (input.h, V6), in their order. What
// they mean is not decided here.

#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "client-hmd/desktop/input.h"
#include "common/base/clock.h"
#include "common/base/result.h"

struct GLFWwindow;

namespace handloft::client {

class PenListener;
struct OrbitCamera;

/// What people did since the last poll().
struct WindowInput {
  bool close = false;  ///< The window's own button.
  std::vector<InputEvent> events;
};

class Window {
 public:
  /// Opens a window with a current OpenGL 3.3 core context. Errors: unsupported when there is no display or
  /// driver.
  static Result<std::unique_ptr<Window>> open(int width_px, int height_px, const std::string& title);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Handles waiting events; never blocks. The window system tells of no times: those since the last poll are
  /// spread evenly over the time since then.
  WindowInput poll();
  WindowInput poll(OrbitCamera&) { return poll(); }
  /// Shows what was drawn, at the display's next refresh.
  void swap();
  /// In pixels of the framebuffer; at least 1.
  int width_px() const;
  int height_px() const;
  /// Of the monitor it is on: 1 for about 96 dots an inch.
  float content_scale() const;
  /// For libraries that draw into the same window. Theirs must chain the callbacks that are there.
  GLFWwindow* handle() { return window_; }

 private:
  Window();
  template <typename What>
  void add(const What& what);
  glm::dvec2 in_pixels(double x, double y) const;

  SystemClock clock_;
  GLFWwindow* window_ = nullptr;
  std::unique_ptr<PenListener> pen_;  ///< Null where there is none.
  WindowInput input_;
  Modifiers modifiers_;
  glm::dvec2 pointer_px_{0.0};
  TimePoint polled_at_;
};

}  // namespace handloft::client
