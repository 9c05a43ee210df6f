// colours and glove.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "daemon-tracking/calibrate/steps.h"
#include "daemon-tracking/calibration/colours.h"
#include "daemon-tracking/calibration/glove_ranges.h"
#include "daemon-tracking/calibration/picture.h"
#include "daemon-tracking/vision/fingertip_tracker.h"

namespace handloft::tracking {
namespace {

namespace fs = std::filesystem;

constexpr std::array<Ink, finger_count> finger_inks = {
    {{1, 0.2, 0.2, 1}, {0.2, 0.9, 0.2, 1}, {0.3, 0.4, 1, 1}, {1, 1, 0.2, 1}, {1, 0.3, 1, 1}}};

Status draw_colours(const StepContext& context, const std::string& name, const PlanarImage& last,
                    const ColourCalibration& made) {
  Picture picture(last.y);
  if (auto tracker = FingertipTracker::create(made.colours, {})) {
    for (const FingertipBlob& blob : tracker->track(last, from_ns(1))) {
      const auto finger = static_cast<std::size_t>(blob.finger);
      picture.circle(blob.centre_px, std::sqrt(blob.area_px / 3.14159265), finger_inks[finger]);
      picture.text(blob.centre_px, finger_name(blob.finger), finger_inks[finger], 11);
    }
  }
  picture.text({8, 18}, fmt::format("{}: caps found with the colours learned", name), ink::note);
  if (const Status saved = picture.save(fs::path(context.options.out) / fmt::format("colours-{}.png", name));
      !saved)
    return saved;
  // The chroma plane: Cb to the right, Cr upwards, an ellipse of two standard deviations each.
  constexpr double zoom = 2.0;
  Picture plane(512, 512, {0.25, 0.25, 0.25, 1});
  const auto at = [](double cb, double cr) { return Eigen::Vector2d(zoom * cb, 511 - zoom * cr); };
  plane.circle(at(128, 128), zoom * 28, ink::white);
  plane.text(at(112, 126), "background", ink::white, 11);
  for (std::size_t i = 0; i < finger_count; ++i) {
    const FingertipColour& colour = made.colours[i];
    for (int step = 0; step < 36; ++step) {
      const auto rim = [&](int k) {
        const double angle = k * 2 * 3.14159265 / 36;
        return at(colour.cb + 2 * colour.sigma_cb * std::cos(angle),
                  colour.cr + 2 * colour.sigma_cr * std::sin(angle));
      };
      plane.line(rim(step), rim(step + 1), finger_inks[i], 2);
    }
    plane.text(at(colour.cb, colour.cr), finger_name(colour.finger), finger_inks[i], 12);
  }
  return plane.save(fs::path(context.options.out) / fmt::format("chroma-{}.png", name));
}

}  // namespace

Result<Verdict> run_colours(StepContext& context) {
  auto input = open_input(context.options, context.calibration);
  if (!input) return input.error();
  Rig& rig = context.calibration.rig;
  std::map<std::uint32_t, ColourLearner> learners;
  std::map<std::uint32_t, PlanarImage> last;
  const auto count = for_each_frame(
      *input, context.options, context.calibration, DecodePlanes::luma_and_chroma, context.terminal,
      [&](const CameraFrame& frame, const PlanarImage& image, const std::string&) {
        if (rig.cameras[frame.camera].role != CameraRole::table) return;
        learners.try_emplace(frame.camera, rig.colours).first->second.add(image);
        last[frame.camera] = image;
      });
  if (!count) return count.error();
  if (learners.empty())
    return make_error(ErrorCode::failed_precondition, "no frame of a table camera came", "colours");
  Verdict worst = Verdict::good;
  for (const auto& [camera, learner] : learners) {
    const std::string& name = rig.cameras[camera].name;
    auto made = learner.learn();
    if (!made) {
      Error error = made.error();
      error.field = fmt::format("colours.{}", name);
      return error;
    }
    tell(context, name, made->result);
    for (std::size_t i = 0; i < finger_count; ++i)
      if (context.terminal != nullptr)
        fmt::print(context.terminal, "  {}: Cb {:.0f} +- {:.0f}, Cr {:.0f} +- {:.0f}, from {} samples.\n",
                   finger_name(static_cast<Finger>(i)), made->colours[i].cb, made->colours[i].sigma_cb,
                   made->colours[i].cr, made->colours[i].sigma_cr, made->samples[i]);
    if (const Status drawn = draw_colours(context, name, last[camera], *made); !drawn) return drawn.error();
    worst = std::max(worst, made->result.verdict);
    if (made->result.verdict == Verdict::bad) continue;
    made->result.date = context.date;
    context.calibration.cameras[camera].colours = made->colours;
    context.calibration.cameras[camera].results["colours"] = made->result;
  }
  return worst;
}

Result<Verdict> run_glove(StepContext& context) {
  auto input = open_input(context.options, context.calibration);
  if (!input) return input.error();
  std::vector<GloveReport> reports;
  std::size_t refused = 0;
  while (const auto sample = input->stream->next()) {
    const GloveBytes* bytes = std::get_if<GloveBytes>(&*sample);
    if (bytes == nullptr) continue;
    if (const auto report = parse_glove_report(bytes->bytes))
      reports.push_back(*report);
    else
      ++refused;
  }
  if (refused > 0 && context.terminal != nullptr)
    fmt::print(context.terminal, "{} reports were no input reports of this glove.\n", refused);
  auto made = calibrate_glove(reports);
  if (!made) return made.error();
  tell(context, "glove", made->result);
  // The force over time, with what was found of it.
  Picture chart(800, 300, ink::white);
  const auto at = [&](std::size_t i, double value) {
    return Eigen::Vector2d(800.0 * static_cast<double>(i) / static_cast<double>(reports.size()),
                           290 - 280 * value / glove_analogue_max);
  };
  for (std::size_t i = 1; i < reports.size(); ++i) {
    chart.line(at(i - 1, reports[i - 1].force), at(i, reports[i].force), ink::black);
    chart.line(at(i - 1, reports[i - 1].potentiometer), at(i, reports[i].potentiometer), {0.2, 0.4, 1, 1});
  }
  for (const double level : {made->ranges.force_zero, made->ranges.force_full})
    chart.line(at(0, level), at(reports.size(), level), ink::bad);
  for (const double level : {made->ranges.potentiometer_low, made->ranges.potentiometer_high})
    chart.line(at(0, level), at(reports.size(), level), ink::good);
  chart.text({8, 16}, "black: force, red: its zero and full; blue: potentiometer, green: its ends", ink::note,
             12);
  if (const Status saved = chart.save(fs::path(context.options.out) / "glove.png"); !saved)
    return saved.error();
  if (made->result.verdict == Verdict::bad) return Verdict::bad;
  if (context.calibration.glove) made->ranges.device = context.calibration.glove->device;
  // A recording does not say which glove it was of: what the file knows stays.
  if (const auto plugged = input->glove ? input->glove() : std::nullopt) made->ranges.device = *plugged;
  context.calibration.glove = made->ranges;
  made->result.date = context.date;
  context.calibration.results["glove"] = made->result;
  return made->result.verdict;
}

}  // namespace handloft::tracking
