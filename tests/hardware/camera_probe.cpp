// Prints which cameras there are, and what the daemon's own camera source gets from one of them:
//   camera_probe                         the list
//   camera_probe CAMERA [FRAMES [HZ [WIDTH HEIGHT]]]   CAMERA: "path=...", "serial=...", "/dev/video0"
// Exit status 0 when the frames came, 1 when they did not within ten seconds each hundred.

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>

#include "daemon-tracking/source/camera/v4l2_camera.h"

namespace {

using namespace handloft;
using namespace handloft::tracking;

int list() {
  for (const V4l2CameraInfo& camera : list_v4l2_cameras()) {
    fmt::print("{}: {} ({}, {})\n  {}\n", camera.node.node, camera.model, camera.driver, camera.bus_info,
               camera.identity);
    if (!camera.unusable.empty()) fmt::print("  unusable: {}\n", camera.unusable);
    for (const VideoSize& size : camera.sizes) {
      fmt::print("  {}x{} {}: {:.4g} Hz\n", size.width_px, size.height_px, to_string(size.format),
                 fmt::join(size.rates_hz, ", "));
    }
  }
  return 0;
}

int stream(const V4l2CameraOptions& options, int wanted) {
  const SystemClock clock;
  const auto camera = make_v4l2_camera(0, "camera/probe", options, clock, Logger("probe"));
  std::mutex mutex;
  std::condition_variable changed;
  int frames = 0;
  const Status started = camera->start([&](Sample sample) {
    const std::lock_guard lock(mutex);
    if (const auto* presence = std::get_if<DevicePresence>(&sample))
      fmt::print("{}\n", presence->present ? "present" : "absent");
    if (const auto* frame = std::get_if<CameraFrame>(&sample)) {
      ++frames;
      fmt::print("{} sequence {} {} bytes, {:.1f} ms old\n", frames, frame->sequence, frame->bytes->size(),
                 to_seconds(frame->arrival_time - frame->capture_time) * 1000.0);
      changed.notify_all();
    }
  });
  if (!started) {
    fmt::print("{}\n", started.error().describe());
    return 1;
  }
  bool all = false;
  {
    std::unique_lock lock(mutex);
    all = changed.wait_for(lock, std::chrono::seconds(10 + wanted / 10), [&] { return frames >= wanted; });
  }
  camera->stop();
  const CameraHealth health = camera->health();
  fmt::print("{}, {} of {} Hz, {} frames, {} dropped, {} drained, {} refused, {} bad stamps\n{}\n",
             to_string(health.mode), health.measured_rate_hz, health.asked_rate_hz, health.frames,
             health.dropped, health.drained, health.refused, health.bad_timestamps, health.problem);
  return all ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return list();
  const auto number = [&](int index, int otherwise) {
    return argc > index ? std::atoi(argv[index]) : otherwise;
  };
  const Result<CameraSelector> selector = parse_camera_selector(argv[1]);
  if (!selector) {
    fmt::print(stderr, "{}\n", selector.error().describe());
    return 2;
  }
  V4l2CameraOptions options;
  options.selector = *selector;
  options.mode.rate_hz = number(3, 30);
  options.mode.width_px = number(4, options.mode.width_px);
  options.mode.height_px = number(5, options.mode.height_px);
  return stream(options, number(2, 100));
}
