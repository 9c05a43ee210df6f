#include "daemon-tracking/source/camera/v4l2_probe.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "daemon-tracking/source/camera/v4l2_words.h"

namespace handloft::tracking {

namespace {

// A driver that answers for ever must not keep us: real cameras name some ten formats of some twenty sizes.
constexpr std::uint32_t most_formats = 32;
constexpr std::uint32_t most_sizes = 64;
constexpr std::uint32_t most_rates = 32;

constexpr std::array<std::array<int, 2>, 9> common_sizes{{{1920, 1080},
                                                          {1280, 960},
                                                          {1280, 720},
                                                          {1024, 768},
                                                          {800, 600},
                                                          {640, 480},
                                                          {640, 360},
                                                          {320, 240},
                                                          {320, 180}}};
constexpr std::array<double, 8> common_rates{120, 90, 60, 50, 30, 25, 15, 10};

template <std::size_t N>
std::string text(const std::uint8_t (&field)[N]) {
  const auto* start = reinterpret_cast<const char*>(field);
  return std::string(start, ::strnlen(start, N));
}

double rate_of(const v4l2_fract& interval) {
  return interval.numerator == 0
             ? 0.0
             : static_cast<double>(interval.denominator) / static_cast<double>(interval.numerator);
}

void add_unique(std::vector<double>& rates, double rate) {
  if (rate > 0 && std::find(rates.begin(), rates.end(), rate) == rates.end()) rates.push_back(rate);
}

std::vector<double> query_rates(V4l2System& system, int fd, std::uint32_t fourcc, std::uint32_t width,
                                std::uint32_t height, double wished_hz) {
  std::vector<double> rates;
  for (std::uint32_t index = 0; index < most_rates; ++index) {
    v4l2_frmivalenum interval{};
    interval.index = index;
    interval.pixel_format = fourcc;
    interval.width = width;
    interval.height = height;
    if (system.ioctl(fd, VIDIOC_ENUM_FRAMEINTERVALS, &interval) < 0) break;
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      add_unique(rates, rate_of(interval.discrete));
      continue;
    }
    const double fastest = rate_of(interval.stepwise.min);
    const double slowest = rate_of(interval.stepwise.max);
    add_unique(rates, fastest);
    for (const double rate : common_rates) {
      if (rate >= slowest && rate <= fastest) add_unique(rates, rate);
    }
    if (wished_hz >= slowest && wished_hz <= fastest) add_unique(rates, wished_hz);
    break;
  }
  // Drivers that don't know their rates (loopbacks) run at what they get.
  if (rates.empty()) rates.push_back(wished_hz > 0 ? wished_hz : 30.0);
  std::sort(rates.begin(), rates.end(), std::greater<>());
  return rates;
}

bool within(int value, std::uint32_t low, std::uint32_t high, std::uint32_t step) {
  const auto wanted = static_cast<std::uint32_t>(value);
  return value > 0 && wanted >= low && wanted <= high && (step < 2 || (wanted - low) % step == 0);
}

}  // namespace

std::uint32_t fourcc_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::mjpeg:
      return V4L2_PIX_FMT_MJPEG;
    case PixelFormat::yuyv:
      return V4L2_PIX_FMT_YUYV;
    case PixelFormat::grey:
      return V4L2_PIX_FMT_GREY;
  }
  return 0;
}

std::optional<PixelFormat> format_of(std::uint32_t fourcc) {
  switch (fourcc) {
    case V4L2_PIX_FMT_MJPEG:
    case V4L2_PIX_FMT_JPEG:
      return PixelFormat::mjpeg;
    case V4L2_PIX_FMT_YUYV:
      return PixelFormat::yuyv;
    case V4L2_PIX_FMT_GREY:
      return PixelFormat::grey;
    default:
      return std::nullopt;
  }
}

Result<NodeCapability> query_capability(V4l2System& system, int fd, const std::string& node) {
  v4l2_capability answer{};
  const int status = system.ioctl(fd, VIDIOC_QUERYCAP, &answer);
  if (status < 0) return camera_error(CameraStep::query, -status, node);
  NodeCapability found;
  found.driver = text(answer.driver);
  found.card = text(answer.card);
  found.bus_info = text(answer.bus_info);
  // `capabilities` is the whole device's: only device_caps tells a camera's metadata node from its pictures.
  const std::uint32_t caps =
      (answer.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? answer.device_caps : answer.capabilities;
  const bool memory_to_memory = (caps & (V4L2_CAP_VIDEO_M2M | V4L2_CAP_VIDEO_M2M_MPLANE)) != 0;
  if (memory_to_memory) {
    found.kind = NodeKind::other;
  } else if ((caps & V4L2_CAP_VIDEO_CAPTURE) != 0) {
    found.kind = (caps & V4L2_CAP_STREAMING) != 0 ? NodeKind::capture : NodeKind::not_streaming;
  } else if ((caps & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0) {
    found.kind = NodeKind::multi_planar;
  }
  return found;
}

std::vector<VideoSize> query_sizes(V4l2System& system, int fd, const ModeWish& wish) {
  std::vector<VideoSize> sizes;
  for (std::uint32_t f = 0; f < most_formats; ++f) {
    v4l2_fmtdesc description{};
    description.index = f;
    description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (system.ioctl(fd, VIDIOC_ENUM_FMT, &description) < 0) break;
    const std::optional<PixelFormat> format = format_of(description.pixelformat);
    if (!format) continue;
    const auto add = [&](std::uint32_t width, std::uint32_t height) {
      if (width > largest_side_px || height > largest_side_px) return;
      const auto same = [&](const VideoSize& each) {
        return each.format == *format && each.width_px == static_cast<int>(width) &&
               each.height_px == static_cast<int>(height);
      };
      if (std::any_of(sizes.begin(), sizes.end(), same)) return;
      sizes.push_back({*format, static_cast<int>(width), static_cast<int>(height),
                       query_rates(system, fd, description.pixelformat, width, height, wish.rate_hz)});
    };
    for (std::uint32_t s = 0; s < most_sizes; ++s) {
      v4l2_frmsizeenum size{};
      size.index = s;
      size.pixel_format = description.pixelformat;
      if (system.ioctl(fd, VIDIOC_ENUM_FRAMESIZES, &size) < 0) break;
      if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
        add(size.discrete.width, size.discrete.height);
        continue;
      }
      const auto fits = [&](int width, int height) {
        return within(width, size.stepwise.min_width, size.stepwise.max_width, size.stepwise.step_width) &&
               within(height, size.stepwise.min_height, size.stepwise.max_height, size.stepwise.step_height);
      };
      for (const auto& [width, height] : common_sizes) {
        if (fits(width, height)) add(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
      }
      if (fits(wish.width_px, wish.height_px))
        add(static_cast<std::uint32_t>(wish.width_px), static_cast<std::uint32_t>(wish.height_px));
      break;
    }
  }
  return sizes;
}

}  // namespace handloft::tracking
