#pragma once
// One opened and streaming camera: format, rate, mapped buffers, and the newest frame at each turn (T1). It
// lives from one plug to the next; v4l2_camera.cpp makes a new one each time. Not thread-safe.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/source/camera/frame_pool.h"
#include "daemon-tracking/source/camera/v4l2_modes.h"
#include "daemon-tracking/source/camera/v4l2_system.h"
#include "daemon-tracking/source/camera/v4l2_timestamps.h"

namespace handloft::tracking {

/// The driver fills one, two wait, one is with us.
inline constexpr std::uint32_t wanted_buffers = 4;

/// What dequeuing cost and lost, since the stream was opened.
struct StreamCounters {
  std::uint64_t filled = 0;   ///< Buffers that the driver gave back.
  std::uint64_t dropped = 0;  ///< Gaps in its sequence.
  std::uint64_t drained = 0;  ///< Good, but older than another one that was ready.
  std::uint64_t refused = 0;  ///< Broken, empty or cut off.
};

/// A frame whose bytes are ours.
struct CapturedFrame {
  std::uint32_t sequence = 0;
  DriverStamp stamp;
  TimePoint dequeued;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
};

class V4l2Stream {
 public:
  /// Opens `node`, sets the best mode that it and its bus allow, and starts. Errors: those of camera_error();
  /// unsupported for what is no capture node or has none of our formats. `pool` and `clock` must outlive it.
  static Result<std::unique_ptr<V4l2Stream>> open(std::shared_ptr<V4l2System> system, const std::string& node,
                                                  const ModeWish& wish, const Clock& clock, FramePool& pool);
  ~V4l2Stream();
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  /// To wait on for POLLIN.
  int fd() const { return fd_; }
  const std::string& model() const { return model_; }
  /// As the driver granted it; the rate is G_PARM's, or what was asked where the driver has no such call.
  const VideoMode& mode() const { return mode_; }
  /// What is less than asked for, in words; empty when all was granted.
  const std::string& compromise() const { return compromise_; }
  const StreamCounters& counters() const { return counters_; }

  /// False once the driver says that the device is gone.
  bool alive() const;

  /// Takes all that is ready and keeps the newest good frame; nullopt when there is none. Errors: not_found
  /// when the camera is gone, io when it broke down. After an error the stream is of no more use.
  Result<std::optional<CapturedFrame>> newest();

 private:
  struct Mapping {
    const std::uint8_t* start = nullptr;
    std::size_t length = 0;
  };
  struct Dequeued;

  V4l2Stream(std::shared_ptr<V4l2System> system, std::string node, int fd, const Clock& clock,
             FramePool& pool)
      : system_(std::move(system)), node_(std::move(node)), fd_(fd), clock_(clock), pool_(pool) {}
  Status prepare(const ModeWish& wish);
  Status start_mode(const VideoMode& wanted);
  Status set_format(const VideoMode& wanted);
  void set_rate(double rate_hz);
  Status map_buffers();
  void release_buffers();
  Status start();
  Status queue(std::uint32_t index);
  Result<std::optional<Dequeued>> dequeue();
  std::shared_ptr<const std::vector<std::uint8_t>> copy(const Dequeued& from);
  void count_gap(std::uint32_t sequence);

  std::shared_ptr<V4l2System> system_;
  std::string node_;
  int fd_;
  const Clock& clock_;
  FramePool& pool_;
  std::string model_;
  VideoMode mode_;
  std::size_t row_bytes_ = 0;  ///< As the driver pads them; 0 for MJPEG.
  std::string compromise_;
  std::vector<Mapping> mappings_;
  bool streaming_ = false;
  std::optional<std::uint32_t> last_sequence_;
  StreamCounters counters_;
};

}  // namespace handloft::tracking
