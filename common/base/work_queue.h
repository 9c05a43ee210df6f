#pragma once
// Where work is done beside whoever asks for it: by a thread in a program; in a simulation by a queue that
// the test steps, so that one seed gives one run.

#include <functional>

namespace handloft {

class WorkQueue {
 public:
  virtual ~WorkQueue() = default;

  /// Returns before it is done. Work of one queue is begun in the order of calls. Thread-safe, also from
  /// within work. After stop() it is forgotten.
  virtual void post(std::function<void()> work) = 0;
  /// Returns when `work`, posted now, is done. Not from within work of this queue, nor after stop().
  virtual void run_and_wait(const std::function<void()>& work) = 0;
  /// Ends after what is at work; what waits is forgotten. Not from within work of this queue.
  virtual void stop() = 0;
};

}  // namespace handloft
