#include "daemon-tracking/main/doctor_checks.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "daemon-tracking/main/device_sources.h"
#include "daemon-tracking/source/camera/v4l2_modes.h"

namespace handloft::tracking {

namespace {

constexpr const char* permission_remedy =
    "install the udev rules (cmake --install, then `sudo udevadm control --reload && sudo udevadm trigger`) "
    "and "
    "log in at this computer's own screen; over ssh, `sudo usermod -aG video,input $USER` and log in anew";

Finding ok(std::string subject, std::string words) {
  return {Finding::Level::ok, std::move(subject), std::move(words), {}};
}
Finding warn(std::string subject, std::string words, std::string remedy) {
  return {Finding::Level::warn, std::move(subject), std::move(words), std::move(remedy)};
}
Finding fail(std::string subject, std::string words, std::string remedy) {
  return {Finding::Level::fail, std::move(subject), std::move(words), std::move(remedy)};
}

std::vector<V4l2Node> nodes_of(const std::vector<V4l2CameraInfo>& cameras) {
  std::vector<V4l2Node> nodes;
  for (const V4l2CameraInfo& camera : cameras) nodes.push_back(camera.node);
  return nodes;
}

// The capture node among those of the camera that `record` means.
const V4l2CameraInfo* find_camera(const Calibration& calibration, std::size_t index,
                                  const std::vector<V4l2CameraInfo>& cameras, std::string& why_not) {
  const V4l2CameraOptions options = camera_options(calibration, index);
  const Result<NodeMatch> match = match_camera(nodes_of(cameras), options.selector, options.mismatch);
  if (!match) {
    why_not = match.error().message;
    return nullptr;
  }
  const V4l2CameraInfo* found = nullptr;
  for (const V4l2CameraInfo& camera : cameras)
    for (const V4l2Node& node : match->nodes)
      if (camera.node.node == node.node && (found == nullptr || !found->unusable.empty())) found = &camera;
  return found;
}

bool has_mode(const V4l2CameraInfo& camera, const CameraCalibration& calibrated, const CameraRecord& record) {
  constexpr double rate_tolerance_hz = 0.5;
  for (const VideoSize& size : camera.sizes) {
    if (size.format != record.format || size.width_px != calibrated.intrinsics.width_px ||
        size.height_px != calibrated.intrinsics.height_px)
      continue;
    for (const double rate : size.rates_hz)
      if (rate >= record.frames_per_s - rate_tolerance_hz) return true;
  }
  return false;
}

Finding check_camera(const Calibration& calibration, std::size_t index,
                     const std::vector<V4l2CameraInfo>& cameras) {
  const CameraCalibration& calibrated = calibration.rig.cameras[index];
  const CameraRecord& record = calibration.cameras[index];
  const std::string subject = "camera " + calibrated.name;
  std::string why_not;
  const V4l2CameraInfo* camera = find_camera(calibration, index, cameras, why_not);
  if (camera == nullptr) {
    return fail(
        subject, "is not plugged in: " + why_not,
        "plug in the camera that was calibrated, or calibrate the one there is with handloft-calibrate");
  }
  if (!camera->unusable.empty())
    return fail(subject, fmt::format("{} can't be used: {}", camera->node.node, camera->unusable),
                permission_remedy);
  const VideoMode mode{record.format, calibrated.intrinsics.width_px, calibrated.intrinsics.height_px,
                       record.frames_per_s};
  if (!has_mode(*camera, calibrated, record)) {
    return fail(subject,
                fmt::format("{} has no {}, with which it was calibrated", camera->node.node, to_string(mode)),
                "plug it into a USB port of its own, or calibrate it in a mode that it has (`handloft-trackd "
                "devices` lists them)");
  }
  for (const auto& [step, result] : record.results) {
    if (result.verdict == tracking::Verdict::bad)
      return warn(subject, fmt::format("its {} came out badly: {}", step, result.words),
                  "repeat that step with handloft-calibrate");
  }
  return ok(subject, fmt::format("{} at {}, {}", camera->identity, camera->node.node, to_string(mode)));
}

std::string first_line(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

}  // namespace

std::vector<Finding> check_calibrated_cameras(const Result<Calibration>& calibration,
                                              const std::vector<V4l2CameraInfo>& cameras) {
  std::vector<Finding> findings;
  if (!calibration) {
    findings.push_back(fail("calibration", calibration.error().message,
                            "calibrate with handloft-calibrate; its first step prints the boards"));
    for (const V4l2CameraInfo& camera : cameras) {
      const std::string subject = "camera " + camera.node.node;
      findings.push_back(camera.unusable.empty() ? ok(subject, camera.identity)
                                                 : fail(subject, camera.unusable, permission_remedy));
    }
    return findings;
  }
  findings.push_back(ok(
      "calibration", fmt::format("of {}, {} cameras", calibration->date, calibration->rig.cameras.size())));
  for (std::size_t i = 0; i < calibration->rig.cameras.size(); ++i)
    findings.push_back(check_camera(*calibration, i, cameras));
  for (const DeviceFacts& facts : unmatched_cameras(nodes_of(cameras), *calibration)) {
    findings.push_back(
        warn("camera " + facts.identity, facts.problem, "add it with handloft-calibrate, or unplug it"));
  }
  return findings;
}

std::vector<Finding> check_usb_bandwidth(const Calibration& calibration,
                                         const std::vector<V4l2CameraInfo>& cameras) {
  std::map<std::string, BusShare> buses;
  for (std::size_t i = 0; i < calibration.rig.cameras.size(); ++i) {
    std::string why_not;
    const V4l2CameraInfo* camera = find_camera(calibration, i, cameras, why_not);
    if (camera == nullptr || camera->node.bus.empty()) continue;
    BusShare& bus = buses[camera->node.bus];
    bus.bus = camera->node.bus;
    if (camera->node.bus_speed_mbit_s > 0.0) bus.speed_mbit_s = camera->node.bus_speed_mbit_s;
    const CameraIntrinsics& lens = calibration.rig.cameras[i].intrinsics;
    bus.modes.push_back(
        {calibration.cameras[i].format, lens.width_px, lens.height_px, calibration.cameras[i].frames_per_s});
  }
  std::vector<Finding> findings;
  for (const auto& [name, bus] : buses) {
    const std::string problem = bus_problem(bus);
    const std::string subject = "USB bus " + name;
    findings.push_back(
        problem.empty() ? ok(subject, fmt::format("{} cameras fit through it", bus.modes.size()))
                        : warn(subject, problem, "spread the cameras over ports of different controllers"));
  }
  return findings;
}

std::vector<Finding> check_inputs(const std::vector<InputDevice>& inputs, const MayOpen& may_open) {
  std::vector<Finding> findings;
  std::set<InputKind> found;
  for (const InputDevice& input : inputs) {
    if (input.kind == InputKind::serial_line) continue;
    found.insert(input.kind);
    const std::string subject(to_string(input.kind));
    if (may_open(input.device.devnode)) {
      findings.push_back(ok(subject, describe(input.device)));
    } else {
      findings.push_back(fail(subject, fmt::format("{} may not be opened by this user", input.device.devnode),
                              permission_remedy));
    }
  }
  if (!found.contains(InputKind::glove)) {
    findings.push_back(warn("glove", "none is plugged in",
                            "plug it in; a LucidGloves-compatible one is named with --serial-glove"));
  }
  for (const InputKind kind : {InputKind::pen, InputKind::space_mouse})
    if (!found.contains(kind))
      findings.push_back(ok(std::string(to_string(kind)), "none is plugged in; none is needed"));
  return findings;
}

Finding check_udev_rules(const std::filesystem::path& root) {
  constexpr std::array folders{"etc/udev/rules.d", "run/udev/rules.d", "usr/lib/udev/rules.d",
                               "lib/udev/rules.d", "usr/local/lib/udev/rules.d"};
  for (const char* folder : folders) {
    std::error_code missing;
    for (std::filesystem::directory_iterator it(root / folder, missing), end; !missing && it != end;
         it.increment(missing)) {
      const std::string name = it->path().filename().string();
      if (name.find("handloft") != std::string::npos && name.ends_with(".rules"))
        return ok("udev rules", (root / folder / name).string());
    }
  }
  return warn(
      "udev rules", "ours are not installed, so devices may be closed to this user",
      "cmake --install, or copy deploy/udev/70-handloft.rules to /etc/udev/rules.d; then `sudo udevadm "
      "control --reload && sudo udevadm trigger`");
}

Finding check_runtime_folder(const char* runtime) {
  constexpr const char* subject = "runtime folder";
  if (runtime == nullptr || runtime[0] != '/') {
    return warn(subject, "XDG_RUNTIME_DIR is not set; sockets go to a folder in /tmp",
                "log in through systemd (pam_systemd), or set it to a folder of mode 0700 of your own");
  }
  struct stat status {};
  if (stat(runtime, &status) != 0 || !S_ISDIR(status.st_mode))
    return fail(subject, fmt::format("{} is no folder", runtime), "log in anew, or set XDG_RUNTIME_DIR");
  if (status.st_uid != geteuid())
    return fail(subject, fmt::format("{} belongs to another user", runtime),
                "don't use sudo: the daemon runs as the user who works with it");
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return fail(subject, fmt::format("{} is open to others", runtime), fmt::format("chmod 0700 {}", runtime));
  return ok(subject, runtime);
}

std::vector<Finding> check_machine(const std::filesystem::path& root, unsigned processors) {
  std::vector<Finding> findings;
  constexpr unsigned fewest_processors = 2;
  if (processors < fewest_processors) {
    findings.push_back(warn("processors", fmt::format("{} processor", processors),
                            "four cameras need two; use fewer cameras or lower rates"));
  } else {
    findings.push_back(ok("processors", fmt::to_string(processors)));
  }
  const std::string governor = first_line(root / "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  // intel_pstate and amd-pstate in active mode scale by load under this name too.
  const std::string driver = first_line(root / "sys/devices/system/cpu/cpu0/cpufreq/scaling_driver");
  const bool sleepy =
      governor == "powersave" && !driver.starts_with("intel_pstate") && !driver.starts_with("amd-pstate");
  findings.push_back(sleepy ? warn("CPU governor", "powersave: processors stay at their lowest frequency",
                                   "`sudo cpupower frequency-set -g schedutil`, or performance")
                            : ok("CPU governor", governor.empty() ? "none" : governor));
  const std::string source =
      first_line(root / "sys/devices/system/clocksource/clocksource0/current_clocksource");
  const bool slow = source == "hpet" || source == "acpi_pm" || source == "jiffies";
  findings.push_back(
      slow ? warn("clock", fmt::format("{}: slow to read and coarse", source),
                  "boot with tsc=reliable, or find out with `dmesg | grep -i tsc` why the kernel left tsc")
           : ok("clock", source.empty() ? "CLOCK_MONOTONIC" : "CLOCK_MONOTONIC by " + source));
  return findings;
}

Finding check_hid_library(const std::function<bool(const char* name)>& can_load) {
  if (can_load("libhidapi-hidraw.so.0")) return ok("hidapi", "libhidapi-hidraw");
  return fail("hidapi", "libhidapi-hidraw.so.0 can't be loaded, so gloves and 3D mice are not followed",
              "sudo apt install libhidapi-hidraw0");
}

Finding check_socket(const std::string& endpoint, const std::optional<Error>& answer) {
  if (!answer) return ok("daemon", "runs at " + endpoint);
  if (answer->code == ErrorCode::not_found)
    return ok("daemon", "does not run at " + endpoint + "; `systemctl --user start handloft-trackd`");
  return fail("daemon", answer->message, "end what listens at " + endpoint + ", or use another --listen");
}

std::string findings_text(const std::vector<Finding>& findings) {
  constexpr std::array marks{"ok  ", "warn", "FAIL"};
  fmt::memory_buffer out;
  for (const Finding& finding : findings) {
    fmt::format_to(std::back_inserter(out), "{}  {}: {}\n", marks.at(static_cast<std::size_t>(finding.level)),
                   printable(finding.subject), printable(finding.words));
    if (!finding.remedy.empty()) fmt::format_to(std::back_inserter(out), "      -> {}\n", finding.remedy);
  }
  return fmt::to_string(out);
}

std::string findings_json(const std::vector<Finding>& findings) {
  constexpr std::array levels{"ok", "warn", "fail"};
  nlohmann::json document = nlohmann::json::array();
  for (const Finding& finding : findings) {
    document.push_back({{"level", levels.at(static_cast<std::size_t>(finding.level))},
                        {"subject", finding.subject},
                        {"words", finding.words},
                        {"remedy", finding.remedy}});
  }
  return document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

bool any_failed(const std::vector<Finding>& findings) {
  for (const Finding& finding : findings)
    if (finding.level == Finding::Level::fail) return true;
  return false;
}

}  // namespace handloft::tracking
