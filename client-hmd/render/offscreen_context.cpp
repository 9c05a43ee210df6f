#include "client-hmd/render/offscreen_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <string_view>

namespace handloft::client {
namespace {

Error refused(const char* step) {
  return make_error(
      ErrorCode::unsupported,
      fmt::format("no offscreen OpenGL 3.3: {} failed with EGL error {:#06x}; is libegl-mesa0 and "
                  "libgl1-mesa-dri (or a driver with EGL) installed?",
                  step, static_cast<unsigned>(eglGetError())));
}

/// A graphics card without a display: drivers that have no surfaceless platform have this one. None where
/// software is asked for in Mesa's own way.
EGLDisplay open_graphics_card() {
  const char* software = std::getenv("LIBGL_ALWAYS_SOFTWARE");
  if (software != nullptr && std::string_view(software) != "0") return EGL_NO_DISPLAY;
  if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device") ||
      !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") ||
      !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_query")) {
    return EGL_NO_DISPLAY;
  }
  std::array<EGLDeviceEXT, 16> devices{};
  EGLint count = 0;
  if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count) != EGL_TRUE) {
    return EGL_NO_DISPLAY;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(count, 0)); ++i) {
    const char* extensions = eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS);
    const std::string_view names = extensions == nullptr ? "" : extensions;
    if (names.find("EGL_MESA_device_software") != std::string_view::npos) continue;
    EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr);
    if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE) return display;
  }
  return EGL_NO_DISPLAY;
}

EGLDisplay open_display() {
  if (EGLDisplay card = open_graphics_card(); card != EGL_NO_DISPLAY) return card;
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless") &&
      epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base")) {
    EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
    if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE) return display;
  }
  EGLDisplay display = eglGetDisplay(EGL_DEFAULT_DISPLAY);
  if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE) return display;
  return EGL_NO_DISPLAY;
}

}  // namespace

GraphicsState graphics_state() {
  const bool core = epoxy_gl_version() >= 45;
  if (!core && !epoxy_has_gl_extension("GL_ARB_robustness")) return GraphicsState::good;
  const GLenum status = core ? glGetGraphicsResetStatus() : glGetGraphicsResetStatusARB();
  return status == GL_NO_ERROR ? GraphicsState::good : GraphicsState::lost;
}

Result<std::unique_ptr<OffscreenContext>> OffscreenContext::create() {
  std::unique_ptr<OffscreenContext> self(new OffscreenContext);
  EGLDisplay display = open_display();
  if (display == EGL_NO_DISPLAY) return refused("eglInitialize");
  self->display_ = display;
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return refused("eglBindAPI");

  constexpr std::array<EGLint, 5> config_attributes{EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                                    EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configs = 0;
  if (eglChooseConfig(display, config_attributes.data(), &config, 1, &configs) != EGL_TRUE || configs < 1) {
    return refused("eglChooseConfig");
  }
  // First one that is told of resets, where the driver has such.
  std::array<EGLint, 9> context_attributes{EGL_CONTEXT_MAJOR_VERSION,
                                           3,
                                           EGL_CONTEXT_MINOR_VERSION,
                                           3,
                                           EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                           EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                           EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                                           EGL_LOSE_CONTEXT_ON_RESET,
                                           EGL_NONE};
  EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, context_attributes.data());
  if (context == EGL_NO_CONTEXT) {
    context_attributes[6] = EGL_NONE;
    context = eglCreateContext(display, config, EGL_NO_CONTEXT, context_attributes.data());
  }
  if (context == EGL_NO_CONTEXT) return refused("eglCreateContext");
  self->context_ = context;

  EGLSurface surface = EGL_NO_SURFACE;
  if (!epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context")) {
    constexpr std::array<EGLint, 5> pbuffer_attributes{EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
    surface = eglCreatePbufferSurface(display, config, pbuffer_attributes.data());
    if (surface == EGL_NO_SURFACE) return refused("eglCreatePbufferSurface");
    self->surface_ = surface;
  }
  if (eglMakeCurrent(display, surface, surface, context) != EGL_TRUE) return refused("eglMakeCurrent");
  return self;
}

OffscreenContext::~OffscreenContext() {
  if (display_ == nullptr) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  if (surface_ != nullptr) eglDestroySurface(display_, surface_);
  if (context_ != nullptr) eglDestroyContext(display_, context_);
  eglTerminate(display_);
}

}  // namespace handloft::client
