// HID devices by hidapi's two libraries (hid_device.h).

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <hidapi/hidapi.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <mutex>
#include <string>

#include "daemon-tracking/source/hid/hid_device.h"
#include "daemon-tracking/source/hid/report_descriptor.h"

namespace handloft::tracking {
namespace {

constexpr const char* rules_remedy =
    "install Handloft's udev rules (deploy/README.md), then plug it out and in again";

// The calls of one of the libraries. Never unloaded: libusb's thread may still run in it at the end.
struct Library {
  decltype(&hid_init) init = nullptr;
  decltype(&hid_enumerate) enumerate = nullptr;
  decltype(&hid_free_enumeration) free_enumeration = nullptr;
  decltype(&hid_open_path) open_path = nullptr;
  decltype(&hid_read_timeout) read_timeout = nullptr;
  decltype(&hid_write) write = nullptr;
  decltype(&hid_get_feature_report) get_feature = nullptr;
  decltype(&hid_send_feature_report) send_feature = nullptr;
  decltype(&hid_close) close = nullptr;
  decltype(&hid_error) error = nullptr;
};

template <typename Function>
bool find(void* library, const char* name, Function& to) {
  to = reinterpret_cast<Function>(::dlsym(library, name));
  return to != nullptr;
}

Result<Library> load(const char* file, const char* package) {
  // Local: the two libraries have the same names in them.
  void* opened = ::dlopen(file, RTLD_NOW | RTLD_LOCAL);
  if (opened == nullptr) {
    return make_error(ErrorCode::unsupported, fmt::format("{} is missing: install {}", file, package),
                      "hidapi");
  }
  Library out;
  const bool all =
      find(opened, "hid_init", out.init) && find(opened, "hid_enumerate", out.enumerate) &&
      find(opened, "hid_free_enumeration", out.free_enumeration) &&
      find(opened, "hid_open_path", out.open_path) && find(opened, "hid_read_timeout", out.read_timeout) &&
      find(opened, "hid_write", out.write) && find(opened, "hid_get_feature_report", out.get_feature) &&
      find(opened, "hid_send_feature_report", out.send_feature) && find(opened, "hid_close", out.close) &&
      find(opened, "hid_error", out.error);
  if (!all || out.init() != 0) {
    return make_error(ErrorCode::unsupported, fmt::format("{} is not a hidapi that can be used", file),
                      "hidapi");
  }
  return out;
}

std::string narrow(const wchar_t* wide) {
  std::string out;
  for (; wide != nullptr && *wide != L'\0' && out.size() < 256; ++wide)
    out.push_back(*wide < 0x80 ? static_cast<char>(*wide) : '?');
  return out;
}

class HidapiDevice final : public HidDevice {
 public:
  HidapiDevice(const Library& library, hid_device* device) : library_(library), device_(device) {}
  ~HidapiDevice() override { library_.close(device_); }
  HidapiDevice(const HidapiDevice&) = delete;
  HidapiDevice& operator=(const HidapiDevice&) = delete;

  Result<std::size_t> read(std::span<std::uint8_t> into, std::chrono::milliseconds timeout) override {
    return counted(
        library_.read_timeout(device_, into.data(), into.size(), static_cast<int>(timeout.count())),
        "reading");
  }
  Status write(std::span<const std::uint8_t> report) override {
    return done(library_.write(device_, report.data(), report.size()), "writing an output report");
  }
  Result<std::size_t> get_feature(std::span<std::uint8_t> into) override {
    return counted(library_.get_feature(device_, into.data(), into.size()), "reading a feature report");
  }
  Status set_feature(std::span<const std::uint8_t> report) override {
    return done(library_.send_feature(device_, report.data(), report.size()), "writing a feature report");
  }

 private:
  Error failed(const char* what) const {
    return make_error(ErrorCode::io, fmt::format("{} failed: {}", what, narrow(library_.error(device_))),
                      "hid");
  }
  Result<std::size_t> counted(int size, const char* what) const {
    if (size < 0) return failed(what);
    return static_cast<std::size_t>(size);
  }
  Status done(int size, const char* what) const {
    if (size < 0) return failed(what);
    return {};
  }

  const Library& library_;
  hid_device* device_;
};

class HidapiSystem final : public HidSystem {
 public:
  Result<std::vector<std::uint8_t>> report_descriptor(const PluggedDevice& device) override {
    if (device.subsystem != "hidraw") return std::vector<std::uint8_t>();
    std::ifstream file(device.syspath + "/device/report_descriptor", std::ios::binary);
    if (!file) {
      return make_error(ErrorCode::not_found, "its report descriptor is gone with it", device.devnode);
    }
    std::array<char, max_report_descriptor> bytes{};
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + file.gcount());
  }

  Result<std::unique_ptr<HidDevice>> open(const PluggedDevice& device) override {
    return device.subsystem == "usb" ? open_usb(device) : open_hidraw(device);
  }

 private:
  Result<std::unique_ptr<HidDevice>> open_hidraw(const PluggedDevice& device) {
    const Result<const Library*> library = get(hidraw_, "libhidapi-hidraw.so.0", "libhidapi-hidraw0");
    if (!library) return library.error();
    hid_device* opened = (*library)->open_path(device.devnode.c_str());
    if (opened != nullptr) return std::unique_ptr<HidDevice>(new HidapiDevice(**library, opened));
    // hidapi tells no reason by number; the system does.
    const int direct = ::open(device.devnode.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
    const int reason = direct < 0 ? errno : 0;
    if (direct >= 0) ::close(direct);
    if (reason == EACCES || reason == EPERM) {
      return make_error(ErrorCode::permission_denied,
                        fmt::format("{} may not be opened by this user: {}", device.devnode, rules_remedy),
                        device.devnode);
    }
    if (reason == ENOENT || reason == ENODEV || reason == ENXIO) {
      return make_error(ErrorCode::not_found, fmt::format("{} is gone again", device.devnode),
                        device.devnode);
    }
    return make_error(ErrorCode::io,
                      fmt::format("{} does not open: {}", device.devnode,
                                  reason == 0 ? std::string("no reason given") : std::strerror(reason)),
                      device.devnode);
  }

  Result<std::unique_ptr<HidDevice>> open_usb(const PluggedDevice& device) {
    const Result<const Library*> library = get(libusb_, "libhidapi-libusb.so.0", "libhidapi-libusb0");
    if (!library) return library.error();
    hid_device_info* all = (*library)->enumerate(device.vendor_id, device.product_id);
    // "1-2:1.0" is the first interface of the device in port 2 of bus 1, whose path_id is "usb-1-2".
    const std::string port = device.path_id.substr(std::min<std::size_t>(4, device.path_id.size())) + ":";
    std::string path;
    for (const hid_device_info* each = all; each != nullptr; each = each->next) {
      if (path.empty() && std::string_view(each->path).starts_with(port)) path = each->path;
    }
    (*library)->free_enumeration(all);
    if (path.empty()) {
      return make_error(ErrorCode::not_found,
                        fmt::format("{} has no HID interface that libusb can see", describe(device)),
                        device.devnode);
    }
    hid_device* opened = (*library)->open_path(path.c_str());
    if (opened != nullptr) return std::unique_ptr<HidDevice>(new HidapiDevice(**library, opened));
    if (::access(device.devnode.c_str(), R_OK | W_OK) != 0 && errno == EACCES) {
      return make_error(ErrorCode::permission_denied,
                        fmt::format("{} may not be opened by this user: {}", device.devnode, rules_remedy),
                        device.devnode);
    }
    return make_error(ErrorCode::io,
                      fmt::format("{} does not open through libusb; another program may hold it", path),
                      device.devnode);
  }

  Result<const Library*> get(std::optional<Result<Library>>& slot, const char* file, const char* package) {
    const std::lock_guard lock(loading_);
    if (!slot) slot = load(file, package);
    if (!*slot) return slot->error();
    return &slot->value();
  }

  std::mutex loading_;
  std::optional<Result<Library>> hidraw_, libusb_;
};

}  // namespace

std::shared_ptr<HidSystem> make_hidapi_system() {
  return std::make_shared<HidapiSystem>();
}

}  // namespace handloft::tracking
