#pragma once
// What the glove and the 3D mouse have in common as HID devices: a thread that waits until the device is
// plugged in, opens it, makes sure that it is the right one, reads its reports, and begins again when it is
// gone (T3). It never gives up, and says in words what it waits for.
//
//   absent        waits for the hot-plug monitor; no polling
//   unreadable    says which rule or group is missing, tries again every second (udev may yet give access)
//   foreign       the right numbers, but another report descriptor: left alone until it is plugged in anew
//   half open     opened, but nothing comes: said after `silent_after`, opened anew after that
//   breaks down   EIO while reading: closed, absent, opened again after a back-off of 50 ms to 1 s
//   no hidraw     a USB device without a driver of the kernel: opened through libusb

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "daemon-tracking/source/device_status.h"
#include "daemon-tracking/source/hid/hid_device.h"
#include "daemon-tracking/source/hid/report_descriptor.h"
#include "daemon-tracking/source/hotplug.h"

namespace handloft::tracking {

enum class SilentDevice : std::uint8_t {
  fine,       ///< A 3D mouse says nothing while nobody touches it.
  suspicious  ///< A glove reports all the time.
};

struct HidReaderOptions {
  std::string what = "device";  ///< "glove", in messages and as the log's component.
  Duration first_back_off = std::chrono::milliseconds(50);
  Duration last_back_off = std::chrono::seconds(1);
  /// A USB device is opened through libusb when no hidraw node of it has come for this long. udev makes nodes
  /// within some 50 ms, but seconds on a busy computer, and libusb would take the device from the kernel's
  /// driver.
  Duration wait_for_hidraw = std::chrono::seconds(3);
  SilentDevice silence = SilentDevice::fine;
  Duration silent_after = std::chrono::seconds(1);  ///< Some 250 reports of a glove.
  std::size_t max_report = 64;
};

/// What differs between devices. All are called on the reader's thread.
struct HidReaderHooks {
  /// Could it be ours, by its numbers (and, for hidraw, its descriptor)? `reports` is null for a device that
  /// is only known by libusb or whose descriptor can't be read.
  std::function<bool(const PluggedDevice&, const HidReports* reports)> suits;
  /// It is open: is it ours, and ready? An error leaves it alone until it is plugged in anew.
  std::function<Status(HidDevice&, const PluggedDevice&, const HidReports* reports)> accept;
  /// One input report. False: the parser refuses it.
  std::function<bool(TimePoint arrival, std::span<const std::uint8_t>)> on_report;
  std::function<void(TimePoint, bool present)> on_presence;
};

class HidReader {
 public:
  /// `hotplug` and `clock` must outlive it.
  HidReader(HidReaderOptions options, HidReaderHooks hooks, HotplugMonitor& hotplug,
            std::shared_ptr<HidSystem> system, const Clock& clock, Logger log);
  ~HidReader();
  HidReader(const HidReader&) = delete;
  HidReader& operator=(const HidReader&) = delete;

  /// Errors: failed_precondition when already started.
  Status start();
  bool started() const { return thread_.joinable(); }
  /// When it returns no hook is called any more. Idempotent; not from a hook.
  void stop();

  /// Runs `action` on the reader's thread with the open device, and waits for it. Errors: not_found when the
  /// device is absent or goes meanwhile, timeout; those of the action.
  Status with_device(std::function<Status(HidDevice&)> action);
  /// The same without waiting; of several with the same key that wait only the newest is run, errors are
  /// logged.
  void post(int key, std::function<Status(HidDevice&)> action);

  DeviceStatus status() const;
  /// Adds to the count of what the device itself says was lost. From hooks.
  void note_lost(std::uint64_t count);

 private:
  struct Node {
    PluggedDevice device;
    std::optional<HidReports> reports;
    TimePoint seen;        // When it was plugged in.
    TimePoint not_before;  // Back-off.
    Duration back_off{};
    bool foreign = false;
  };
  struct Command {
    int key = 0;
    std::function<Status(HidDevice&)> action;
    std::shared_ptr<std::promise<Status>> done;  // Null: nobody waits.
  };
  using Key = std::pair<std::string, std::string>;  // subsystem, devnode

  void on_plug(PlugChange change, const PluggedDevice& device);
  void run();
  std::optional<Key> choose(TimePoint now, Duration& wait);
  void use(const Key& key);
  void read_on(HidDevice& device, const Key& key);
  void run_commands(HidDevice* device);
  void fail(const Key& key, const Error& error);
  void set_problem(std::string problem);
  bool plugged(const Key& key) const;  // With the mutex held.
  bool is_plugged(const Key& key) const;
  std::string unplugged() const;

  HidReaderOptions options_;
  HidReaderHooks hooks_;
  HotplugMonitor& hotplug_;
  std::shared_ptr<HidSystem> system_;
  const Clock& clock_;
  Logger log_;
  RateLimit problem_limit_{std::chrono::seconds(10)};

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Key, Node> nodes_;  // What suits.
  std::deque<Command> commands_;
  DeviceStatus status_;
  bool stopping_ = false;
  bool open_ = false;
  std::unique_ptr<HotplugMonitor::Subscription> hidraw_, usb_;
  std::thread thread_;
};

}  // namespace handloft::tracking
