#pragma once
// Frames that a camera counted but never delivered: the gaps in its own counter.

#include <cstdint>
#include <optional>

namespace handloft::tracking {

class SequenceGaps {
 public:
  /// How many are missing just before this one. A counter that stands still or goes back has begun anew.
  std::uint64_t note(std::uint64_t sequence) {
    const std::uint64_t gap = last_ && sequence > *last_ ? sequence - *last_ - 1 : 0;
    last_ = sequence;
    missing_ += gap;
    return gap;
  }
  std::uint64_t missing() const { return missing_; }

 private:
  std::optional<std::uint64_t> last_;
  std::uint64_t missing_ = 0;
};

}  // namespace handloft::tracking
