#pragma once
// SIGINT and SIGTERM end the session, SIGHUP has it read its files anew: taken from a signalfd by a thread of
// its own, so that no code runs inside a signal handler and nobody polls. One object a process, made before
// any other thread, so that all of them inherit the blocked signals.

#include <functional>
#include <thread>

#include "common/base/result.h"
#include "common/net/endpoint.h"
#include "daemon-tracking/main/session_control.h"

namespace handloft::tracking {

class SignalThread {
 public:
  /// Blocks the three signals for this thread and those that it starts. `control` must outlive the object.
  explicit SignalThread(SessionControl& control);
  ~SignalThread();
  SignalThread(const SignalThread&) = delete;
  SignalThread& operator=(const SignalThread&) = delete;

  /// io where the kernel gave no descriptor.
  const Status& status() const { return status_; }

 private:
  void run();

  SessionControl& control_;
  net::FileDescriptor signals_;
  net::FileDescriptor ending_;  // An eventfd.
  Status status_;
  std::thread thread_;
};

}  // namespace handloft::tracking
