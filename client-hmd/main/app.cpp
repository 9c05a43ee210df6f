#include "client-hmd/main/app.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <thread>

#include "client-hmd/desktop/window.h"
#include "client-hmd/main/frame_composer.h"
#include "client-hmd/main/report.h"
#include "client-hmd/main/scene_extent.h"
#include "client-hmd/render/offscreen_context.h"
#include "client-hmd/render/renderer.h"

namespace handloft::client {
namespace {

constexpr auto idle_after = std::chrono::seconds(1);
constexpr auto once_settled_after =
    std::chrono::milliseconds(200);  ///< Large scenes come in several messages.
constexpr auto once_patience = std::chrono::seconds(10);
constexpr int still_supersampling = 2;
constexpr int offscreen_niceness = 10;  ///< Drawing in software yields to tracking and modelling.

/// SIGTERM and SIGINT as something to look at once a frame.
class EndSignal {
 public:
  EndSignal() {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    fd_ = net::FileDescriptor(signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC));
  }
  bool came() {
    signalfd_siginfo info{};
    return ::read(fd_.get(), &info, sizeof(info)) == static_cast<ssize_t>(sizeof(info));
  }

 private:
  net::FileDescriptor fd_;
};

/// The place where frames go: a window, or nowhere.
struct Screen {
  std::unique_ptr<Window> window;
  std::unique_ptr<OffscreenContext> offscreen;

  static Result<Screen> open(const HmdOptions& options, const Logger& log) {
    Screen screen;
    const bool display = std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
    if (!options.offscreen && !options.once && display) {
      Result<std::unique_ptr<Window>> window = Window::open(options.width_px, options.height_px, "Handloft");
      if (window) {
        screen.window = std::move(*window);
        return screen;
      }
      log.warning("no window, so drawing offscreen: {}", window.error().describe());
    }
    // Threads that a software driver starts inherit this, those of the network run already.
    if (setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), offscreen_niceness) != 0) {
      log.warning("cannot lower the priority of drawing");
    }
    Result<std::unique_ptr<OffscreenContext>> context = OffscreenContext::create();
    if (!context) return context.error();
    screen.offscreen = std::move(*context);
    return screen;
  }
};

class App {
 public:
  App(const HmdOptions& options, Logger log) : options_(options), log_(std::move(log)) {}

  Status run(const net::Endpoint& model) {
    EndSignal end_signal;
    model_ = ModelFeed::start(model, clock_, log_.component("model"));
    if (options_.tracking) {
      tracking_ = TrackingFeed::start(*options_.tracking, clock_, log_.component("tracking"));
      if (options_.camera == CameraMode::head)
        film_ = FilmFeed::start(*options_.tracking, log_.component("film"));
    }
    Result<Screen> screen = Screen::open(options_, log_);
    if (!screen) return screen.error();
    Result<std::unique_ptr<Renderer>> renderer = Renderer::create();
    if (!renderer) return renderer.error();
    renderer_ = std::move(*renderer);
    figures_.offscreen = screen->window == nullptr;

    started_ = clock_.now();
    Status status;
    while (!end_signal.came() && status.ok() && !finished_) status = step(screen->window.get());
    if (status.ok() && !options_.screenshot.empty() && !screenshot_taken_)
      status = take_screenshot(clock_.now());
    if (status.ok() && !options_.report.empty()) status = write_report();
    renderer_.reset();  // Before its context.
    return status;
  }

 private:
  Status step(Window* window) {
    const TimePoint begin = clock_.now();
    if (window != nullptr) {
      const WindowInput input = window->poll(orbit_);
      if (input.close) finished_ = true;
      if (input.toggle_head) {
        camera_ = camera_ == CameraMode::head ? CameraMode::orbit : CameraMode::head;
        if (camera_ == CameraMode::head && film_ == nullptr && options_.tracking) {
          film_ = FilmFeed::start(*options_.tracking, log_.component("film"));
        }
      }
      if (input.toggle_distances) distances_ = !distances_;
      if (input.toggle_zebra) shading_ = shading_ == Shading::zebra ? Shading::studio : Shading::zebra;
      if (input.fit_view) fit_wanted_ = true;
      if (input.screenshot) save_from_window(begin);
      width_px_ = window->width_px();
      height_px_ = window->height_px();
    }
    follow_daemon();
    const std::shared_ptr<const ModelState> model = model_->state();
    fit_view(*model, window == nullptr);
    const RenderOptions rendering;
    const double scale = window == nullptr ? options_.offscreen_scale : 1.0;
    const Frame frame = compose(begin, model, scale, window != nullptr);
    const Status drawn =
        window == nullptr ? renderer_->draw_offscreen(frame, rendering) : renderer_->draw(frame, rendering);
    if (!drawn) return drawn;
    if (window != nullptr) window->swap();
    count_frame(begin, *model);
    if (const Status taken = take_due_screenshot(*model, window == nullptr); !taken) return taken;
    if (options_.duration > Duration::zero() && clock_.now() - started_ >= options_.duration)
      finished_ = true;
    if (window == nullptr && !finished_) pace(begin);
    return {};
  }

  /// A daemon that started anew has other pictures.
  void follow_daemon() {
    if (tracking_ == nullptr || film_ == nullptr) return;
    const std::uint64_t connects = tracking_->status().connects;
    if (connects > 1 && connects != film_connects_) film_->reconnect();
    film_connects_ = connects;
  }

  /// Without a window the view follows the scene; in a window people move it themselves.
  void fit_view(const ModelState& model, bool offscreen) {
    if (!fit_wanted_ || model.snapshots == 0 || model.scene == fitted_) return;
    const std::vector<glm::dvec3> places = visible_places(*model.scene);
    orbit_.fit(places, width_px_, height_px_);
    fitted_ = model.scene;
    if (!offscreen && !places.empty()) fit_wanted_ = false;
  }

  Frame compose(TimePoint now, const std::shared_ptr<const ModelState>& model, double scale, bool late_warp) {
    FrameRequest request;
    request.camera = camera_;
    request.width_px = std::max(1, static_cast<int>(std::lround(width_px_ * scale)));
    request.height_px = std::max(1, static_cast<int>(std::lround(height_px_ * scale)));
    request.orbit = orbit_;
    request.now = now;
    request.display_time = now + options_.display_latency;
    request.late_warp = late_warp;
    if (distances_) request.distances = DistanceScale{static_cast<float>(options_.distance_range_mm / 1e3)};
    request.shading = shading_;
    if (tracking_ != nullptr) request.latency_ms = model_->statistics().capture_to_receipt.quantile_ms(0.5);
    return compose_frame(request, {model, tracking_.get(), film_.get()},
                         [this](std::string_view text) { return renderer_->measure_text(text); });
  }

  void count_frame(TimePoint begin, const ModelState& model) {
    const TimePoint now = clock_.now();
    figures_.frame_time.add(now - begin);
    if (model.scene != presented_ && model.scene_capture_time != TimePoint{}) {
      figures_.capture_to_presentation.add(now - model.scene_capture_time);
    }
    presented_ = model.scene;
  }

  Status take_due_screenshot(const ModelState& model, bool offscreen) {
    if (options_.screenshot.empty() || screenshot_taken_) return {};
    const TimePoint now = clock_.now();
    const bool idle_wanted = options_.once || options_.screenshot_time == ScreenshotTime::idle;
    const Duration quiet = options_.once ? Duration(once_settled_after) : Duration(idle_after);
    bool due = false;
    if (idle_wanted) {
      due = model.snapshots > 0 && now - model.received_at >= quiet;
      if (options_.once && model.snapshots == 0 && now - started_ > once_patience) {
        return make_error(ErrorCode::timeout, "no scene came from the model server" +
                                                  (model.problem.empty() ? "" : ": " + model.problem));
      }
    } else if (options_.screenshot_time == ScreenshotTime::frames) {
      due = figures_.frame_time.count() >= options_.screenshot_frames;
    }
    if (!due) return {};
    if (offscreen) finished_ = true;
    return take_screenshot(now);
  }

  Result<Image> picture(TimePoint now) {
    RenderOptions rendering;
    rendering.supersampling = still_supersampling;
    const std::shared_ptr<const ModelState> model = model_->state();
    if (figures_.offscreen) fit_view(*model, true);
    return renderer_->draw_to_image(compose(now, model, 1.0, false), rendering);
  }

  Status take_screenshot(TimePoint now) {
    const Result<Image> image = picture(now);
    if (!image) return image.error();
    screenshot_taken_ = true;
    return write_png(options_.screenshot, *image);
  }

  /// The S key: a file of its own each time, and a failure is no reason to end.
  void save_from_window(TimePoint now) {
    const std::string path = fmt::format("handloft-{}.png", ++saved_);
    const Result<Image> image = picture(now);
    const Status saved = image ? write_png(path, *image) : Status(image.error());
    if (saved.ok()) {
      log_.info("saved {}", path);
    } else {
      log_.warning("no screenshot: {}", saved.error().describe());
    }
  }

  Status write_report() {
    figures_.width_px = width_px_;
    figures_.height_px = height_px_;
    figures_.seconds = to_seconds(clock_.now() - started_);
    figures_.model = model_->statistics();
    if (tracking_ != nullptr) figures_.tracking = tracking_->status();
    figures_.scene = model_->state()->scene;
    figures_.screenshot = screenshot_taken_ ? options_.screenshot : "";
    return write_text(options_.report, report_json(figures_));
  }

  void pace(TimePoint begin) const {
    const TimePoint next = begin + from_seconds(1.0 / options_.offscreen_rate_hz);
    const TimePoint now = clock_.now();
    if (next > now) std::this_thread::sleep_for(next - now);
  }

  const HmdOptions& options_;
  const Logger log_;
  const SystemClock clock_;
  std::unique_ptr<ModelFeed> model_;
  std::unique_ptr<TrackingFeed> tracking_;
  std::unique_ptr<FilmFeed> film_;
  std::unique_ptr<Renderer> renderer_;
  OrbitCamera orbit_;
  CameraMode camera_ = options_.camera;
  bool distances_ = options_.distances;
  Shading shading_ = options_.shading;
  bool fit_wanted_ = options_.view == ViewChoice::fit;
  std::shared_ptr<const Scene> fitted_;  ///< What the view was fitted to last.
  int width_px_ = options_.width_px;
  int height_px_ = options_.height_px;
  TimePoint started_;
  bool finished_ = false;
  bool screenshot_taken_ = false;
  int saved_ = 0;
  std::uint64_t film_connects_ = 0;
  std::shared_ptr<const Scene> presented_;
  RunFigures figures_;
};

}  // namespace

Status run_hmd(const HmdOptions& options, const Logger& log) {
  Result<net::Endpoint> model =
      options.model ? Result<net::Endpoint>(*options.model) : net::default_model_endpoint();
  if (!model) return model.error();
  App app(options, log);
  return app.run(*model);
}

}  // namespace handloft::client
