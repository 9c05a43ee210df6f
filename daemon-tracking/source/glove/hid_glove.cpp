#include "daemon-tracking/source/glove/hid_glove.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

namespace handloft::tracking {
namespace {

constexpr const char* glove_name = "glove";
constexpr int show_command = 1;

class HidGlove final : public GloveSource {
 public:
  HidGlove(const HidGloveOptions& options, HotplugMonitor& hotplug, std::shared_ptr<HidSystem> system,
           const Clock& clock, Logger log)
      : options_(options),
        name_(glove_name),
        clock_(clock),
        log_(log),
        reader_(reader_options(options), hooks(), hotplug, std::move(system), clock, std::move(log)) {}

  ~HidGlove() override { reader_.stop(); }

  const std::string& name() const override { return name_; }
  Status start(SampleSink sink) override {
    if (reader_.started()) return make_error(ErrorCode::failed_precondition, "is reading already", name_);
    sink_ = std::move(sink);
    return reader_.start();
  }
  void stop() override { reader_.stop(); }
  bool finished() const override { return false; }
  DeviceStatus status() const override { return reader_.status(); }

  void show(const GloveOutput& output) override {
    reader_.post(show_command,
                 [output](HidDevice& device) { return device.write(encode_glove_output(output)); });
  }

  Result<GloveRange> range() override {
    std::optional<GloveRange> range;
    const Status status = reader_.with_device([&range](HidDevice& device) -> Status {
      auto read = read_range(device);
      if (!read) return read.error();
      range = read->range;
      return {};
    });
    if (!status) return status.error();
    return *range;
  }

  Status set_range(const GloveRange& range) override {
    const auto bytes = encode_glove_range(range);
    if (auto valid = parse_glove_range(bytes); !valid) return valid.error();
    return reader_.with_device([this, bytes, range](HidDevice& device) -> Status {
      if (Status status = device.set_feature(bytes); !status) return status;
      auto read = read_range(device);
      if (!read) return read.error();
      if (read->range != range) {
        return make_error(ErrorCode::data_corrupt, "the glove did not keep its new range; set it again",
                          "range");
      }
      sink_(GloveBytes{clock_.now(), read->bytes});
      return {};
    });
  }

 private:
  struct ReadRange {
    GloveRange range;
    std::vector<std::uint8_t> bytes;
  };

  static HidReaderOptions reader_options(const HidGloveOptions& options) {
    HidReaderOptions out;
    out.what = glove_name;
    out.silence = SilentDevice::suspicious;
    out.silent_after = options.silent_after;
    out.wait_for_hidraw = options.wait_for_hidraw;
    out.max_report = glove_report_size;
    return out;
  }

  HidReaderHooks hooks() {
    HidReaderHooks out;
    out.suits = [this](const PluggedDevice& device, const HidReports* reports) {
      return suits(device, reports);
    };
    out.accept = [this](HidDevice& device, const PluggedDevice& plugged, const HidReports* reports) {
      return accept(device, plugged, reports);
    };
    out.on_report = [this](TimePoint arrival, std::span<const std::uint8_t> bytes) {
      return on_report(arrival, bytes);
    };
    out.on_presence = [this](TimePoint time, bool present) { on_presence(time, present); };
    return out;
  }

  bool suits(const PluggedDevice& device, const HidReports* reports) const {
    if (!options_.serial.empty() && device.serial != options_.serial && device.subsystem != "usb")
      return false;
    // The numbers alone suit too, so that a foreign device under them is told about.
    return (reports != nullptr && reports->is({glove_usage_page, glove_usage})) ||
           (device.vendor_id == options_.vendor_id && device.product_id == options_.product_id);
  }

  static Result<ReadRange> read_range(HidDevice& device) {
    ReadRange out;
    out.bytes.resize(glove_range_size);
    out.bytes[0] = glove_range_id;
    const Result<std::size_t> size = device.get_feature(out.bytes);
    if (!size) return size.error();
    out.bytes.resize(std::min(*size, out.bytes.size()));
    auto range = parse_glove_range(out.bytes);
    if (!range) return range.error();
    out.range = *range;
    return out;
  }

  Status accept(HidDevice& device, const PluggedDevice& plugged, const HidReports* reports) {
    range_bytes_.clear();
    if (reports != nullptr) {
      if (!reports->is({glove_usage_page, glove_usage})) {
        const HidUsage found = reports->applications.empty() ? HidUsage{} : reports->applications.front();
        return make_error(ErrorCode::unsupported,
                          fmt::format("found usage {:04x}:{:04x}, expected {:04x}:{:04x}", found.page,
                                      found.usage, glove_usage_page, glove_usage),
                          "report_descriptor");
      }
      const std::size_t input = HidReports::bytes(reports->input_bits, glove_report_id);
      if (input + 1 != glove_report_size) {
        return make_error(ErrorCode::unsupported,
                          fmt::format("found an input report of {} bytes, expected {}: its firmware is of "
                                      "another version",
                                      input + 1, glove_report_size),
                          "report_descriptor");
      }
    }
    auto range = read_range(device);
    if (range) {
      range_bytes_ = std::move(range->bytes);
    } else if (reports == nullptr) {
      // Only its answer tells a glove from whatever else bears these numbers.
      return make_error(ErrorCode::unsupported,
                        fmt::format("it does not answer as a glove does ({})", range.error().describe()),
                        "range");
    } else {
      log_.warning("{} tells no range ({}): that of the calibration is used", describe(plugged),
                   range.error().describe());
    }
    return {};
  }

  void on_presence(TimePoint time, bool present) {
    sequence_.reset();
    sink_(DevicePresence{time, name_, present});
    if (present && !range_bytes_.empty()) sink_(GloveBytes{time, range_bytes_});
  }

  bool on_report(TimePoint arrival, std::span<const std::uint8_t> bytes) {
    const auto report = parse_glove_report(bytes);
    if (report) {
      if (sequence_ && (report->flags & glove_restarted) == 0) {
        const auto missing = static_cast<std::uint16_t>(report->sequence - *sequence_ - 1);
        if (missing != 0) reader_.note_lost(missing);
      }
      sequence_ = report->sequence;
    }
    // What the parser refuses is handed on too: it is recorded and counted behind the recording as here.
    sink_(GloveBytes{arrival, {bytes.begin(), bytes.end()}});
    return report.ok();
  }

  HidGloveOptions options_;
  std::string name_;
  const Clock& clock_;
  Logger log_;
  SampleSink sink_;
  // On the reader's thread.
  std::vector<std::uint8_t> range_bytes_;
  std::optional<std::uint16_t> sequence_;
  HidReader reader_;
};

}  // namespace

std::unique_ptr<GloveSource> make_hid_glove(const HidGloveOptions& options, HotplugMonitor& hotplug,
                                            std::shared_ptr<HidSystem> system, const Clock& clock,
                                            Logger log) {
  return std::make_unique<HidGlove>(options, hotplug, std::move(system), clock, std::move(log));
}

}  // namespace handloft::tracking
