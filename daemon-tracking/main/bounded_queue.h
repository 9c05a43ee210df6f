#pragma once
// A queue between threads that never grows beyond its bound: whoever pushes into a full one is told so and
// goes on.

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace handloft::tracking {

/// What waiting on a queue came to: a value, nothing in time, or nothing ever again.
enum class QueueState { value, empty, closed };
template <typename T>
struct Popped {
  QueueState state = QueueState::empty;
  std::optional<T> value;
};

template <typename T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  /// False: full or closed, and the value was not taken.
  bool push(T value) {
    {
      const std::lock_guard lock(mutex_);
      if (closed_ || values_.size() >= capacity_) return false;
      values_.push_back(std::move(value));
    }
    changed_.notify_one();
    return true;
  }

  /// Waits for a value; nullopt: closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !values_.empty(); });
    if (values_.empty()) return std::nullopt;
    T value = std::move(values_.front());
    values_.pop_front();
    return value;
  }

  /// The same, but waits no longer than `timeout`.
  Popped<T> pop_within(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    const bool come = changed_.wait_for(lock, timeout, [&] { return closed_ || !values_.empty(); });
    if (!come) return {QueueState::empty, std::nullopt};
    if (values_.empty()) return {QueueState::closed, std::nullopt};
    Popped<T> popped{QueueState::value, std::move(values_.front())};
    values_.pop_front();
    return popped;
  }

  /// Nothing is taken any more; what waits is still given out.
  void close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    changed_.notify_all();
  }

 private:
  const std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<T> values_;
  bool closed_ = false;
};

}  // namespace handloft::tracking
