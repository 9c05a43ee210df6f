#include "daemon-tracking/main/session_control.h"

namespace handloft::tracking {

template <typename Asked>
SessionControl::Wake SessionControl::wait_while(Asked asked,
                                                std::optional<std::chrono::milliseconds> timeout) const {
  std::unique_lock lock(mutex_);
  if (!timeout) {
    changed_.wait(lock, asked);
  } else if (!changed_.wait_for(lock, *timeout, asked)) {
    return Wake::timeout;
  }
  return stop_ ? Wake::stop : reload_ ? Wake::reload : Wake::end;
}

void SessionControl::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
}

void SessionControl::reload() {
  {
    const std::lock_guard lock(mutex_);
    reload_ = true;
  }
  changed_.notify_all();
}

void SessionControl::note_end() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
}

bool SessionControl::stopping() const {
  const std::lock_guard lock(mutex_);
  return stop_;
}

bool SessionControl::take_reload() {
  const std::lock_guard lock(mutex_);
  const bool asked = reload_;
  reload_ = false;
  return asked;
}

SessionControl::Wake SessionControl::wait(std::optional<std::chrono::milliseconds> timeout) const {
  return wait_while([&] { return stop_ || reload_ || ended_; }, timeout);
}

SessionControl::Wake SessionControl::wait_for_request(
    std::optional<std::chrono::milliseconds> timeout) const {
  return wait_while([&] { return stop_ || reload_; }, timeout);
}

void SessionControl::begin() {
  const std::lock_guard lock(mutex_);
  ended_ = false;
}

}  // namespace handloft::tracking
