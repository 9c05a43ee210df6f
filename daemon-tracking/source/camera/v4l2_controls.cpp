#include "daemon-tracking/source/camera/v4l2_controls.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace handloft::tracking {

namespace {

// V4L2_CID_EXPOSURE_ABSOLUTE counts in these.
constexpr Duration exposure_unit = std::chrono::microseconds(100);
// Cameras round to what their sensor can do; more than this part of what was asked is worth a word.
constexpr double rounding_part = 0.2;
// After so many looks a control is taken to be beyond our power, and then set only at every tenth.
constexpr int looks_until_hopeless = 3;
constexpr int looks_between_tries = 10;

struct Named {
  std::uint32_t id;
  const char* name;
};

// What the colour model and the tags' edges depend on and nobody sets: kept as it was found.
constexpr std::array<Named, 6> kept_as_found{{{V4L2_CID_BRIGHTNESS, "brightness"},
                                              {V4L2_CID_CONTRAST, "contrast"},
                                              {V4L2_CID_SATURATION, "saturation"},
                                              {V4L2_CID_HUE, "hue"},
                                              {V4L2_CID_GAMMA, "gamma"},
                                              {V4L2_CID_SHARPNESS, "sharpness"}}};

std::optional<v4l2_queryctrl> describe(V4l2System& system, int fd, std::uint32_t id) {
  v4l2_queryctrl query{};
  query.id = id;
  if (system.ioctl(fd, VIDIOC_QUERYCTRL, &query) < 0) return std::nullopt;
  if ((query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return std::nullopt;
  return query;
}

std::optional<std::int32_t> read(V4l2System& system, int fd, std::uint32_t id) {
  v4l2_control control{};
  control.id = id;
  if (system.ioctl(fd, VIDIOC_G_CTRL, &control) < 0) return std::nullopt;
  return control.value;
}

bool write(V4l2System& system, int fd, std::uint32_t id, std::int32_t value) {
  v4l2_control control{};
  control.id = id;
  control.value = value;
  return system.ioctl(fd, VIDIOC_S_CTRL, &control) == 0;
}

std::int32_t within(const v4l2_queryctrl& query, std::int32_t value) {
  if (query.type == V4L2_CTRL_TYPE_BOOLEAN) return value != 0 ? 1 : 0;
  const std::int32_t clamped = std::clamp(value, query.minimum, std::max(query.minimum, query.maximum));
  if (query.step < 2 || query.type == V4L2_CTRL_TYPE_MENU) return clamped;
  // Wide enough for whatever range a driver names.
  const std::int64_t low = query.minimum;
  return static_cast<std::int32_t>(low + (clamped - low) / query.step * query.step);
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : "; ") + word;
  return all;
}

}  // namespace

void ControlKeeper::hold(V4l2System& system, int fd, std::uint32_t id, const char* name,
                         std::optional<std::int32_t> wanted) {
  const std::optional<v4l2_queryctrl> query = describe(system, fd, id);
  // Cameras have some of these only; what the driver marks inactive is ruled by an automatic.
  if (!query || (query->flags & (V4L2_CTRL_FLAG_READ_ONLY | V4L2_CTRL_FLAG_INACTIVE)) != 0) return;
  if (!wanted) {
    const auto known = remembered_.find(id);
    if (known != remembered_.end()) wanted = known->second;
  }
  if (!wanted) {
    const std::optional<std::int32_t> found = read(system, fd, id);
    if (!found) return;
    remembered_[id] = *found;
    held_.push_back({id, name, *found});
    return;
  }
  const std::int32_t value = within(*query, *wanted);
  const bool written = write(system, fd, id, value);
  const std::optional<std::int32_t> got = read(system, fd, id);
  if (!got) return;
  if (!written && *got != value) {
    refused_.push_back(fmt::format("{} can't be set to {}, it is {}", name, value, *got));
  } else if (const double asked = *wanted; std::abs(*got - asked) > rounding_part * std::abs(asked) + 1) {
    refused_.push_back(fmt::format("{} was asked to be {}, the camera set {} (it has {}..{})", name, *wanted,
                                   *got, query->minimum, query->maximum));
  }
  held_.push_back({id, name, *got});
}

ControlReport ControlKeeper::apply(V4l2System& system, int fd) {
  held_.clear();
  refused_.clear();
  // Automatics first: they rule the values after them.
  hold(system, fd, V4L2_CID_EXPOSURE_AUTO, "automatic exposure", V4L2_EXPOSURE_MANUAL);
  hold(system, fd, V4L2_CID_EXPOSURE_AUTO_PRIORITY, "exposure's power over the frame rate", 0);
  hold(system, fd, V4L2_CID_AUTOGAIN, "automatic gain", 0);
  hold(system, fd, V4L2_CID_AUTO_WHITE_BALANCE, "automatic white balance", 0);
  hold(system, fd, V4L2_CID_FOCUS_AUTO, "automatic focus", 0);
  hold(system, fd, V4L2_CID_IMAGE_STABILIZATION, "image stabilisation", 0);
  hold(system, fd, V4L2_CID_WIDE_DYNAMIC_RANGE, "wide dynamic range", 0);
  hold(system, fd, V4L2_CID_BACKLIGHT_COMPENSATION, "backlight compensation", 0);
  hold(system, fd, V4L2_CID_POWER_LINE_FREQUENCY, "power line frequency",
       static_cast<std::int32_t>(settings_.power_line));

  std::optional<std::int32_t> exposure;
  if (settings_.exposure) {
    const auto units = (*settings_.exposure + exposure_unit / 2) / exposure_unit;
    exposure = static_cast<std::int32_t>(std::clamp<std::int64_t>(units, 1, INT32_MAX));
  }
  hold(system, fd, V4L2_CID_EXPOSURE_ABSOLUTE, "exposure", exposure);
  hold(system, fd, V4L2_CID_GAIN, "gain", settings_.gain);
  hold(system, fd, V4L2_CID_WHITE_BALANCE_TEMPERATURE, "white balance", settings_.white_balance_kelvin);
  hold(system, fd, V4L2_CID_FOCUS_ABSOLUTE, "focus", settings_.focus);
  for (const Named& control : kept_as_found) hold(system, fd, control.id, control.name, std::nullopt);

  ControlReport report;
  finish(system, fd, report);
  return report;
}

ControlReport ControlKeeper::check(V4l2System& system, int fd) {
  ControlReport report;
  std::vector<std::string> hopeless;
  for (Held& each : held_) {
    const std::optional<std::int32_t> now = read(system, fd, each.id);
    if (!now || *now == each.value) {
      if (now) each.lost = 0;
      continue;
    }
    ++each.lost;
    if (each.lost >= looks_until_hopeless)
      hopeless.push_back(fmt::format("{} doesn't stay at {}", each.name, each.value));
    if (each.lost > looks_until_hopeless && each.lost % looks_between_tries != 0) continue;
    report.drifted.push_back(fmt::format("{} was {}, is set to {} again", each.name, *now, each.value));
    write(system, fd, each.id, each.value);
  }
  finish(system, fd, report);
  if (!report.drifted.empty() && report.exposure == ExposureState::locked)
    report.exposure = ExposureState::drifted;
  if (!hopeless.empty()) {
    report.exposure = report.exposure == ExposureState::unknown ? report.exposure : ExposureState::drifted;
    report.problem += (report.problem.empty() ? "" : "; ") + joined(hopeless);
  }
  return report;
}

void ControlKeeper::finish(V4l2System& system, int fd, ControlReport& report) const {
  report.problem = joined(refused_);
  const std::optional<std::int32_t> mode = read(system, fd, V4L2_CID_EXPOSURE_AUTO);
  const std::optional<std::int32_t> exposure = read(system, fd, V4L2_CID_EXPOSURE_ABSOLUTE);
  const std::int32_t ruled_by = mode.value_or(V4L2_EXPOSURE_AUTO);
  const bool manual = ruled_by == V4L2_EXPOSURE_MANUAL || ruled_by == V4L2_EXPOSURE_SHUTTER_PRIORITY;
  if (!mode && !exposure) {
    report.exposure = ExposureState::unknown;
  } else {
    report.exposure = manual || !mode ? ExposureState::locked : ExposureState::automatic;
  }
  // What an automatic last set is not what the next frame has, yet nearer than nothing.
  if (exposure && *exposure > 0) report.exposure_time = *exposure * exposure_unit;
}

}  // namespace handloft::tracking
