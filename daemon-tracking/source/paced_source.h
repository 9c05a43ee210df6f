#pragma once
// Delivers a stream's samples at their delivery times on a clock, or as fast as the sink takes them. One
// thread prepares samples ahead (a simulated frame takes milliseconds to render), one delivers.

#include <memory>
#include <string>

#include "common/base/clock.h"
#include "daemon-tracking/source/sample_source.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

enum class Pace {
  real_time,  ///< Each sample when the clock reaches its delivery time.
  unpaced,    ///< One after the other, waiting only for the sink.
};

struct PaceOptions {
  Pace pace = Pace::real_time;
  /// Added to all times of every sample: brings a recording's time line to the present.
  Duration shift{};
  /// How many samples are prepared ahead: 32 is about 0.1 s of a rig with three cameras and a glove (15
  /// frames' bytes).
  std::size_t ahead = 32;
};

class PacedSource final : public SampleSource {
 public:
  /// `clock` must outlive the source. The stream is used from the source's threads only, from start() on.
  PacedSource(std::string name, std::unique_ptr<SampleStream> stream, const Clock& clock,
              PaceOptions options = {});
  ~PacedSource() override;
  PacedSource(const PacedSource&) = delete;
  PacedSource& operator=(const PacedSource&) = delete;

  const std::string& name() const override;
  Status start(SampleSink sink) override;
  void stop() override;
  bool finished() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace handloft::tracking
