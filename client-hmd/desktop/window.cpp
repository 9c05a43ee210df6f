#include "client-hmd/desktop/window.h"

// epoxy brings its own OpenGL headers and must come before GLFW.
#include <epoxy/gl.h>
// clang-format off
#include <GLFW/glfw3.h>
// clang-format on

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <utility>

namespace handloft::client {
namespace {

constexpr double zoom_per_step = 1.12;  ///< Six steps of the wheel double the size.

Error last_failure(const char* step) {
  const char* reason = nullptr;
  glfwGetError(&reason);
  return make_error(ErrorCode::unsupported,
                    std::string(step) + " failed: " + (reason == nullptr ? "no reason given" : reason));
}

}  // namespace

Result<std::unique_ptr<Window>> Window::open(int width_px, int height_px, const std::string& title) {
  if (glfwInit() != GLFW_TRUE) return last_failure("opening a display");
  std::unique_ptr<Window> self(new Window);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);  // The renderer has its own.
  self->window_ = glfwCreateWindow(width_px, height_px, title.c_str(), nullptr, nullptr);
  if (self->window_ == nullptr) return last_failure("opening a window");
  glfwMakeContextCurrent(self->window_);
  glfwSwapInterval(1);
  glfwSetWindowUserPointer(self->window_, self.get());
  glfwSetKeyCallback(self->window_, [](GLFWwindow* window, int key, int, int action, int) {
    static_cast<Window*>(glfwGetWindowUserPointer(window))->on_key(key, action);
  });
  glfwSetScrollCallback(self->window_, [](GLFWwindow* window, double, double steps) {
    static_cast<Window*>(glfwGetWindowUserPointer(window))->on_scroll(steps);
  });
  glfwGetCursorPos(self->window_, &self->last_x_, &self->last_y_);
  return self;
}

Window::~Window() {
  if (window_ != nullptr) glfwDestroyWindow(window_);
  glfwTerminate();
}

void Window::on_key(int key, int action) {
  if (action != GLFW_PRESS) return;
  switch (key) {
    case GLFW_KEY_Q:
    case GLFW_KEY_ESCAPE:
      input_.close = true;
      break;
    case GLFW_KEY_S:
      input_.screenshot = true;
      break;
    case GLFW_KEY_H:
      input_.toggle_head = true;
      break;
    case GLFW_KEY_F:
      input_.fit_view = true;
      break;
    case GLFW_KEY_D:
      input_.toggle_distances = true;
      break;
    case GLFW_KEY_Z:
      input_.toggle_zebra = true;
      break;
    case GLFW_KEY_1:
      camera_->look(StandardView::perspective);
      break;
    case GLFW_KEY_2:
      camera_->look(StandardView::front);
      break;
    case GLFW_KEY_3:
      camera_->look(StandardView::top);
      break;
    default:
      break;
  }
}

void Window::on_scroll(double steps) {
  camera_->zoom(std::pow(zoom_per_step, std::clamp(steps, -10.0, 10.0)));
}

WindowInput Window::poll(OrbitCamera& camera) {
  input_ = {};
  camera_ = &camera;
  glfwPollEvents();
  double x = 0.0;
  double y = 0.0;
  glfwGetCursorPos(window_, &x, &y);
  const double height = std::max(height_px(), 1);
  const double right = (x - std::exchange(last_x_, x)) / height;
  const double down = (y - std::exchange(last_y_, y)) / height;
  const auto pressed = [this](int button) { return glfwGetMouseButton(window_, button) == GLFW_PRESS; };
  if (pressed(GLFW_MOUSE_BUTTON_LEFT)) {
    camera.orbit(-right * glm::pi<double>(), down * glm::pi<double>());
  } else if (pressed(GLFW_MOUSE_BUTTON_RIGHT) || pressed(GLFW_MOUSE_BUTTON_MIDDLE)) {
    camera.pan(right, -down);
  }
  camera_ = nullptr;
  input_.close = input_.close || glfwWindowShouldClose(window_) == GLFW_TRUE;
  return input_;
}

void Window::swap() {
  glfwSwapBuffers(window_);
}

int Window::width_px() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return std::max(width, 1);
}

int Window::height_px() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return std::max(height, 1);
}

}  // namespace handloft::client
