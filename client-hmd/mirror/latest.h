#pragma once
// The newest state, handed from the network's thread to the frame loop: the writer replaces, the reader takes
// what is there, and neither ever waits for the other's work (V5). The lock is held for the copy of a pointer
// only.

#include <memory>
#include <mutex>
#include <utility>

namespace handloft::client {

template <typename T>
class Latest {
 public:
  void publish(std::shared_ptr<const T> value) {
    const std::lock_guard lock(mutex_);
    value_.swap(value);
    // The former value is freed here, after the lock: `value` is destroyed last.
  }
  /// Replaces `expected`, if it is still the newest.
  void replace(const std::shared_ptr<const T>& expected, std::shared_ptr<const T> value) {
    const std::lock_guard lock(mutex_);
    if (value_ == expected) value_.swap(value);
  }
  /// Null before the first publish().
  std::shared_ptr<const T> get() const {
    const std::lock_guard lock(mutex_);
    return value_;
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const T> value_;
};

}  // namespace handloft::client
