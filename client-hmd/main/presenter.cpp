#include "client-hmd/main/presenter.h"

#include <algorithm>
#include <array>
#include <tuple>

namespace handloft::client {

std::pair<int, int> Presenter::picture_size(const Canvas& canvas) {
  const View& first = canvas.views.front();
  if (!first.optics) return {first.area.width_px, first.area.height_px};
  std::vector<EyeOptics> eyes;
  for (const View& view : canvas.views) eyes.push_back(*view.optics);
  return overlay_size(eyes);
}

double Presenter::largest_turn_rad(LastTurn turn) const {
  return turn == LastTurn::none ? 0.0 : options_.turn.largest_rad();
}

Status Presenter::draw(Renderer& renderer, const Frame& middle, const Canvas& canvas,
                       const RenderOptions& rendering, LastTurn turn) {
  constexpr std::array slots{PictureSlot::left, PictureSlot::right};
  frames_.clear();
  EyeFrameOptions eye;
  eye.film_depth_m = options_.film_depth_m;
  eye.largest_turn_rad = largest_turn_rad(turn);
  std::tie(eye.overlay_width_px, eye.overlay_height_px) = picture_size(canvas);
  for (std::size_t i = 0; i < std::min(canvas.views.size(), slots.size()); ++i) {
    const std::optional<EyeOptics>& optics = canvas.views[i].optics;
    frames_.push_back(optics ? frame_of_eye(middle, *optics, eye) : middle);
    if (const Status drawn = renderer.draw_scene(frames_.back(), rendering, slots[i]); !drawn) return drawn;
  }
  return {};
}

Status Presenter::present(Renderer& renderer, const Canvas& canvas,
                          const std::optional<PoseAnswer>& shown) const {
  constexpr std::array slots{PictureSlot::left, PictureSlot::right};
  const bool gaps = canvas.views.front().optics.has_value();
  if (gaps) renderer.clear(canvas.target);
  for (std::size_t i = 0; i < std::min(frames_.size(), canvas.views.size()); ++i) {
    const Frame& frame = frames_[i];
    const View& view = canvas.views[i];
    Presentation how = whole_picture(frame);
    how.area = view.area;
    how.canvas_height_px = canvas.height_px;
    if (view.optics) how.lens = view.optics->lens;
    if (frame.head) {
      how.drawn_from_shown = turned_to(frame, late_turn(frame.head->world_from_head, shown, options_.turn));
    }
    if (const Status done = renderer.present(how, frame.overlay, slots[i], canvas.target); !done) return done;
  }
  return {};
}

}  // namespace handloft::client
