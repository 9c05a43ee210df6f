#include "tests/support/fake_v4l2_system.h"

#include <linux/videodev2.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace handloft::tracking::testing {

const std::uint32_t good_stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;

namespace {

std::uint32_t fourcc(PixelFormat format) {
  if (format == PixelFormat::yuyv) return V4L2_PIX_FMT_YUYV;
  return format == PixelFormat::grey ? V4L2_PIX_FMT_GREY : V4L2_PIX_FMT_MJPEG;
}

std::vector<PixelFormat> formats_of(const FakeCamera& camera) {
  std::vector<PixelFormat> formats;
  for (const VideoSize& size : camera.sizes) {
    if (std::find(formats.begin(), formats.end(), size.format) == formats.end())
      formats.push_back(size.format);
  }
  return formats;
}

// The index-th of what `fits`, or null.
template <typename Fits>
const VideoSize* nth(const FakeCamera& camera, std::uint32_t index, Fits fits) {
  for (const VideoSize& size : camera.sizes) {
    if (fits(size) && index-- == 0) return &size;
  }
  return nullptr;
}

void fill(std::uint8_t* field, std::size_t room, const std::string& text) {
  std::memcpy(field, text.data(), std::min(room - 1, text.size()));
}

void ring(int fd) {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(fd, &one, sizeof one);
}

}  // namespace

std::vector<std::uint8_t> fake_jpeg(std::size_t length, std::uint8_t fill_byte) {
  std::vector<std::uint8_t> bytes(length, fill_byte);
  bytes[0] = 0xFF;
  bytes[1] = 0xD8;
  bytes[length - 2] = 0xFF;
  bytes[length - 1] = 0xD9;
  return bytes;
}

FakeV4l2System::~FakeV4l2System() {
  for (const auto& [fd, opened] : opened_) ::close(fd);
}

void FakeV4l2System::plug(FakeCamera camera) {
  const std::lock_guard lock(mutex_);
  const std::string node = camera.node.node;
  cameras_[node] = std::move(camera);
}

void FakeV4l2System::unplug(const std::string& node) {
  const std::lock_guard lock(mutex_);
  cameras_.erase(node);
  for (auto& [fd, opened] : opened_) {
    if (opened.node != node) continue;
    opened.gone = true;
    ring(fd);
  }
}

FakeV4l2System::Opened* FakeV4l2System::opened(const std::string& node) {
  for (auto& [fd, opened] : opened_) {
    if (opened.node == node && !opened.gone) return &opened;
  }
  return nullptr;
}

bool FakeV4l2System::deliver(const std::string& node, const FakeFrame& frame) {
  const std::lock_guard lock(mutex_);
  for (auto& [fd, opened] : opened_) {
    if (opened.node != node || !opened.streaming || opened.gone || opened.queued.empty()) continue;
    const std::uint32_t index = opened.queued.front();
    opened.queued.pop_front();
    std::vector<std::uint8_t>& buffer = opened.buffers[index];
    std::copy_n(frame.bytes.begin(), std::min(frame.bytes.size(), buffer.size()), buffer.begin());
    opened.filled.emplace_back(index, frame);
    ring(fd);
    return true;
  }
  return false;
}

bool FakeV4l2System::streaming(const std::string& node) {
  const std::lock_guard lock(mutex_);
  const Opened* found = opened(node);
  return found != nullptr && found->streaming;
}

void FakeV4l2System::poll_error(const std::string& node) {
  const std::lock_guard lock(mutex_);
  for (auto& [fd, opened] : opened_) {
    if (opened.node != node) continue;
    opened.error = true;
    ring(fd);
  }
}

void FakeV4l2System::fail(unsigned long request, int error, int count) {
  const std::lock_guard lock(mutex_);
  failures_[request].insert(failures_[request].end(), static_cast<std::size_t>(count), error);
}

void FakeV4l2System::fail_open(const std::string& node, int error) {
  const std::lock_guard lock(mutex_);
  open_failures_[node] = error;
}

void FakeV4l2System::set_liar(std::function<void(unsigned long, void*)> liar) {
  const std::lock_guard lock(mutex_);
  liar_ = std::move(liar);
}

std::int32_t FakeV4l2System::control(const std::string& node, std::uint32_t id) {
  const std::lock_guard lock(mutex_);
  return cameras_.at(node).controls.at(id).value;
}

void FakeV4l2System::set_control(const std::string& node, std::uint32_t id, std::int32_t value) {
  const std::lock_guard lock(mutex_);
  cameras_.at(node).controls.at(id).value = value;
}

int FakeV4l2System::open_count() const {
  const std::lock_guard lock(mutex_);
  return opens_;
}

int FakeV4l2System::mapped_count() const {
  const std::lock_guard lock(mutex_);
  return mapped_;
}

std::vector<V4l2Node> FakeV4l2System::nodes() {
  const std::lock_guard lock(mutex_);
  std::vector<V4l2Node> found;
  for (const auto& [node, camera] : cameras_) found.push_back(camera.node);
  return found;
}

int FakeV4l2System::open(const std::string& node) {
  const std::lock_guard lock(mutex_);
  if (const auto failure = open_failures_.find(node); failure != open_failures_.end() && failure->second != 0)
    return -failure->second;
  if (cameras_.count(node) == 0) return -ENOENT;
  // Readable once for each filled buffer, as a video node is.
  const int fd = ::eventfd(0, EFD_SEMAPHORE | EFD_NONBLOCK | EFD_CLOEXEC);
  if (fd < 0) return -errno;
  opened_[fd].node = node;
  ++opens_;
  return fd;
}

void FakeV4l2System::close(int fd) {
  const std::lock_guard lock(mutex_);
  opened_.erase(fd);
  ::close(fd);
}

int FakeV4l2System::ioctl(int fd, unsigned long request, void* argument) {
  const std::lock_guard lock(mutex_);
  const auto found = opened_.find(fd);
  if (found == opened_.end()) return -EBADF;
  if (found->second.gone) return -ENODEV;
  if (std::deque<int>& failures = failures_[request]; !failures.empty()) {
    const int error = failures.front();
    failures.pop_front();
    return -error;
  }
  const int status = answer(found->second, fd, request, argument);
  if (liar_ && status == 0) liar_(request, argument);
  return status;
}

std::uint32_t FakeV4l2System::buffer_bytes(const Opened& opened) const {
  const std::uint32_t row = opened.width * (opened.format == PixelFormat::yuyv ? 2 : 1);
  return (row + cameras_.at(opened.node).row_padding) * opened.height;
}

int FakeV4l2System::answer_enumeration(FakeCamera& camera, unsigned long request, void* argument) {
  if (request == VIDIOC_ENUM_FMT) {
    auto& description = *static_cast<v4l2_fmtdesc*>(argument);
    const std::vector<PixelFormat> formats = formats_of(camera);
    if (description.index >= formats.size()) return -EINVAL;
    description.pixelformat = fourcc(formats[description.index]);
    return 0;
  }
  if (request == VIDIOC_ENUM_FRAMESIZES) {
    auto& wanted = *static_cast<v4l2_frmsizeenum*>(argument);
    const VideoSize* size = nth(camera, wanted.index, [&](const VideoSize& each) {
      return fourcc(each.format) == wanted.pixel_format;
    });
    if (size == nullptr) return -EINVAL;
    wanted.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    wanted.discrete = {static_cast<std::uint32_t>(size->width_px),
                       static_cast<std::uint32_t>(size->height_px)};
    return 0;
  }
  auto& wanted = *static_cast<v4l2_frmivalenum*>(argument);
  const VideoSize* size = nth(camera, 0, [&](const VideoSize& each) {
    return fourcc(each.format) == wanted.pixel_format &&
           static_cast<std::uint32_t>(each.width_px) == wanted.width &&
           static_cast<std::uint32_t>(each.height_px) == wanted.height;
  });
  if (size == nullptr || wanted.index >= size->rates_hz.size()) return -EINVAL;
  wanted.type = V4L2_FRMIVAL_TYPE_DISCRETE;
  wanted.discrete = {1000, static_cast<std::uint32_t>(std::lround(size->rates_hz[wanted.index] * 1000))};
  return 0;
}

int FakeV4l2System::answer_control(FakeCamera& camera, unsigned long request, void* argument) {
  if (request == VIDIOC_QUERYCTRL) {
    auto& query = *static_cast<v4l2_queryctrl*>(argument);
    const auto found = camera.controls.find(query.id);
    if (found == camera.controls.end()) return -EINVAL;
    const FakeControl& control = found->second;
    query.type = V4L2_CTRL_TYPE_INTEGER;
    query.minimum = control.minimum;
    query.maximum = control.maximum;
    query.step = control.step;
    query.flags = control.flags;
    return 0;
  }
  auto& wanted = *static_cast<v4l2_control*>(argument);
  const auto found = camera.controls.find(wanted.id);
  if (found == camera.controls.end()) return -EINVAL;
  FakeControl& control = found->second;
  if (request == VIDIOC_G_CTRL) {
    wanted.value = control.value;
    return 0;
  }
  if (wanted.value < control.minimum || wanted.value > control.maximum) return -ERANGE;
  if (!control.stubborn) control.value = wanted.value;
  return 0;
}

int FakeV4l2System::answer(Opened& opened, int fd, unsigned long request, void* argument) {
  FakeCamera& camera = cameras_.at(opened.node);
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& caps = *static_cast<v4l2_capability*>(argument);
      fill(caps.driver, sizeof caps.driver, "fake");
      fill(caps.card, sizeof caps.card, camera.card);
      caps.device_caps =
          camera.device_caps != 0 ? camera.device_caps : V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      // As the metadata node of a webcam says: what the whole device can do.
      caps.capabilities =
          V4L2_CAP_DEVICE_CAPS | V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | caps.device_caps;
      return 0;
    }
    case VIDIOC_ENUM_FMT:
    case VIDIOC_ENUM_FRAMESIZES:
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return answer_enumeration(camera, request, argument);
    case VIDIOC_QUERYCTRL:
    case VIDIOC_G_CTRL:
    case VIDIOC_S_CTRL:
      return answer_control(camera, request, argument);
    case VIDIOC_S_FMT: {
      v4l2_pix_format& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
      opened.format = pix.pixelformat == V4L2_PIX_FMT_YUYV   ? PixelFormat::yuyv
                      : pix.pixelformat == V4L2_PIX_FMT_GREY ? PixelFormat::grey
                                                             : PixelFormat::mjpeg;
      opened.width = pix.width;
      opened.height = pix.height;
      pix.bytesperline = opened.format == PixelFormat::mjpeg
                             ? 0
                             : pix.width * (opened.format == PixelFormat::yuyv ? 2 : 1) + camera.row_padding;
      pix.sizeimage = buffer_bytes(opened);
      return 0;
    }
    case VIDIOC_S_PARM: {
      const v4l2_fract& interval = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
      opened.rate_hz = static_cast<double>(interval.denominator) / static_cast<double>(interval.numerator);
      return 0;
    }
    case VIDIOC_G_PARM:
      static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {
          1000, static_cast<std::uint32_t>(std::lround(opened.rate_hz * 1000))};
      return 0;
    case VIDIOC_REQBUFS: {
      auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
      if (wanted.count > 0) wanted.count = camera.buffers_given;
      opened.buffers.assign(wanted.count, std::vector<std::uint8_t>(buffer_bytes(opened)));
      opened.queued.clear();
      opened.filled.clear();
      return 0;
    }
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= opened.buffers.size()) return -EINVAL;
      buffer.length = static_cast<std::uint32_t>(opened.buffers[buffer.index].size());
      buffer.m.offset = buffer.index;
      return 0;
    }
    case VIDIOC_QBUF: {
      const std::uint32_t index = static_cast<v4l2_buffer*>(argument)->index;
      if (index >= opened.buffers.size()) return -EINVAL;
      if (std::find(opened.queued.begin(), opened.queued.end(), index) != opened.queued.end()) return -EINVAL;
      opened.queued.push_back(index);
      return 0;
    }
    case VIDIOC_STREAMON:
      opened.streaming = true;
      return 0;
    case VIDIOC_STREAMOFF:
      opened.streaming = false;
      return 0;
    case VIDIOC_DQBUF: {
      if (opened.filled.empty()) return -EAGAIN;
      std::uint64_t one = 0;
      [[maybe_unused]] const ssize_t got = ::read(fd, &one, sizeof one);
      const auto [index, frame] = opened.filled.front();
      opened.filled.pop_front();
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      buffer.index = index;
      buffer.sequence = frame.sequence;
      buffer.flags = frame.flags;
      buffer.timestamp.tv_sec = frame.timestamp_ns / 1'000'000'000;
      buffer.timestamp.tv_usec = frame.timestamp_ns % 1'000'000'000 / 1000;
      buffer.bytesused = frame.bytesused.value_or(static_cast<std::uint32_t>(frame.bytes.size()));
      buffer.length = static_cast<std::uint32_t>(opened.buffers[index].size());
      return 0;
    }
    default:
      return -ENOTTY;
  }
}

const std::uint8_t* FakeV4l2System::map(int fd, std::size_t length, std::int64_t offset) {
  const std::lock_guard lock(mutex_);
  const auto found = opened_.find(fd);
  if (found == opened_.end() || static_cast<std::size_t>(offset) >= found->second.buffers.size())
    return nullptr;
  std::vector<std::uint8_t>& buffer = found->second.buffers[static_cast<std::size_t>(offset)];
  if (length > buffer.size()) return nullptr;
  ++mapped_;
  return buffer.data();
}

void FakeV4l2System::unmap(const std::uint8_t*, std::size_t) {
  const std::lock_guard lock(mutex_);
  --mapped_;
}

int FakeV4l2System::poll(std::span<pollfd> what, int timeout_ms) {
  const int ready = ::poll(what.data(), what.size(), timeout_ms);
  if (ready <= 0) return ready < 0 ? (errno == EINTR ? 0 : -errno) : 0;
  const std::lock_guard lock(mutex_);
  for (pollfd& each : what) {
    const auto found = opened_.find(each.fd);
    if (found == opened_.end() || each.revents == 0) continue;
    Opened& opened = found->second;
    if (opened.gone) each.revents = POLLERR;
    if (opened.error) {
      opened.error = false;
      std::uint64_t one = 0;
      [[maybe_unused]] const ssize_t got = ::read(each.fd, &one, sizeof one);
      each.revents = POLLERR;
    }
  }
  return ready;
}

}  // namespace handloft::tracking::testing
