#pragma once
// Which devices are plugged in, and word when one comes or goes (T3), by libudev and, for USB devices without
// a driver of the kernel, by libusb. Sources subscribe to their subsystem and open what suits them; they
// never look for devices by polling.
//
// Identity (T2): a port (`path_id`, udev's ID_PATH: the same plug gives the same text after a reboot) and a
// serial number where the device has one.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/log.h"
#include "common/base/result.h"

namespace handloft::tracking {

/// A device node of one subsystem, as far as udev knows it; what it does not know is empty or 0.
struct PluggedDevice {
  std::string subsystem;        ///< "hidraw", "input", "video4linux", "tty"; "usb" from libusb.
  std::string devnode;          ///< "/dev/hidraw0"; for "usb" its node on the bus, "/dev/bus/usb/001/002".
  std::string syspath;          ///< The device's folder below /sys; empty for "usb".
  std::string path_id;          ///< ID_PATH, "pci-0000:00:14.0-usb-0:2:1.0".
  std::string serial;           ///< The USB device's serial number, else the HID or input device's unique id.
  std::uint16_t vendor_id = 0;  ///< USB or Bluetooth.
  std::uint16_t product_id = 0;
  std::string name;     ///< As the device calls itself.
  bool tablet = false;  ///< Has a pen: udev's ID_INPUT_TABLET, or its keys.

  bool operator==(const PluggedDevice&) const = default;
};

enum class PlugChange : std::uint8_t { added, removed };

/// "046d:c626 SpaceNavigator, serial 12, at pci-...-usb-0:2:1.0 (/dev/hidraw0)": for logs and `devices`.
std::string describe(const PluggedDevice& device);

/// Called for each device present when it subscribes, from within subscribe(), then for each change, on the
/// monitor's thread; one call at a time over all subscribers. Must be quick; must neither subscribe nor end a
/// subscription.
using HotplugCallback = std::function<void(PlugChange, const PluggedDevice&)>;

/// The registry of what is plugged in; implementations feed it. Thread-safe.
class HotplugMonitor {
 public:
  HotplugMonitor();
  virtual ~HotplugMonitor();
  HotplugMonitor(const HotplugMonitor&) = delete;
  HotplugMonitor& operator=(const HotplugMonitor&) = delete;

  /// Ends with the object: once its destructor has returned the callback isn't called any more. May outlive
  /// the monitor. Not to be destroyed in the callback.
  class Subscription;

  /// `subsystem` as in PluggedDevice; empty: all.
  std::unique_ptr<Subscription> subscribe(std::string subsystem, HotplugCallback callback);

  /// What is plugged in now, ordered by devnode; of one subsystem, or of all when empty.
  std::vector<PluggedDevice> present(std::string_view subsystem = {}) const;

 protected:
  /// A device that is there already (the same subsystem and devnode) is told again only if it is another one
  /// or has changed: first its removal, then the new one.
  void note_added(PluggedDevice device);
  /// Unknown ones are ignored.
  void note_removed(std::string_view subsystem, std::string_view devnode);
  /// All of `subsystems` that is present, after events were lost: what is missing is told as removed.
  void note_all(const std::vector<std::string>& subsystems, std::vector<PluggedDevice> found);

 private:
  struct Registry;
  std::shared_ptr<Registry> registry_;
};

class HotplugMonitor::Subscription {
 public:
  ~Subscription();
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;

 private:
  friend class HotplugMonitor;
  Subscription(std::shared_ptr<Registry> registry, std::uint64_t id);
  std::shared_ptr<Registry> registry_;
  std::uint64_t id_;
};

/// A monitor that is told what is plugged in: for tests and simulated sessions.
class ManualHotplug final : public HotplugMonitor {
 public:
  void plug(PluggedDevice device) { note_added(std::move(device)); }
  void unplug(std::string_view subsystem, std::string_view devnode) { note_removed(subsystem, devnode); }
};

/// Whether USB devices are watched by libusb too. They are needed only where the kernel makes no hidraw node
/// (no usbhid): the glove is then opened through libusb.
enum class UsbWatch : std::uint8_t { off, libusb };

struct HotplugOptions {
  std::vector<std::string> subsystems{"hidraw", "input", "video4linux", "tty"};
  UsbWatch usb = UsbWatch::off;
};

/// The computer's devices: looks up what is present before it returns, then listens on a thread of its own
/// until it is destroyed. Listens to udevd, or to the kernel itself where no udevd runs (a container). When
/// events are lost (ENOBUFS) everything is looked up again.
/// Errors: io when neither netlink nor sysfs is to be had.
Result<std::unique_ptr<HotplugMonitor>> open_system_hotplug(const HotplugOptions& options, Logger log);

}  // namespace handloft::tracking
