#pragma once
// HID devices as hidapi gives them: report in, report out, feature reports. hidapi comes in two libraries
// with the same names in them, one over hidraw nodes and one over libusb; both are loaded when they are first
// needed, so that one program can use hidraw and fall back to libusb. An interface, so that tests can be the
// device.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/hotplug.h"

namespace handloft::tracking {

/// An open device. One thread at a time. Every error but `timeout` means that it is lost.
class HidDevice {
 public:
  virtual ~HidDevice() = default;
  /// Waits for one input report, its id in front. 0: none came. Errors: io.
  virtual Result<std::size_t> read(std::span<std::uint8_t> into, std::chrono::milliseconds timeout) = 0;
  /// An output report, its id in front.
  virtual Status write(std::span<const std::uint8_t> report) = 0;
  /// A feature report; the id goes in `into[0]`. The number of bytes, with the id.
  virtual Result<std::size_t> get_feature(std::span<std::uint8_t> into) = 0;
  virtual Status set_feature(std::span<const std::uint8_t> report) = 0;
};

class HidSystem {
 public:
  virtual ~HidSystem() = default;
  /// The report descriptor of a "hidraw" device, readable without opening it. Empty for "usb", whose
  /// descriptor nobody has fetched. Errors: not_found when it is gone.
  virtual Result<std::vector<std::uint8_t>> report_descriptor(const PluggedDevice& device) = 0;
  /// Opens a "hidraw" device, or a "usb" one through libusb. Errors: permission_denied, not_found (gone),
  /// io, unsupported (the library isn't installed); the message says what to do.
  virtual Result<std::unique_ptr<HidDevice>> open(const PluggedDevice& device) = 0;
};

/// The system's, by hidapi. Loads its libraries on the first open.
std::shared_ptr<HidSystem> make_hidapi_system();

}  // namespace handloft::tracking
