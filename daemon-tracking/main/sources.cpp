#include "daemon-tracking/main/sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "common/codec/tilt_file.h"
#include "daemon-tracking/main/repeated_stream.h"
#include "daemon-tracking/source/recorded/recorded_stream.h"
#include "daemon-tracking/source/simulated/motion_program.h"
#include "daemon-tracking/source/simulated/mouse_shell.h"
#include "daemon-tracking/source/simulated/sculpt_program.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"
#include "daemon-tracking/source/simulated/stroke_program.h"
#include "daemon-tracking/source/simulated/tour_program.h"

namespace handloft::tracking {

namespace {

// In a recording's metadata.
constexpr const char* rig_key = "rig";
constexpr const char* calibration_key = "calibration";  // The whole file's text.
constexpr const char* simulated_rig_name = "default";

// Unity's left-handed axes, y up, to ours: z up, y away from the designer.
Stroke to_stroke(const codec::TiltStroke& from) {
  Stroke stroke;
  stroke.reserve(from.points.size());
  for (const codec::TiltControlPoint& point : from.points) {
    StrokePoint to;
    to.position_m = {point.position[0], point.position[2], point.position[1]};
    to.pressure = std::clamp(static_cast<double>(point.pressure), 0.0, 1.0);
    to.time_s = static_cast<double>(point.time_ms) / 1000.0;
    stroke.push_back(to);
  }
  return stroke;
}

Result<HandProgram> stroke_file_program(const DaemonOptions& options,
                                        std::map<std::string, std::string>& description) {
  const Result<codec::TiltFile> file = codec::read_tilt_file(*options.strokes);
  if (!file) return file.error();
  std::vector<Stroke> strokes;
  for (const codec::TiltStroke& each : file->strokes) {
    if (!each.points.empty()) strokes.push_back(to_stroke(each));
  }
  StrokeProgramOptions program_options;
  program_options.hand.seed = options.seed;
  Result<StrokeProgram> program = stroke_program(strokes, program_options);
  if (!program) return program.error();
  description["strokes"] =
      fmt::format("{} strokes, {} points, scaled by {:.4f}, slowed {:.2f} times", strokes.size(),
                  file->point_count(), program->placement.scale, program->placement.time_stretch);
  return std::move(program->program);
}

Result<SourceSet> open_simulation(const DaemonOptions& options, TimePoint start) {
  SourceSet set;
  set.replay_end = std::make_shared<ReplayEnd>();
  set.calibration = calibration_of(default_rig());
  set.description = {
      {rig_key, simulated_rig_name}, {"simulate", *options.simulate}, {"seed", std::to_string(options.seed)}};
  HandProgram program;
  if (options.simulate == "strokes") {
    Result<HandProgram> strokes = stroke_file_program(options, set.description);
    if (!strokes) return strokes.error();
    program = std::move(*strokes);
  } else if (options.simulate == "motion") {
    const Result<HandMotion> motion = read_hand_motion(*options.motion);
    if (!motion) return motion.error();
    MotionProgramOptions program_options;
    program_options.hand.seed = options.seed;
    program_options.longest_s = options.motion_s;
    Result<HandProgram> moved = motion_program(*motion, program_options);
    if (!moved) return moved.error();
    set.description["motion"] = fmt::format("{} frames at {} Hz", motion->frames.size(), motion->rate_hz);
    program = std::move(*moved);
  } else if (options.simulate == "tour") {
    tour::Options tour;
    tour.hand.seed = options.seed;
    program = tour_program(tour);
  } else if (options.simulate == "sculpt") {
    sculpt::Options sculpt;
    sculpt.hand.seed = options.seed;
    program = sculpt_program(sculpt);
  } else {
    mouse_shell::Options shell;
    shell.hand.seed = options.seed;
    // The side is a shape of its own on either side: after "same shape" comes "partner".
    shell.side_symmetry = mouse_shell::SideSymmetry::toggle;
    program = mouse_shell_program(shell);
  }
  SimulatedRigOptions rig_options;
  rig_options.seed = options.seed;
  rig_options.start = start;
  rig_options.frames_per_s = options.camera_rate_hz;
  rig_options.head.glances = glances_at_palette(program);
  set.stream = std::make_unique<SimulatedRig>(set.calibration.rig, std::move(program), rig_options);
  return set;
}

// Tells how a recording ended, after the stream itself is gone.
class WatchedRecording final : public SampleStream {
 public:
  WatchedRecording(std::unique_ptr<RecordedStream> stream, std::shared_ptr<ReplayEnd> end)
      : stream_(std::move(stream)), end_(std::move(end)) {}
  std::optional<Sample> next() override {
    std::optional<Sample> sample = stream_->next();
    if (!sample) *end_ = {stream_->error(), stream_->end()};
    return sample;
  }

 private:
  std::unique_ptr<RecordedStream> stream_;
  std::shared_ptr<ReplayEnd> end_;
};

// The rig that a recording was made with: the default one, or the calibration in its metadata.
Result<Calibration> recorded_rig(const DaemonOptions& options,
                                 const std::map<std::string, std::string>& metadata) {
  if (options.calibration) return load_calibration(*options.calibration);
  const auto text = metadata.find(calibration_key);
  if (text != metadata.end()) return parse_calibration(text->second, *options.replay + ": its calibration");
  const auto rig = metadata.find(rig_key);
  if (rig != metadata.end() && rig->second != simulated_rig_name) {
    return make_error(ErrorCode::unsupported,
                      fmt::format("{} was recorded with the rig '{}', expected '{}' or a calibration",
                                  *options.replay, rig->second, simulated_rig_name),
                      "replay");
  }
  return calibration_of(default_rig());
}

Result<SourceSet> open_recording(const DaemonOptions& options) {
  Result<std::unique_ptr<RecordedStream>> stream = RecordedStream::open(*options.replay);
  if (!stream) return stream.error();
  SourceSet set;
  set.description = (*stream)->metadata().more;
  Result<Calibration> calibration = recorded_rig(options, set.description);
  if (!calibration) return calibration.error();
  set.calibration = std::move(*calibration);
  const auto end = std::make_shared<ReplayEnd>();
  set.replay_end = end;
  auto first = std::make_shared<std::unique_ptr<RecordedStream>>(std::move(*stream));
  const auto reopen = [first, end, path = *options.replay]() -> std::unique_ptr<SampleStream> {
    std::unique_ptr<RecordedStream> round = std::move(*first);
    if (round == nullptr) {
      Result<std::unique_ptr<RecordedStream>> again = RecordedStream::open(path);
      if (!again) {
        end->error = again.error();
        return nullptr;
      }
      round = std::move(*again);
    }
    return std::make_unique<WatchedRecording>(std::move(round), end);
  };
  if (options.repeat > 1) {
    set.stream = std::make_unique<RepeatedStream>(reopen, options.repeat);
  } else {
    set.stream = reopen();
  }
  return set;
}

Result<SourceSet> open_devices(const DaemonOptions& options, const Clock& clock, const Logger& log) {
  Result<Calibration> calibration = load_lab(options);
  if (!calibration) return calibration.error();
  Result<std::string> text = format_calibration(*calibration);
  if (!text) return text.error();
  SourceSet set;
  set.replay_end = std::make_shared<ReplayEnd>();
  set.description = {{rig_key, "calibration"}, {calibration_key, std::move(*text)}};
  Result<std::unique_ptr<DeviceSources>> devices =
      DeviceSources::open(*calibration, {options.serial_glove}, clock, log);
  if (!devices) return devices.error();
  set.devices = std::move(*devices);
  set.calibration = std::move(*calibration);
  return set;
}

}  // namespace

Result<Calibration> load_lab(const DaemonOptions& options) {
  if (!options.cameras) {
    Rig rig = default_rig();
    rig.cameras.clear();
    return calibration_of(rig);
  }
  std::string path;
  if (options.calibration) {
    path = *options.calibration;
  } else {
    const Result<std::string> usual = default_calibration_path();
    if (!usual) return usual.error();
    path = *usual;
  }
  Result<Calibration> calibration = load_calibration(path);
  if (!calibration && calibration.error().code == ErrorCode::not_found) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("there is no calibration at {}: make one with handloft-calibrate (it tells the "
                    "steps; `handloft-trackd devices` lists the cameras), follow gloves, pens and "
                    "3D mice alone with --no-cameras, or try --simulate mouse, which needs no device",
                    path),
        "calibration");
  }
  return calibration;
}

Result<SourceSet> open_sources(const DaemonOptions& options, TimePoint start, const Clock& clock,
                               const Logger& log) {
  if (options.replay) return open_recording(options);
  if (options.simulate) return open_simulation(options, start);
  return open_devices(options, clock, log);
}

}  // namespace handloft::tracking
