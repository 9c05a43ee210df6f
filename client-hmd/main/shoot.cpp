#include "client-hmd/main/shoot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <ostream>
#include <thread>

#include "client-hmd/main/scene_extent.h"
#include "client-hmd/shots/matte.h"
#include "client-hmd/shots/picture_files.h"
#include "client-hmd/shots/shot_script.h"

namespace handloft::client {
namespace {

constexpr auto settled_after = std::chrono::milliseconds(500);  ///< Surfaces come when they are tessellated.
constexpr auto patience = std::chrono::seconds(10);
constexpr auto look_again_after = std::chrono::milliseconds(20);
constexpr double room_m = 20.0;  ///< Drawn behind the target, as DepthRange has it.

/// The eye of `camera`, `to_the_right_m` of it; what is at the target stays where it is in the picture.
Eye eye_beside(const OrbitCamera& camera, int width_px, int height_px, double to_the_right_m) {
  Eye eye = camera.eye(width_px, height_px);
  const glm::dvec3 right = eye.world_from_eye.orientation * glm::dvec3(1, 0, 0);
  eye.world_from_eye.position += to_the_right_m * right;
  eye.pinhole.cx_px += eye.pinhole.fx_px * to_the_right_m / camera.distance_m;
  eye.depth.far_m = std::max(eye.depth.far_m, camera.distance_m + room_m);
  return eye;
}

Image side_by_side(const Image& left, const Image& right) {
  Image both{left.width_px + right.width_px, left.height_px, {}};
  both.rgba.reserve(left.rgba.size() + right.rgba.size());
  const auto row = [](const Image& image, int y) {
    const auto stride = static_cast<std::ptrdiff_t>(4) * image.width_px;
    return std::pair{image.rgba.begin() + y * stride, image.rgba.begin() + (y + 1) * stride};
  };
  for (int y = 0; y < left.height_px; ++y) {
    for (const Image* image : {&left, &right}) {
      const auto [begin, end] = row(*image, y);
      both.rgba.insert(both.rgba.end(), begin, end);
    }
  }
  return both;
}

Result<Image> draw_eye(Renderer& renderer, const ShotPlan& plan, Frame& frame) {
  RenderOptions rendering;
  rendering.supersampling = plan.supersampling;
  rendering.curvatures = Curvatures::awaited;
  if (plan.background == ShotBackground::studio) return renderer.draw_to_image(frame, rendering);
  frame.plain_backdrop = glm::vec3(0.0F);
  const Result<Image> black = renderer.draw_to_image(frame, rendering);
  if (!black) return black.error();
  frame.plain_backdrop = glm::vec3(matte_grey);
  const Result<Image> grey = renderer.draw_to_image(frame, rendering);
  if (!grey) return grey.error();
  return difference_matte(*black, *grey);
}

/// The scene once nothing of it has changed for a while.
Result<std::shared_ptr<const Scene>> settled_scene(const ShootParts& parts,
                                                   const std::function<bool()>& interrupted) {
  const TimePoint begun = parts.clock.now();
  while (!interrupted()) {
    if (const Status let_in = parts.feeds.follow_access(); !let_in) return let_in.error();
    const std::shared_ptr<const ModelState> model = parts.feeds.newest().model;
    const TimePoint now = parts.clock.now();
    if (model->snapshots > 0 && model->coming == nullptr && now - model->received_at >= settled_after) {
      return model->scene;
    }
    // One that never rests is taken as it is by then.
    if (now - begun >= patience) {
      if (model->snapshots > 0) return model->scene;
      return make_error(ErrorCode::timeout, "no scene came from the model server" +
                                                (model->problem.empty() ? "" : ": " + model->problem));
    }
    std::this_thread::sleep_for(look_again_after);
  }
  return make_error(ErrorCode::cancelled, "ended before the first picture was taken");
}

/// The scene as the picture shows it; the same one as long as that is the same.
class ShownScene {
 public:
  explicit ShownScene(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)), shown_(scene_) {}
  const std::shared_ptr<const Scene>& as(std::optional<Representation> representation) {
    if (representation != representation_) {
      shown_ = representation ? shown_as(scene_, *representation) : scene_;
      representation_ = representation;
    }
    return shown_;
  }

 private:
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const Scene> shown_;
  std::optional<Representation> representation_;
};

}  // namespace

Result<ShotPlan> plan_of(const HmdOptions& options) {
  ShotPlan plan;
  if (!options.shots.script.empty()) {
    Result<ShotPlan> read = read_shot_script(options.shots.script);
    if (!read) return read;
    plan = std::move(*read);
  } else {
    TurntableOptions turntable;
    turntable.frames = options.shots.frames;
    turntable.elevation_rad = glm::radians(options.shots.elevation_deg);
    if (options.shots.distance_m > 0.0) turntable.distance_m = options.shots.distance_m;
    plan = turntable_plan(turntable);
    plan.width_px = options.width_px;
    plan.height_px = options.height_px;
    if (options.stereo) plan.eyes = ShotEyes::side_by_side;
  }
  if (options.shots.transparent) plan.background = ShotBackground::transparent;
  return plan;
}

Result<Image> draw_shot(Renderer& renderer, const ShotPlan& plan, const ShotView& view, Frame frame) {
  if (plan.eyes == ShotEyes::one) {
    frame.eye = eye_beside(view.camera, plan.width_px, plan.height_px, 0.0);
    return draw_eye(renderer, plan, frame);
  }
  frame.eye = eye_beside(view.camera, plan.width_px, plan.height_px, -plan.eye_distance_m / 2.0);
  const Result<Image> left = draw_eye(renderer, plan, frame);
  if (!left) return left;
  frame.eye = eye_beside(view.camera, plan.width_px, plan.height_px, plan.eye_distance_m / 2.0);
  const Result<Image> right = draw_eye(renderer, plan, frame);
  if (!right) return right;
  return side_by_side(*left, *right);
}

Status shoot(const ShootParts& parts, const std::function<bool()>& interrupted, const Logger& log) {
  // What can be wrong about the wishes is told before anybody waits.
  const Result<ShotPlan> plan = plan_of(parts.options);
  if (!plan) return plan.error();
  const SequenceOptions& wishes = parts.options.shots;
  const Result<PictureFiles> files =
      PictureFiles::prepare(wishes.script.empty() ? wishes.turntable : wishes.pictures, plan->frames(),
                            wishes.overwrite ? ExistingFiles::overwrite : ExistingFiles::keep);
  if (!files) return files.error();
  const Result<std::unique_ptr<Renderer>> renderer = Renderer::create();
  if (!renderer) return renderer.error();
  const Result<std::shared_ptr<const Scene>> scene = settled_scene(parts, interrupted);
  if (!scene) return scene.error();
  const Result<Shot> shot = Shot::settle(*plan, visible_places(**scene));
  if (!shot) return shot.error();

  ShownScene shown(*scene);
  const std::size_t tenth = std::max<std::size_t>(shot->frames() / 10, 1);
  for (std::size_t i = 0; i < shot->frames(); ++i) {
    if (interrupted()) {
      return make_error(ErrorCode::cancelled,
                        fmt::format("ended after {} of {} pictures", i, shot->frames()));
    }
    const ShotView view = shot->view(i);
    Frame frame;
    frame.scene = shown.as(view.show);
    frame.surroundings = Surroundings::bare;
    frame.shading = view.shading.value_or(parts.options.shading);
    if (parts.options.distances) {
      frame.distances = DistanceScale{static_cast<float>(parts.options.distance_range_mm / 1e3)};
    }
    const Result<Image> image = draw_shot(**renderer, *plan, view, std::move(frame));
    if (!image) return image.error();
    if (const Status written = files->write(i, *image); !written) return written;
    if ((i + 1) % tenth == 0) log.info("{} of {} pictures", i + 1, shot->frames());
  }
  parts.out << files->how_to_make_a_video(plan->rate_hz) << std::endl;
  return {};
}

}  // namespace handloft::client
