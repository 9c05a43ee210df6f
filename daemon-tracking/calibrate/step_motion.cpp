// head-rig and check.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "daemon-tracking/calibrate/seen_tags.h"
#include "daemon-tracking/calibrate/steps.h"
#include "daemon-tracking/calibration/check.h"
#include "daemon-tracking/calibration/picture.h"
#include "daemon-tracking/calibration/trajectory.h"

namespace handloft::tracking {
namespace {

namespace fs = std::filesystem;

struct Watched {
  std::vector<TagSight> sights;
  std::map<std::uint32_t, Plane> last;
  Input input;
};

Result<Watched> watch(StepContext& context) {
  auto tags = SeenTags::create(context.calibration.rig);
  if (!tags) return tags.error();
  auto input = open_input(context.options, context.calibration);
  if (!input) return input.error();
  Watched watched;
  std::optional<Error> wrong_size;
  const auto count =
      for_each_frame(*input, context.options, context.calibration, DecodePlanes::luma, context.terminal,
                     [&](const CameraFrame& frame, const PlanarImage& image, const std::string&) {
                       const DeviceIdentity same = context.calibration.cameras[frame.camera].device;
                       const Status fits = check_device(context.calibration, frame.camera, same,
                                                        frame.width_px, frame.height_px);
                       if (!fits) {
                         wrong_size = fits.error();
                         return;
                       }
                       tags->look(frame, image.y);
                       watched.last[frame.camera] = image.y;
                     });
  if (!count) return count.error();
  if (wrong_size) return *wrong_size;
  for (const auto& [camera, device] : input->devices) {
    const Status fits = check_device(context.calibration, camera, device,
                                     context.calibration.rig.cameras[camera].intrinsics.width_px,
                                     context.calibration.rig.cameras[camera].intrinsics.height_px);
    if (!fits) return fits.error();
  }
  watched.sights = tags->sights();
  watched.input = std::move(*input);
  return watched;
}

Status draw_last(const StepContext& context, const Watched& watched, const char* step) {
  for (const auto& [camera, plane] : watched.last) {
    Picture picture(plane);
    const auto seen =
        std::find_if(watched.sights.rbegin(), watched.sights.rend(),
                     [camera = camera](const TagSight& sight) { return sight.camera == camera; });
    if (seen != watched.sights.rend())
      for (const TagDetection& tag : seen->tags) {
        for (std::size_t i = 0; i < 4; ++i)
          picture.line(tag.corners_px[i], tag.corners_px[(i + 1) % 4], ink::good, 2);
        picture.text(tag.corners_px[0], fmt::format("{}", tag.id), ink::note);
      }
    const std::string& name = context.calibration.rig.cameras[camera].name;
    picture.text({8, 18}, fmt::format("{}: tags of the last frame", name), ink::note);
    if (const Status saved =
            picture.save(fs::path(context.options.out) / fmt::format("{}-{}.png", step, name));
        !saved)
      return saved;
  }
  return {};
}

}  // namespace

Result<Verdict> run_head_rig(StepContext& context) {
  auto watched = watch(context);
  if (!watched) return watched.error();
  if (const Status drawn = draw_last(context, *watched, "head-rig"); !drawn) return drawn.error();
  Rig& rig = context.calibration.rig;
  const TrajectoryInput input{rig.cameras, rig.head_tags, rig.table_tags, std::move(watched->sights)};
  TrajectoryOptions options;
  options.row_times = context.options.row_times ? Estimate::find : Estimate::keep;
  auto made = calibrate_on_the_move(input, options);
  if (!made) return made.error();
  tell(context, "head rig", made->result);
  for (std::size_t i = 0; i < made->body_tags.size(); ++i) {
    const Eigen::Isometry3d shift =
        input.body_tags[i].body_from_tag.inverse() * made->body_tags[i].body_from_tag;
    if (context.terminal == nullptr) continue;
    const auto& sigma_m = made->tag_sigma_m[i];
    const std::string known = !sigma_m        ? "not seen"
                              : *sigma_m == 0 ? "it carries the rig's frame"
                                              : fmt::format("known to {:.2f} mm", 1e3 * *sigma_m);
    fmt::print(context.terminal, "  tag {}: {:.1f} mm and {:.1f} degrees from where it was said to be; {}.\n",
               made->body_tags[i].id, 1e3 * shift.translation().norm(),
               57.29577951 * Eigen::AngleAxisd(shift.linear()).angle(), known);
  }
  if (made->result.verdict == Verdict::bad) return Verdict::bad;
  rig.head_tags = made->body_tags;
  made->result.date = context.date;
  context.calibration.results["head_rig"] = made->result;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    CameraTiming& timing = made->cameras[i];
    if (timing.corners == 0) continue;
    rig.cameras[i].head_from_camera = made->head_from_camera[i];
    tell(context, fmt::format("{}'s clock", rig.cameras[i].name), timing.result);
    if (timing.result.verdict == Verdict::bad) continue;
    if (worth_using(timing)) rig.cameras[i].time_offset += from_seconds(timing.offset_s);
    if (context.options.row_times) context.calibration.rig.cameras[i].row_time = from_seconds(timing.row_s);
    timing.result.date = context.date;
    context.calibration.cameras[i].results["time"] = timing.result;
  }
  return made->result.verdict;
}

Result<Verdict> run_check(StepContext& context) {
  auto watched = watch(context);
  if (!watched) return watched.error();
  if (const Status drawn = draw_last(context, *watched, "check"); !drawn) return drawn.error();
  const auto made = check_sights(context.calibration, watched->sights);
  if (!made) return made.error();
  Verdict worst = made->result.verdict;
  for (const CameraCheck& camera : made->cameras) {
    if (!wants_camera(context.options, camera.name)) continue;
    tell(context, camera.name, camera.result);
  }
  tell(context, "all", made->result);
  for (std::size_t i = 0; i < context.calibration.cameras.size(); ++i)
    for (const auto& [step, result] : context.calibration.cameras[i].results)
      if (context.terminal != nullptr)
        fmt::print(context.terminal, "  {} of {}: {} on {} ({:.2f} {})\n", step,
                   context.calibration.rig.cameras[i].name, to_string(result.verdict), result.date,
                   result.residual, result.unit);
  return worst;
}

}  // namespace handloft::tracking
