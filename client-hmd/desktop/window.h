#pragma once
// A GLFW window with mouse and keyboard standing in for the head (V4, V6): left button orbits, right or
// middle button pans, the wheel zooms; S takes a screenshot, 1, 2, 3 look from the designer's side, the front
// and the top, F comes as near as the whole scene allows, H follows the tracked head, D shows distances to
// references, Q or Escape ends.

#include <functional>
#include <memory>
#include <string>

#include "client-hmd/view/orbit_camera.h"
#include "common/base/result.h"

struct GLFWwindow;

namespace handloft::client {

/// What people asked for since the last poll().
struct WindowInput {
  bool close = false;
  bool screenshot = false;
  bool toggle_head = false;
  bool toggle_distances = false;
  bool toggle_zebra = false;
  bool fit_view = false;
};

class Window {
 public:
  /// Opens a window with a current OpenGL 3.3 core context. Errors: unsupported when there is no display or
  /// driver.
  static Result<std::unique_ptr<Window>> open(int width_px, int height_px, const std::string& title);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Handles waiting events; moves `camera`. Never blocks.
  WindowInput poll(OrbitCamera& camera);
  /// Shows what was drawn, at the display's next refresh.
  void swap();
  /// In pixels of the framebuffer; at least 1.
  int width_px() const;
  int height_px() const;

 private:
  Window() = default;
  void on_key(int key, int action);
  void on_scroll(double steps);

  GLFWwindow* window_ = nullptr;
  WindowInput input_;
  OrbitCamera* camera_ = nullptr;  ///< During poll() only.
  double last_x_ = 0.0;
  double last_y_ = 0.0;
};

}  // namespace handloft::client
