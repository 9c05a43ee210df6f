#pragma once
// SIGTERM and SIGINT: the frame loop ends after the frame that it draws, and takes its last picture. A frame
// that the graphics driver does not finish must not keep the program from ending, nor must somebody who asks
// twice have to wait.

#include <atomic>
#include <chrono>
#include <thread>

#include "common/base/log.h"
#include "common/net/endpoint.h"

namespace handloft::client {

class EndSignal {
 public:
  /// How long a frame may go on after the signal, and all that follows it: a large picture takes its time.
  static constexpr std::chrono::seconds frame_patience{10}, picture_patience{60};

  /// Blocks the two signals for the calling thread: to be made before any other thread, which then inherits
  /// that. Without eventfd or signalfd it throws std::system_error.
  explicit EndSignal(Logger log);
  ~EndSignal();
  EndSignal(const EndSignal&) = delete;
  EndSignal& operator=(const EndSignal&) = delete;

  /// Whether there was one; to be asked once a frame. When nobody asked within `frame_patience` after the
  /// first signal, or this lives on for `picture_patience`, or at the second signal, the process ends with
  /// exit_failed, without picture and report.
  bool came();

 private:
  void watch();

  Logger log_;
  net::FileDescriptor signals_;
  net::FileDescriptor stop_;
  std::atomic<bool> came_{false};
  std::atomic<bool> noticed_{false};
  std::thread thread_;
};

}  // namespace handloft::client
