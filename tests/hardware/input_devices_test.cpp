// Gloves, 3D mice and pens through the kernel's own interfaces (T1, T3, T4, T9): the sources open what
// devices/ makes in the guest. What the daemon as a whole does with them is tested elsewhere.

#include <gtest/gtest.h>
#include <linux/input-event-codes.h>
#include <sys/wait.h>
#include <unistd.h>

#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "daemon-tracking/fusion/glove_tracker.h"
#include "daemon-tracking/fusion/pen_tracker.h"
#include "daemon-tracking/fusion/space_mouse_tracker.h"
#include "daemon-tracking/source/glove/hid_glove.h"
#include "daemon-tracking/source/hotplug.h"
#include "daemon-tracking/source/pen/evdev_pen.h"
#include "daemon-tracking/source/pen/pen_streams.h"
#include "daemon-tracking/source/space_mouse/hid_space_mouse.h"
#include "tests/hardware/driven_device.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 20s;  // The guest is slow; nothing here is asserted by this time.

using Device = test::DrivenDevice;

/// Keeps what a source delivers and lets the test wait for something.
class Samples {
 public:
  SampleSink sink() {
    return [this](Sample sample) {
      const std::lock_guard lock(mutex_);
      samples_.push_back(std::move(sample));
      changed_.notify_all();
    };
  }
  /// Hands on every sample to `take`, in order, until it says true. False: patience ended.
  template <typename Take>
  bool until(const Take& take) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, [&] {
      while (!samples_.empty()) {
        const Sample sample = std::move(samples_.front());
        samples_.pop_front();
        if (take(sample)) return true;
      }
      return false;
    });
  }
  std::optional<DevicePresence> presence(bool present) {
    std::optional<DevicePresence> found;
    until([&](const Sample& sample) {
      const auto* presence = std::get_if<DevicePresence>(&sample);
      if (presence != nullptr && presence->present == present) found = *presence;
      return found.has_value();
    });
    return found;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Sample> samples_;
};

class InputDevices : public testing::Test {
 protected:
  InputDevices() {
    HotplugOptions options;
    options.usb = UsbWatch::libusb;
    auto opened = open_system_hotplug(options, log_);
    EXPECT_TRUE(opened.ok()) << opened.error().describe();
    if (opened) hotplug_ = std::move(*opened);
  }
  SystemClock clock_;
  Logger log_{"test", LogLevel::info};
  std::unique_ptr<HotplugMonitor> hotplug_;
};

/// Until `count` good reports came one after another; tells what was missing between.
std::uint64_t read_reports(Samples& samples, std::size_t count, GloveReport* last = nullptr) {
  std::uint64_t missing = 0;
  std::optional<std::uint16_t> sequence;
  std::size_t good = 0;
  EXPECT_TRUE(samples.until([&](const Sample& sample) {
    const auto* bytes = std::get_if<GloveBytes>(&sample);
    if (bytes == nullptr) return false;
    const auto report = parse_glove_report(bytes->bytes);
    if (!report) return false;
    if (sequence) missing += static_cast<std::uint16_t>(report->sequence - *sequence - 1);
    sequence = report->sequence;
    if (last != nullptr) *last = *report;
    return ++good == count;
  })) << "only "
      << good << " reports";
  return missing;
}

TEST_F(InputDevices, AUsbGloveIsReadToldOfAndKeepsItsRangeT9) {
  Device device({"glove_gadget"});
  device.hear("ready");
  Samples samples;
  const auto glove = make_hid_glove({}, *hotplug_, make_hidapi_system(), clock_, log_);
  ASSERT_TRUE(glove->start(samples.sink()).ok());
  EXPECT_NE(glove->status().problem, "");
  device.tell("force 300");
  device.tell("contacts 15");
  device.tell("plug");
  ASSERT_TRUE(samples.presence(true).has_value());
  GloveReport report;
  EXPECT_EQ(read_reports(samples, 500, &report), 0u);
  EXPECT_EQ(report.force, 300);
  EXPECT_EQ(report.contacts, 15);
  EXPECT_EQ(glove->status().problem, "");
  EXPECT_NE(glove->status().identity.find("GADGET1"), std::string::npos) << glove->status().identity;

  glove->show({10, 20, 30, 200, 150});
  EXPECT_EQ(device.hear("output"), "output 10 20 30 200 150");
  const GloveRange range{40, 800, 3, 1000, true};
  const Status stored = glove->set_range(range);
  EXPECT_TRUE(stored.ok()) << stored.error().describe();
  EXPECT_EQ(device.hear("range"), "range 40 800 3 1000 1");
  const auto kept = glove->range();
  ASSERT_TRUE(kept.ok()) << kept.error().describe();
  EXPECT_EQ(*kept, range);

  device.tell("skip 7");
  device.tell("corrupt 3");
  EXPECT_EQ(read_reports(samples, 250), 7u + 3u) << "those that could not be read are missing too";
  const DeviceStatus status = glove->status();
  EXPECT_EQ(status.refused, 3u);
  EXPECT_GE(status.lost, 7u);
  glove->stop();
}

TEST_F(InputDevices, AGloveThatFallsSilentIsOpenedAnewAndSaysSo) {
  Device device({"glove_gadget"});
  device.hear("ready");
  Samples samples;
  const auto glove = make_hid_glove({}, *hotplug_, make_hidapi_system(), clock_, log_);
  ASSERT_TRUE(glove->start(samples.sink()).ok());
  device.tell("plug");
  ASSERT_TRUE(samples.presence(true).has_value());
  read_reports(samples, 50);
  device.tell("silence on");
  ASSERT_TRUE(samples.presence(false).has_value());
  EXPECT_NE(glove->status().problem.find("sends nothing"), std::string::npos) << glove->status().problem;
  device.tell("silence off");
  ASSERT_TRUE(samples.presence(true).has_value());
  read_reports(samples, 50);
  EXPECT_EQ(glove->status().problem, "");
}

TEST_F(InputDevices, UnpluggedAndPluggedBackTwentyTimesT3) {
  Device device({"glove_gadget"});
  device.hear("ready");
  Samples samples;
  const auto glove = make_hid_glove({}, *hotplug_, make_hidapi_system(), clock_, log_);
  ASSERT_TRUE(glove->start(samples.sink()).ok());
  Duration slowest_gone{}, slowest_back{};
  for (int i = 0; i < 20; ++i) {
    const TimePoint plugged = clock_.now();
    device.tell("plug");
    const auto came = samples.presence(true);
    ASSERT_TRUE(came.has_value()) << i;
    slowest_back = std::max(slowest_back, came->time - plugged);
    read_reports(samples, 25);
    const TimePoint unplugged = clock_.now();
    device.tell("unplug");
    const auto went = samples.presence(false);
    ASSERT_TRUE(went.has_value()) << i;
    slowest_gone = std::max(slowest_gone, went->time - unplugged);
  }
  std::printf("glove gone after %.0f ms at most, back after %.0f ms at most\n",
              1e3 * to_seconds(slowest_gone), 1e3 * to_seconds(slowest_back));
  EXPECT_GE(glove->status().times_lost, 20u);
}

TEST_F(InputDevices, WithoutAHidrawNodeTheGloveIsOpenedThroughLibusb) {
  ASSERT_EQ(std::system("modprobe -r usbhid 2>/dev/null || rmmod usbhid"), 0) << "usbhid stays";
  Device device({"glove_gadget"});
  device.hear("ready");
  Samples samples;
  const auto glove = make_hid_glove({}, *hotplug_, make_hidapi_system(), clock_, log_);
  ASSERT_TRUE(glove->start(samples.sink()).ok());
  device.tell("force 123");
  device.tell("plug");
  ASSERT_TRUE(samples.presence(true).has_value()) << glove->status().problem;
  GloveReport report;
  read_reports(samples, 100, &report);
  EXPECT_EQ(report.force, 123);
  EXPECT_NE(glove->status().identity.find("/dev/bus/usb/"), std::string::npos) << glove->status().identity;
  glove->show({1, 2, 3, 0, 0});
  EXPECT_EQ(device.hear("output"), "output 1 2 3 0 0");
  device.tell("unplug");
  EXPECT_TRUE(samples.presence(false).has_value());
  glove->stop();
  EXPECT_EQ(std::system("modprobe -d \"$HANDLOFT_GUEST/modules\" usbhid"), 0);
}

TEST_F(InputDevices, AForeignDeviceUnderTheGlovesNumbersIsLeftAlone) {
  Device device({"uhid_device", "foreign"});
  device.hear("ready");
  Samples samples;
  const auto glove = make_hid_glove({}, *hotplug_, make_hidapi_system(), clock_, log_);
  ASSERT_TRUE(glove->start(samples.sink()).ok());
  device.tell("plug");
  const TimePoint until = clock_.now() + patience;
  while (glove->status().problem.find("no glove of ours") == std::string::npos && clock_.now() < until)
    std::this_thread::sleep_for(10ms);
  EXPECT_NE(glove->status().problem.find("no glove of ours"), std::string::npos) << glove->status().problem;
  EXPECT_FALSE(glove->status().present);
}

void follow_a_space_mouse(HotplugMonitor& hotplug, const Clock& clock, const Logger& log,
                          const std::string& form) {
  Device device({"uhid_device", "space_mouse", form});
  device.hear("ready");
  Samples samples;
  const auto mouse = make_hid_space_mouse({}, hotplug, make_hidapi_system(), clock, log);
  ASSERT_TRUE(mouse->start(samples.sink()).ok());
  device.tell("plug");
  ASSERT_TRUE(samples.presence(true).has_value());
  SpaceMouseTracker tracker;
  FusedSpaceMouse state;
  // A hidraw node keeps 63 reports for its reader: no more at once than that.
  for (int i = 1; i <= 20; ++i) {
    device.tell("axes " + std::to_string(15 * i) + " 0 -350 0 350 " + std::to_string(-15 * i));
    if (i == 10) device.tell("buttons 3");
  }
  EXPECT_TRUE(samples.until([&](const Sample& sample) {
    if (const auto* bytes = std::get_if<DeviceBytes>(&sample)) {
      EXPECT_TRUE(tracker.consume(*bytes).ok());
    }
    tracker.describe(state);
    // Pushing and twisting go together: they are never of two moments.
    EXPECT_NEAR(state.translation.x(), state.rotation.z(), 1e-12);
    return state.translation.x() > (300.0 / 350 - 0.03) / 0.97 - 1e-9;
  }));
  EXPECT_EQ(state.translation.z(), 1.0);
  EXPECT_EQ(state.rotation.y(), -1.0);
  EXPECT_EQ(state.buttons, 3u);
  device.tell("unplug");
  EXPECT_TRUE(samples.presence(false).has_value());
}

TEST_F(InputDevices, A3dMouseOfTheSplitForm) {
  follow_a_space_mouse(*hotplug_, clock_, log_, "split");
}

TEST_F(InputDevices, A3dMouseOfTheCombinedForm) {
  follow_a_space_mouse(*hotplug_, clock_, log_, "combined");
}

TEST_F(InputDevices, APenIsFollowedThroughDroppedEventsAndUnpluggingT4) {
  Device device({"uinput_pen"});
  device.hear("ready");
  Samples samples;
  std::mutex slow;
  const auto pen = make_evdev_pen({}, *hotplug_, clock_, log_);
  const auto sink = samples.sink();
  ASSERT_TRUE(pen->start([&](Sample sample) {
                   const std::lock_guard wait(slow);
                   sink(std::move(sample));
                 })
                  .ok());
  device.tell("plug");
  ASSERT_TRUE(samples.presence(true).has_value()) << pen->status().problem;
  PenTracker tracker;
  FusedPen state;
  const auto follow_until = [&](const auto& done) {
    return samples.until([&](const Sample& sample) {
      if (const auto* bytes = std::get_if<DeviceBytes>(&sample)) {
        EXPECT_TRUE(tracker.consume(*bytes).ok());
        tracker.describe(state);
        if (bytes->kind == DeviceData::pen_events) {
          EXPECT_LE(state.time, bytes->arrival_time);
          EXPECT_LT(to_seconds(bytes->arrival_time - state.time), 10.0);
        }
      }
      return done();
    });
  };
  device.tell("pen near");
  const TimePoint before = clock_.now();
  device.tell("at 10800 3500 8191 57 0");
  ASSERT_TRUE(follow_until([&] { return state.pressure == 1.0; }));
  EXPECT_GT(state.time, before - 1s);
  EXPECT_NEAR(state.position_m.x(), 0.108, 1e-9);
  EXPECT_NEAR(state.position_m.y(), 0.100, 1e-9);
  EXPECT_NEAR(state.tilt_rad.x(), 1.0, 1e-9);
  device.tell("button 1 1");
  ASSERT_TRUE(follow_until([&] { return state.buttons == 2; }));
  {
    // Nobody reads while the pen goes on: the kernel drops events, among them the button's release.
    const std::lock_guard hold(slow);
    device.tell("at 1 1 10 0 0");  // Brings the reader to the lock.
    device.tell("flood 2000");
    device.hear("flooded");
    device.tell("button 1 0");
    device.tell("flood 2000");
    device.hear("flooded");
  }
  ASSERT_TRUE(follow_until([&] { return state.buttons == 0; }));
  EXPECT_GE(tracker.overruns(), 1u);
  EXPECT_GE(pen->status().lost, 1u);
  device.tell("at 21600 0 100 0 0");
  ASSERT_TRUE(follow_until([&] { return state.position_m.x() > 0.2159 && state.position_m.y() > 0.1349; }));
  device.tell("unplug");
  ASSERT_TRUE(samples.presence(false).has_value());
  device.tell("plug");
  EXPECT_TRUE(samples.presence(true).has_value());
}

}  // namespace
}  // namespace handloft::tracking
