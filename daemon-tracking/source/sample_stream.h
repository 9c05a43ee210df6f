#pragma once
// A stream of samples in the order in which they reach us, and its paced delivery. Simulated and recorded
// devices are streams; a pipeline under test pulls them with `next()` as fast as it can, the daemon lets a
// PacedSource deliver them.

#include <memory>
#include <optional>

#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

/// When a sample reaches us: a frame's or report's arrival, a presence's or truth's time.
TimePoint delivery_time(const Sample& sample);

/// Moves all times of a sample by `by`.
void shift_times(Sample& sample, Duration by);

class SampleStream {
 public:
  virtual ~SampleStream() = default;
  /// The next sample, ordered by delivery_time(); nullopt at the end, for good. Not thread-safe.
  virtual std::optional<Sample> next() = 0;
  /// Allows the stream to leave out camera frames that reach us before `time`, on its own time line: whoever
  /// asks is too late for them. Simulated cameras do so instead of drawing them; a recording leaves out
  /// nothing.
  virtual void skip_frames_before(TimePoint /*time*/) {}
};

/// Merges streams by delivery time; of equal times the earlier stream's sample comes first. Deterministic.
class MergedStream final : public SampleStream {
 public:
  explicit MergedStream(std::vector<std::unique_ptr<SampleStream>> streams);
  std::optional<Sample> next() override;
  void skip_frames_before(TimePoint time) override;

 private:
  struct Head {
    std::unique_ptr<SampleStream> stream;
    std::optional<Sample> sample;
  };
  std::vector<Head> heads_;
};

}  // namespace handloft::tracking
