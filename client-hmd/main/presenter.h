#pragma once
// From a composed frame to light, in two steps (V1): draw() composes the picture of every view, which takes
// most of a frame's time; present() is short and turns them by what the head has done since, so that its pose
// can be asked for as late as possible.

#include "client-hmd/display/display.h"
#include "client-hmd/main/eye_frames.h"
#include "client-hmd/render/renderer.h"
#include "client-hmd/view/late_turn.h"

namespace handloft::client {

/// A canvas of framebuffer `target` and its parts.
struct Canvas {
  int width_px = 1;
  int height_px = 1;
  std::vector<View> views;
  unsigned target = 0;
};

struct PresenterOptions {
  LateTurnLimits turn;
  double film_depth_m = 0.5;  ///< As EyeFrameOptions.
};

/// Whether the finished picture is turned to when it is seen, or kept as it is.
enum class LastTurn { none, to_display };

class Presenter {
 public:
  explicit Presenter(const PresenterOptions& options = {}) : options_(options) {}

  /// Size in pixels that the overlay of a frame is laid out for, and a mono frame drawn with.
  static std::pair<int, int> picture_size(const Canvas& canvas);
  /// `largest_turn_rad` of the FrameRequest for these views.
  double largest_turn_rad(LastTurn turn) const;

  /// `middle`: composed for picture_size(). Errors: as Renderer::draw_scene().
  Status draw(Renderer& renderer, const Frame& middle, const Canvas& canvas, const RenderOptions& rendering,
              LastTurn turn);
  /// Everything that was drawn, onto the canvas, which is made black where no view is. `shown`: the head when
  /// the display lights up, if it is known. Errors: as Renderer::present().
  Status present(Renderer& renderer, const Canvas& canvas, const std::optional<PoseAnswer>& shown) const;

  /// What the views drawn last show; as many as the canvas had views.
  const std::vector<Frame>& frames() const { return frames_; }

 private:
  PresenterOptions options_;
  std::vector<Frame> frames_;
};

}  // namespace handloft::client
