#include "client-hmd/display/window_display.h"

#include <epoxy/gl.h>
// clang-format off
#include <GLFW/glfw3.h>
// clang-format on

#include <algorithm>

namespace handloft::client {
namespace {

constexpr auto monitors_asked_every = std::chrono::milliseconds(500);

MonitorInfo info_of(GLFWmonitor* monitor) {
  MonitorInfo info;
  if (const char* name = glfwGetMonitorName(monitor); name != nullptr) info.name = name;
  glfwGetMonitorPos(monitor, &info.x_px, &info.y_px);
  if (const GLFWvidmode* mode = glfwGetVideoMode(monitor); mode != nullptr) {
    info.width_px = mode->width;
    info.height_px = mode->height;
    info.refresh_hz = mode->refreshRate;
  }
  return info;
}

/// glfwInit() must have succeeded.
std::vector<MonitorInfo> present_monitors() {
  std::vector<MonitorInfo> monitors;
  int count = 0;
  GLFWmonitor** all = glfwGetMonitors(&count);
  for (int i = 0; i < count; ++i) monitors.push_back(info_of(all[i]));
  return monitors;
}

}  // namespace

Result<std::vector<MonitorInfo>> list_monitors() {
  if (glfwInit() != GLFW_TRUE) return make_error(ErrorCode::unsupported, "no display server");
  std::vector<MonitorInfo> monitors = present_monitors();
  glfwTerminate();
  return monitors;
}

WindowDisplay::WindowDisplay(WindowDisplayOptions options, Logger log)
    : options_(std::move(options)), log_(std::move(log)), choice_(options_.monitor) {}

Result<std::unique_ptr<Display>> WindowDisplay::open(const WindowDisplayOptions& options, Logger log) {
  std::unique_ptr<WindowDisplay> self(new WindowDisplay(options, std::move(log)));
  if (const Status made = self->renew(); !made) return made.error();
  return std::unique_ptr<Display>(std::move(self));
}

Status WindowDisplay::renew() {
  window_.reset();
  Result<std::unique_ptr<Window>> window = Window::open(options_.width_px, options_.height_px, "Handloft");
  if (!window) return window.error();
  window_ = std::move(*window);
  choice_ = MonitorChoice(options_.monitor);
  monitors_at_.reset();
  follow_monitors();
  return {};
}

WindowInput WindowDisplay::poll(OrbitCamera& camera) {
  const WindowInput input = window_->poll(camera);
  follow_monitors();
  return input;
}

void WindowDisplay::follow_monitors() {
  if (!options_.monitor) return;
  if (const std::optional<Placement> placement = choice_.after_change(monitors())) place(*placement);
}

const std::vector<MonitorInfo>& WindowDisplay::monitors() const {
  const TimePoint now = clock_.now();
  if (!monitors_at_ || now - *monitors_at_ > monitors_asked_every) {
    monitors_ = present_monitors();
    monitors_at_ = now;
  }
  return monitors_;
}

/// Borderless rather than exclusive: a window manager then shows warnings and other windows as ever, and
/// nothing changes the monitor's mode.
void WindowDisplay::place(const Placement& placement) {
  GLFWwindow* window = window_->handle();
  if (!placement.said.empty()) log_.warning("{}", placement.said);
  glfwSetWindowAttrib(window, GLFW_DECORATED, placement.cover ? GLFW_FALSE : GLFW_TRUE);
  glfwSetWindowAttrib(window, GLFW_FLOATING, placement.cover ? GLFW_TRUE : GLFW_FALSE);
  if (placement.cover) {
    const MonitorInfo& monitor = *placement.cover;
    glfwSetWindowPos(window, monitor.x_px, monitor.y_px);
    glfwSetWindowSize(window, monitor.width_px, monitor.height_px);
    glfwSetInputMode(window, GLFW_CURSOR, GLFW_CURSOR_HIDDEN);
  } else {
    glfwSetWindowSize(window, options_.width_px, options_.height_px);
    glfwSetInputMode(window, GLFW_CURSOR, GLFW_CURSOR_NORMAL);
  }
}

bool WindowDisplay::visible() const {
  int width = 0;
  int height = 0;
  glfwGetFramebufferSize(window_->handle(), &width, &height);
  return width > 0 && height > 0 && glfwGetWindowAttrib(window_->handle(), GLFW_ICONIFIED) == GLFW_FALSE;
}

std::optional<Duration> WindowDisplay::refresh_period() const {
  // Of the monitor that holds the window's middle.
  int x = 0, y = 0, width = 0, height = 0;
  glfwGetWindowPos(window_->handle(), &x, &y);
  glfwGetWindowSize(window_->handle(), &width, &height);
  int hz = 0;
  for (const MonitorInfo& monitor : monitors()) {
    const int right = x + width / 2 - monitor.x_px;
    const int down = y + height / 2 - monitor.y_px;
    const bool inside = right >= 0 && down >= 0 && right < monitor.width_px && down < monitor.height_px;
    if (hz == 0 || inside) hz = monitor.refresh_hz;
  }
  if (hz <= 0) return std::nullopt;
  return from_seconds(1.0 / hz);
}

std::vector<View> WindowDisplay::views(int width_px, int height_px) {
  return {View{{0, 0, width_px, height_px}, std::nullopt}};
}

}  // namespace handloft::client
