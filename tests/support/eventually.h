#pragma once
// Waiting for what another thread or process brings about and nobody tells of.

#include <chrono>
#include <functional>
#include <thread>

namespace handloft::test {

/// Looks again and again until `condition` holds; false: it has not held within the time.
inline bool eventually(const std::function<bool()>& condition,
                       std::chrono::milliseconds patience = std::chrono::seconds(10)) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (std::chrono::steady_clock::now() < deadline) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return condition();
}

}  // namespace handloft::test
