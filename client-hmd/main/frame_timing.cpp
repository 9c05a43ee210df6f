#include "client-hmd/main/frame_timing.h"

#include <algorithm>
#include <thread>

namespace handloft::client {
namespace {

constexpr auto hidden_pause = std::chrono::milliseconds(20);

}  // namespace

FrameTiming::FrameTiming(const Clock& clock, Duration unpaced_latency) : clock_(clock) {
  pacer_.set_unpaced_latency(unpaced_latency);
}

const FramePlan& FrameTiming::begin(std::optional<Duration> period) {
  period_ = period;
  pacer_.set_period(period);
  plan_ = pacer_.plan(clock_.now());
  wait_until(plan_.begin);
  drawn_from_ = clock_.now();
  return plan_;
}

void FrameTiming::drawn() {
  scene_ = clock_.now() - drawn_from_;
  wait_until(plan_.latch);
  latched_at_ = clock_.now();
}

void FrameTiming::shown(const Frame& frame, const TrackingFeed* tracking) {
  const TimePoint now = clock_.now();
  FrameTimes times;
  if (frame.film && frame.head) times.exposure = frame.head->time;
  if (tracking != nullptr) {
    const TrackingStatus status = tracking->status();
    if (status.connected && status.frames > 0 && status.capture_time <= latched_at_) {
      times.newest_pose = status.capture_time;
    }
  }
  times.predicted_light = plan_.light;
  times.swapped = now;
  times.to_light = period_ ? *period_ / 2 : Duration::zero();
  times.missed_refresh = pacer_.swapped(plan_, now);
  // Where swaps wait for the refresh, the last pass took what was left until then at most.
  const Duration last_pass = now - latched_at_;
  pacer_.drew(scene_, period_ ? std::min(last_pass, *period_ / 4) : last_pass);
  figures_.add(times);
}

void FrameTiming::skipped() {
  ++figures_.skipped;
  std::this_thread::sleep_for(hidden_pause);
}

void FrameTiming::wait_until(TimePoint time) const {
  const TimePoint now = clock_.now();
  if (time <= now) return;
  const Duration most = period_.value_or(Duration::zero());
  std::this_thread::sleep_for(std::min(time - now, most));
}

void add_stats(const std::string& lines, int height_px, Overlay& overlay) {
  const float line_px = std::max(11.0F, static_cast<float>(height_px) / 60.0F);
  constexpr float spacing = 1.4F;
  const auto count = static_cast<float>(std::count(lines.begin(), lines.end(), '\n'));
  const glm::vec2 size(26.0F * line_px, (count + 0.6F) * spacing * line_px);
  const glm::vec2 corner(line_px, static_cast<float>(height_px) - size.y - line_px);
  overlay.panels.push_back({corner, size, 0.4F * line_px, {0.05F, 0.06F, 0.08F, 0.72F}});
  std::size_t from = 0;
  for (float row = 1.0F; from < lines.size(); row += 1.0F) {
    const std::size_t end = std::min(lines.find('\n', from), lines.size());
    overlay.texts.push_back({lines.substr(from, end - from),
                             corner + glm::vec2(line_px, row * spacing * line_px), line_px,
                             glm::vec4(0.92F, 0.94F, 0.96F, 1.0F), TextAlign::left});
    from = end + 1;
  }
}

}  // namespace handloft::client
