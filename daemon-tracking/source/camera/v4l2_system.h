#pragma once
// The few calls into the kernel and udev that a V4L2 camera needs (T1, T3), behind one small interface: the
// real one is v4l2_system.cpp, tests put one in its place that refuses, lies and loses devices. Errors are
// negative errno values here, as in the kernel; who calls turns them into words (v4l2_words.h).

#include <poll.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace handloft::tracking {

/// What udev and sysfs tell of one /dev/videoN, without opening it. Empty: not known.
struct V4l2Node {
  std::string node;    ///< "/dev/video0"
  std::string name;    ///< The driver's name for it: "HD Pro Webcam C920".
  std::string path;    ///< Where it is plugged in, as in /dev/v4l/by-path: "pci-0000:00:14.0-usb-0:3:1.0".
  std::string serial;  ///< The USB serial number; many webcams have none, or all the same.
  std::string usb_id;  ///< "046d:082d"
  std::string bus;     ///< The USB bus that it shares with others: "usb1".
  double bus_speed_mbit_s = 0;  ///< Of the device's own link: 480 for USB 2.
  std::string product;          ///< QUERYCAP's card as udevd asked it; empty where udevd doesn't run.
};

class V4l2System {
 public:
  virtual ~V4l2System() = default;

  /// All nodes of the subsystem video4linux, ordered by number.
  virtual std::vector<V4l2Node> nodes() = 0;

  /// Read-write, non-blocking, close-on-exec. A file descriptor or -errno.
  virtual int open(const std::string& node) = 0;
  virtual void close(int fd) = 0;
  /// Repeats EINTR. 0 or -errno.
  virtual int ioctl(int fd, unsigned long request, void* argument) = 0;
  /// Shared, read-only. Null when refused.
  virtual const std::uint8_t* map(int fd, std::size_t length, std::int64_t offset) = 0;
  virtual void unmap(const std::uint8_t* start, std::size_t length) = 0;
  /// poll(2): how many are ready, 0 on time-out, -errno (EINTR counts as a time-out).
  virtual int poll(std::span<pollfd> what, int timeout_ms) = 0;
};

/// The running kernel. Thread-safe: holds nothing.
std::shared_ptr<V4l2System> make_v4l2_system();

}  // namespace handloft::tracking
