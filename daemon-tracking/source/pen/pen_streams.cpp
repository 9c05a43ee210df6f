#include "daemon-tracking/source/pen/pen_streams.h"

#include <linux/input-event-codes.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>

#include "daemon-tracking/source/paced_device.h"
#include "daemon-tracking/source/recorded/recorded_stream.h"

namespace handloft::tracking {
namespace {

constexpr double rate_hz = 200.0;
constexpr std::int32_t units_per_mm = 100;
constexpr std::int32_t width_units = 21600, height_units = 13500, pressure_levels = 8191, tilt_limit_deg = 60;
constexpr double edge_s = 0.2;        // The pen is away at the beginning and end for this long.
constexpr double loop_s = 4.0;        // Once round the eight.
constexpr double erasing_from = 0.7;  // Part of the time.
constexpr double largest_tilt_rad = 0.5;
constexpr double metres_per_unit = 1e-3 / units_per_mm;

class SimulatedPen final : public SampleStream {
 public:
  explicit SimulatedPen(const SimulatedPenOptions& options) : options_(options) {
    waiting_.push_back(DevicePresence{options.start, pen_device, true});
    waiting_.push_back(
        DeviceBytes{options.start, DeviceData::pen_facts, encode_pen_facts(simulated_pen_facts())});
  }

  std::optional<Sample> next() override {
    while (waiting_.empty()) {
      const double seconds = static_cast<double>(frame_) / rate_hz;
      if (seconds > options_.seconds) return std::nullopt;
      add_frame(seconds);
      ++frame_;
    }
    Sample out = std::move(waiting_.front());
    waiting_.pop_front();
    return out;
  }

 private:
  void add_frame(double seconds) {
    const SimulatedPenTruth now = simulated_pen_at(options_, seconds);
    const TimePoint time = options_.start + from_seconds(seconds);
    std::vector<PenEvent> events;
    const auto add = [&](unsigned type, unsigned code, std::int32_t value) {
      events.push_back({time, static_cast<std::uint16_t>(type), static_cast<std::uint16_t>(code), value});
    };
    const auto tool = [&](unsigned code, bool was, bool is) {
      if (was != is) add(EV_KEY, code, is ? 1 : 0);
    };
    tool(BTN_TOOL_PEN, last_.in_proximity && !last_.eraser, now.in_proximity && !now.eraser);
    tool(BTN_TOOL_RUBBER, last_.in_proximity && last_.eraser, now.in_proximity && now.eraser);
    if (now.in_proximity) {
      tool(BTN_TOUCH, last_.pressure > 0.0, now.pressure > 0.0);
      add(EV_ABS, ABS_X, static_cast<std::int32_t>(std::lround(now.x_m / metres_per_unit)));
      add(EV_ABS, ABS_Y, height_units - static_cast<std::int32_t>(std::lround(now.y_m / metres_per_unit)));
      add(EV_ABS, ABS_PRESSURE, static_cast<std::int32_t>(std::lround(now.pressure * pressure_levels)));
      const double degrees = 180.0 / std::numbers::pi;
      add(EV_ABS, ABS_TILT_X, static_cast<std::int32_t>(std::lround(now.tilt_x_rad * degrees)));
      add(EV_ABS, ABS_TILT_Y, -static_cast<std::int32_t>(std::lround(now.tilt_y_rad * degrees)));
    }
    last_ = now;
    if (events.empty()) return;
    add(EV_SYN, SYN_REPORT, 0);
    waiting_.push_back(DeviceBytes{time + options_.delay, DeviceData::pen_events, encode_pen_events(events)});
  }

  SimulatedPenOptions options_;
  std::int64_t frame_ = 0;
  SimulatedPenTruth last_;
  std::deque<Sample> waiting_;
};

}  // namespace

PenFacts simulated_pen_facts() {
  return {{true, 0, width_units, units_per_mm},
          {true, 0, height_units, units_per_mm},
          {true, 0, pressure_levels, 0},
          {true, -tilt_limit_deg, tilt_limit_deg, 57},  // Units per radian, as drivers round it.
          {true, -tilt_limit_deg, tilt_limit_deg, 57}};
}

SimulatedPenTruth simulated_pen_at(const SimulatedPenOptions& options, double seconds) {
  SimulatedPenTruth out;
  out.in_proximity = seconds >= edge_s && seconds <= options.seconds - edge_s;
  if (!out.in_proximity) return out;
  out.eraser = seconds > erasing_from * options.seconds;
  const double phase = 2.0 * std::numbers::pi * seconds / loop_s;
  out.x_m = metres_per_unit * width_units * (0.5 + 0.4 * std::sin(phase));
  out.y_m = metres_per_unit * height_units * (0.5 + 0.4 * std::sin(2.0 * phase));
  out.pressure = std::max(0.0, std::sin(3.0 * phase));
  out.tilt_x_rad = largest_tilt_rad * std::sin(phase);
  out.tilt_y_rad = largest_tilt_rad * std::cos(phase);
  return out;
}

std::unique_ptr<SampleStream> simulated_pen_stream(const SimulatedPenOptions& options) {
  return std::make_unique<SimulatedPen>(options);
}

std::unique_ptr<PenSource> make_simulated_pen(const SimulatedPenOptions& options, const Clock& clock,
                                              PaceOptions pace) {
  return std::make_unique<PacedDevice<PenSource>>(pen_device, simulated_pen_stream(options), clock, pace);
}

Result<std::unique_ptr<PenSource>> open_recorded_pen(const std::filesystem::path& path, const Clock& clock,
                                                     PaceOptions pace) {
  auto stream = RecordedStream::open(path, {RecordedSelection::Kind::pen, 0, pen_device});
  if (!stream) return stream.error();
  return std::unique_ptr<PenSource>(
      std::make_unique<PacedDevice<PenSource>>(pen_device, std::move(*stream), clock, pace));
}

}  // namespace handloft::tracking
