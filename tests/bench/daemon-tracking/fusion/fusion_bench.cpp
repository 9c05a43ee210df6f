// What one camera's observation costs the fusion thread: five fingertips, a head, the snapshot.

#include <benchmark/benchmark.h>

#include <vector>

#include "daemon-tracking/fusion/tracking_pipeline.h"
#include "daemon-tracking/source/simulated/mouse_shell.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"

namespace handloft::tracking {
namespace {

void observation(benchmark::State& state) {
  const Rig rig = default_rig();
  std::vector<CameraTracker> trackers;
  for (std::uint32_t camera = 0; camera < rig.cameras.size(); ++camera)
    trackers.push_back(CameraTracker::create(rig, camera).value());
  std::vector<CameraObservation> observations;
  SimulatedRig stream(rig, mouse_shell_program());
  while (observations.size() < 180) {
    const auto sample = stream.next();
    if (!sample) break;
    if (const auto* frame = std::get_if<CameraFrame>(&*sample))
      observations.push_back(trackers[frame->camera].process(*frame).value());
  }
  auto pipeline = TrackingPipeline::create(rig).value();
  const Duration lap =
      observations.back().capture_time - observations.front().capture_time + std::chrono::milliseconds(11);
  std::size_t next = 0;
  for (auto _ : state) {
    CameraObservation one = observations[next % observations.size()];
    one.capture_time += lap * static_cast<std::int64_t>(next / observations.size());
    ++next;
    benchmark::DoNotOptimize(pipeline.consume(one));
  }
}
BENCHMARK(observation)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace handloft::tracking
