#include "daemon-tracking/source/camera/v4l2_system.h"

#include <fcntl.h>
#include <libudev.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <string_view>

namespace handloft::tracking {

namespace {

template <auto Free>
struct Freed {
  template <typename T>
  void operator()(T* pointer) const {
    Free(pointer);
  }
};
using Udev = std::unique_ptr<udev, Freed<udev_unref>>;
using Enumeration = std::unique_ptr<udev_enumerate, Freed<udev_enumerate_unref>>;
using Device = std::unique_ptr<udev_device, Freed<udev_device_unref>>;

std::string text(const char* value) {
  return value == nullptr ? std::string() : std::string(value);
}

std::string trimmed(std::string value) {
  while (!value.empty() && (value.back() == '\n' || value.back() == ' ')) value.pop_back();
  return value;
}

// Where udevd doesn't run (a container) there is no ID_PATH: the port's own name in sysfs is as stable.
std::string place_of(udev_device* device, udev_device* usb) {
  const std::string path = text(udev_device_get_property_value(device, "ID_PATH"));
  if (!path.empty()) return path;
  if (usb != nullptr) return "usb-" + text(udev_device_get_sysname(usb));
  udev_device* parent = udev_device_get_parent(device);
  return parent == nullptr ? std::string() : text(udev_device_get_sysname(parent));
}

V4l2Node describe(udev_device* device) {
  V4l2Node node;
  node.node = text(udev_device_get_devnode(device));
  node.name = trimmed(text(udev_device_get_sysattr_value(device, "name")));
  node.product = text(udev_device_get_property_value(device, "ID_V4L_PRODUCT"));
  udev_device* usb = udev_device_get_parent_with_subsystem_devtype(device, "usb", "usb_device");
  node.path = place_of(device, usb);
  if (usb == nullptr) return node;
  const std::string vendor = trimmed(text(udev_device_get_sysattr_value(usb, "idVendor")));
  const std::string product = trimmed(text(udev_device_get_sysattr_value(usb, "idProduct")));
  if (!vendor.empty() && !product.empty()) node.usb_id = vendor + ":" + product;
  node.serial = trimmed(text(udev_device_get_sysattr_value(usb, "serial")));
  const std::string bus = trimmed(text(udev_device_get_sysattr_value(usb, "busnum")));
  if (!bus.empty()) node.bus = "usb" + bus;
  node.bus_speed_mbit_s = std::strtod(text(udev_device_get_sysattr_value(usb, "speed")).c_str(), nullptr);
  return node;
}

// "/dev/video10" after "/dev/video9".
bool by_number(const V4l2Node& a, const V4l2Node& b) {
  return a.node.size() != b.node.size() ? a.node.size() < b.node.size() : a.node < b.node;
}

class Kernel final : public V4l2System {
 public:
  std::vector<V4l2Node> nodes() override {
    std::vector<V4l2Node> found;
    const Udev context(udev_new());
    if (!context) return found;
    const bool udevd_runs = ::access("/run/udev/control", F_OK) == 0;
    const Enumeration all(udev_enumerate_new(context.get()));
    if (!all || udev_enumerate_add_match_subsystem(all.get(), "video4linux") < 0 ||
        udev_enumerate_scan_devices(all.get()) < 0) {
      return found;
    }
    for (udev_list_entry* entry = udev_enumerate_get_list_entry(all.get()); entry != nullptr;
         entry = udev_list_entry_get_next(entry)) {
      const Device device(udev_device_new_from_syspath(context.get(), udev_list_entry_get_name(entry)));
      if (!device) continue;  // Unplugged while we looked.
      // udevd has not yet said where it is plugged in; its word comes within milliseconds.
      if (udevd_runs && udev_device_get_is_initialized(device.get()) == 0 &&
          udev_device_get_property_value(device.get(), "ID_PATH") == nullptr) {
        continue;
      }
      V4l2Node node = describe(device.get());
      // Radios, teletext and sub-devices share the subsystem.
      if (std::string_view(node.node).starts_with("/dev/video")) found.push_back(std::move(node));
    }
    std::sort(found.begin(), found.end(), by_number);
    return found;
  }

  int open(const std::string& node) override {
    const int fd = ::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return fd >= 0 ? fd : -errno;
  }

  void close(int fd) override { ::close(fd); }

  int ioctl(int fd, unsigned long request, void* argument) override {
    int result = 0;
    do {
      result = ::ioctl(fd, request, argument);
    } while (result < 0 && errno == EINTR);
    return result < 0 ? -errno : 0;
  }

  const std::uint8_t* map(int fd, std::size_t length, std::int64_t offset) override {
    void* start = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, fd, static_cast<off_t>(offset));
    return start == MAP_FAILED ? nullptr : static_cast<const std::uint8_t*>(start);
  }

  void unmap(const std::uint8_t* start, std::size_t length) override {
    ::munmap(const_cast<std::uint8_t*>(start), length);
  }

  int poll(std::span<pollfd> what, int timeout_ms) override {
    const int ready = ::poll(what.data(), what.size(), timeout_ms);
    if (ready < 0) return errno == EINTR ? 0 : -errno;
    return ready;
  }
};

}  // namespace

std::shared_ptr<V4l2System> make_v4l2_system() {
  return std::make_shared<Kernel>();
}

}  // namespace handloft::tracking
