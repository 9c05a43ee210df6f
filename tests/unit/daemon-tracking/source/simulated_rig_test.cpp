// The simulated rig's time lines, and delivery through the daemon's source interfaces.

#include "daemon-tracking/source/simulated/simulated_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <condition_variable>
#include <map>
#include <mutex>
#include <set>

#include "common/base/table_palette.h"
#include "daemon-tracking/source/camera/simulated_camera.h"
#include "daemon-tracking/source/glove/simulated_glove.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/sample_codec.h"

namespace handloft::tracking {
namespace {

/// Closes and opens within a second.
HandProgram short_program() {
  HandProgram program;
  program.gesture(HandPose::closed, {-0.02, -0.06, 0.13}, 0.05);
  program.gesture(HandPose::open, {-0.02, -0.06, 0.13}, 0.05);
  return program;
}

std::vector<Sample> all_of(SampleStream& stream) {
  std::vector<Sample> samples;
  while (auto sample = stream.next()) samples.push_back(std::move(*sample));
  return samples;
}

std::vector<Sample> run(std::uint64_t seed, std::size_t limit = SIZE_MAX) {
  SimulatedRigOptions options;
  options.seed = seed;
  options.start = from_ns(1'000'000'000);
  SimulatedRig rig(default_rig(), short_program(), options);
  std::vector<Sample> samples;
  while (samples.size() < limit) {
    auto sample = rig.next();
    if (!sample) break;
    samples.push_back(std::move(*sample));
  }
  return samples;
}

std::vector<std::uint8_t> bytes_of(const std::vector<Sample>& samples) {
  std::vector<std::uint8_t> all;
  for (const Sample& sample : samples) {
    const auto bytes = encode_sample(sample);
    EXPECT_TRUE(bytes.ok());
    if (bytes) all.insert(all.end(), bytes->begin(), bytes->end());
  }
  return all;
}

TEST(SimulatedRigT13, SameSeedGivesTheSameBytes) {
  constexpr std::size_t beginning = 50;  // Several frames among them.
  const auto first = bytes_of(run(5, beginning));
  EXPECT_EQ(first, bytes_of(run(5, beginning)));
  EXPECT_NE(first, bytes_of(run(6, beginning)));
}

TEST(SimulatedRigT4, TimeLines) {
  const std::vector<Sample> samples = run(1);
  std::map<std::uint32_t, std::vector<const CameraFrame*>> frames;
  std::set<std::int64_t> truth_times;
  std::set<std::string> present;
  TimePoint last{};
  for (const Sample& sample : samples) {
    EXPECT_GE(delivery_time(sample), last);
    last = delivery_time(sample);
    if (const auto* frame = std::get_if<CameraFrame>(&sample)) frames[frame->camera].push_back(frame);
    if (const auto* truth = std::get_if<Truth>(&sample)) truth_times.insert(to_ns(truth->time));
    if (const auto* presence = std::get_if<DevicePresence>(&sample)) present.insert(presence->device);
  }
  EXPECT_EQ(present, (std::set<std::string>{"camera/head", "camera/left", "camera/right", "glove"}));
  ASSERT_EQ(frames.size(), 3u);
  std::set<std::int64_t> phases;
  for (const auto& [camera, list] : frames) {
    ASSERT_GT(list.size(), 20u);
    for (std::size_t i = 0; i < list.size(); ++i) {
      EXPECT_EQ(list[i]->sequence, i);
      EXPECT_TRUE(truth_times.contains(to_ns(list[i]->capture_time)));
      const double delay_s = to_seconds(list[i]->arrival_time - list[i]->capture_time);
      EXPECT_GE(delay_s, 0.004);
      EXPECT_LT(delay_s, 0.006);
      if (i > 0) {
        EXPECT_NEAR(to_seconds(list[i]->capture_time - list[i - 1]->capture_time), 1.0 / 30, 0.003);
      }
    }
    phases.insert(to_ns(list[0]->capture_time));
  }
  EXPECT_EQ(phases.size(), 3u) << "free-running cameras have phases of their own";
}

TEST(SimulatedRigT9, GloveReportsParseAndBounce) {
  SimulatedRigOptions options;
  const auto scene =
      std::make_shared<const SimulatedScene>(SimulatedScene{default_rig(), short_program(), options});
  auto stream = simulated_glove_stream(scene);
  int reports = 0, edges = 0;
  std::uint16_t last = 0;
  std::uint32_t last_us = 0;
  while (auto sample = stream->next()) {
    const auto* bytes = std::get_if<GloveBytes>(&*sample);
    if (bytes == nullptr) continue;
    const auto report = parse_glove_report(bytes->bytes);
    ASSERT_TRUE(report.ok()) << report.error().describe();
    EXPECT_EQ(report->sequence, reports);
    if (reports > 0) {
      EXPECT_EQ(report->device_time_us - last_us, 4000u);
    }
    last_us = report->device_time_us;
    edges += ((report->contacts ^ last) & contact_index) != 0;
    last = report->contacts;
    ++reports;
  }
  EXPECT_NEAR(reports, scene->program.duration_s() * 250, 2);
  // Closed once and opened once, each with one bounce: 2 x 3 edges.
  EXPECT_EQ(edges, 6);
}

TEST(SimulatedRig, TruthIsTheProgramsState) {
  SimulatedRigOptions options;
  const SimulatedScene scene{default_rig(), short_program(), options};
  const Truth truth = scene.truth_at(0.3);
  const HandState hand = scene.program.at(0.3);
  for (std::size_t i = 0; i < finger_count; ++i) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(truth.fingertips_m[i][axis], hand.fingertips_m[i][axis]);
  }
  const Eigen::Quaterniond orientation(truth.head_orientation_wxyz[0], truth.head_orientation_wxyz[1],
                                       truth.head_orientation_wxyz[2], truth.head_orientation_wxyz[3]);
  EXPECT_TRUE(orientation.toRotationMatrix().isApprox(options.head.at(0.3).linear(), 1e-12));
  EXPECT_NEAR(orientation.norm(), 1.0, 1e-12);
}

// The palette's near row is 21 degrees below the gaze at the work: a picture of 34 degrees would not show it.
TEST(SimulatedRig, TheHeadLooksDownAtTheRowThatTheHandTouches) {
  HandProgram program;
  program.idle(1.0);
  program.touch(PaletteCommand::fit);  // Beside the work: in the picture anyway.
  program.touch(PaletteCommand::exponent);
  program.gesture(HandPose::open, {0.0, 0.0, 0.15}, 2.0);
  HeadMotion head;
  head.glances = glances_at_palette(program);
  ASSERT_EQ(head.glances.size(), 1u);
  const PaletteCell& cell = palette_cell_of(PaletteCommand::exponent);
  const auto below_gaze_deg = [&](const Eigen::Vector3d& place, double time_s) {
    const Eigen::Vector3d seen = head.at(time_s).inverse() * place;  // x right, y up, z back
    return std::atan2(-seen.y(), -seen.z()) * 180 / M_PI;
  };
  const Eigen::Vector3d near_edge(cell.centre_x_m, cell.centre_y_m - cell.height_m / 2, 0.0);
  constexpr double half_picture_deg = 17;
  for (double time_s = 0; time_s < program.duration_s(); time_s += 0.01) {
    const HeadGlance& glance = head.glances.front();
    if (time_s >= glance.begin_s && time_s <= glance.end_s) {
      EXPECT_LT(below_gaze_deg(near_edge, time_s), half_picture_deg) << time_s;
      EXPECT_GT(below_gaze_deg({0.0, 0.0, 0.1}, time_s), -half_picture_deg)
          << "the work stays in the picture";
    } else if (time_s < glance.begin_s - head.glance_turn_s || time_s > glance.end_s + head.glance_turn_s) {
      EXPECT_GT(below_gaze_deg(near_edge, time_s), half_picture_deg) << "negative control";
      EXPECT_TRUE(head.at(time_s).isApprox(HeadMotion{}.at(time_s), 1e-15));
    }
    const double turned =
        Eigen::AngleAxisd(head.at(time_s).linear().transpose() * head.at(time_s + 0.01).linear()).angle();
    EXPECT_LT(turned, 0.01) << "no faster than a radian a second";
  }
}

/// Collects what a source delivers; waits for a count with a generous limit.
class Collector {
 public:
  SampleSink sink() {
    return [this](Sample sample) {
      const std::scoped_lock lock(mutex_);
      samples_.push_back(std::move(sample));
      changed_.notify_all();
    };
  }
  bool wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(30), [&] { return samples_.size() >= count; });
  }
  std::vector<Sample> take() {
    const std::scoped_lock lock(mutex_);
    return samples_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Sample> samples_;
};

TEST(PacedSourceT1, DeliversWhatTheStreamHolds) {
  SimulatedRigOptions options;
  const auto scene =
      std::make_shared<const SimulatedScene>(SimulatedScene{default_rig(), short_program(), options});
  const std::vector<Sample> expected = all_of(*simulated_glove_stream(scene));
  const ManualClock clock;
  const auto glove = make_simulated_glove(scene, clock, {Pace::unpaced, {}, 4});
  Collector collector;
  ASSERT_TRUE(glove->start(collector.sink()).ok());
  EXPECT_FALSE(glove->start(collector.sink()).ok());
  ASSERT_TRUE(collector.wait_for(expected.size()));
  glove->stop();
  glove->stop();
  EXPECT_TRUE(glove->finished());
  EXPECT_EQ(bytes_of(collector.take()), bytes_of(expected));
  EXPECT_EQ(glove->name(), "glove");
}

TEST(PacedSourceT4, WaitsForItsClockAndShiftsTimes) {
  SimulatedRigOptions options;
  const auto scene =
      std::make_shared<const SimulatedScene>(SimulatedScene{default_rig(), short_program(), options});
  ManualClock clock(from_ns(0));
  const Duration shift = std::chrono::seconds(100);
  const auto glove = make_simulated_glove(scene, clock, {Pace::real_time, shift, 8});
  Collector collector;
  ASSERT_TRUE(glove->start(collector.sink()).ok());
  clock.set(from_ns(0) + shift + std::chrono::milliseconds(50));
  // Presence at 0 and reports every 4 ms, 1 ms on the way: at 50 ms those of 4..48 ms are here.
  ASSERT_TRUE(collector.wait_for(13));
  glove->stop();
  const auto samples = collector.take();
  EXPECT_EQ(samples.size(), 13u);
  for (const Sample& sample : samples) {
    EXPECT_GE(delivery_time(sample), from_ns(0) + shift);
    EXPECT_LE(delivery_time(sample), clock.now());
  }
}

TEST(PacedSourceT1, StopsWhileWaiting) {
  SimulatedRigOptions options;
  const auto scene =
      std::make_shared<const SimulatedScene>(SimulatedScene{default_rig(), short_program(), options});
  const ManualClock clock(from_ns(-1'000'000'000));
  const auto camera = make_simulated_camera(scene, 2, clock);
  EXPECT_EQ(camera->camera(), 2u);
  EXPECT_EQ(camera->name(), "camera/head");
  Collector collector;
  ASSERT_TRUE(camera->start(collector.sink()).ok());
  camera->stop();
  EXPECT_TRUE(collector.take().empty());
}

}  // namespace
}  // namespace handloft::tracking
