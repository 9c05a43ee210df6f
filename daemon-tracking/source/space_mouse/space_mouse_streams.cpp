#include "daemon-tracking/source/space_mouse/space_mouse_streams.h"

#include <cmath>
#include <deque>
#include <numbers>
#include <utility>
#include <vector>

#include "daemon-tracking/source/paced_device.h"
#include "daemon-tracking/source/recorded/recorded_stream.h"

namespace handloft::tracking {
namespace {

constexpr double rate_hz = 60.0;
constexpr double full_scale = 350.0;

class SimulatedSpaceMouse final : public SampleStream {
 public:
  explicit SimulatedSpaceMouse(const SimulatedSpaceMouseOptions& options) : options_(options) {
    waiting_.push_back(DevicePresence{options.start, space_mouse_device, true});
  }

  std::optional<Sample> next() override {
    if (waiting_.empty()) {
      const double seconds = static_cast<double>(frame_) / rate_hz;
      if (seconds > options_.seconds) return std::nullopt;
      add_reports(seconds);
      ++frame_;
    }
    Sample out = std::move(waiting_.front());
    waiting_.pop_front();
    return out;
  }

 private:
  void add_reports(double seconds) {
    const TimePoint time = options_.start + from_seconds(seconds);
    const auto axes = simulated_space_mouse_at(seconds);
    std::vector<std::uint8_t> bytes{1};
    const auto flush = [&](std::uint8_t next_id) {
      waiting_.push_back(DeviceBytes{time, DeviceData::space_mouse_report, std::exchange(bytes, {next_id})});
    };
    for (std::size_t i = 0; i < axes.size(); ++i) {
      if (i == 3 && options_.form == SpaceMouseForm::split) flush(2);
      const auto bits = static_cast<std::uint16_t>(axes[i]);
      bytes.push_back(static_cast<std::uint8_t>(bits & 0xFFu));
      bytes.push_back(static_cast<std::uint8_t>(bits >> 8));
    }
    flush(3);
    const bool pressed = static_cast<std::int64_t>(seconds) % 2 == 1;
    if (pressed != pressed_) {
      bytes.push_back(pressed ? 1 : 0);
      bytes.push_back(0);
      flush(0);
      pressed_ = pressed;
    }
  }

  SimulatedSpaceMouseOptions options_;
  std::int64_t frame_ = 0;
  bool pressed_ = false;
  std::deque<Sample> waiting_;
};

}  // namespace

std::array<std::int16_t, 6> simulated_space_mouse_at(double seconds) {
  std::array<std::int16_t, 6> out{};
  const double whole = std::floor(seconds);
  const auto second = static_cast<std::int64_t>(whole);
  const double sign = (second / 6) % 2 == 0 ? 1.0 : -1.0;
  out[static_cast<std::size_t>(second % 6)] = static_cast<std::int16_t>(
      std::lround(sign * full_scale * std::sin(std::numbers::pi * (seconds - whole))));
  return out;
}

std::unique_ptr<SampleStream> simulated_space_mouse_stream(const SimulatedSpaceMouseOptions& options) {
  return std::make_unique<SimulatedSpaceMouse>(options);
}

std::unique_ptr<SpaceMouseSource> make_simulated_space_mouse(const SimulatedSpaceMouseOptions& options,
                                                             const Clock& clock, PaceOptions pace) {
  return std::make_unique<PacedDevice<SpaceMouseSource>>(space_mouse_device,
                                                         simulated_space_mouse_stream(options), clock, pace);
}

Result<std::unique_ptr<SpaceMouseSource>> open_recorded_space_mouse(const std::filesystem::path& path,
                                                                    const Clock& clock, PaceOptions pace) {
  auto stream = RecordedStream::open(path, {RecordedSelection::Kind::space_mouse, 0, space_mouse_device});
  if (!stream) return stream.error();
  return std::unique_ptr<SpaceMouseSource>(
      std::make_unique<PacedDevice<SpaceMouseSource>>(space_mouse_device, std::move(*stream), clock, pace));
}

}  // namespace handloft::tracking
