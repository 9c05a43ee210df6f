#pragma once
// What a camera delivered to a test.

#include <condition_variable>
#include <mutex>
#include <variant>
#include <vector>

#include "daemon-tracking/source/sample_source.h"

namespace handloft::tracking::test {

/// Keeps what a camera's sink was given, to be waited for.
class CameraInbox {
 public:
  /// `patience`: far longer than anything takes; only a failing test waits so long.
  explicit CameraInbox(Duration patience) : patience_(patience) {}
  SampleSink sink() {
    return [this](Sample sample) {
      const std::lock_guard lock(mutex_);
      if (const auto* frame = std::get_if<CameraFrame>(&sample)) frames_.push_back(*frame);
      if (const auto* presence = std::get_if<DevicePresence>(&sample)) presences_.push_back(*presence);
      changed_.notify_all();
    };
  }
  bool wait_frames(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience_, [&] { return frames_.size() >= count; });
  }
  bool wait_presences(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience_, [&] { return presences_.size() >= count; });
  }
  std::vector<CameraFrame> frames() {
    const std::lock_guard lock(mutex_);
    return frames_;
  }
  std::vector<DevicePresence> presences() {
    const std::lock_guard lock(mutex_);
    return presences_;
  }

 private:
  Duration patience_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<CameraFrame> frames_;
  std::vector<DevicePresence> presences_;
};

}  // namespace handloft::tracking::test
