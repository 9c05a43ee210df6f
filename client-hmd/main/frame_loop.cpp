#include "client-hmd/main/frame_loop.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <thread>
#include <tuple>

#include "client-hmd/render/warm_up.h"

namespace handloft::client {
namespace {

constexpr int still_supersampling = 2;
/// Often enough for whoever asks every few seconds.
constexpr Duration metrics_every = std::chrono::seconds(1);

int scaled(int pixels, double scale) {
  return std::max(1, static_cast<int>(std::lround(pixels * scale)));
}

double film_depth_m(const HmdOptions& options) {
  return options.film_depth_m > 0.0 ? options.film_depth_m : std::numeric_limits<double>::infinity();
}

}  // namespace

Result<std::unique_ptr<FrameLoop>> FrameLoop::create(FrameLoopParts parts, Logger log) {
  Result<std::unique_ptr<Renderer>> renderer = Renderer::create();
  if (!renderer) return renderer.error();
  std::unique_ptr<FrameLoop> loop(new FrameLoop(parts, std::move(log), std::move(*renderer)));
  if (loop->wants_panels()) {
    if (const Status shown = loop->panels_.show(); !shown) return shown.error();
  }
  if (const Status warm = loop->warm_up(); !warm) return warm.error();
  loop->started_ = loop->parts_.clock.now();
  return loop;
}

FrameLoop::FrameLoop(FrameLoopParts parts, Logger log, std::unique_ptr<Renderer> renderer)
    : parts_(parts),
      log_(std::move(log)),
      renderer_(std::move(renderer)),
      timing_(parts_.clock, parts_.options.display_latency),
      presenter_({.turn = {}, .film_depth_m = film_depth_m(parts_.options)}),
      view_(parts_.options),
      panels_(settings_path(std::getenv("XDG_CONFIG_HOME"), std::getenv("HOME")), log_.component("panels")),
      desktop_(parts_.options),
      pictures_(parts_.options, log_, parts_.clock.now()),
      started_(parts_.clock.now()) {
  figures_.offscreen = offscreen();
}

/// What drivers do once, they do before the first frame that is seen.
Status FrameLoop::warm_up() {
  Canvas canvas = canvas_of(offscreen() ? parts_.options.offscreen_scale : 1.0);
  const Result<unsigned> own = renderer_->own_canvas(canvas.width_px, canvas.height_px);
  if (!own) return own.error();
  canvas.target = *own;
  const LastTurn turn = offscreen() ? LastTurn::none : LastTurn::to_display;
  const auto [width, height] = Presenter::picture_size(canvas);
  for (const Frame& frame : warm_up_frames(width, height)) {
    if (const Status drawn = presenter_.draw(*renderer_, frame, canvas, {}, turn); !drawn) return drawn;
    if (const Status shown = presenter_.present(*renderer_, canvas, std::nullopt); !shown) return shown;
  }
  renderer_->finish();
  return {};
}

Status FrameLoop::run(const std::function<bool()>& interrupted) {
  while (!finished_ && !interrupted()) {
    if (const Status status = step(); !status) return status;
  }
  return pictures_.at_end([this] {
    await_newest();
    return still();
  });
}

/// A former scene may still outlive the newest one (mirror/resume.h); the last picture is of the newest.
void FrameLoop::await_newest() const {
  for (auto model = parts_.feeds.model().state(); model->coming != nullptr;
       model = parts_.feeds.model().state()) {
    std::this_thread::sleep_for(std::max(model->coming_until - parts_.clock.now(), Duration(1)));
  }
}

Status FrameLoop::step() {
  const FramePlan plan = timing_.begin(offscreen() ? std::nullopt : parts_.display.refresh_period());
  const TimePoint begin = parts_.clock.now();
  handle_input();
  if (!parts_.display.visible()) {
    timing_.skipped();
    end_when_due();
    return {};
  }
  parts_.feeds.follow_daemon();
  // Somebody before a window reads why, and may get access in the meantime; nobody else would ever know.
  if (const Status let_in = parts_.feeds.follow_access(); !let_in && offscreen()) return let_in;
  parts_.feeds.follow_users();
  const FrameSources sources = parts_.feeds.newest();
  if (const std::size_t entities = sources.model->scene->entities.size(); entities != entities_shown_) {
    log_.debug("shows {} entities from now on", entities);
    entities_shown_ = entities;
  }
  fit_view(view_, *sources.model, parts_.display.width_px(), parts_.display.height_px(),
           offscreen() ? Fitting::follow : Fitting::once, headset_eye());

  if (parts_.display.graphics() == GraphicsState::lost) {
    if (const Status renewed = renew_graphics(); !renewed) return renewed;
  }
  // Frames that nobody sees are drawn smaller than the stills.
  Canvas canvas = canvas_of(offscreen() ? parts_.options.offscreen_scale : 1.0);
  if (offscreen()) {
    const Result<unsigned> own = renderer_->own_canvas(canvas.width_px, canvas.height_px);
    if (!own) return own.error();
    canvas.target = *own;
  }
  const LastTurn turn = offscreen() ? LastTurn::none : LastTurn::to_display;
  Frame frame = compose(begin, plan.light, sources, canvas, turn);
  if (parts_.options.stats) {
    add_stats(describe(timing_.figures(), figures_.frame_time), Presenter::picture_size(canvas).second,
              frame.overlay);
  }
  if (const Status drawn = presenter_.draw(*renderer_, frame, canvas, {}, turn); !drawn) return drawn;
  timing_.drawn();
  std::optional<PoseAnswer> shown;
  if (turn == LastTurn::to_display && sources.tracking != nullptr) {
    shown = sources.tracking->head_at(plan.light);
  }
  if (const Status done = presenter_.present(*renderer_, canvas, shown); !done) return done;
  if (const Status drawn = draw_panels(canvas, sources, begin); !drawn) return drawn;
  parts_.display.show();
  timing_.shown(frame, sources.tracking);
  count_frame(begin, *sources.model);

  const Result<bool> taken = pictures_.after_frame(
      {parts_.clock.now(), *sources.model, figures_.frame_time.count()}, [this] { return still(); });
  if (!taken) return taken.error();
  if (*taken && offscreen()) finished_ = true;
  end_when_due();
  if (offscreen() && !finished_) pace(begin);
  return {};
}

void FrameLoop::end_when_due() {
  const Duration duration = parts_.options.duration;
  if (duration > Duration::zero() && parts_.clock.now() - started_ >= duration) finished_ = true;
}

void FrameLoop::handle_input() {
  const WindowInput input = parts_.display.poll(view_.orbit);
  const PictureSize size{parts_.display.width_px(), parts_.display.height_px()};
  const TimePoint now = parts_.clock.now();
  const PanelledInput given = panels_.take(input.events, parts_.feeds.model(), view_, now);
  const InputWishes wishes =
      desktop_.handle({given.events, given.commands, given.taken, size, now}, parts_.feeds.model(), view_);
  if (wishes.end || input.close) finished_ = true;
  if (wishes.film) parts_.feeds.want_film();
  if (wishes.screenshot) pictures_.save_numbered([this] { return still(); });
}

Status FrameLoop::renew_graphics() {
  log_.warning("the graphics card was reset: drawing everything anew");
  const bool panels = panels_.shown();
  panels_.hide();
  renderer_.reset();  // Its objects went with the context.
  if (const Status renewed = parts_.display.renew(); !renewed) return renewed;
  Result<std::unique_ptr<Renderer>> renderer = Renderer::create();
  if (!renderer) return renderer.error();
  renderer_ = std::move(*renderer);
  ++figures_.graphics_resets;
  if (panels) {
    if (const Status shown = panels_.show(); !shown) return shown;
  }
  return warm_up();
}

Canvas FrameLoop::canvas_of(double scale) {
  Canvas canvas;
  canvas.width_px = scaled(parts_.display.width_px(), scale);
  canvas.height_px = scaled(parts_.display.height_px(), scale);
  canvas.views = parts_.display.views(canvas.width_px, canvas.height_px);
  return canvas;
}

std::optional<EyeOptics> FrameLoop::headset_eye() const {
  const std::vector<View> views = parts_.display.views(parts_.display.width_px(), parts_.display.height_px());
  return views.empty() ? std::nullopt : views.front().optics;
}

Frame FrameLoop::compose(TimePoint now, TimePoint light, const FrameSources& sources, const Canvas& canvas,
                         LastTurn turn) {
  FrameRequest request;
  request.camera = view_.camera;
  std::tie(request.width_px, request.height_px) = Presenter::picture_size(canvas);
  request.orbit = view_.orbit;
  request.now = now;
  request.display_time = light;
  request.largest_turn_rad = presenter_.largest_turn_rad(turn);
  request.distances = view_.distances;
  request.shading = view_.shading;
  request.curvature = view_.curvature;
  request.overlays = view_.overlays;
  request.edges = view_.edges;
  request.surroundings = view_.surroundings;
  parts_.feeds.model().want_control_nets(view_.overlays.control_nets ? ControlNetWish::shown
                                                                     : ControlNetWish::hidden);
  request.hand_occlusion = parts_.options.hand_occlusion;
  request.latency_ms = parts_.feeds.latency_ms();
  request.colours = panels_.colours();
  place_hud(request, canvas);
  Frame frame = compose_frame(request, sources,
                              [this](std::string_view text) { return renderer_->measure_text(text); });
  desktop_.add_to(frame);
  // Nobody's hand can touch it, and its commands are on the panels.
  if (panels_.shown() && sources.tracking == nullptr) frame.palette_page = 0;
  return frame;
}

Result<Image> FrameLoop::still() {
  RenderOptions rendering;
  rendering.supersampling = still_supersampling;
  rendering.curvatures = Curvatures::awaited;
  rendering.points = PointDetail::all;
  const FrameSources sources = parts_.feeds.newest();
  if (offscreen()) {
    fit_view(view_, *sources.model, parts_.display.width_px(), parts_.display.height_px(), Fitting::follow,
             headset_eye());
  }
  Canvas canvas = canvas_of(1.0);
  const Result<unsigned> own = renderer_->own_canvas(canvas.width_px, canvas.height_px);
  if (!own) return own.error();
  canvas.target = *own;
  const TimePoint now = parts_.clock.now();
  const Frame frame = compose(now, now + parts_.options.display_latency, sources, canvas, LastTurn::none);
  if (const Status drawn = presenter_.draw(*renderer_, frame, canvas, rendering, LastTurn::none); !drawn) {
    return drawn.error();
  }
  if (const Status done = presenter_.present(*renderer_, canvas, std::nullopt); !done) return done.error();
  if (offscreen() && panels_.shown()) {
    // What is first drawn knows no sizes yet.
    constexpr int settling_frames = 3;
    for (int i = 1; i < settling_frames; ++i) {
      if (const Status drawn = draw_panels(canvas, sources, parts_.clock.now()); !drawn) return drawn.error();
    }
    if (const Status done = presenter_.present(*renderer_, canvas, std::nullopt); !done) return done.error();
    if (const Status drawn = draw_panels(canvas, sources, parts_.clock.now()); !drawn) return drawn.error();
  }
  return renderer_->read_canvas();
}

bool FrameLoop::wants_panels() const {
  switch (parts_.options.panels) {
    case PanelWish::never:
      return false;
    case PanelWish::always:
      return true;
    case PanelWish::in_windows:
      break;
  }
  // A headset shows no edges: there, the table says it all.
  return !offscreen() && !parts_.options.stereo;
}

void FrameLoop::place_hud(FrameRequest& request, const Canvas& canvas) const {
  const bool headset = canvas.views.size() > 1 || view_.camera == CameraMode::head;
  if (const std::optional<PixelRect> free = panels_.free_part(); free && !headset) {
    request.hud = HudPlace::legends;
    request.hud_corner_px = free->corner;
    request.hud_size_px = free->size;
  } else if (headset) {
    request.hud = HudPlace::table;
    const std::optional<EyeOptics>& optics = canvas.views.front().optics;
    if (optics) request.eye_focal_px = optics->shown.fy_px;
  }
}

Status FrameLoop::draw_panels(const Canvas& canvas, const FrameSources& sources, TimePoint now) {
  if (!panels_.shown()) return {};
  Window* window = parts_.display.window();
  return panels_.draw({.width_px = canvas.width_px,
                       .height_px = canvas.height_px,
                       .content_scale = window == nullptr ? 1.0F : window->content_scale(),
                       .target = canvas.target,
                       .now = now,
                       .sources = sources,
                       .desktop = desktop_.state(),
                       .view = view_,
                       .latency_ms = parts_.feeds.latency_ms()});
}

void FrameLoop::count_frame(TimePoint begin, const ModelState& model) {
  const TimePoint now = parts_.clock.now();
  figures_.frame_time.add(now - begin);
  if (!model.connected && model.snapshots > 0) figures_.frame_time_alone.add(now - begin);
  constexpr double twice = 2.0, middle = 0.5;
  if (const double ms = 1e3 * to_seconds(now - begin); ms > twice * figures_.frame_time.quantile_ms(middle)) {
    log_.debug("frame {} took {:.1f} ms, the others {:.1f}", figures_.frame_time.count(), ms,
               figures_.frame_time.quantile_ms(middle));
  }
  constexpr std::uint64_t told_every = 10;
  if (figures_.frame_time.count() % told_every == 0) log_.debug("{} frames", figures_.frame_time.count());
  if (model.scene != presented_ && model.scene_capture_time != TimePoint{}) {
    figures_.capture_to_presentation.add(now - model.scene_capture_time);
  }
  presented_ = model.scene;
  if (parts_.metrics != nullptr && now - metrics_told_ >= metrics_every) {
    parts_.metrics->put(figures());
    metrics_told_ = now;
  }
}

void FrameLoop::pace(TimePoint begin) const {
  const TimePoint next = begin + from_seconds(1.0 / parts_.options.offscreen_rate_hz);
  const TimePoint now = parts_.clock.now();
  if (next > now) std::this_thread::sleep_for(next - now);
}

RunFigures FrameLoop::figures() const {
  RunFigures figures = figures_;
  figures.width_px = parts_.display.width_px();
  figures.height_px = parts_.display.height_px();
  figures.seconds = to_seconds(parts_.clock.now() - started_);
  figures.model = parts_.feeds.model().statistics();
  if (TrackingFeed* tracking = parts_.feeds.tracking(); tracking != nullptr) {
    figures.tracking = tracking->status();
  }
  figures.photons = timing_.figures();
  figures.scene = parts_.feeds.model().state()->scene;
  figures.screenshot = pictures_.taken() ? parts_.options.screenshot : "";
  return figures;
}

}  // namespace handloft::client
