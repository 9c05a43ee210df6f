#include "daemon-tracking/source/camera/v4l2_modes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

namespace handloft::tracking {

namespace {

// Cameras name 29.97 for 30, and 7.5 for 8 would be another rate.
constexpr double rate_reached_part = 0.95;
// What a bus may give to isochronous transfers: 80 % of a USB 2 microframe, of which bit stuffing and headers
// leave about this part of the raw speed.
constexpr double isochronous_part = 0.7;

double bytes_per_pixel(PixelFormat format) {
  switch (format) {
    case PixelFormat::mjpeg:
      return 0.25;
    case PixelFormat::yuyv:
      return 2.0;
    case PixelFormat::grey:
      return 1.0;
  }
  return 2.0;
}

bool colourless(PixelFormat format) {
  return format == PixelFormat::grey;
}

// Smaller is better.
auto rank(const VideoMode& mode, const ModeWish& wish) {
  const bool reached = mode.rate_hz >= rate_reached_part * wish.rate_hz;
  const double rate_miss = reached ? 0.0 : wish.rate_hz - mode.rate_hz;
  const double wanted_pixels = static_cast<double>(wish.width_px) * wish.height_px;
  const double pixels = static_cast<double>(mode.width_px) * mode.height_px;
  const double size_miss = std::abs(std::log(pixels / std::max(1.0, wanted_pixels)));
  const bool same_shape =
      std::int64_t{mode.width_px} * wish.height_px == std::int64_t{mode.height_px} * wish.width_px;
  const bool fits = bandwidth_bytes_per_s(mode) <= wish.bandwidth_bytes_per_s;
  // Raw pictures lose nothing and cost nothing to decode, if they fit.
  const int format = mode.format == PixelFormat::mjpeg ? 1 : (fits ? 0 : 2);
  // Faster than asked only costs bandwidth.
  const double excess = reached ? mode.rate_hz - wish.rate_hz : 0.0;
  return std::make_tuple(colourless(mode.format), rate_miss, size_miss, !same_shape, format, excess);
}

}  // namespace

double bandwidth_bytes_per_s(const VideoMode& mode) {
  return bytes_per_pixel(mode.format) * mode.width_px * mode.height_px * mode.rate_hz;
}

std::vector<VideoMode> rank_modes(const std::vector<VideoSize>& sizes, const ModeWish& wish) {
  std::vector<VideoMode> modes;
  for (const VideoSize& size : sizes) {
    if (wish.format && size.format != *wish.format) continue;
    if (size.width_px < 1 || size.height_px < 1 || size.width_px > largest_side_px ||
        size.height_px > largest_side_px)
      continue;
    for (const double rate : size.rates_hz) {
      if (std::isfinite(rate) && rate > 0)
        modes.push_back({size.format, size.width_px, size.height_px, rate});
    }
  }
  std::stable_sort(modes.begin(), modes.end(),
                   [&](const VideoMode& a, const VideoMode& b) { return rank(a, wish) < rank(b, wish); });
  return modes;
}

Result<VideoMode> choose_mode(const std::vector<VideoSize>& sizes, const ModeWish& wish) {
  const std::vector<VideoMode> ranked = rank_modes(sizes, wish);
  if (!ranked.empty()) return ranked.front();
  std::string have;
  for (const VideoSize& size : sizes) {
    have += fmt::format("{}{}x{} {}", have.empty() ? "" : ", ", size.width_px, size.height_px,
                        to_string(size.format));
  }
  return make_error(
      ErrorCode::not_found,
      fmt::format("found {}, expected {}", have.empty() ? "no mode that the daemon can read" : have,
                  wish.format ? to_string(*wish.format) : "MJPEG, YUYV or GREY"),
      "mode");
}

std::optional<VideoMode> smaller_mode(const std::vector<VideoMode>& ranked, const VideoMode& refused) {
  const double too_much = bandwidth_bytes_per_s(refused);
  const VideoMode* best = nullptr;
  bool best_same_size = false;
  for (const VideoMode& mode : ranked) {
    if (bandwidth_bytes_per_s(mode) >= too_much) continue;
    const bool same_size = mode.width_px == refused.width_px && mode.height_px == refused.height_px;
    if (best == nullptr || (same_size && !best_same_size)) {
      best = &mode;
      best_same_size = same_size;
    }
  }
  return best == nullptr ? std::nullopt : std::optional(*best);
}

std::string bus_problem(const BusShare& share) {
  double needed = 0;
  std::size_t raw = 0;
  double raw_needed = 0;
  double compressed_instead = 0;
  for (const VideoMode& mode : share.modes) {
    const double each = bandwidth_bytes_per_s(mode);
    needed += each;
    VideoMode as_jpeg = mode;
    as_jpeg.format = PixelFormat::mjpeg;
    if (mode.format != PixelFormat::mjpeg) {
      ++raw;
      raw_needed += each;
      compressed_instead += bandwidth_bytes_per_s(as_jpeg);
    }
  }
  const double room = share.speed_mbit_s * 1e6 / 8.0 * isochronous_part;
  if (needed <= room) return {};
  const std::string proposal =
      raw > 0 && needed - raw_needed + compressed_instead <= room
          ? "choose MJPEG for them"
          : fmt::format("lower their rates to {:.0f} %", std::floor(100.0 * room / needed));
  return fmt::format(
      "{} cameras on {} ask for {:.0f} MB/s, it carries about {:.0f}: plug some into another USB "
      "controller, or {}",
      share.modes.size(), share.bus, needed / 1e6, room / 1e6, proposal);
}

std::string to_string(const VideoMode& mode) {
  return fmt::format("{}x{} at {:g} Hz {}", mode.width_px, mode.height_px,
                     std::round(mode.rate_hz * 100.0) / 100.0, to_string(mode.format));
}

std::string_view to_string(PixelFormat format) {
  switch (format) {
    case PixelFormat::mjpeg:
      return "MJPEG";
    case PixelFormat::yuyv:
      return "YUYV";
    case PixelFormat::grey:
      return "GREY";
  }
  return "unknown";
}

}  // namespace handloft::tracking
