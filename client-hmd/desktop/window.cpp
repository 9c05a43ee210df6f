#include "client-hmd/desktop/window.h"

// epoxy brings its own OpenGL headers and must come before GLFW.
#include <epoxy/gl.h>
// clang-format off
#include <GLFW/glfw3.h>
// clang-format on

#include <algorithm>
#include <optional>
#include <utility>

#include "client-hmd/desktop/glfw_names.h"
#include "client-hmd/desktop/pen_listener.h"

namespace handloft::client {
namespace {

Error last_failure(const char* step) {
  const char* reason = nullptr;
  glfwGetError(&reason);
  return make_error(ErrorCode::unsupported,
                    std::string(step) + " failed: " + (reason == nullptr ? "no reason given" : reason));
}

Window& window_of(GLFWwindow* handle) {
  return *static_cast<Window*>(glfwGetWindowUserPointer(handle));
}

Modifiers modifiers_of(int bits) {
  return {(bits & GLFW_MOD_SHIFT) != 0, (bits & GLFW_MOD_CONTROL) != 0, (bits & GLFW_MOD_ALT) != 0};
}

std::optional<PointerButton> button_of(int button) {
  switch (button) {
    case GLFW_MOUSE_BUTTON_LEFT:
      return PointerButton::left;
    case GLFW_MOUSE_BUTTON_MIDDLE:
      return PointerButton::middle;
    case GLFW_MOUSE_BUTTON_RIGHT:
      return PointerButton::right;
    default:
      return std::nullopt;
  }
}

}  // namespace

Window::Window() : polled_at_(clock_.now()) {}

template <typename What>
void Window::add(const What& what) {
  InputEvent& event = input_.events.emplace_back();
  event.modifiers = modifiers_;
  event.what.emplace<What>(what);
}

glm::dvec2 Window::in_pixels(double x, double y) const {
  int width = 0, height = 0;
  glfwGetWindowSize(window_, &width, &height);
  // Of the framebuffer, which has more pixels than the window on some screens.
  return {x * width_px() / std::max(width, 1), y * height_px() / std::max(height, 1)};
}

Result<std::unique_ptr<Window>> Window::open(int width_px, int height_px, const std::string& title) {
  if (glfwInit() != GLFW_TRUE) return last_failure("opening a display");
  std::unique_ptr<Window> self(new Window);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);  // The renderer has its own.
  // A card that was reset then says so (graphics_state()) instead of ending the program; not all drivers
  // can.
  glfwWindowHint(GLFW_CONTEXT_ROBUSTNESS, GLFW_LOSE_CONTEXT_ON_RESET);
  self->window_ = glfwCreateWindow(width_px, height_px, title.c_str(), nullptr, nullptr);
  if (self->window_ == nullptr) {
    glfwWindowHint(GLFW_CONTEXT_ROBUSTNESS, GLFW_NO_ROBUSTNESS);
    self->window_ = glfwCreateWindow(width_px, height_px, title.c_str(), nullptr, nullptr);
  }
  if (self->window_ == nullptr) return last_failure("opening a window");
  glfwMakeContextCurrent(self->window_);
  glfwSwapInterval(1);
  glfwSetWindowUserPointer(self->window_, self.get());
  glfwSetKeyCallback(self->window_, [](GLFWwindow* handle, int key, int scancode, int action, int mods) {
    Window& window = window_of(handle);
    window.modifiers_ = modifiers_of(mods);
    // X11 tells the modifiers before the key: its own bit is still missing, or still there.
    const bool down = action != GLFW_RELEASE;
    if (key == GLFW_KEY_LEFT_SHIFT || key == GLFW_KEY_RIGHT_SHIFT) window.modifiers_.shift = down;
    if (key == GLFW_KEY_LEFT_CONTROL || key == GLFW_KEY_RIGHT_CONTROL) window.modifiers_.control = down;
    if (key == GLFW_KEY_LEFT_ALT || key == GLFW_KEY_RIGHT_ALT) window.modifiers_.alt = down;
    window.add(KeyChanged{is_modifier(key) ? "" : key_name(key, scancode), down, action == GLFW_REPEAT});
  });
  glfwSetScrollCallback(self->window_, [](GLFWwindow* handle, double, double steps) {
    if (steps != 0.0) window_of(handle).add(WheelTurned{steps});
  });
  glfwSetCursorPosCallback(self->window_, [](GLFWwindow* handle, double x, double y) {
    Window& window = window_of(handle);
    window.pointer_px_ = window.in_pixels(x, y);
    window.add(PointerMoved{window.pointer_px_});
  });
  glfwSetMouseButtonCallback(self->window_, [](GLFWwindow* handle, int number, int action, int mods) {
    const auto button = button_of(number);
    if (!button) return;
    Window& window = window_of(handle);
    window.modifiers_ = modifiers_of(mods);
    // Where the pointer was then: asked for, its place would be the one at the end of all waiting events.
    window.add(ButtonChanged{*button, action == GLFW_PRESS, window.pointer_px_});
  });
  glfwSetCursorEnterCallback(self->window_, [](GLFWwindow* handle, int entered) {
    if (entered == GLFW_FALSE) window_of(handle).add(PointerLeft{});
  });
  glfwSetWindowFocusCallback(self->window_, [](GLFWwindow* handle, int focused) {
    Window& window = window_of(handle);
    if (focused == GLFW_TRUE) return;
    window.modifiers_ = {};
    window.add(FocusLost{});
  });
  double x = 0.0, y = 0.0;
  glfwGetCursorPos(self->window_, &x, &y);
  self->pointer_px_ = self->in_pixels(x, y);
  self->pen_ = PenListener::open();
  return self;
}

Window::~Window() {
  if (window_ != nullptr) glfwDestroyWindow(window_);
  glfwTerminate();
}

WindowInput Window::poll() {
  input_ = {};
  glfwPollEvents();
  if (pen_ != nullptr) {
    // Before what the pointer did meanwhile: a stroke begins with its own pressure.
    if (const auto pressure = pen_->poll()) {
      InputEvent& event = *input_.events.emplace(input_.events.begin());
      event.modifiers = modifiers_;
      event.what.emplace<PenPressed>(PenPressed{*pressure});
    }
  }
  const TimePoint now = clock_.now();
  const auto count = static_cast<std::int64_t>(input_.events.size());
  for (std::int64_t i = 0; i < count; ++i) {
    input_.events[static_cast<std::size_t>(i)].time = polled_at_ + (now - polled_at_) * (i + 1) / count;
  }
  polled_at_ = now;
  input_.close = glfwWindowShouldClose(window_) == GLFW_TRUE;
  return std::exchange(input_, {});
}

void Window::swap() {
  glfwSwapBuffers(window_);
}

int Window::width_px() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return std::max(width, 1);
}

float Window::content_scale() const {
  float across = 1.0F, down = 1.0F;
  glfwGetWindowContentScale(window_, &across, &down);
  return std::max(across, down);
}

int Window::height_px() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return std::max(height, 1);
}

}  // namespace handloft::client
