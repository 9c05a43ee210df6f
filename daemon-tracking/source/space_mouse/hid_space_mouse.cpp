#include "daemon-tracking/source/space_mouse/hid_space_mouse.h"

#include <fmt/format.h>

#include <utility>

#include "daemon-tracking/source/hid/hid_reader.h"
#include "daemon-tracking/source/space_mouse/space_mouse_report.h"

namespace handloft::tracking {
namespace {

constexpr std::uint8_t first_report = 1;
constexpr std::size_t split_bytes = 6, combined_bytes = 12;

class HidSpaceMouse final : public SpaceMouseSource {
 public:
  HidSpaceMouse(HidSpaceMouseOptions options, HotplugMonitor& hotplug, std::shared_ptr<HidSystem> system,
                const Clock& clock, Logger log)
      : options_(std::move(options)),
        name_(space_mouse_device),
        reader_(reader_options(), hooks(), hotplug, std::move(system), clock, std::move(log)) {}
  ~HidSpaceMouse() override { reader_.stop(); }

  const std::string& name() const override { return name_; }
  Status start(SampleSink sink) override {
    if (reader_.started()) return make_error(ErrorCode::failed_precondition, "is reading already", name_);
    sink_ = std::move(sink);
    return reader_.start();
  }
  void stop() override { reader_.stop(); }
  bool finished() const override { return false; }
  DeviceStatus status() const override { return reader_.status(); }

 private:
  static HidReaderOptions reader_options() {
    HidReaderOptions out;
    out.what = "3D mouse";
    out.max_report = max_space_mouse_report;
    return out;
  }

  HidReaderHooks hooks() {
    HidReaderHooks out;
    out.suits = [this](const PluggedDevice& device, const HidReports* reports) {
      // Through libusb only: the kernel's driver would have to be taken away from the desktop's own programs.
      if (device.subsystem == "usb") return false;
      if (!options_.serial.empty() && device.serial != options_.serial) return false;
      return (reports != nullptr && reports->is({space_mouse_usage_page, space_mouse_usage})) ||
             is_known_space_mouse(device.vendor_id, device.product_id);
    };
    out.accept = [](HidDevice&, const PluggedDevice&, const HidReports* reports) -> Status {
      if (reports == nullptr) return {};
      const std::size_t bytes = HidReports::bytes(reports->input_bits, first_report);
      // A report of 12 bytes in the descriptor is sent in the split form by some; so is the other way round
      // by none.
      if (bytes >= split_bytes && bytes <= combined_bytes) return {};
      return make_error(ErrorCode::unsupported,
                        fmt::format("found an input report 1 of {} bytes, expected {} or {}", bytes,
                                    split_bytes, combined_bytes),
                        "report_descriptor");
    };
    out.on_report = [this](TimePoint arrival, std::span<const std::uint8_t> bytes) {
      sink_(DeviceBytes{arrival, DeviceData::space_mouse_report, {bytes.begin(), bytes.end()}});
      return parse_space_mouse_report(bytes).ok();
    };
    out.on_presence = [this](TimePoint time, bool present) { sink_(DevicePresence{time, name_, present}); };
    return out;
  }

  HidSpaceMouseOptions options_;
  std::string name_;
  SampleSink sink_;
  HidReader reader_;
};

}  // namespace

std::unique_ptr<SpaceMouseSource> make_hid_space_mouse(const HidSpaceMouseOptions& options,
                                                       HotplugMonitor& hotplug,
                                                       std::shared_ptr<HidSystem> system, const Clock& clock,
                                                       Logger log) {
  return std::make_unique<HidSpaceMouse>(options, hotplug, std::move(system), clock, std::move(log));
}

}  // namespace handloft::tracking
