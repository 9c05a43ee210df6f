#include "daemon-tracking/calibrate/live_input.h"

#include <fmt/format.h>

#include <condition_variable>
#include <deque>
#include <mutex>

#include "daemon-tracking/source/camera/v4l2_camera.h"
#include "daemon-tracking/source/glove/hid_glove.h"

namespace handloft::tracking {
namespace {

/// What may wait to be looked at: a second of three cameras. Older frames make room, as a camera's own
/// buffers would.
constexpr std::size_t longest_queue = 90;
constexpr Duration longest_silence = std::chrono::seconds(5);

/// Sources that push, read as a stream.
class LiveStream final : public SampleStream {
 public:
  LiveStream(std::unique_ptr<HotplugMonitor> hotplug, double seconds)
      : hotplug_(std::move(hotplug)), length_(from_seconds(seconds)) {}
  ~LiveStream() override {
    for (const auto& source : sources_) source->stop();
  }
  LiveStream(const LiveStream&) = delete;
  LiveStream& operator=(const LiveStream&) = delete;

  const Clock& clock() const { return clock_; }
  HotplugMonitor* hotplug() { return hotplug_.get(); }
  void add(std::unique_ptr<SampleSource> source) { sources_.push_back(std::move(source)); }
  Status start() {
    end_ = clock_.now() + length_;
    for (const auto& source : sources_) {
      const Status started = source->start([this](Sample sample) { put(std::move(sample)); });
      if (!started) return started;
    }
    return {};
  }

  std::optional<Sample> next() override {
    std::unique_lock lock(mutex_);
    const Duration left = end_ - clock_.now();
    if (left <= Duration::zero()) return std::nullopt;
    if (!filled_.wait_for(lock, std::min(left, longest_silence), [this] { return !queue_.empty(); }))
      return std::nullopt;
    Sample sample = std::move(queue_.front());
    queue_.pop_front();
    return sample;
  }

 private:
  void put(Sample sample) {
    const std::lock_guard lock(mutex_);
    if (queue_.size() >= longest_queue) queue_.pop_front();
    queue_.push_back(std::move(sample));
    filled_.notify_one();
  }

  SystemClock clock_;
  std::unique_ptr<HotplugMonitor> hotplug_;
  Duration length_;
  TimePoint end_;
  std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<Sample> queue_;
  std::vector<std::unique_ptr<SampleSource>> sources_;  ///< Stopped and freed before what they write to.
};

/// The flag's selector, else what the calibration remembers.
Result<CameraSelector> selector_of(const CalibrateOptions& options, const CameraRecord& record,
                                   const std::string& name) {
  for (const std::string& one : options.cameras) {
    const auto equals = one.find('=');
    if (equals != std::string::npos && one.substr(0, equals) == name)
      return parse_camera_selector(one.substr(equals + 1));
  }
  CameraSelector selector;
  selector.serial = record.device.serial;
  if (selector.serial.empty()) selector.path = record.device.path;
  if (selector.serial.empty() && selector.path.empty())
    return make_error(
        ErrorCode::not_found,
        fmt::format(
            "it is not said which device '{}' is: expected --camera {}=/dev/video0, or serial=..., path=...",
            name, name),
        "camera");
  return selector;
}

}  // namespace

std::optional<DeviceIdentity> glove_identity(const std::vector<PluggedDevice>& present) {
  for (const PluggedDevice& device : present)
    if ((device.subsystem == "hidraw" || device.subsystem == "usb") && device.vendor_id == glove_usb_vendor &&
        device.product_id == glove_usb_product)
      return DeviceIdentity{device.name, device.serial, device.path_id};
  return std::nullopt;
}

Result<Input> open_live(const CalibrateOptions& options, const Calibration& calibration) {
  const Logger log("calibrate", LogLevel::warning);
  HotplugOptions watched;
  watched.usb = options.step == "glove" ? UsbWatch::libusb : UsbWatch::off;
  auto hotplug = open_system_hotplug(watched, log);
  if (!hotplug) return hotplug.error();
  auto stream = std::make_unique<LiveStream>(std::move(*hotplug), options.seconds);
  Input input;
  if (options.step == "glove") {
    stream->add(make_hid_glove({}, *stream->hotplug(), make_hidapi_system(), stream->clock(), log));
  } else {
    const std::shared_ptr<V4l2System> system = make_v4l2_system();
    const std::vector<V4l2CameraInfo> present = list_v4l2_cameras(*system);
    for (std::uint32_t i = 0; i < calibration.rig.cameras.size(); ++i) {
      const CameraCalibration& camera = calibration.rig.cameras[i];
      if (!wants_camera(options, camera.name)) continue;
      if (options.step == "extrinsics" && camera.role == CameraRole::head) continue;
      const auto selector = selector_of(options, calibration.cameras[i], camera.name);
      if (!selector) return selector.error();
      const auto match = match_camera(system->nodes(), *selector, IdentityMismatch::accept_moved);
      if (!match) return match.error();
      for (const V4l2CameraInfo& info : present)
        if (!match->nodes.empty() && info.unusable.empty() &&
            std::any_of(match->nodes.begin(), match->nodes.end(),
                        [&](const V4l2Node& node) { return node.node == info.node.node; }))
          input.devices.emplace_back(i, DeviceIdentity{info.model, info.node.serial, info.node.path});
      V4l2CameraOptions camera_options;
      camera_options.selector = *selector;
      camera_options.mode.width_px = camera.intrinsics.width_px;
      camera_options.mode.height_px = camera.intrinsics.height_px;
      camera_options.mode.rate_hz = calibration.cameras[i].frames_per_s;
      camera_options.settings.exposure = from_seconds(1e-3 * options.exposure_ms);
      camera_options.time_offset = camera.time_offset;
      camera_options.hotplug = stream->hotplug();
      stream->add(make_v4l2_camera(i, "camera/" + camera.name, camera_options, stream->clock(), log));
    }
  }
  if (const Status started = stream->start(); !started) return started.error();
  if (options.step == "glove")
    input.glove = [monitor = stream->hotplug()] { return glove_identity(monitor->present()); };
  input.stream = std::move(stream);
  return input;
}

}  // namespace handloft::tracking
