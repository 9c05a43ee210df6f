#pragma once
// Video through shared memory, newest wins (architecture, "What the eye sees"): a memfd of fixed size with a
// ring of slots, each guarded by a sequence lock. The writer never waits and knows nothing of its readers; a
// reader maps the memory read-only, copies the newest frame out and checks everything that it reads, so that
// a writer gone mad can spoil a picture but not crash a reader. The file descriptor travels over a unix
// socket of its own
// ("<tracking socket>.video", PROTOCOL.md "Video ring").

#include <boost/asio/any_io_executor.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/endpoint.h"

namespace handloft::net {

enum class VideoFormat : std::uint32_t { jpeg = 1, yuyv = 2, grey = 3, rgb = 4 };

struct VideoFrameInfo {
  std::uint32_t camera = 0;  ///< Index of the tracking daemon's camera.
  std::uint64_t sequence = 0;
  TimePoint exposure_time;  ///< Middle of the exposure, CLOCK_MONOTONIC of the daemon's host.
  VideoFormat format = VideoFormat::jpeg;
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
};

struct VideoFrame {
  VideoFrameInfo info;
  std::vector<std::uint8_t> bytes;
};

struct FrameRingOptions {
  /// The reader copies one while the writer fills the others: four give it three frame times.
  std::uint32_t slot_count = 4;
  std::uint32_t slot_bytes = 2u << 20;  ///< A 1080p JPEG at high quality is below 1 MiB.
};

class FrameRingWriter {
 public:
  static Result<FrameRingWriter> create(FrameRingOptions options = {});
  FrameRingWriter(FrameRingWriter&&) noexcept;
  FrameRingWriter& operator=(FrameRingWriter&&) noexcept;
  ~FrameRingWriter();

  /// resource_exhausted for more bytes than a slot holds. One thread at a time; never blocks.
  Status write(const VideoFrameInfo& info, std::span<const std::uint8_t> bytes);
  int fd() const;

 private:
  struct Implementation;
  explicit FrameRingWriter(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

class FrameRingReader {
 public:
  /// Maps the memory behind `fd`; data_corrupt when its header is not one of ours or promises more than is
  /// there.
  static Result<FrameRingReader> map(FileDescriptor fd);
  /// Fetches the descriptor from a FrameRingServer and maps it.
  static Result<FrameRingReader> connect(const Endpoint& video_endpoint, std::chrono::milliseconds timeout);
  FrameRingReader(FrameRingReader&&) noexcept;
  FrameRingReader& operator=(FrameRingReader&&) noexcept;
  ~FrameRingReader();

  /// Copies the newest frame into `frame` (its memory is reused) when it is newer than the last one returned
  /// here; false otherwise. With a camera: the newest of that camera that is still in the ring.
  bool read_newest(VideoFrame& frame, std::optional<std::uint32_t> camera = std::nullopt);

 private:
  struct Implementation;
  explicit FrameRingReader(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

/// Hands a ring's descriptor to whoever connects, if it is the same user.
class FrameRingServer {
 public:
  /// `fd` is the writer's; it is duplicated.
  static Result<std::unique_ptr<FrameRingServer>> listen(const boost::asio::any_io_executor& executor,
                                                         const Endpoint& video_endpoint, int fd, Logger log);
  ~FrameRingServer();
  FrameRingServer(const FrameRingServer&) = delete;
  FrameRingServer& operator=(const FrameRingServer&) = delete;
  void stop();

 private:
  struct Implementation;
  explicit FrameRingServer(std::shared_ptr<Implementation> implementation);
  std::shared_ptr<Implementation> implementation_;
};

}  // namespace handloft::net
