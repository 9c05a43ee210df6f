// How well, and at what cost, hand and head are followed on one rendered session, beside what is commonly
// done, in the same run on the same frames (T5 to T7):
//
//   ours            regions of interest, every camera's frame at its own time, rows at theirs
//   rows unknown    the same, but the shutter is taken to be global
//   whole frames    tags and caps are looked for everywhere in every frame, at full resolution
//   newest frames   the newest blobs and corners of all cameras, taken as if of one moment
//
//   compare_tracking [--seconds 12] [--noise 1] [--blur 0.6] [--row-us 50] [--cameras 2] [--motion FILE.tsv]
//   [--seed 1]
//
// A tip is unsure while it is single or predicted: one camera or none saw it lately.
//
// The pictures are drawn by the simulated rig: noise, blur, a rolling shutter and a distorting lens in code
// that the estimator does not share. Drawing is not counted.

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <ctime>
#include <map>
#include <string>
#include <vector>

#include "daemon-tracking/fusion/tracking_pipeline.h"
#include "daemon-tracking/source/simulated/motion_program.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"
#include "daemon-tracking/source/simulated/tour_program.h"
#include "daemon-tracking/vision/triangulation.h"

namespace {

using namespace handloft;
using namespace handloft::tracking;

constexpr double settle_s = 1.0;  ///< From the session's begin; not counted.
constexpr double smooth_delay_s = 0.040;

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct RootMeanSquare {
  double sum = 0, count = 0, worst = 0;
  void add(double value) {
    sum += value * value;
    ++count;
    worst = std::max(worst, value);
  }
  double value() const { return count > 0 ? std::sqrt(sum / count) : std::nan(""); }
};

struct Figures {
  RootMeanSquare tips_m;  ///< Seen by two cameras or more lately.
  RootMeanSquare unsure_m, smooth_m, head_m, head_rad;
  double lost = 0, asked = 0;
  double cpu_ms = 0;  ///< A frame.
};

struct Session {
  Rig rig;
  std::vector<Sample> samples;
  std::map<TimePoint, Truth> truths;
  std::size_t frames = 0;
};

struct Shutter {
  Duration row_time{};
};

/// Table cameras beside the default rig's two, so that all look at the hand.
Rig rig_of(int table_cameras) {
  Rig rig = default_rig();
  if (table_cameras == 2) return rig;
  const CameraCalibration left = rig.cameras[0], right = rig.cameras[1];
  for (int extra = 2; extra < table_cameras; ++extra) {
    // Turned about the table's vertical axis, away from both.
    CameraCalibration more = extra % 2 == 0 ? left : right;
    const double turn = (extra % 2 == 0 ? 0.45 : -0.45) * (1 + (extra - 2) / 2);
    more.name = fmt::format("more-{}", extra);
    more.world_from_camera = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) * more.world_from_camera;
    rig.cameras.push_back(more);
  }
  return rig;
}

void count_tip(RootMeanSquare& errors, const Truth& truth, std::size_t finger,
               const Eigen::Vector3d& position) {
  errors.add((position - Eigen::Vector3d(truth.fingertips_m[finger])).norm());
}

void count_head(Figures& figures, const Truth& truth, const Eigen::Vector3d& position,
                const Eigen::Quaterniond& orientation) {
  const double* q = truth.head_orientation_wxyz;
  figures.head_m.add((position - Eigen::Vector3d(truth.head_position_m)).norm());
  figures.head_rad.add(orientation.angularDistance(Eigen::Quaterniond(q[0], q[1], q[2], q[3])));
}

bool settled(TimePoint time) {
  return to_seconds(time - TimePoint{}) > settle_s;
}

Result<Figures> follow(const Session& session, const Shutter& shutter, const PipelineOptions& options) {
  Rig rig = session.rig;
  for (CameraCalibration& camera : rig.cameras) camera.row_time = shutter.row_time;
  auto pipeline = TrackingPipeline::create(rig, options);
  if (!pipeline) return pipeline.error();
  Figures figures;
  double spent_s = 0;
  for (const Sample& sample : session.samples) {
    const double begin = processor_s();
    const auto state = pipeline->consume(sample);
    spent_s += processor_s() - begin;
    if (!state || !settled(state->time)) continue;
    const auto truth = session.truths.find(state->time);
    if (truth == session.truths.end() || !truth->second.hand_present) continue;
    for (std::size_t f = 0; f < finger_count; ++f) {
      ++figures.asked;
      const FusedTip& tip = state->hand.tips[f];
      if (tip.state == TrackingState::lost) {
        ++figures.lost;
      } else {
        count_tip(tip.state == TrackingState::tracked ? figures.tips_m : figures.unsure_m, truth->second, f,
                  tip.position_m);
      }
    }
    if (state->head.position_valid)
      count_head(figures, truth->second, state->head.position_m, state->head.orientation);
    // Some time later, at a moment whose truth was told.
    const auto before = session.truths.lower_bound(state->time - from_seconds(smooth_delay_s));
    if (before == session.truths.end() || !before->second.hand_present) continue;
    for (std::size_t f = 0; f < finger_count; ++f) {
      const TipAt tip = pipeline->tip_at(static_cast<Finger>(f), before->first);
      if (tip.kind == ResultKind::interpolated || tip.kind == ResultKind::exact)
        figures.smooth_m.add((tip.position_m - Eigen::Vector3d(before->second.fingertips_m[f])).norm());
    }
  }
  figures.cpu_ms = 1e3 * spent_s / static_cast<double>(session.frames);
  return figures;
}

/// What is commonly done: at every frame, the newest of all cameras as if exposed together.
Result<Figures> pair_newest(const Session& session) {
  std::vector<CameraTracker> trackers;
  std::vector<CameraModel> models;
  for (std::uint32_t camera = 0; camera < session.rig.cameras.size(); ++camera) {
    auto tracker = CameraTracker::create(session.rig, camera);
    if (!tracker) return tracker.error();
    trackers.push_back(std::move(*tracker));
    auto model = CameraModel::create(session.rig.cameras[camera].intrinsics);
    if (!model) return model.error();
    models.push_back(*model);
  }
  std::vector<CameraObservation> newest(trackers.size());
  Figures figures;
  double spent_s = 0;
  for (const Sample& sample : session.samples) {
    const auto* frame = std::get_if<CameraFrame>(&sample);
    if (frame == nullptr) continue;
    const double begin = processor_s();
    auto observation = trackers[frame->camera].process(*frame);
    if (!observation) continue;
    newest[frame->camera] = std::move(*observation);
    std::array<std::optional<Eigen::Vector3d>, finger_count> tips;
    for (std::size_t f = 0; f < finger_count; ++f) {
      std::vector<PointView> views;
      for (std::size_t c = 0; c < newest.size(); ++c) {
        if (session.rig.cameras[c].role != CameraRole::table) continue;
        for (const FingertipBlob& blob : newest[c].blobs) {
          if (blob.finger != static_cast<Finger>(f)) continue;
          views.push_back(
              {&models[c], session.rig.cameras[c].world_from_camera, blob.centre_px, blob.covariance});
          break;  // The largest.
        }
      }
      TriangulationOptions loose;
      loose.max_sigmas = 1e9;
      if (const auto point = triangulate(views, loose)) tips[f] = point->position_m;
    }
    std::vector<BodyView> views;
    for (std::size_t c = 0; c < newest.size(); ++c) {
      const CameraCalibration& camera = session.rig.cameras[c];
      const bool on_table = camera.role == CameraRole::table;
      BodyView view = make_view(models[c], on_table ? CameraOn::base : CameraOn::body,
                                on_table ? camera.world_from_camera : camera.head_from_camera, newest[c].tags,
                                on_table ? session.rig.head_tags : session.rig.table_tags);
      if (!view.corners.empty()) views.push_back(std::move(view));
    }
    const auto head = solve_body_pose(views, std::nullopt);
    spent_s += processor_s() - begin;
    const auto truth = session.truths.find(frame->capture_time);
    if (!settled(frame->capture_time) || truth == session.truths.end() || !truth->second.hand_present)
      continue;
    for (std::size_t f = 0; f < finger_count; ++f) {
      ++figures.asked;
      if (tips[f]) {
        count_tip(figures.tips_m, truth->second, f, *tips[f]);
      } else {
        ++figures.lost;
      }
    }
    if (head) {
      count_head(figures, truth->second, head->base_from_body.translation(),
                 Eigen::Quaterniond(head->base_from_body.linear()));
    }
  }
  figures.cpu_ms = 1e3 * spent_s / static_cast<double>(session.frames);
  return figures;
}

void print(const char* what, const Figures& figures) {
  const double seen = figures.tips_m.count + figures.unsure_m.count;
  fmt::print("{:<14} {:8.2f} {:7.1f} {:9.2f} {:7.2f} {:10.2f} {:7.2f} {:8.2f} {:9.3f} {:10.2f}\n", what,
             figures.tips_m.value() * 1e3, figures.tips_m.worst * 1e3, figures.unsure_m.value() * 1e3,
             100 * figures.unsure_m.count / std::max(1.0, seen), figures.smooth_m.value() * 1e3,
             100 * figures.lost / std::max(1.0, figures.asked), figures.head_m.value() * 1e3,
             figures.head_rad.value() * 180 / M_PI, figures.cpu_ms);
}

}  // namespace

int main(int argc, char** argv) {
  double seconds = 12;
  SimulatedRigOptions options;
  double row_us = 50;
  int cameras = 2;
  std::string motion_file;
  double noise = 1;
  CLI::App app("Compares ways to follow a hand and a head on one rendered session");
  app.add_option("--seconds", seconds, "Of the session")->check(CLI::Range(2.0, 600.0));
  app.add_option("--noise", noise, "Times the default sensor noise")->check(CLI::Range(0.0, 10.0));
  app.add_option("--blur", options.image.blur_px, "Lens blur, px")->check(CLI::Range(0.0, 3.0));
  app.add_option("--row-us", row_us, "Rolling shutter, microseconds a row")->check(CLI::Range(0.0, 65.0));
  app.add_option("--cameras", cameras, "Table cameras")->check(CLI::Range(2, 6));
  app.add_option("--motion", motion_file, "A recorded hand instead of the tour")->check(CLI::ExistingFile);
  app.add_option("--seed", options.seed, "Of noise and timing");
  CLI11_PARSE(app, argc, argv);
  options.image.noise_luma *= noise;
  options.image.noise_chroma *= noise;
  options.image.row_time_s = row_us * 1e-6;

  HandProgram program = tour_program();
  if (!motion_file.empty()) {
    const auto motion = read_hand_motion(motion_file);
    auto made = motion ? motion_program(*motion) : Result<HandProgram>(motion.error());
    if (!made) {
      fmt::print(stderr, "compare_tracking: {}\n", made.error().describe());
      return 1;
    }
    program = std::move(*made);
  }
  Session session;
  session.rig = rig_of(cameras);
  SimulatedRig rig(session.rig, std::move(program), options);
  while (auto sample = rig.next()) {
    if (to_seconds(delivery_time(*sample) - TimePoint{}) > seconds) break;
    if (const auto* truth = std::get_if<Truth>(&*sample)) session.truths[truth->time] = *truth;
    session.frames += std::holds_alternative<CameraFrame>(*sample) ? 1 : 0;
    session.samples.push_back(std::move(*sample));
  }

  PipelineOptions whole;
  whole.camera.tags.whole_frame_every = whole.camera.tags.whole_frame_when_none_every = 1;
  whole.camera.tags.search_decimation = 1.0;
  whole.camera.tags.standing_every = 1;
  whole.camera.fingertips.whole_frame_every = whole.camera.fingertips.whole_frame_when_lost_every = 1;
  const Shutter rolling{from_seconds(options.image.row_time_s)};
  fmt::print("{} frames of {} cameras, {} us a row, blur {} px, noise x {}\n", session.frames,
             session.rig.cameras.size(), row_us, options.image.blur_px, noise);
  fmt::print("{:<14} {:>8} {:>7} {:>9} {:>7} {:>10} {:>7} {:>8} {:>9} {:>10}\n", "", "tips mm", "worst",
             "unsure mm", "%", "40ms later", "lost %", "head mm", "head deg", "CPU ms/fr");
  const std::vector<std::pair<const char*, Result<Figures>>> rows = [&] {
    std::vector<std::pair<const char*, Result<Figures>>> out;
    out.emplace_back("ours", follow(session, rolling, {}));
    out.emplace_back("rows unknown", follow(session, {}, {}));
    out.emplace_back("whole frames", follow(session, rolling, whole));
    out.emplace_back("newest frames", pair_newest(session));
    return out;
  }();
  for (const auto& [what, figures] : rows) {
    if (!figures) {
      fmt::print(stderr, "compare_tracking: {}: {}\n", what, figures.error().describe());
      return 1;
    }
    print(what, *figures);
  }
  return 0;
}
