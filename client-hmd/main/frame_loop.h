#pragma once
// The frame loop (V5): input, what is new, picture, display; it waits for the display's refresh and for
// nothing else. In this order, each in a place of its own: desktop_link.h makes input events into a hand and
// a camera, frame_composer.h decides what the frame shows, presenter.h draws it for every view,
// panel_link.h draws panels over it, pictures.h takes what is asked for. A graphics card that was reset is
// given everything anew: the scene is still in the mirror.

#include <functional>

#include "client-hmd/display/display.h"
#include "client-hmd/main/desktop_link.h"
#include "client-hmd/main/feeds.h"
#include "client-hmd/main/frame_timing.h"
#include "client-hmd/main/metrics.h"
#include "client-hmd/main/panel_link.h"
#include "client-hmd/main/pictures.h"
#include "client-hmd/main/presenter.h"
#include "client-hmd/main/report.h"
#include "client-hmd/render/renderer.h"

namespace handloft::client {

/// What a loop is made of; all of it outlives the loop.
struct FrameLoopParts {
  const HmdOptions& options;
  const Clock& clock;
  Feeds& feeds;
  Display& display;
  Metrics* metrics = nullptr;  ///< Null: nobody asks.
};

class FrameLoop {
 public:
  /// Errors: as Renderer::create().
  static Result<std::unique_ptr<FrameLoop>> create(FrameLoopParts parts, Logger log);

  /// Runs until people or the options end it, or `interrupted` says so; then takes the last picture. Errors:
  /// of drawing and of saving pictures.
  Status run(const std::function<bool()>& interrupted);

  /// Of the whole run.
  RunFigures figures() const;

 private:
  FrameLoop(FrameLoopParts parts, Logger log, std::unique_ptr<Renderer> renderer);

  bool wants_panels() const;
  Status warm_up();
  Status step();
  void handle_input();
  Status renew_graphics();
  Canvas canvas_of(double scale);
  /// The first eye's, in a headset.
  std::optional<EyeOptics> headset_eye() const;
  Frame compose(TimePoint now, TimePoint light, const FrameSources& sources, const Canvas& canvas,
                LastTurn turn);
  void end_when_due();
  Result<Image> still();
  void await_newest() const;
  void place_hud(FrameRequest& request, const Canvas& canvas) const;
  Status draw_panels(const Canvas& canvas, const FrameSources& sources, TimePoint now);
  void count_frame(TimePoint begin, const ModelState& model);
  void pace(TimePoint begin) const;
  bool offscreen() const { return parts_.display.window() == nullptr; }

  FrameLoopParts parts_;
  Logger log_;
  std::unique_ptr<Renderer> renderer_;
  FrameTiming timing_;
  Presenter presenter_;
  ViewState view_;
  PanelLink panels_;
  DesktopLink desktop_;
  Pictures pictures_;
  TimePoint started_;
  bool finished_ = false;
  std::shared_ptr<const Scene> presented_;
  std::size_t entities_shown_ = 0;
  TimePoint metrics_told_;
  RunFigures figures_;
};

}  // namespace handloft::client
