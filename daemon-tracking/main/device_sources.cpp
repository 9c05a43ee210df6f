#include "daemon-tracking/main/device_sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <set>
#include <utility>

#include "daemon-tracking/source/camera/v4l2_enumerate.h"
#include "daemon-tracking/source/glove/hid_glove.h"
#include "daemon-tracking/source/glove/serial_glove.h"
#include "daemon-tracking/source/pen/evdev_pen.h"
#include "daemon-tracking/source/space_mouse/hid_space_mouse.h"

namespace handloft::tracking {

namespace {

constexpr auto exposure_unit = std::chrono::microseconds(100);  // V4L2_CID_EXPOSURE_ABSOLUTE

CameraSelector selector_of(const DeviceIdentity& device) {
  CameraSelector selector;
  selector.serial = device.serial;
  selector.model = device.model;
  // Two alike cameras without serial numbers are told apart by their sockets.
  if (device.serial.empty()) selector.path = device.path;
  return selector;
}

}  // namespace

V4l2CameraOptions camera_options(const Calibration& calibration, std::size_t camera) {
  const CameraRecord& record = calibration.cameras.at(camera);
  const CameraCalibration& calibrated = calibration.rig.cameras.at(camera);
  V4l2CameraOptions options;
  options.selector = selector_of(record.device);
  options.mode.rate_hz = record.frames_per_s;
  options.mode.width_px = calibrated.intrinsics.width_px;
  options.mode.height_px = calibrated.intrinsics.height_px;
  options.mode.format = record.format;
  if (record.controls.exposure_100us)
    options.settings.exposure = *record.controls.exposure_100us * exposure_unit;
  options.settings.gain = record.controls.gain;
  options.settings.white_balance_kelvin = record.controls.white_balance_k;
  options.settings.focus = record.controls.focus;
  options.time_offset = calibrated.time_offset;
  options.readout = calibrated.row_time * calibrated.intrinsics.height_px;
  return options;
}

DeviceFacts facts_of(const std::string& device, const CameraHealth& health, const Calibration& calibration,
                     std::size_t camera) {
  DeviceFacts facts;
  facts.device = device;
  facts.identity = health.identity;
  facts.asked_rate_hz = calibration.cameras.at(camera).frames_per_s;
  facts.problem = health.problem;
  facts.refused = health.refused;
  if (!health.present || health.mode.width_px <= 0) return facts;
  DeviceIdentity found = calibration.cameras[camera].device;
  found.model = health.model;
  const Status fits = check_device(calibration, camera, found, health.mode.width_px, health.mode.height_px);
  if (!fits) facts.problem = "unmatched: " + fits.error().message;
  return facts;
}

std::vector<DeviceFacts> unmatched_cameras(const std::vector<V4l2Node>& nodes,
                                           const Calibration& calibration) {
  std::set<std::string> taken;
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    const V4l2CameraOptions options = camera_options(calibration, i);
    const Result<NodeMatch> match = match_camera(nodes, options.selector, options.mismatch);
    if (!match) continue;
    for (const V4l2Node& node : match->nodes) taken.insert(node.node);
  }
  // A camera has several nodes; they share its identity.
  std::map<std::string, std::string> rest;
  for (const V4l2Node& node : nodes)
    if (!taken.contains(node.node)) rest.try_emplace(identity_of(node), node.node);
  std::vector<DeviceFacts> facts;
  for (const auto& [identity, node] : rest) {
    DeviceFacts fact;
    fact.device = fmt::format("camera/unmatched-{}", facts.size() + 1);
    fact.identity = identity;
    fact.present = true;
    fact.problem = fmt::format(
        "unmatched: {} at {} is in no calibration and is not used; add it with handloft-calibrate, or unplug "
        "it",
        identity, node);
    facts.push_back(std::move(fact));
  }
  return facts;
}

struct DeviceSources::Implementation {
  Calibration calibration;
  std::shared_ptr<V4l2System> system;
  std::unique_ptr<HotplugMonitor> plugs;
  std::vector<std::unique_ptr<V4l2Camera>> cameras;
  std::unique_ptr<GloveSource> glove;
  std::unique_ptr<PenSource> pen;
  std::unique_ptr<SpaceMouseSource> space_mouse;
  std::atomic<bool> cameras_changed{true};
  std::vector<DeviceFacts> unmatched;
  // Last, so that it ends first: it calls the cameras.
  std::unique_ptr<HotplugMonitor::Subscription> camera_plugs;

  void look_for_unmatched() {
    if (!cameras_changed.exchange(false)) return;
    const std::size_t before = unmatched.size();
    std::vector<DeviceFacts> now = unmatched_cameras(system->nodes(), calibration);
    // Who was told of must be told to be gone.
    for (std::size_t i = now.size(); i < before; ++i) {
      DeviceFacts gone;
      gone.device = fmt::format("camera/unmatched-{}", i + 1);
      gone.present = false;
      now.push_back(std::move(gone));
    }
    unmatched = std::move(now);
  }
};

DeviceFacts facts_of(const std::string& device, const DeviceStatus& status) {
  constexpr std::string_view nobody_plugged_it_in = "not plugged in";
  DeviceFacts facts;
  facts.device = device;
  facts.identity = status.identity;
  if (!status.problem.starts_with(nobody_plugged_it_in)) facts.problem = status.problem;
  return facts;
}

DeviceSources::DeviceSources(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
DeviceSources::~DeviceSources() = default;

Result<std::unique_ptr<DeviceSources>> DeviceSources::open(const Calibration& calibration,
                                                           const DeviceSourceOptions& options,
                                                           const Clock& clock, const Logger& log) {
  auto parts = std::make_unique<Implementation>();
  parts->calibration = calibration;
  parts->system = make_v4l2_system();
  HotplugOptions watched;
  watched.usb = UsbWatch::libusb;
  Result<std::unique_ptr<HotplugMonitor>> plugs = open_system_hotplug(watched, log.component("hotplug"));
  if (!plugs) return plugs.error();
  parts->plugs = std::move(*plugs);
  for (std::size_t i = 0; i < calibration.rig.cameras.size(); ++i) {
    const std::string name = "camera/" + calibration.rig.cameras[i].name;
    parts->cameras.push_back(make_v4l2_camera(static_cast<std::uint32_t>(i), name,
                                              camera_options(calibration, i), clock, log.component(name),
                                              parts->system));
  }
  if (options.serial_glove) {
    SerialGloveOptions line;
    line.line = *options.serial_glove;
    parts->glove = make_serial_glove(line, *parts->plugs, clock, log.component("glove"));
  } else {
    HidGloveOptions glove;
    if (calibration.glove) glove.serial = calibration.glove->device.serial;
    parts->glove = make_hid_glove(glove, *parts->plugs, make_hidapi_system(), clock, log.component("glove"));
  }
  parts->pen = make_evdev_pen({}, *parts->plugs, clock, log.component("pen"));
  parts->space_mouse =
      make_hid_space_mouse({}, *parts->plugs, make_hidapi_system(), clock, log.component("space_mouse"));
  Implementation* self = parts.get();
  parts->camera_plugs = parts->plugs->subscribe("video4linux", [self](PlugChange, const PluggedDevice&) {
    self->cameras_changed = true;
    for (const auto& camera : self->cameras) camera->look_again();
  });
  return std::unique_ptr<DeviceSources>(new DeviceSources(std::move(parts)));
}

std::vector<SampleSource*> DeviceSources::sources() const {
  std::vector<SampleSource*> all;
  for (const auto& camera : implementation_->cameras) all.push_back(camera.get());
  all.push_back(implementation_->glove.get());
  all.push_back(implementation_->pen.get());
  all.push_back(implementation_->space_mouse.get());
  return all;
}

std::vector<DeviceFacts> DeviceSources::facts() {
  implementation_->look_for_unmatched();
  std::vector<DeviceFacts> facts = implementation_->unmatched;
  for (std::size_t i = 0; i < implementation_->cameras.size(); ++i) {
    const V4l2Camera& camera = *implementation_->cameras[i];
    facts.push_back(facts_of(camera.name(), camera.health(), implementation_->calibration, i));
  }
  for (const auto& [device, status] : {std::pair{"glove", implementation_->glove->status()},
                                       std::pair{"pen", implementation_->pen->status()},
                                       std::pair{"space_mouse", implementation_->space_mouse->status()}}) {
    if (!status.identity.empty() || !status.problem.empty()) facts.push_back(facts_of(device, status));
  }
  return facts;
}

void DeviceSources::show(const GloveOutput& output) {
  implementation_->glove->show(output);
}

}  // namespace handloft::tracking
