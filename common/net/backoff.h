#pragma once
// How long to wait before the next attempt to connect: twice as long each time up to a limit, and never the
// same for two clients, so that a server that comes back is not met by all of them in the same millisecond
// (Brooker, "Exponential backoff and jitter", 2015: equal jitter).

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace handloft::net {

class Backoff {
 public:
  /// Waits of `first` up to `most`; `seed` decides the jitter.
  Backoff(std::chrono::milliseconds first, std::chrono::milliseconds most, std::uint64_t seed)
      : first_(first), most_(std::max(first, most)), wait_(first), state_(seed) {}

  /// Between a half of the present wait and all of it; the next one is twice as long.
  std::chrono::milliseconds next() {
    const std::int64_t half = wait_.count() / 2;
    const auto spread = static_cast<std::uint64_t>(wait_.count() - half) + 1;
    const auto jitter = static_cast<std::int64_t>(random() % spread);
    wait_ = std::min(most_, wait_ * 2);
    return std::chrono::milliseconds(half + jitter);
  }
  /// Things went well.
  void reset() { wait_ = first_; }

 private:
  /// SplitMix64 (Steele, Lea, Flood 2014).
  std::uint64_t random() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15ULL;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  }

  std::chrono::milliseconds first_, most_, wait_;
  std::uint64_t state_;
};

}  // namespace handloft::net
