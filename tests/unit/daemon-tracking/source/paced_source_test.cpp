// What happens when frames are ready too late, and where a session's time line begins (T4, T15).

#include "daemon-tracking/source/paced_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <thread>
#include <utility>

#include "daemon-tracking/source/simulated/simulated_rig.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

constexpr Duration interval = 10ms;
constexpr std::uint64_t frame_count = 400;

// A camera whose frames take a while to make, on a clock that passes only with that.
class SlowCamera final : public SampleStream {
 public:
  /// `preparation`: what the first frame takes besides.
  SlowCamera(ManualClock& clock, Duration effort, Duration preparation = {})
      : clock_(clock), effort_(effort), preparation_(preparation) {}
  std::optional<Sample> next() override {
    while (skipping_ && arrival() < skip_before_) ++sequence_;
    if (sequence_ >= frame_count) return std::nullopt;
    clock_.advance(effort_ + std::exchange(preparation_, Duration{}));
    CameraFrame frame;
    frame.sequence = sequence_;
    frame.capture_time = frame.arrival_time = arrival();
    ++sequence_;
    return frame;
  }
  void skip_frames_before(TimePoint time) override {
    skipping_ = true;
    skip_before_ = time;
  }

 private:
  TimePoint arrival() const { return TimePoint{} + static_cast<std::int64_t>(sequence_) * interval; }
  ManualClock& clock_;
  const Duration effort_;
  Duration preparation_;
  std::uint64_t sequence_ = 0;
  bool skipping_ = false;
  TimePoint skip_before_;
};

struct Delivered {
  std::vector<std::uint64_t> sequences;
  Duration first_late{}, latest{};
};

// Lets all of the stream come through; the clock goes on while nothing is made.
Delivered play(PacedSource& source, ManualClock& clock) {
  std::mutex mutex;
  Delivered delivered;
  EXPECT_TRUE(source
                  .start([&](Sample sample) {
                    const Duration late = clock.now() - delivery_time(sample);
                    const std::scoped_lock lock(mutex);
                    if (delivered.sequences.empty()) delivered.first_late = late;
                    delivered.latest = std::max(delivered.latest, late);
                    delivered.sequences.push_back(std::get<CameraFrame>(sample).sequence);
                  })
                  .ok());
  const auto deadline = std::chrono::steady_clock::now() + 100s;
  while (!source.finished() && std::chrono::steady_clock::now() < deadline) {
    clock.advance(4us);
    std::this_thread::yield();
  }
  source.stop();
  EXPECT_TRUE(source.finished());
  return delivered;
}

PaceOptions live() {
  PaceOptions options;
  options.start = TimeLineStart::when_prepared;
  options.drop_frames_later_than = interval / 2;
  options.ahead = 4;
  return options;
}

TEST(PacedSource, FramesThatTakeTooLongAreDroppedAndNeverPileUpT15) {
  ManualClock clock(from_ns(7'000'000'000));
  PacedSource source("camera", std::make_unique<SlowCamera>(clock, 25ms), clock, live());
  const Delivered delivered = play(source, clock);
  // How many come through depends on how the threads take turns; most can't.
  EXPECT_LT(delivered.sequences.size(), frame_count * 3 / 4);
  EXPECT_TRUE(std::is_sorted(delivered.sequences.begin(), delivered.sequences.end()));
  // Half an interval, and what passes while a frame is handed over; without dropping it would be 6 s.
  EXPECT_LE(delivered.latest, 50 * interval);
}

TEST(PacedSource, ARecordingIsPlayedWholeHoweverLate) {
  ManualClock clock(from_ns(7'000'000'000));
  PaceOptions options = live();
  options.drop_frames_later_than = std::nullopt;
  PacedSource source("recording", std::make_unique<SlowCamera>(clock, 25ms), clock, options);
  const Delivered delivered = play(source, clock);
  EXPECT_EQ(delivered.sequences.size(), frame_count);
  EXPECT_EQ(source.frames_dropped(), 0u);
  EXPECT_GT(delivered.latest, 100 * interval) << "the control: it did fall behind";
}

TEST(PacedSource, TheTimeLineBeginsWhenTheFirstSamplesArePrepared) {
  for (const TimeLineStart start : {TimeLineStart::when_prepared, TimeLineStart::shifted}) {
    ManualClock clock(from_ns(0));
    PaceOptions options;
    options.start = start;
    options.ahead = 4;
    PacedSource source("camera", std::make_unique<SlowCamera>(clock, 0ms, 10s), clock, options);
    const Delivered delivered = play(source, clock);
    ASSERT_EQ(delivered.sequences.size(), frame_count);
    if (start == TimeLineStart::shifted) {
      EXPECT_GE(delivered.first_late, 9s) << "the control";
    } else {
      EXPECT_EQ(delivered.sequences.front(), 0u);
      EXPECT_LT(delivered.first_late, 1s) << "its own preparation is not counted";
    }
  }
}

TEST(PacedSource, AStreamThatEndsBeforeEnoughIsPreparedIsDelivered) {
  ManualClock clock;
  PaceOptions options = live();
  options.ahead = 2 * frame_count;
  PacedSource source("camera", std::make_unique<SlowCamera>(clock, 0ms), clock, options);
  EXPECT_FALSE(play(source, clock).sequences.empty());
}

TEST(SimulatedRig, LeavesOutFramesThatAreTooLateWithoutDrawingThem) {
  HandProgram program;
  program.idle(20.0);
  const auto scene = std::make_shared<const SimulatedScene>(SimulatedScene{default_rig(), program, {}});
  const auto camera = simulated_camera_stream(scene, 0);
  const TimePoint late = scene->options.start + 19s;
  ASSERT_TRUE(std::holds_alternative<DevicePresence>(*camera->next()));
  camera->skip_frames_before(late);
  std::optional<Sample> sample = camera->next();
  ASSERT_TRUE(sample && std::holds_alternative<Truth>(*sample)) << "the truth of the frame that comes";
  const TimePoint truth = std::get<Truth>(*sample).time;
  sample = camera->next();
  ASSERT_TRUE(sample && std::holds_alternative<CameraFrame>(*sample));
  const auto& frame = std::get<CameraFrame>(*sample);
  EXPECT_EQ(frame.capture_time, truth);
  EXPECT_GE(frame.arrival_time, late);
  EXPECT_LT(frame.arrival_time, late + 40ms);
  EXPECT_GT(frame.sequence, 19u * 30u - 5u) << "the counter shows the gap";
  camera->skip_frames_before(late + 60s);
  EXPECT_FALSE(camera->next().has_value()) << "and the end is still the end";
}

}  // namespace
}  // namespace handloft::tracking
