#pragma once
// The time of day, for what people read later: logs, histories, invitations. What is measured or waited for
// takes clock.h.

#include <chrono>
#include <cstdint>

namespace handloft {

/// Nanoseconds since 1970 (UTC).
inline std::int64_t wall_clock_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace handloft
