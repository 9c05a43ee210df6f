// One 640 x 480 camera's stages on rendered frames (T15: all of them together within 6 ms). The baseline of
// the tag stage, the whole frame at full resolution, runs beside it (T5).

#include <benchmark/benchmark.h>

#include <vector>

#include "daemon-tracking/source/simulated/mouse_shell.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"
#include "daemon-tracking/vision/body_pose.h"
#include "daemon-tracking/vision/camera_tracker.h"

namespace handloft::tracking {
namespace {

const std::vector<CameraFrame>& frames() {
  static const std::vector<CameraFrame> all = [] {
    std::vector<CameraFrame> out;
    auto stream = SimulatedRig(default_rig(), mouse_shell_program());
    while (out.size() < 60) {
      auto sample = stream.next();
      if (!sample) break;
      if (auto* frame = std::get_if<CameraFrame>(&*sample); frame != nullptr && frame->camera == 0)
        out.push_back(std::move(*frame));
    }
    return out;
  }();
  return all;
}

TagTrackerOptions tags_of_a_table_camera() {
  const Rig rig = default_rig();
  TagTrackerOptions options;
  for (const auto& tag : rig.head_tags) options.known_ids.push_back(tag.id);
  for (const auto& tag : rig.table_tags) {
    options.known_ids.push_back(tag.id);
    options.standing_ids.push_back(tag.id);
  }
  return options;
}

void decode(benchmark::State& state, DecodePlanes planes) {
  FrameDecoder decoder;
  std::size_t next = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(decoder.decode(frames()[next++ % frames().size()], planes).ok());
}
BENCHMARK_CAPTURE(decode, luma, DecodePlanes::luma)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(decode, planar, DecodePlanes::luma_and_chroma)->Unit(benchmark::kMicrosecond);

void tags(benchmark::State& state, const TagTrackerOptions& options) {
  auto tracker = TagTracker::create(options).value();
  FrameDecoder decoder;
  std::size_t next = 0;
  double found = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const CameraFrame& frame = frames()[next++ % frames().size()];
    const auto image = decoder.decode(frame, DecodePlanes::luma);
    state.ResumeTiming();
    found += static_cast<double>(tracker.track((*image)->y, frame.capture_time).tags.size());
  }
  state.counters["tags"] = benchmark::Counter(found, benchmark::Counter::kAvgIterations);
}
void tags_in_regions(benchmark::State& state) {
  auto options = tags_of_a_table_camera();
  options.whole_frame_every = 1 << 30;
  options.standing_ids.clear();  // All of them every frame, as the baseline
  tags(state, options);
}
void tags_as_tracked(benchmark::State& state) {
  tags(state, tags_of_a_table_camera());
}
void tags_whole_frame_baseline(benchmark::State& state) {
  auto options = tags_of_a_table_camera();
  options.whole_frame_every = options.whole_frame_when_none_every = 1;
  options.search_decimation = 1.0;
  options.roi_growth = -10.0;  // No regions
  tags(state, options);
}
BENCHMARK(tags_in_regions)->Unit(benchmark::kMicrosecond);
BENCHMARK(tags_as_tracked)->Unit(benchmark::kMicrosecond);
BENCHMARK(tags_whole_frame_baseline)->Unit(benchmark::kMicrosecond);

void fingertips(benchmark::State& state, int whole_frame_every) {
  FingertipTrackerOptions options;
  options.whole_frame_every = options.whole_frame_when_lost_every = whole_frame_every;
  auto tracker = FingertipTracker::create(default_rig().colours, options).value();
  FrameDecoder decoder;
  std::size_t next = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const CameraFrame& frame = frames()[next++ % frames().size()];
    const auto image = decoder.decode(frame, DecodePlanes::luma_and_chroma);
    state.ResumeTiming();
    benchmark::DoNotOptimize(tracker.track(**image, frame.capture_time));
  }
}
BENCHMARK_CAPTURE(fingertips, in_regions, 10)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(fingertips, whole_frame, 1)->Unit(benchmark::kMicrosecond);

void camera_frame(benchmark::State& state) {
  auto tracker = CameraTracker::create(default_rig(), 0).value();
  std::size_t next = 0;
  for (auto _ : state) {
    CameraFrame frame = frames()[next % frames().size()];
    frame.capture_time =
        from_ns(1'000'000'000) + std::chrono::milliseconds(33) * static_cast<std::int64_t>(next++);
    benchmark::DoNotOptimize(tracker.process(frame).ok());
  }
}
/// A head's pose from ten tags, started 5 mm and 0.02 rad off (within 0.5 ms).
void refine_ten_tags(benchmark::State& state) {
  const auto camera = CameraModel::create(CameraIntrinsics{}).value();
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.linear() = rotation_from_vector({3.0, 0.15, 0.05}).toRotationMatrix();
  truth.translation() = Eigen::Vector3d(0.0, 0.0, 0.8);
  BodyView view{&camera, CameraOn::base, Eigen::Isometry3d::Identity(), {}};
  for (int i = 0; i < 10; ++i) {
    TagPlacement tag;
    tag.body_from_tag.translation() = Eigen::Vector3d(0.05 * (i % 5 - 2), 0.05 * (i / 5), 0.01 * (i % 3));
    for (const Eigen::Vector3d& corner : tag_corners(tag))
      view.corners.push_back(
          {corner, *camera.project(truth * corner) + Eigen::Vector2d(0.2 * (i % 3 - 1), 0.1)});
  }
  Eigen::Isometry3d start = truth;
  start.translation().x() += 0.005;
  start.linear() = rotation_from_vector({0.02, 0, 0}).toRotationMatrix() * truth.linear();
  const std::vector<BodyView> views{view};
  for (auto _ : state) benchmark::DoNotOptimize(refine_body_pose(views, start, std::nullopt).ok());
}
BENCHMARK(refine_ten_tags)->Unit(benchmark::kMicrosecond);

BENCHMARK(camera_frame)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace handloft::tracking
