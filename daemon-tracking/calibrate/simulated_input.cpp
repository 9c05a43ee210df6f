#include "daemon-tracking/calibrate/simulated_input.h"

#include <cmath>
#include <vector>

#include "daemon-tracking/calibrate/input.h"
#include "daemon-tracking/calibration/simulated_board.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"
#include "daemon-tracking/source/simulated/tour_program.h"

namespace handloft::tracking {
namespace {

constexpr int lens_poses = 16, table_poses = 12;

/// One stream after the other, each beginning ten seconds after the last one's end.
class Chain final : public SampleStream {
 public:
  explicit Chain(std::vector<std::unique_ptr<SampleStream>> streams) : streams_(std::move(streams)) {}
  std::optional<Sample> next() override {
    while (at_ < streams_.size()) {
      if (auto sample = streams_[at_]->next()) {
        shift_times(*sample, shift_);
        last_ = delivery_time(*sample);
        return sample;
      }
      ++at_;
      shift_ = last_ - TimePoint{} + std::chrono::seconds(10);
    }
    return std::nullopt;
  }

 private:
  std::vector<std::unique_ptr<SampleStream>> streams_;
  std::size_t at_ = 0;
  Duration shift_{};
  TimePoint last_{};
};

/// The first seconds of a stream.
class Cut final : public SampleStream {
 public:
  Cut(std::unique_ptr<SampleStream> stream, double seconds) : stream_(std::move(stream)), seconds_(seconds) {}
  std::optional<Sample> next() override {
    auto sample = stream_->next();
    if (sample && to_seconds(delivery_time(*sample) - TimePoint{}) > seconds_) return std::nullopt;
    return sample;
  }

 private:
  std::unique_ptr<SampleStream> stream_;
  double seconds_;
};

std::unique_ptr<SampleStream> rig_stream(const CalibrateOptions& options, HandProgram program,
                                         double seconds) {
  SimulatedRigOptions rig_options;
  rig_options.seed = options.seed;
  // The guide asks for a brisk nod and shake.
  rig_options.head.sway_m = 0.03;
  rig_options.head.sway_hz = 0.5;
  return std::make_unique<Cut>(std::make_unique<SimulatedRig>(default_rig(), std::move(program), rig_options),
                               seconds);
}

HandProgram resting_hand(double seconds) {
  HandProgram program;
  program.idle(seconds);
  return program;
}

/// Rests, presses five times, turns the potentiometer from stop to stop.
std::unique_ptr<SampleStream> glove_stream(const CalibrateOptions& options) {
  HandProgram program;
  program.idle(3.0);
  const auto here = [](double) { return Eigen::Vector3d(0.0, 0.0, 0.12); };
  program.timed_stroke("press", here, 5.0, [](double u) {
    const double wave = std::sin(5 * 3.14159265 * u);
    return 0.92 * wave * wave;
  });
  program.push(
      "turn down", here, 1.5, [](double) { return 0.0; }, 0.02);
  program.push(
      "turn up", here, 1.5, [](double) { return 0.0; }, 0.98);
  program.idle(2.0);
  SimulatedRigOptions rig_options;
  rig_options.seed = options.seed;
  return simulated_glove_stream(
      std::make_shared<const SimulatedScene>(SimulatedScene{default_rig(), std::move(program), rig_options}));
}

}  // namespace

std::unique_ptr<SampleStream> simulated_input(const CalibrateOptions& options) {
  const Rig rig = default_rig();
  SimulatedBoardOptions board;
  board.shape = options.chessboard();
  board.frames_per_pose = 4;
  if (options.step == "intrinsics") {
    std::vector<std::unique_ptr<SampleStream>> streams;
    for (std::uint32_t camera = 0; camera < rig.cameras.size(); ++camera)
      if (wants_camera(options, rig.cameras[camera].name))
        streams.push_back(simulated_board_stream(
            rig, {camera}, waved_before(rig.cameras[camera], board.shape, lens_poses), board));
    return std::make_unique<Chain>(std::move(streams));
  }
  if (options.step == "extrinsics") {
    std::vector<std::uint32_t> table;
    for (std::uint32_t camera = 0; camera < rig.cameras.size(); ++camera)
      if (rig.cameras[camera].role == CameraRole::table) table.push_back(camera);
    std::vector<std::unique_ptr<SampleStream>> streams;
    streams.push_back(simulated_board_stream(rig, table, waved_over_table(rig, table_poses), board));
    streams.push_back(rig_stream(options, resting_hand(7.0), 6.0));
    return std::make_unique<Chain>(std::move(streams));
  }
  if (options.step == "glove") return glove_stream(options);
  if (options.step == "colours") return rig_stream(options, tour_program(), 10.0);
  constexpr double check_s = 2.0, motion_s = 8.0;
  const double seconds = options.step == "check" ? check_s : motion_s;
  return rig_stream(options, resting_hand(seconds + 1), seconds);
}

}  // namespace handloft::tracking
