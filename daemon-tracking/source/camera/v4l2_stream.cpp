#include "daemon-tracking/source/camera/v4l2_stream.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <span>

#include "daemon-tracking/source/camera/v4l2_probe.h"
#include "daemon-tracking/source/camera/v4l2_words.h"

namespace handloft::tracking {

namespace {

constexpr std::uint32_t capture_type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
// With one buffer the driver has nothing to fill while we copy.
constexpr std::uint32_t fewest_buffers = 2;
constexpr std::uint32_t most_buffers = 32;
// 4096 x 4096 YUYV twice over; a driver that asks for more is not believed.
constexpr std::uint32_t most_buffer_bytes = 64u << 20;
constexpr int most_mode_tries = 8;
// A gap longer than ten minutes at 60 Hz is a counter that began anew.
constexpr std::uint32_t longest_gap = 36000;
// Less than this part of the asked rate granted is worth a word.
constexpr double rate_granted_part = 0.95;

std::size_t pixel_bytes(PixelFormat format) {
  return format == PixelFormat::yuyv ? 2 : 1;
}

}  // namespace

struct V4l2Stream::Dequeued {
  std::uint32_t index = 0;
  std::uint32_t sequence = 0;
  std::size_t bytes = 0;  ///< 0: of no use.
  DriverStamp stamp;
  TimePoint at;
};

Result<std::unique_ptr<V4l2Stream>> V4l2Stream::open(std::shared_ptr<V4l2System> system,
                                                     const std::string& node, const ModeWish& wish,
                                                     const Clock& clock, FramePool& pool) {
  const int fd = system->open(node);
  if (fd < 0) return camera_error(CameraStep::open, -fd, node);
  std::unique_ptr<V4l2Stream> stream(new V4l2Stream(std::move(system), node, fd, clock, pool));
  if (const Status prepared = stream->prepare(wish); !prepared) return prepared.error();
  return stream;
}

V4l2Stream::~V4l2Stream() {
  release_buffers();
  system_->close(fd_);
}

Status V4l2Stream::prepare(const ModeWish& wish) {
  const Result<NodeCapability> capability = query_capability(*system_, fd_, node_);
  if (!capability) return capability.error();
  if (capability->kind != NodeKind::capture) {
    return make_error(ErrorCode::unsupported,
                      capability->kind == NodeKind::multi_planar
                          ? "the camera has the multi-planar interface, expected a single-planar one"
                          : "found no streaming capture node",
                      node_);
  }
  model_ = capability->card;
  const std::vector<VideoSize> sizes = query_sizes(*system_, fd_, wish);
  const Result<VideoMode> best = choose_mode(sizes, wish);
  if (!best) return make_error(best.error().code, best.error().message, node_);
  const std::vector<VideoMode> ranked = rank_modes(sizes, wish);
  VideoMode mode = *best;
  Status started = start_mode(mode);
  for (int tries = 1;
       !started && started.error().code == ErrorCode::resource_exhausted && tries < most_mode_tries;
       ++tries) {
    const std::optional<VideoMode> smaller = smaller_mode(ranked, mode);
    if (!smaller) break;
    mode = *smaller;
    started = start_mode(mode);
    if (started) {
      compromise_ = fmt::format(
          "the USB bus has no bandwidth left for {}, so it runs at {}: plug the camera into "
          "another USB controller, or ask less of its neighbours",
          to_string(*best), to_string(mode_));
    }
  }
  if (!started) return started;
  if (!compromise_.empty()) return {};
  if (mode_.width_px != wish.width_px || mode_.height_px != wish.height_px) {
    compromise_ = fmt::format("asked for {}x{}, it gives {}: a calibration belongs to one size",
                              wish.width_px, wish.height_px, to_string(mode_));
  } else if (mode_.rate_hz < rate_granted_part * wish.rate_hz) {
    compromise_ = fmt::format("asked for {:g} Hz, it grants {}", wish.rate_hz, to_string(mode_));
  }
  return {};
}

Status V4l2Stream::start_mode(const VideoMode& wanted) {
  release_buffers();
  if (const Status set = set_format(wanted); !set) return set;
  set_rate(wanted.rate_hz);
  if (const Status mapped = map_buffers(); !mapped) return mapped;
  return start();
}

Status V4l2Stream::set_format(const VideoMode& wanted) {
  v4l2_format format{};
  format.type = capture_type;
  format.fmt.pix.width = static_cast<std::uint32_t>(wanted.width_px);
  format.fmt.pix.height = static_cast<std::uint32_t>(wanted.height_px);
  format.fmt.pix.pixelformat = fourcc_of(wanted.format);
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int status = system_->ioctl(fd_, VIDIOC_S_FMT, &format); status < 0)
    return camera_error(CameraStep::set_format, -status, node_);
  // The driver may have changed every field to what it can do.
  const v4l2_pix_format& granted = format.fmt.pix;
  const std::optional<PixelFormat> pixels = format_of(granted.pixelformat);
  constexpr std::uint32_t most_side = largest_side_px;
  if (!pixels || granted.width < 1 || granted.height < 1 || granted.width > most_side ||
      granted.height > most_side) {
    return make_error(ErrorCode::unsupported,
                      fmt::format("asked for {}, the driver set {}x{} of format {:#010x}", to_string(wanted),
                                  granted.width, granted.height, granted.pixelformat),
                      node_);
  }
  mode_ = {*pixels, static_cast<int>(granted.width), static_cast<int>(granted.height), wanted.rate_hz};
  row_bytes_ = *pixels == PixelFormat::mjpeg
                   ? 0
                   : std::max<std::size_t>(granted.bytesperline, granted.width * pixel_bytes(*pixels));
  return {};
}

void V4l2Stream::set_rate(double rate_hz) {
  v4l2_streamparm parameters{};
  parameters.type = capture_type;
  constexpr double thousandths = 1000.0;
  parameters.parm.capture.timeperframe.numerator = static_cast<std::uint32_t>(thousandths);
  parameters.parm.capture.timeperframe.denominator =
      static_cast<std::uint32_t>(std::lround(rate_hz * thousandths));
  // Loopbacks and the like know no rates; the measured one tells then.
  system_->ioctl(fd_, VIDIOC_S_PARM, &parameters);
  v4l2_streamparm granted{};
  granted.type = capture_type;
  if (system_->ioctl(fd_, VIDIOC_G_PARM, &granted) < 0) return;
  const v4l2_fract& interval = granted.parm.capture.timeperframe;
  if (interval.numerator > 0 && interval.denominator > 0)
    mode_.rate_hz = static_cast<double>(interval.denominator) / static_cast<double>(interval.numerator);
}

Status V4l2Stream::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = wanted_buffers;
  request.type = capture_type;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int status = system_->ioctl(fd_, VIDIOC_REQBUFS, &request); status < 0)
    return camera_error(CameraStep::buffers, -status, node_);
  if (request.count < fewest_buffers || request.count > most_buffers) {
    return make_error(ErrorCode::io,
                      fmt::format("the driver gave {} buffers, expected {}..{}", request.count,
                                  fewest_buffers, most_buffers),
                      node_);
  }
  for (std::uint32_t index = 0; index < request.count; ++index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = capture_type;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (const int status = system_->ioctl(fd_, VIDIOC_QUERYBUF, &buffer); status < 0)
      return camera_error(CameraStep::buffers, -status, node_);
    if (buffer.length < 1 || buffer.length > most_buffer_bytes) {
      return make_error(
          ErrorCode::io,
          fmt::format("the driver's buffer has {} bytes, expected 1..{}", buffer.length, most_buffer_bytes),
          node_);
    }
    const std::uint8_t* start = system_->map(fd_, buffer.length, buffer.m.offset);
    if (start == nullptr) return make_error(ErrorCode::io, "the driver's buffers can't be mapped", node_);
    mappings_.push_back({start, buffer.length});
  }
  return {};
}

void V4l2Stream::release_buffers() {
  if (streaming_) {
    std::uint32_t type = capture_type;
    system_->ioctl(fd_, VIDIOC_STREAMOFF, &type);
    streaming_ = false;
  }
  for (const Mapping& mapping : mappings_) system_->unmap(mapping.start, mapping.length);
  if (!mappings_.empty()) {
    v4l2_requestbuffers none{};
    none.type = capture_type;
    none.memory = V4L2_MEMORY_MMAP;
    system_->ioctl(fd_, VIDIOC_REQBUFS, &none);
  }
  mappings_.clear();
}

Status V4l2Stream::start() {
  for (std::uint32_t index = 0; index < mappings_.size(); ++index) {
    if (const Status queued = queue(index); !queued) return queued;
  }
  std::uint32_t type = capture_type;
  if (const int status = system_->ioctl(fd_, VIDIOC_STREAMON, &type); status < 0)
    return camera_error(CameraStep::start, -status, node_);
  streaming_ = true;
  last_sequence_.reset();
  return {};
}

bool V4l2Stream::alive() const {
  return query_capability(*system_, fd_, node_).ok();
}

Status V4l2Stream::queue(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = capture_type;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (const int status = system_->ioctl(fd_, VIDIOC_QBUF, &buffer); status < 0)
    return camera_error(CameraStep::capture, -status, node_);
  return {};
}

void V4l2Stream::count_gap(std::uint32_t sequence) {
  if (last_sequence_) {
    const std::uint32_t step = sequence - *last_sequence_;
    if (step > 1 && step < longest_gap) counters_.dropped += step - 1;
  }
  last_sequence_ = sequence;
}

Result<std::optional<V4l2Stream::Dequeued>> V4l2Stream::dequeue() {
  v4l2_buffer buffer{};
  buffer.type = capture_type;
  buffer.memory = V4L2_MEMORY_MMAP;
  const int status = system_->ioctl(fd_, VIDIOC_DQBUF, &buffer);
  if (status == -EAGAIN) return std::optional<Dequeued>();
  if (status < 0) return camera_error(CameraStep::capture, -status, node_);
  if (buffer.index >= mappings_.size()) {
    return make_error(ErrorCode::io,
                      fmt::format("the driver gave buffer {} of {}", buffer.index, mappings_.size()), node_);
  }
  Dequeued got;
  got.index = buffer.index;
  got.sequence = buffer.sequence;
  got.at = clock_.now();
  // A driver's stamp may be anything; what can't be nanoseconds is none.
  constexpr std::int64_t most_seconds = 1'000'000'000;
  if (buffer.timestamp.tv_sec >= 0 && buffer.timestamp.tv_sec < most_seconds &&
      buffer.timestamp.tv_usec >= 0 && buffer.timestamp.tv_usec < 1'000'000)
    got.stamp.ns = buffer.timestamp.tv_sec * 1'000'000'000 + buffer.timestamp.tv_usec * 1000;
  got.stamp.monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  got.stamp.point = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE
                        ? StampPoint::start_of_exposure
                        : StampPoint::end_of_frame;
  ++counters_.filled;
  count_gap(buffer.sequence);
  // bytesused is authoritative; a buffer marked broken may hold half a picture.
  const bool broken = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  if (!broken && buffer.bytesused <= mappings_[got.index].length) got.bytes = buffer.bytesused;
  return std::optional<Dequeued>(got);
}

std::shared_ptr<const std::vector<std::uint8_t>> V4l2Stream::copy(const Dequeued& from) {
  const std::uint8_t* start = mappings_[from.index].start;
  std::size_t bytes = from.bytes;
  if (mode_.format == PixelFormat::mjpeg) {
    // Cut-off pictures are routine on USB: whole ones begin with a start and end with an end marker, after
    // which some drivers pad with zeros.
    while (bytes > 2 && start[bytes - 1] == 0) --bytes;
    const bool whole = bytes >= 4 && start[0] == 0xFF && start[1] == 0xD8 && start[bytes - 2] == 0xFF &&
                       start[bytes - 1] == 0xD9;
    return whole ? pool_.copy({start, bytes}) : nullptr;
  }
  const auto height = static_cast<std::size_t>(mode_.height_px);
  const std::size_t row = static_cast<std::size_t>(mode_.width_px) * pixel_bytes(mode_.format);
  // The last row's padding may be missing.
  if (bytes < row_bytes_ * (height - 1) + row) return nullptr;
  if (row == row_bytes_) return pool_.copy({start, row * height});
  std::unique_ptr<FramePool::Bytes> packed = pool_.take();
  packed->reserve(row * height);
  for (std::size_t y = 0; y < height; ++y)
    packed->insert(packed->end(), start + y * row_bytes_, start + y * row_bytes_ + row);
  return pool_.share(std::move(packed));
}

Result<std::optional<CapturedFrame>> V4l2Stream::newest() {
  std::optional<CapturedFrame> frame;
  std::optional<Dequeued> held;
  // Not for ever: a driver that is always ready must not keep us from handing on.
  for (std::size_t turn = 0; turn < mappings_.size(); ++turn) {
    Result<std::optional<Dequeued>> got = dequeue();
    if (!got) return got.error();
    if (!*got) break;
    if ((*got)->bytes == 0) {
      ++counters_.refused;
      if (const Status queued = queue((*got)->index); !queued) return queued.error();
      continue;
    }
    if (held) {
      ++counters_.drained;
      if (const Status queued = queue(held->index); !queued) return queued.error();
    }
    held = **got;
  }
  if (!held) return frame;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes = copy(*held);
  if (const Status queued = queue(held->index); !queued) return queued.error();
  if (!bytes) {
    ++counters_.refused;
    return frame;
  }
  frame = CapturedFrame{held->sequence, held->stamp, held->at, std::move(bytes)};
  return frame;
}

}  // namespace handloft::tracking
