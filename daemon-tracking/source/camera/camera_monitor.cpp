#include "daemon-tracking/source/camera/camera_monitor.h"

#include <fmt/format.h>

#include "daemon-tracking/source/camera/v4l2_enumerate.h"

namespace handloft::tracking {

namespace {

constexpr Duration window_length = std::chrono::seconds(1);
// One in ten broken or wrongly stamped: a cable or a driver, not an accident.
constexpr double alarming_part = 0.1;

void add(std::string& words, const std::string& more) {
  if (more.empty()) return;
  if (!words.empty()) words += "; ";
  words += more;
}

}  // namespace

CameraHealth CameraMonitor::health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

void CameraMonitor::opened(TimePoint now, const V4l2Node& node, const std::string& model,
                           const VideoMode& mode, const std::string& compromise, const std::string& note) {
  seen_ = {};
  window_ = {};
  window_start_ = now;
  first_window_ = true;
  controls_.clear();
  from_start_ = note;
  add(from_start_, compromise);
  const std::lock_guard lock(mutex_);
  health_.present = true;
  health_.identity = identity_of(node);
  health_.node = node.node;
  health_.model = model;
  health_.mode = mode;
  health_.measured_rate_hz = 0;
  health_.timestamps = TimestampState::unknown;
  health_.problem = from_start_;
}

void CameraMonitor::lost() {
  const std::lock_guard lock(mutex_);
  ++health_.times_lost;
}

void CameraMonitor::absent(const std::string& why) {
  const std::lock_guard lock(mutex_);
  health_.present = false;
  health_.measured_rate_hz = 0;
  health_.exposure = ExposureState::unknown;
  health_.problem = why;
}

void CameraMonitor::controls(const ControlReport& report) {
  controls_ = report.problem;
  const std::lock_guard lock(mutex_);
  health_.exposure = report.exposure;
  health_.exposure_time = report.exposure_time;
  health_.control_drifts += report.drifted.size();
}

bool CameraMonitor::counted(const StreamCounters& counters) {
  const std::uint64_t filled = counters.filled - seen_.filled;
  const std::uint64_t refused = counters.refused - seen_.refused;
  window_.filled += filled;
  window_.refused += refused;
  {
    const std::lock_guard lock(mutex_);
    health_.dropped += counters.dropped - seen_.dropped;
    health_.drained += counters.drained - seen_.drained;
    health_.refused += refused;
  }
  seen_ = counters;
  return filled > 0;
}

void CameraMonitor::frame(TimePoint arrival, TimePoint capture, bool estimated, StampPoint point) {
  ++window_.frames;
  if (estimated) ++window_.estimated;
  const std::lock_guard lock(mutex_);
  ++health_.frames;
  health_.last_frame = arrival;
  health_.last_age = arrival - capture;
  if (estimated) ++health_.bad_timestamps;
  health_.timestamps = estimated                                ? TimestampState::estimated
                       : point == StampPoint::start_of_exposure ? TimestampState::start_of_exposure
                                                                : TimestampState::end_of_frame;
}

std::string CameraMonitor::words(double seconds) const {
  const double rate = static_cast<double>(window_.filled) / seconds;
  const auto part = [](std::uint64_t some, std::uint64_t all) {
    return all == 0 ? 0.0 : static_cast<double>(some) / static_cast<double>(all);
  };
  std::string problem = from_start_;
  add(problem, controls_);
  // The first frames of a webcam come late.
  if (!first_window_ && rate < slow_rate_part_ * health_.mode.rate_hz) {
    const bool long_exposure = to_seconds(health_.exposure_time) * health_.mode.rate_hz > 1.0;
    add(problem,
        fmt::format("it delivers {:.1f} of {:.1f} frames a second{}", rate, health_.mode.rate_hz,
                    long_exposure ? fmt::format(": its exposure of {:.1f} ms is longer than a frame",
                                                to_seconds(health_.exposure_time) * 1000.0)
                                  : ": the light, its automatic exposure or the USB bus slow it down"));
  }
  if (part(window_.refused, window_.filled) > alarming_part) {
    add(problem, fmt::format("{:.0f} % of its frames arrive broken: check its cable and hub",
                             100.0 * part(window_.refused, window_.filled)));
  }
  if (part(window_.estimated, window_.frames) > alarming_part) {
    add(problem,
        "its driver's timestamps are of no use, times are estimated from arrival: positions lag or lead "
        "while the hand moves");
  }
  return problem;
}

bool CameraMonitor::second_passed(TimePoint now) {
  const Duration passed = now - window_start_;
  if (passed < window_length) return false;
  const double seconds = to_seconds(passed);
  {
    const std::lock_guard lock(mutex_);
    health_.measured_rate_hz = static_cast<double>(window_.filled) / seconds;
    health_.problem = words(seconds);
  }
  window_ = {};
  window_start_ = now;
  first_window_ = false;
  return true;
}

}  // namespace handloft::tracking
