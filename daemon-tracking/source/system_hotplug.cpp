// The computer's own devices, by libudev and libusb.

#include <fmt/format.h>
#include <libudev.h>
#include <libusb-1.0/libusb.h>
#include <linux/input-event-codes.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <utility>

#include "daemon-tracking/source/hotplug.h"

namespace handloft::tracking {
namespace {

constexpr const char* udevd_socket = "/run/udev/control";  // There while udevd runs.

struct UdevDelete {
  void operator()(udev* it) const { udev_unref(it); }
  void operator()(udev_monitor* it) const { udev_monitor_unref(it); }
  void operator()(udev_device* it) const { udev_device_unref(it); }
  void operator()(udev_enumerate* it) const { udev_enumerate_unref(it); }
};
template <typename T>
using UdevPtr = std::unique_ptr<T, UdevDelete>;

std::string text(const char* from) {
  return from == nullptr ? std::string() : std::string(from);
}

std::uint16_t hexadecimal(std::string_view digits) {
  std::uint16_t value = 0;
  // More digits than fit (HID_ID has eight a number): the low four count.
  if (digits.size() > 4) digits.remove_prefix(digits.size() - 4);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  return error == std::errc() && end == digits.data() + digits.size() ? value : std::uint16_t{0};
}

// Whether an input device has a key, by the kernel's own words: "7 0 0 0 1f ..." are the keys' bits, the
// highest 64 first.
bool has_key(udev_device* input, unsigned key) {
  std::istringstream words(text(udev_device_get_sysattr_value(input, "capabilities/key")));
  std::vector<std::string> all;
  for (std::string word; words >> word && all.size() < 64;) all.push_back(word);
  const std::size_t word = key / 64;
  if (word >= all.size()) return false;
  std::uint64_t bits = 0;
  const std::string& digits = all[all.size() - 1 - word];
  std::from_chars(digits.data(), digits.data() + digits.size(), bits, 16);
  return (bits >> (key % 64) & 1u) != 0;
}

// Facts of the USB device or, for Bluetooth and virtual devices, of the HID or input device above the node.
void add_parents(udev_device* device, PluggedDevice& to) {
  if (udev_device* usb = udev_device_get_parent_with_subsystem_devtype(device, "usb", "usb_device")) {
    to.vendor_id = hexadecimal(text(udev_device_get_sysattr_value(usb, "idVendor")));
    to.product_id = hexadecimal(text(udev_device_get_sysattr_value(usb, "idProduct")));
    to.serial = text(udev_device_get_sysattr_value(usb, "serial"));
    to.name = text(udev_device_get_sysattr_value(usb, "product"));
  }
  if (udev_device* hid = udev_device_get_parent_with_subsystem_devtype(device, "hid", nullptr)) {
    // "0003:00001209:0000F00D": bus, vendor, product.
    const std::string id = text(udev_device_get_property_value(hid, "HID_ID"));
    const auto first = id.find(':'), last = id.rfind(':');
    if (to.vendor_id == 0 && first != std::string::npos && last > first) {
      to.vendor_id = hexadecimal(std::string_view(id).substr(first + 1, last - first - 1));
      to.product_id = hexadecimal(std::string_view(id).substr(last + 1));
    }
    if (to.name.empty()) to.name = text(udev_device_get_property_value(hid, "HID_NAME"));
    if (to.serial.empty()) to.serial = text(udev_device_get_property_value(hid, "HID_UNIQ"));
  }
  if (udev_device* input = udev_device_get_parent_with_subsystem_devtype(device, "input", nullptr)) {
    if (const char* name = udev_device_get_sysattr_value(input, "name")) to.name = name;
    if (to.serial.empty()) to.serial = text(udev_device_get_sysattr_value(input, "uniq"));
    // Without udevd's word on it (ID_INPUT_TABLET): what has a pen is a tablet.
    to.tablet = to.tablet || has_key(input, BTN_TOOL_PEN);
    if (to.vendor_id == 0) {
      to.vendor_id = hexadecimal(text(udev_device_get_sysattr_value(input, "id/vendor")));
      to.product_id = hexadecimal(text(udev_device_get_sysattr_value(input, "id/product")));
    }
  }
  if (const char* name = udev_device_get_sysattr_value(device, "name");
      name != nullptr && to.subsystem == "video4linux")
    to.name = name;
}

// nullopt: has no node, so there is nothing to open.
std::optional<PluggedDevice> read_device(udev_device* device) {
  PluggedDevice out;
  out.devnode = text(udev_device_get_devnode(device));
  if (out.devnode.empty()) return std::nullopt;
  out.subsystem = text(udev_device_get_subsystem(device));
  out.syspath = text(udev_device_get_syspath(device));
  out.path_id = text(udev_device_get_property_value(device, "ID_PATH"));
  out.tablet = text(udev_device_get_property_value(device, "ID_INPUT_TABLET")) == "1";
  add_parents(device, out);
  return out;
}

std::string first_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

/// USB devices by libusb, on the thread that calls handle_events().
class UsbWatcher {
 public:
  using Change = std::function<void(PlugChange, PluggedDevice)>;

  ~UsbWatcher() {
    if (context_ == nullptr) return;
    if (registered_) libusb_hotplug_deregister_callback(context_, handle_);
    libusb_exit(context_);
  }
  /// Tells what is present within; errors: io.
  Status open(Change change) {
    change_ = std::move(change);
    if (const int code = libusb_init(&context_); code != 0) {
      context_ = nullptr;
      return make_error(ErrorCode::io, fmt::format("libusb does not start: {}", libusb_error_name(code)),
                        "usb");
    }
    const int code = libusb_hotplug_register_callback(
        context_, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT,
        LIBUSB_HOTPLUG_ENUMERATE, LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
        LIBUSB_HOTPLUG_MATCH_ANY, &UsbWatcher::on_event, this, &handle_);
    if (code != LIBUSB_SUCCESS) {
      return make_error(ErrorCode::io, fmt::format("libusb tells no changes: {}", libusb_error_name(code)),
                        "usb");
    }
    registered_ = true;
    return {};
  }
  void handle_events(timeval at_most) { libusb_handle_events_timeout_completed(context_, &at_most, nullptr); }
  void interrupt() { libusb_interrupt_event_handler(context_); }

 private:
  static int LIBUSB_CALL on_event(libusb_context*, libusb_device* device, libusb_hotplug_event event,
                                  void* self) {
    PluggedDevice out;
    out.subsystem = "usb";
    out.devnode = fmt::format("/dev/bus/usb/{:03}/{:03}", libusb_get_bus_number(device),
                              libusb_get_device_address(device));
    std::array<std::uint8_t, 8> ports{};
    const int count = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
    out.path_id = fmt::format("usb-{}", libusb_get_bus_number(device));
    for (int i = 0; i < count; ++i)
      out.path_id += fmt::format("{}{}", i == 0 ? '-' : '.', ports[static_cast<std::size_t>(i)]);
    if (event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED && count > 0) {
      // The kernel has read its strings already, and anybody may read them here without opening the device.
      const std::string folder = "/sys/bus/usb/devices/" + out.path_id.substr(std::strlen("usb-"));
      out.serial = first_line(folder + "/serial");
      out.name = first_line(folder + "/product");
    }
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(device, &descriptor) == 0) {
      out.vendor_id = descriptor.idVendor;
      out.product_id = descriptor.idProduct;
    }
    static_cast<UsbWatcher*>(self)->change_(
        event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED ? PlugChange::added : PlugChange::removed,
        std::move(out));
    return 0;
  }

  libusb_context* context_ = nullptr;
  libusb_hotplug_callback_handle handle_{};
  bool registered_ = false;
  Change change_;
};

class SystemHotplug final : public HotplugMonitor {
 public:
  SystemHotplug(HotplugOptions options, Logger log) : options_(std::move(options)), log_(std::move(log)) {}

  ~SystemHotplug() override {
    stopping_.store(true);
    if (wake_ >= 0) {
      const std::uint64_t one = 1;
      [[maybe_unused]] const auto written = ::write(wake_, &one, sizeof one);
    }
    if (usb_thread_.joinable()) {
      usb_.interrupt();
      usb_thread_.join();
    }
    if (thread_.joinable()) thread_.join();
    if (wake_ >= 0) ::close(wake_);
  }

  Status open() {
    wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    udev_.reset(udev_new());
    if (wake_ < 0 || udev_ == nullptr) return make_error(ErrorCode::io, "libudev does not start", "hotplug");
    std::error_code ignored;
    const char* group = std::filesystem::exists(udevd_socket, ignored) || mocked() ? "udev" : "kernel";
    monitor_.reset(udev_monitor_new_from_netlink(udev_.get(), group));
    if (monitor_ == nullptr) {
      return make_error(ErrorCode::io, "the kernel gives no netlink socket for device events", "hotplug");
    }
    for (const std::string& subsystem : options_.subsystems)
      udev_monitor_filter_add_match_subsystem_devtype(monitor_.get(), subsystem.c_str(), nullptr);
    // Listen first, look second: what comes in between is told twice, and the registry knows it.
    if (udev_monitor_enable_receiving(monitor_.get()) < 0) {
      return make_error(ErrorCode::io,
                        fmt::format("cannot listen to device events: {}", std::strerror(errno)), "hotplug");
    }
    look_up();
    thread_ = std::thread([this] { listen(); });
    if (options_.usb == UsbWatch::libusb) {
      const Status status = usb_.open([this](PlugChange change, PluggedDevice device) {
        if (change == PlugChange::added) {
          note_added(std::move(device));
        } else {
          note_removed(device.subsystem, device.devnode);
        }
      });
      if (!status) {
        log_.warning("USB devices without a driver are not seen: {}", status.error().message);
      } else {
        usb_thread_ = std::thread([this] {
          while (!stopping_.load()) usb_.handle_events({.tv_sec = 60, .tv_usec = 0});
        });
      }
    }
    return {};
  }

 private:
  // umockdev has no udevd and speaks in its place.
  static bool mocked() { return ::getenv("UMOCKDEV_DIR") != nullptr; }

  void look_up() {
    const UdevPtr<udev_enumerate> all(udev_enumerate_new(udev_.get()));
    if (all == nullptr) return;
    for (const std::string& subsystem : options_.subsystems)
      udev_enumerate_add_match_subsystem(all.get(), subsystem.c_str());
    udev_enumerate_scan_devices(all.get());
    std::vector<PluggedDevice> found;
    udev_list_entry* entry = nullptr;
    udev_list_entry_foreach(entry, udev_enumerate_get_list_entry(all.get())) {
      const UdevPtr<udev_device> device(
          udev_device_new_from_syspath(udev_.get(), udev_list_entry_get_name(entry)));
      if (device == nullptr) continue;  // Gone in the meantime.
      if (auto read = read_device(device.get())) found.push_back(std::move(*read));
    }
    note_all(options_.subsystems, std::move(found));
  }

  void listen() {
    std::array<pollfd, 2> waited{{{udev_monitor_get_fd(monitor_.get()), POLLIN, 0}, {wake_, POLLIN, 0}}};
    while (!stopping_.load()) {
      if (::poll(waited.data(), waited.size(), -1) < 0 && errno != EINTR) break;
      if ((waited[0].revents & POLLIN) != 0) receive();
      if ((waited[0].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0 && !recover()) break;
    }
  }

  void receive() {
    errno = 0;
    const UdevPtr<udev_device> device(udev_monitor_receive_device(monitor_.get()));
    if (device == nullptr) {
      if (errno == ENOBUFS) recover();
      return;
    }
    const std::string action = text(udev_device_get_action(device.get()));
    if (action == "remove") {
      note_removed(text(udev_device_get_subsystem(device.get())),
                   text(udev_device_get_devnode(device.get())));
    } else if (action == "add" || action == "change") {
      if (auto read = read_device(device.get())) note_added(std::move(*read));
    }
  }

  // Events were lost. False: the socket is beyond help.
  bool recover() {
    int error = 0;
    socklen_t size = sizeof error;
    if (::getsockopt(udev_monitor_get_fd(monitor_.get()), SOL_SOCKET, SO_ERROR, &error, &size) < 0) {
      log_.error("device events end: {}", std::strerror(errno));
      return false;
    }
    log_.warning("device events were lost: looking at all devices again");
    look_up();
    return true;
  }

  HotplugOptions options_;
  Logger log_;
  UdevPtr<udev> udev_;
  UdevPtr<udev_monitor> monitor_;
  UsbWatcher usb_;
  int wake_ = -1;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
  std::thread usb_thread_;
};

}  // namespace

Result<std::unique_ptr<HotplugMonitor>> open_system_hotplug(const HotplugOptions& options, Logger log) {
  auto monitor = std::make_unique<SystemHotplug>(options, std::move(log));
  if (Status status = monitor->open(); !status) return status.error();
  return std::unique_ptr<HotplugMonitor>(std::move(monitor));
}

}  // namespace handloft::tracking
