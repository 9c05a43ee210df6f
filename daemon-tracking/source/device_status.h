#pragma once
// How an input device fares, in words: for `devices`, `status` and `doctor`, and DeviceHealth in what is
// published.

#include <cstdint>
#include <string>

#include "common/base/clock.h"

namespace handloft::tracking {

struct DeviceStatus {
  bool present = false;
  std::string identity;  ///< describe() of the device in use or last used; empty before the first.
  /// What is wrong and what to do about it; empty when all is well. An absent device is no problem by itself:
  /// then it says what is being waited for.
  std::string problem;
  std::uint64_t samples = 0;     ///< Handed on since start().
  std::uint64_t refused = 0;     ///< Of these, what the parser refuses.
  std::uint64_t lost = 0;        ///< Missing by the device's own count, or lost by the kernel (SYN_DROPPED).
  std::uint64_t times_lost = 0;  ///< Unplugged or broken down since start().
  TimePoint last_sample;         ///< Arrival.
};

}  // namespace handloft::tracking
