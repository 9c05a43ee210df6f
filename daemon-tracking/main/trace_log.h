#pragma once
// What each thread did when, for chrome://tracing and ui.perfetto.dev ("Trace Event Format", complete events
// of phase X): the spans of a frame from exposure to socket. Kept in memory, the newest ones only, and
// written when the session ends, so that nothing waits for the disk.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"

namespace handloft::tracking {

/// The stages of a frame.
enum class TraceStage : std::uint8_t {
  capture,     ///< Middle of the exposure until the bytes were ours: sensor, bus, kernel.
  waiting,     ///< For the camera's worker.
  decode,      ///< JPEG to planes.
  tags,        ///< Vision: AprilTags.
  fingertips,  ///< Vision: coloured caps.
  fusion,      ///< All filters, from the worker's end until the state is known; the queue is in it.
  publish,     ///< Message, encoding and the subscribers' sockets.
};
inline constexpr std::array<const char*, 7> trace_stage_names{"capture",    "waiting", "decode", "tags",
                                                              "fingertips", "fusion",  "publish"};

struct TraceSpan {
  TimePoint begin;
  Duration length{};
  std::uint32_t camera = 0;
  std::uint64_t frame = 0;  ///< The camera's own counter.
  TraceStage stage = TraceStage::capture;
};

/// Thread-safe.
class TraceLog {
 public:
  /// Seven spans a frame: 100,000 are two minutes of four cameras at 30 fps, in 4 MB.
  static constexpr std::size_t default_capacity = 100'000;
  explicit TraceLog(std::size_t capacity = default_capacity);

  /// Beyond the capacity the oldest goes.
  void add(const TraceSpan& span);
  /// How many went.
  std::uint64_t forgotten() const;

  /// The JSON object; `cameras` names them by their number. Times in microseconds of CLOCK_MONOTONIC.
  std::string to_json(const std::vector<std::string>& cameras) const;
  /// Errors: io, naming the file.
  Status write(const std::filesystem::path& path, const std::vector<std::string>& cameras) const;

 private:
  mutable std::mutex mutex_;
  std::size_t capacity_;
  std::vector<TraceSpan> spans_;  // A ring once it is full.
  std::uint64_t added_ = 0;
};

}  // namespace handloft::tracking
