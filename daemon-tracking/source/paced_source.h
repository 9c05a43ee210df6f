#pragma once
// Delivers a stream's samples at their delivery times on a clock, or as fast as the sink takes them. One
// thread prepares samples ahead (a simulated frame takes milliseconds to render), one delivers.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "daemon-tracking/source/sample_source.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

enum class Pace {
  real_time,  ///< Each sample when the clock reaches its delivery time.
  unpaced,    ///< One after the other, waiting only for the sink.
};

/// Where a paced stream's time line lies on the clock.
enum class TimeLineStart {
  shifted,        ///< As the stream says, moved by PaceOptions::shift.
  when_prepared,  ///< The first sample is due at the moment when as many as allowed are prepared.
};

struct PaceOptions {
  Pace pace = Pace::real_time;
  /// Added to all times of every sample: brings a recording's time line to the present.
  Duration shift{};
  /// How many samples are prepared ahead: 32 is about 0.1 s of a rig with three cameras and a glove (15
  /// frames' bytes).
  std::size_t ahead = 32;
  /// Real time only. A simulated rig takes half a second to prepare its first frames: with `when_prepared`
  /// they are not late.
  TimeLineStart start = TimeLineStart::shifted;
  /// Real time only. A camera frame that is later than this when its turn comes is dropped, as a camera
  /// drops what nobody fetched, and the stream may leave out those that would be. None: nothing is dropped,
  /// as for recordings. Reports and all else are always delivered.
  std::optional<Duration> drop_frames_later_than = std::nullopt;
  /// Called once, on the delivering thread, after the stream's last sample was delivered; not after stop().
  std::function<void()> on_end = {};
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
  /// Frames that were ready, but too late. Those that the stream left out show as gaps in their sequence.
  std::uint64_t frames_dropped() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace handloft::tracking
