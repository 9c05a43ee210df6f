#include "client-hmd/view/film_feed.h"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace handloft::client {
namespace {

constexpr std::uint32_t max_side_px = 8192;
/// 4096 x 2304, more than what headsets' cameras take: 36 MiB decoded, and a picture bomb costs the frame
/// loop tens of milliseconds instead of seconds.
constexpr std::size_t max_pixels = std::size_t{4096} * 2304;
constexpr auto connect_timeout = std::chrono::milliseconds(500);
constexpr auto retry_interval = std::chrono::milliseconds(500);

using Pixels = std::vector<std::uint8_t>;

// A progressive JPEG of a few kilobytes may ask for hundreds of passes over the picture.
#ifdef TJFLAG_LIMITSCANS
constexpr int decoding_flags = TJFLAG_FASTDCT | TJFLAG_LIMITSCANS;
#else
constexpr int decoding_flags = TJFLAG_FASTDCT;
#endif

Error wrong_size(const net::VideoFrame& frame, std::size_t expected) {
  return make_error(ErrorCode::data_corrupt,
                    fmt::format("a picture of {}x{} px has {} bytes, expected {}", frame.info.width_px,
                                frame.info.height_px, frame.bytes.size(), expected),
                    "video");
}

Result<Pixels> decode_jpeg(const net::VideoFrame& frame) {
  const std::unique_ptr<void, decltype(&tjDestroy)> decoder(tjInitDecompress(), tjDestroy);
  if (decoder == nullptr) return make_error(ErrorCode::internal, "TurboJPEG does not start");
  int width = 0, height = 0, subsampling = 0, colour_space = 0;
  const auto bytes = static_cast<unsigned long>(frame.bytes.size());
  if (tjDecompressHeader3(decoder.get(), frame.bytes.data(), bytes, &width, &height, &subsampling,
                          &colour_space) != 0) {
    return make_error(ErrorCode::data_corrupt, fmt::format("no JPEG: {}", tjGetErrorStr2(decoder.get())),
                      "video");
  }
  if (width != static_cast<int>(frame.info.width_px) || height != static_cast<int>(frame.info.height_px)) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("a JPEG of {}x{} px, expected {}x{}", width, height, frame.info.width_px,
                                  frame.info.height_px),
                      "video");
  }
  Pixels rgba(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (tjDecompress2(decoder.get(), frame.bytes.data(), bytes, rgba.data(), width, 0, height, TJPF_RGBA,
                    decoding_flags) != 0) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("a broken JPEG: {}", tjGetErrorStr2(decoder.get())), "video");
  }
  return rgba;
}

std::uint8_t to_byte(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
}

/// ITU-R BT.601, full range, as webcams send it.
void append_yuv(double y, double u, double v, Pixels& out) {
  out.push_back(to_byte(y + 1.402 * (v - 128.0)));
  out.push_back(to_byte(y - 0.344136 * (u - 128.0) - 0.714136 * (v - 128.0)));
  out.push_back(to_byte(y + 1.772 * (u - 128.0)));
  out.push_back(255);
}

}  // namespace

Result<std::vector<std::uint8_t>> decode_picture(const net::VideoFrame& frame) {
  const std::size_t width = frame.info.width_px;
  const std::size_t height = frame.info.height_px;
  if (width == 0 || height == 0 || width > max_side_px || height > max_side_px) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("a picture of {}x{} px, expected 1..{} a side", width, height, max_side_px),
                      "video");
  }
  const std::size_t pixels = width * height;
  if (pixels > max_pixels) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("a picture of {}x{} px, expected at most {} pixels", width, height, max_pixels), "video");
  }
  Pixels rgba;
  switch (frame.info.format) {
    case net::VideoFormat::jpeg:
      return decode_jpeg(frame);
    case net::VideoFormat::grey:
      if (frame.bytes.size() != pixels) return wrong_size(frame, pixels);
      rgba.reserve(4 * pixels);
      for (const std::uint8_t grey : frame.bytes) rgba.insert(rgba.end(), {grey, grey, grey, 255});
      return rgba;
    case net::VideoFormat::rgb:
      if (frame.bytes.size() != 3 * pixels) return wrong_size(frame, 3 * pixels);
      rgba.reserve(4 * pixels);
      for (std::size_t i = 0; i < frame.bytes.size(); i += 3) {
        rgba.insert(rgba.end(), {frame.bytes[i], frame.bytes[i + 1], frame.bytes[i + 2], 255});
      }
      return rgba;
    case net::VideoFormat::yuyv:
      if (frame.bytes.size() != 2 * pixels || width % 2 != 0) return wrong_size(frame, 2 * pixels);
      rgba.reserve(4 * pixels);
      for (std::size_t i = 0; i < frame.bytes.size(); i += 4) {
        append_yuv(frame.bytes[i], frame.bytes[i + 1], frame.bytes[i + 3], rgba);
        append_yuv(frame.bytes[i + 2], frame.bytes[i + 1], frame.bytes[i + 3], rgba);
      }
      return rgba;
  }
  return make_error(ErrorCode::unsupported,
                    fmt::format("picture format {}", static_cast<unsigned>(frame.info.format)), "video");
}

struct FilmFeed::Implementation {
  Implementation(const net::Endpoint& where, Logger logger) : endpoint(where), log(std::move(logger)) {}

  const net::Endpoint endpoint;
  const Logger log;
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<net::FrameRingReader> arrived;  ///< Mapped by the thread, taken by the frame loop.
  bool wanted = true;                           ///< The thread is to connect.
  bool stopping = false;
  std::thread thread;

  // ---- the frame loop only ----
  std::optional<net::FrameRingReader> reader;
  net::VideoFrame raw;
  std::uint64_t serial = 0;
  std::shared_ptr<const FilmFrame> shown;
  bool complained = false;

  void run() {
    std::unique_lock lock(mutex);
    while (!stopping) {
      if (!wanted) {
        changed.wait(lock);
        continue;
      }
      lock.unlock();
      Result<net::FrameRingReader> connected = net::FrameRingReader::connect(endpoint, connect_timeout);
      lock.lock();
      if (connected) {
        arrived.emplace(std::move(*connected));
        wanted = false;
      } else {
        changed.wait_for(lock, retry_interval, [this] { return stopping; });
      }
    }
  }
};

FilmFeed::FilmFeed(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

FilmFeed::~FilmFeed() {
  {
    const std::lock_guard lock(implementation_->mutex);
    implementation_->stopping = true;
  }
  implementation_->changed.notify_all();
  if (implementation_->thread.joinable()) implementation_->thread.join();
}

std::unique_ptr<FilmFeed> FilmFeed::start(const net::Endpoint& tracking, Logger log) {
  const Result<net::Endpoint> endpoint = net::video_endpoint(tracking);
  auto parts = std::make_unique<Implementation>(endpoint ? *endpoint : tracking, std::move(log));
  if (endpoint) {
    parts->thread = std::thread([self = parts.get()] { self->run(); });
  }
  return std::unique_ptr<FilmFeed>(new FilmFeed(std::move(parts)));
}

void FilmFeed::reconnect() {
  {
    const std::lock_guard lock(implementation_->mutex);
    implementation_->wanted = true;
  }
  implementation_->changed.notify_all();
}

std::shared_ptr<const FilmFrame> FilmFeed::newest(std::uint32_t camera) {
  Implementation& self = *implementation_;
  {
    const std::lock_guard lock(self.mutex);
    if (self.arrived) {
      self.reader.emplace(std::move(*self.arrived));
      self.arrived.reset();
    }
  }
  if (!self.reader || !self.reader->read_newest(self.raw, camera)) return self.shown;
  Result<Pixels> rgba = decode_picture(self.raw);
  if (!rgba) {
    if (!self.complained) self.log.warning("{}", rgba.error().describe());
    self.complained = true;
    return self.shown;
  }
  self.shown = std::make_shared<const FilmFrame>(FilmFrame{
      self.raw.info.camera, ++self.serial, self.raw.info.exposure_time,
      static_cast<int>(self.raw.info.width_px), static_cast<int>(self.raw.info.height_px), std::move(*rgba)});
  return self.shown;
}

}  // namespace handloft::client
