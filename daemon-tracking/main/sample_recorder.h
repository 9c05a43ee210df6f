#pragma once
// Writes samples to a recording on a thread of its own, so that a slow disk never slows the tracking. A
// recording with a hole would replay to something else: when the disk can't keep up, recording ends there,
// and says so.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/record/recording.h"
#include "daemon-tracking/main/bounded_queue.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

class SampleRecorder {
 public:
  static Result<std::unique_ptr<SampleRecorder>> create(const std::filesystem::path& path,
                                                        const std::map<std::string, std::string>& description,
                                                        const Clock& clock, Logger log);
  ~SampleRecorder();
  SampleRecorder(const SampleRecorder&) = delete;
  SampleRecorder& operator=(const SampleRecorder&) = delete;

  /// One thread at a time; never blocks.
  void record(Sample sample);
  /// Writes what waits, and closes the file. The first error there was, if any.
  Status finish();
  std::uint64_t sample_count() const { return written_.load(); }

 private:
  SampleRecorder(record::RecordingWriter writer, Logger log);
  void run();

  record::RecordingWriter writer_;
  Logger log_;
  BoundedQueue<Sample> queue_;
  std::atomic<std::uint64_t> written_{0};
  std::atomic<bool> overflowed_{false};
  Status status_;  // The writing thread's until it has ended.
  std::thread thread_;
};

}  // namespace handloft::tracking
