// Displays that change under the frame loop (V4, V5): windows of any size, hidden ones, a graphics card that
// is reset. The window is a real one, on a display server of the test's own.

#include <epoxy/gl.h>
// clang-format off
#include <GLFW/glfw3.h>
// clang-format on
#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <functional>

#include "client-hmd/display/offscreen_display.h"
#include "client-hmd/display/stereo_display.h"
#include "client-hmd/display/window_display.h"
#include "client-hmd/main/frame_loop.h"

namespace handloft::client {
namespace {

/// Xvfb with one screen, under a number that it chooses itself.
class XServer {
 public:
  XServer() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), 0) != 0) return;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
    const std::string fd = std::to_string(ends[1]);
    std::array<const char*, 10> words{"Xvfb",        "-displayfd", fd.c_str(), "-screen",  "0",
                                      "1280x800x24", "-nolisten",  "tcp",      "-noreset", nullptr};
    const int failed =
        posix_spawnp(&pid_, "Xvfb", &actions, nullptr, const_cast<char* const*>(words.data()), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    std::array<char, 16> number{};
    ssize_t got = 0;
    if (failed == 0) {
      for (std::size_t i = 0; i + 1 < number.size() && ::read(ends[0], &number[i], 1) == 1; ++i) {
        if (number[i] == '\n') break;
        ++got;
      }
    } else {
      pid_ = -1;
    }
    ::close(ends[0]);
    if (got > 0)
      ::setenv("DISPLAY", (":" + std::string(number.data(), static_cast<std::size_t>(got))).c_str(), 1);
    started_ = got > 0;
  }
  ~XServer() {
    ::unsetenv("DISPLAY");
    if (pid_ <= 0) return;
    ::kill(pid_, SIGTERM);
    ::waitpid(pid_, nullptr, 0);
  }
  XServer(const XServer&) = delete;
  XServer& operator=(const XServer&) = delete;
  bool started() const { return started_; }

 private:
  pid_t pid_ = -1;
  bool started_ = false;
};

Frame test_frame(int width_px, int height_px) {
  Frame frame;
  frame.scene = std::make_shared<const Scene>();
  OrbitCamera camera;
  camera.distance_m = 0.12;
  frame.eye = camera.eye(width_px, height_px);
  frame.fingers = {{{0.035F, -0.065F, 0.02F}, {0.02F, 0.85F, 0.02F}, 1.0F}};
  return frame;
}

Status draw_to(Display& display, Renderer& renderer, unsigned target) {
  Canvas canvas{display.width_px(), display.height_px(), {}, target};
  canvas.views = display.views(canvas.width_px, canvas.height_px);
  const auto [width, height] = Presenter::picture_size(canvas);
  Presenter presenter;
  if (const Status drawn = presenter.draw(renderer, test_frame(width, height), canvas, {}, LastTurn::none);
      !drawn) {
    return drawn;
  }
  return presenter.present(renderer, canvas, std::nullopt);
}

/// Green pixels in the left and the right half of the window's own framebuffer.
std::array<int, 2> green_halves(int width_px, int height_px) {
  std::vector<std::uint8_t> rgba(static_cast<std::size_t>(4 * width_px * height_px));
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_px, height_px, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  std::array<int, 2> counts{};
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const std::uint8_t* p = &rgba[4 * static_cast<std::size_t>(y * width_px + x)];
      if (p[1] > 120 && p[0] < 100 && p[2] < 100) ++counts[x < width_px / 2 ? 0 : 1];
    }
  }
  return counts;
}

TEST(StereoWindow, SurvivesEverySize_V4) {
  const XServer server;
  if (!server.started()) GTEST_SKIP() << "no Xvfb";
  Result<std::unique_ptr<Display>> window =
      WindowDisplay::open({640, 360, std::nullopt}, Logger("test", LogLevel::off));
  ASSERT_TRUE(window.ok()) << window.error().describe();
  StereoDisplay display(std::move(*window), default_hmd_calibration());
  Result<std::unique_ptr<Renderer>> renderer = Renderer::create();
  ASSERT_TRUE(renderer.ok()) << renderer.error().describe();
  OrbitCamera camera;
  GLFWwindow* handle = display.window()->handle();
  for (const auto& [width, height] :
       {std::pair{640, 360}, {1000, 300}, {200, 700}, {1, 1}, {1900, 1400}, {640, 360}}) {
    glfwSetWindowSize(handle, width, height);
    // The server tells of it when it has done it.
    for (int i = 0; i < 200 && (display.width_px() != width || display.height_px() != height); ++i) {
      glfwWaitEventsTimeout(0.01);
      display.poll(camera);
    }
    EXPECT_EQ(display.width_px(), width);
    EXPECT_EQ(display.graphics(), GraphicsState::good);
    const Status drawn = draw_to(display, **renderer, 0);
    EXPECT_TRUE(drawn.ok()) << drawn.error().describe();
    if (width >= 200) {
      const auto [left, right] = green_halves(width, height);
      EXPECT_GT(left, 0) << width << "x" << height;
      EXPECT_GT(right, 0) << width << "x" << height;
    }
    display.show();
  }
  renderer->reset();
}

TEST(StereoWindow, CoversTheMonitorThatIsAskedFor_V4) {
  const XServer server;
  if (!server.started()) GTEST_SKIP() << "no Xvfb";
  const Result<std::vector<MonitorInfo>> monitors = list_monitors();
  ASSERT_TRUE(monitors.ok());
  ASSERT_EQ(monitors->size(), 1U);
  Result<std::unique_ptr<Display>> window =
      WindowDisplay::open({640, 360, std::string("0")}, Logger("test", LogLevel::off));
  ASSERT_TRUE(window.ok()) << window.error().describe();
  OrbitCamera camera;
  for (int i = 0; i < 200 && (*window)->width_px() != 1280; ++i) {
    glfwWaitEventsTimeout(0.01);
    (*window)->poll(camera);
  }
  EXPECT_EQ((*window)->width_px(), 1280);
  EXPECT_EQ((*window)->height_px(), 800);
  EXPECT_TRUE((*window)->visible());
  // One that is not there: a window, and no end.
  window->reset();
  window = WindowDisplay::open({640, 360, std::string("HDMI-7")}, Logger("test", LogLevel::off));
  ASSERT_TRUE(window.ok()) << window.error().describe();
  EXPECT_EQ((*window)->width_px(), 640);
}

TEST(LostContext, TheNextOneDrawsTheSamePicture) {
  Result<std::unique_ptr<Display>> display = OffscreenDisplay::open(480, 270);
  ASSERT_TRUE(display.ok()) << display.error().describe();
  const auto picture = [] {
    Result<std::unique_ptr<Renderer>> renderer = Renderer::create();
    EXPECT_TRUE(renderer.ok());
    const Result<Image> image = (*renderer)->draw_to_image(test_frame(480, 270), {});
    EXPECT_TRUE(image.ok());
    return image.ok() ? image->rgba : std::vector<std::uint8_t>();
  };
  const std::vector<std::uint8_t> before = picture();
  ASSERT_TRUE((*display)->renew().ok());
  EXPECT_EQ((*display)->graphics(), GraphicsState::good);
  EXPECT_EQ(picture(), before);
}

/// Says after some frames that its card was reset, and hides for some.
class FaultyDisplay final : public Display {
 public:
  explicit FaultyDisplay(std::unique_ptr<Display> inner) : inner_(std::move(inner)) {}
  WindowInput poll(OrbitCamera& camera) override {
    ++polls;
    return inner_->poll(camera);
  }
  int width_px() const override { return inner_->width_px(); }
  int height_px() const override { return inner_->height_px(); }
  std::vector<View> views(int width_px, int height_px) override { return inner_->views(width_px, height_px); }
  bool visible() const override { return polls < 6 || polls > 8; }
  void show() override { ++shown; }
  Window* window() override { return nullptr; }
  GraphicsState graphics() override {
    return shown == 2 + 2 * renewed && renewed < 2 ? GraphicsState::lost : GraphicsState::good;
  }
  Status renew() override {
    ++renewed;
    return inner_->renew();
  }

  int polls = 0;
  int shown = 0;
  int renewed = 0;

 private:
  std::unique_ptr<Display> inner_;
};

TEST(LostContext, TheFrameLoopGoesOn_V5) {
  Result<std::unique_ptr<Display>> inner = OffscreenDisplay::open(320, 180);
  ASSERT_TRUE(inner.ok()) << inner.error().describe();
  FaultyDisplay display(std::move(*inner));
  HmdOptions options;
  options.offscreen = true;
  options.offscreen_rate_hz = 1000.0;
  const SystemClock clock;
  const Logger log("test", LogLevel::off);
  const Result<net::Endpoint> nobody = net::parse_endpoint("unix:/nowhere/model.sock");
  ASSERT_TRUE(nobody.ok());
  Feeds feeds(options, *nobody, clock, log);
  Result<std::unique_ptr<FrameLoop>> loop = FrameLoop::create({options, clock, feeds, display, nullptr}, log);
  ASSERT_TRUE(loop.ok()) << loop.error().describe();
  const Status ran = (*loop)->run([&display] { return display.polls >= 14; });
  EXPECT_TRUE(ran.ok()) << ran.error().describe();
  EXPECT_EQ(display.renewed, 2);
  const RunFigures figures = (*loop)->figures();
  EXPECT_EQ(figures.graphics_resets, 2U);
  EXPECT_EQ(figures.photons.frames, 11U) << "and nothing was drawn while nothing could be seen";
  EXPECT_EQ(figures.photons.skipped, 3U);
}

}  // namespace
}  // namespace handloft::client
