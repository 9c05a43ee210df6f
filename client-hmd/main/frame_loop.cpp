#include "client-hmd/main/frame_loop.h"

#include <algorithm>
#include <cmath>
#include <thread>

namespace handloft::client {
namespace {

constexpr int still_supersampling = 2;

int scaled(int pixels, double scale) {
  return std::max(1, static_cast<int>(std::lround(pixels * scale)));
}

}  // namespace

Result<std::unique_ptr<FrameLoop>> FrameLoop::create(FrameLoopParts parts, Logger log) {
  Result<std::unique_ptr<Renderer>> renderer = Renderer::create();
  if (!renderer) return renderer.error();
  return std::unique_ptr<FrameLoop>(new FrameLoop(std::move(parts), std::move(log), std::move(*renderer)));
}

FrameLoop::FrameLoop(FrameLoopParts parts, Logger log, std::unique_ptr<Renderer> renderer)
    : parts_(std::move(parts)),
      log_(std::move(log)),
      renderer_(std::move(renderer)),
      view_(parts_.options),
      desktop_(parts_.options),
      pictures_(parts_.options, log_, parts_.clock.now()),
      started_(parts_.clock.now()) {
  figures_.offscreen = offscreen();
}

Status FrameLoop::run(const std::function<bool()>& interrupted) {
  while (!finished_ && !interrupted()) {
    if (const Status status = step(); !status) return status;
  }
  return pictures_.at_end([this] { return still(); });
}

Status FrameLoop::step() {
  const TimePoint begin = parts_.clock.now();
  handle_input();
  parts_.feeds.follow_daemon();
  parts_.feeds.follow_users();
  const FrameSources sources = parts_.feeds.newest();
  fit_view(view_, *sources.model, parts_.display.width_px(), parts_.display.height_px(),
           offscreen() ? Fitting::follow : Fitting::once);

  const Frame frame = compose(begin, sources, Purpose::frame);
  const RenderOptions rendering;
  const Status drawn =
      offscreen() ? renderer_->draw_offscreen(frame, rendering) : renderer_->draw(frame, rendering);
  if (!drawn) return drawn;
  if (Window* window = parts_.display.window(); window != nullptr && parts_.over_picture) {
    parts_.over_picture({*window, sources, frame, view_});
  }
  parts_.display.show();
  count_frame(begin, *sources.model);

  const Result<bool> taken = pictures_.after_frame(
      {parts_.clock.now(), *sources.model, figures_.frame_time.count()}, [this] { return still(); });
  if (!taken) return taken.error();
  if (*taken && offscreen()) finished_ = true;
  const Duration duration = parts_.options.duration;
  if (duration > Duration::zero() && parts_.clock.now() - started_ >= duration) finished_ = true;
  if (offscreen() && !finished_) pace(begin);
  return {};
}

void FrameLoop::handle_input() {
  const WindowInput input = parts_.display.poll(view_.orbit);
  const PictureSize size{parts_.display.width_px(), parts_.display.height_px()};
  const InputWishes wishes =
      desktop_.handle({input.events, {}, {}, size, parts_.clock.now()}, parts_.feeds.model(), view_);
  if (wishes.end || input.close) finished_ = true;
  if (wishes.film) parts_.feeds.want_film();
  if (wishes.screenshot) pictures_.save_numbered([this] { return still(); });
}

Frame FrameLoop::compose(TimePoint now, const FrameSources& sources, Purpose purpose) {
  // Frames that nobody sees are drawn smaller than the stills.
  const double scale = offscreen() && purpose == Purpose::frame ? parts_.options.offscreen_scale : 1.0;
  FrameRequest request;
  request.camera = view_.camera;
  request.width_px = scaled(parts_.display.width_px(), scale);
  request.height_px = scaled(parts_.display.height_px(), scale);
  request.orbit = view_.orbit;
  request.now = now;
  request.display_time = now + parts_.options.display_latency;
  request.late_warp = purpose == Purpose::frame && !offscreen();
  request.distances = view_.distances;
  request.shading = view_.shading;
  request.latency_ms = parts_.feeds.latency_ms();
  Frame frame = compose_frame(request, sources,
                              [this](std::string_view text) { return renderer_->measure_text(text); });
  desktop_.add_to(frame);
  return frame;
}

Result<Image> FrameLoop::still() {
  RenderOptions rendering;
  rendering.supersampling = still_supersampling;
  const FrameSources sources = parts_.feeds.newest();
  if (offscreen()) {
    fit_view(view_, *sources.model, parts_.display.width_px(), parts_.display.height_px(), Fitting::follow);
  }
  return renderer_->draw_to_image(compose(parts_.clock.now(), sources, Purpose::still), rendering);
}

void FrameLoop::count_frame(TimePoint begin, const ModelState& model) {
  const TimePoint now = parts_.clock.now();
  figures_.frame_time.add(now - begin);
  if (model.scene != presented_ && model.scene_capture_time != TimePoint{}) {
    figures_.capture_to_presentation.add(now - model.scene_capture_time);
  }
  presented_ = model.scene;
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
  figures.scene = parts_.feeds.model().state()->scene;
  figures.screenshot = pictures_.taken() ? parts_.options.screenshot : "";
  return figures;
}

}  // namespace handloft::client
