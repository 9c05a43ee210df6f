#include "daemon-tracking/calibrate/input.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <optional>

#include "daemon-tracking/calibrate/live_input.h"
#include "daemon-tracking/calibrate/simulated_input.h"
#include "daemon-tracking/source/recorded/recorded_stream.h"

namespace handloft::tracking {
namespace {

constexpr std::size_t show_every = 15;  // Frames between two signs of life.

}  // namespace

bool wants_camera(const CalibrateOptions& options, const std::string& name) {
  return options.cameras.empty() ||
         std::any_of(options.cameras.begin(), options.cameras.end(),
                     [&](const std::string& one) { return one.substr(0, one.find('=')) == name; });
}

Result<Input> open_input(const CalibrateOptions& options, const Calibration& calibration) {
  std::vector<std::string> names;
  for (const CameraCalibration& camera : calibration.rig.cameras) names.push_back(camera.name);
  for (const std::string& one : options.cameras) {
    const std::string name = one.substr(0, one.find('='));
    if (std::find(names.begin(), names.end(), name) == names.end())
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found '{}', expected one of the calibration's: {}", name, fmt::join(names, ", ")),
          "camera");
  }
  Input input;
  if (options.recording) {
    auto stream = RecordedStream::open(*options.recording);
    if (!stream) return stream.error();
    input.stream = std::move(*stream);
    return input;
  }
  if (options.images) {
    auto folder = ImageFolder::open(*options.images, names);
    if (!folder) return folder.error();
    input.folder = folder->get();
    input.stream = std::move(*folder);
    return input;
  }
  if (options.simulate) {
    input.stream = simulated_input(options);
    return input;
  }
  return open_live(options, calibration);
}

Result<FrameCount> for_each_frame(Input& input, const CalibrateOptions& options,
                                  const Calibration& calibration, DecodePlanes planes, std::FILE* terminal,
                                  const FrameVisitor& visit, const SampleVisitor& others) {
  FrameCount count;
  std::map<std::uint32_t, FrameDecoder> decoders;
  std::optional<TimePoint> start;
  const bool lively = terminal != nullptr && isatty(fileno(terminal)) != 0;
  while (auto sample = input.stream->next()) {
    const CameraFrame* frame = std::get_if<CameraFrame>(&*sample);
    if (frame == nullptr) {
      if (others) others(*sample);
      continue;
    }
    if (frame->camera >= calibration.rig.cameras.size()) {
      ++count.broken;
      continue;
    }
    const std::string& name = calibration.rig.cameras[frame->camera].name;
    if (!wants_camera(options, name)) continue;
    const auto planar = decoders[frame->camera].decode(*frame, planes);
    if (!planar) {
      ++count.broken;
      continue;
    }
    if (!start) start = frame->capture_time;
    ++count.frames;
    visit(*frame, **planar,
          input.folder != nullptr
              ? input.folder->name()
              : fmt::format("{} at {:.1f} s", name, to_seconds(frame->capture_time - *start)));
    if (lively && count.frames % show_every == 0) {
      fmt::print(terminal, "\r{} frames ", count.frames);
      std::fflush(terminal);
    }
  }
  if (lively) fmt::print(terminal, "\r");
  const auto* recorded = dynamic_cast<const RecordedStream*>(input.stream.get());
  if (recorded != nullptr && recorded->error() && terminal != nullptr)
    fmt::print(terminal, "The recording is damaged; what comes before is used: {}\n",
               recorded->error()->describe());
  if (input.folder != nullptr && terminal != nullptr)
    for (const std::string& problem : input.folder->problems())
      fmt::print(terminal, "Passed over: {}\n", problem);
  if (count.broken > 0 && terminal != nullptr)
    fmt::print(terminal,
               "{} frames could not be decoded, or are of a camera that the calibration does not have.\n",
               count.broken);
  return count;
}

}  // namespace handloft::tracking
