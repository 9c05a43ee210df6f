// T1, T13: the recorded and simulated twins of pen and 3D mouse, and a session of every input through a
// recording.

#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>

#include "daemon-tracking/source/glove/serial_glove_line.h"
#include "daemon-tracking/source/pen/pen_streams.h"
#include "daemon-tracking/source/recorded/recorded_stream.h"
#include "daemon-tracking/source/sample_codec.h"
#include "daemon-tracking/source/space_mouse/space_mouse_streams.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint start = from_ns(1'000'000'000);

std::vector<std::vector<std::uint8_t>> all_of(SampleSource& source) {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::vector<std::uint8_t>> out;
  EXPECT_TRUE(source
                  .start([&](const Sample& sample) {
                    auto bytes = encode_sample(sample);
                    EXPECT_TRUE(bytes.ok());
                    const std::lock_guard lock(mutex);
                    if (bytes) out.push_back(std::move(*bytes));
                    changed.notify_all();
                  })
                  .ok());
  std::unique_lock lock(mutex);
  for (int i = 0; i < 2000 && !source.finished(); ++i) changed.wait_for(lock, 10ms);
  EXPECT_TRUE(source.finished());
  lock.unlock();
  source.stop();
  return out;
}

TEST(InputStreamsT1, ARecordedPenAnd3dMouseSendWhatTheSimulatedOnesSent) {
  const test::TemporaryDirectory folder;
  const auto path = folder.path() / "inputs.rec";
  const SystemClock clock;
  SimulatedPenOptions pen_options;
  pen_options.start = start;
  pen_options.seconds = 1.0;
  SimulatedSpaceMouseOptions mouse_options;
  mouse_options.start = start;
  mouse_options.seconds = 1.5;
  {
    std::vector<std::unique_ptr<SampleStream>> parts;
    parts.push_back(simulated_pen_stream(pen_options));
    parts.push_back(simulated_space_mouse_stream(mouse_options));
    MergedStream all(std::move(parts));
    auto writer = record::RecordingWriter::create(path, {}, clock);
    ASSERT_TRUE(writer.ok()) << writer.error().describe();
    const std::string line = "A1B2C3";
    ASSERT_TRUE(
        append_sample(*writer, DeviceBytes{start, DeviceData::serial_glove_line, {line.begin(), line.end()}})
            .ok());
    TimePoint last = start;
    while (const auto sample = all.next()) {
      ASSERT_GE(delivery_time(*sample), last);
      last = delivery_time(*sample);
      ASSERT_TRUE(append_sample(*writer, *sample).ok());
    }
    ASSERT_TRUE(writer->finish().ok());
  }
  const PaceOptions unpaced{.pace = Pace::unpaced};
  const auto simulated_pen = make_simulated_pen(pen_options, clock, unpaced);
  auto recorded_pen = open_recorded_pen(path, clock, unpaced);
  ASSERT_TRUE(recorded_pen.ok());
  const auto pen = all_of(*simulated_pen);
  EXPECT_GT(pen.size(), 100u);
  EXPECT_EQ(all_of(**recorded_pen), pen) << "to the bit";

  const auto simulated_mouse = make_simulated_space_mouse(mouse_options, clock, unpaced);
  auto recorded_mouse = open_recorded_space_mouse(path, clock, unpaced);
  ASSERT_TRUE(recorded_mouse.ok());
  const auto mouse = all_of(*simulated_mouse);
  EXPECT_GT(mouse.size(), 150u);
  EXPECT_EQ(all_of(**recorded_mouse), mouse);

  auto glove = RecordedStream::open(path, {RecordedSelection::Kind::glove, 0, "glove"});
  ASSERT_TRUE(glove.ok());
  EXPECT_EQ(std::get<DeviceBytes>(*(*glove)->next()).kind, DeviceData::serial_glove_line);
  EXPECT_FALSE((*glove)->next().has_value());
  EXPECT_FALSE(open_recorded_pen(folder.path() / "none.rec", clock).ok());
}

TEST(InputStreamsT13, AShiftMovesArrivalsAsItMovesFrames) {
  Sample sample = DeviceBytes{start, DeviceData::space_mouse_report, {1}};
  shift_times(sample, 5ms);
  EXPECT_EQ(delivery_time(sample), start + 5ms);
}

}  // namespace
}  // namespace handloft::tracking
