#include "daemon-tracking/main/camera_worker.h"

#include <gtest/gtest.h>

#include <future>
#include <vector>

#include "daemon-tracking/source/rig.h"

namespace handloft::tracking {
namespace {

// A picture in which there is nothing.
CameraFrame grey_frame(std::uint64_t sequence) {
  const Rig rig = default_rig();
  CameraFrame frame;
  frame.sequence = sequence;
  frame.capture_time = frame.arrival_time = from_ns(static_cast<std::int64_t>(sequence) * 33'000'000 + 1);
  frame.format = PixelFormat::grey;
  frame.width_px = rig.cameras[0].intrinsics.width_px;
  frame.height_px = rig.cameras[0].intrinsics.height_px;
  const auto bytes = static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px);
  frame.bytes = std::make_shared<const std::vector<std::uint8_t>>(bytes, std::uint8_t{128});
  return frame;
}

TEST(CameraWorker, TheNewestFrameWinsWhileOneIsLookedAt) {
  const ManualClock clock;
  auto tracker = CameraTracker::create(default_rig(), 0);
  ASSERT_TRUE(tracker.ok()) << tracker.error().describe();
  std::promise<void> begun, go_on;
  std::shared_future<void> may_go_on = go_on.get_future().share();
  std::vector<std::uint64_t> seen;
  CameraWorker worker(
      std::move(*tracker),
      [&](const CameraFrame& frame, const CameraObservation&) {
        seen.push_back(frame.sequence);
        if (seen.size() > 1) return;
        begun.set_value();
        may_go_on.wait();
      },
      Logger("test", LogLevel::off), clock);
  worker.offer(grey_frame(1));
  begun.get_future().wait();
  for (const std::uint64_t sequence : {2u, 3u, 4u, 8u}) worker.offer(grey_frame(sequence));
  go_on.set_value();
  worker.finish();
  EXPECT_EQ(seen, (std::vector<std::uint64_t>{1, 8})) << "old ones are not caught up with";
  EXPECT_EQ(worker.dropped(), 3u);
  EXPECT_EQ(worker.missing(), 3u) << "5, 6 and 7 never came";
}

TEST(CameraWorker, AFrameThatCannotBeReadIsPassedOver) {
  const ManualClock clock;
  auto tracker = CameraTracker::create(default_rig(), 0);
  ASSERT_TRUE(tracker.ok());
  std::vector<std::uint64_t> seen;
  CameraWorker worker(
      std::move(*tracker),
      [&](const CameraFrame& frame, const CameraObservation&) { seen.push_back(frame.sequence); },
      Logger("test", LogLevel::off), clock);
  CameraFrame broken = grey_frame(1);
  broken.format = PixelFormat::mjpeg;
  worker.offer(broken);
  worker.finish();
  EXPECT_TRUE(seen.empty());
  worker.finish();
}

}  // namespace
}  // namespace handloft::tracking
