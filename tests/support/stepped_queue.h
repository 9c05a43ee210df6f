#pragma once
// A WorkQueue without a thread: work waits until the test does it. For one thread.

#include <cstddef>
#include <deque>
#include <functional>
#include <utility>

#include "common/base/work_queue.h"

namespace handloft::test {

class SteppedQueue final : public WorkQueue {
 public:
  void post(std::function<void()> work) override {
    if (!stopped_) waiting_.push_back(std::move(work));
  }
  void run_and_wait(const std::function<void()>& work) override {
    run_all();
    work();
  }
  void stop() override {
    stopped_ = true;
    waiting_.clear();
  }

  /// The oldest piece of work; false: there was none.
  bool step() {
    if (waiting_.empty()) return false;
    const auto work = std::move(waiting_.front());
    waiting_.pop_front();
    work();
    return true;
  }
  void run_all() {
    while (step()) {
    }
  }
  std::size_t waiting() const { return waiting_.size(); }

 private:
  std::deque<std::function<void()>> waiting_;
  bool stopped_ = false;
};

}  // namespace handloft::test
