#include "daemon-tracking/main/doctor_command.h"

#include <dlfcn.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <thread>

#include "common/net/endpoint.h"
#include "daemon-tracking/main/doctor_checks.h"
#include "daemon-tracking/main/exit_status.h"
#include "daemon-tracking/main/sources.h"
#include "daemon-tracking/main/status_command.h"

namespace handloft::tracking {

namespace {

void append(std::vector<Finding>& all, std::vector<Finding> more) {
  for (Finding& finding : more) all.push_back(std::move(finding));
}

bool can_load(const char* name) {
  void* library = dlopen(name, RTLD_LAZY | RTLD_LOCAL);
  if (library != nullptr) dlclose(library);
  return library != nullptr;
}

Finding ask_daemon(const DaemonOptions& options, const Clock& clock) {
  const Result<net::Endpoint> endpoint =
      options.listen.empty() ? net::default_tracking_endpoint() : net::parse_endpoint(options.listen);
  if (!endpoint)
    return {Finding::Level::fail, "daemon", endpoint.error().message, "see `--listen` in --help"};
  const Result<v1::TrackingFrame> answer = ask_status(options, clock);
  return check_socket(endpoint->to_string(), answer ? std::nullopt : std::optional<Error>(answer.error()));
}

}  // namespace

int run_doctor(const DaemonOptions& options, const Clock& clock) {
  std::vector<Finding> findings;
  const Result<FoundDevices> found = find_devices();
  if (!found) {
    findings.push_back({Finding::Level::fail, "devices", found.error().describe(),
                        "make /sys readable and netlink sockets allowed for this program"});
  }
  const FoundDevices devices = found ? *found : FoundDevices{};
  if (options.cameras) {
    const Result<Calibration> calibration = load_lab(options);
    append(findings, check_calibrated_cameras(calibration, devices.cameras));
    if (calibration) append(findings, check_usb_bandwidth(*calibration, devices.cameras));
  }
  append(findings, check_inputs(devices.inputs, [](const std::string& node) {
           return access(node.c_str(), R_OK | W_OK) == 0;
         }));
  findings.push_back(check_hid_library(can_load));
  findings.push_back(check_udev_rules("/"));
  findings.push_back(check_runtime_folder(std::getenv("XDG_RUNTIME_DIR")));
  findings.push_back(ask_daemon(options, clock));
  append(findings, check_machine("/", std::thread::hardware_concurrency()));
  std::fputs((options.json ? findings_json(findings) : findings_text(findings)).c_str(), stdout);
  return any_failed(findings) ? exit_failed : exit_ok;
}

}  // namespace handloft::tracking
