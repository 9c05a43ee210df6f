// A USB glove on the kernel's dummy USB controller (dummy_hcd, libcomposite, usb_f_fs), by FunctionFS: real
// usbhid, hidraw and libusb see the very device that the firmware makes, with its descriptors, feature and
// output reports. As root, in the guest. See control.h; its own commands:
//
//   force N, pot N, contacts BITS     what the reports say from now on
//   restart                           the device's time and sequence begin anew
//   corrupt N                         the next N reports have a wrong checksum
//   skip N                            the sequence jumps by N
//   silence on|off                    it stays plugged in, but sends nothing
//
// Says: "plugged", "unplugged", "output R G B VIBRATION MS", "range ZERO FULL LOW HIGH CALIBRATED", "sent N"
// (at an unplug).

#include <endian.h>
#include <fmt/format.h>
#include <linux/usb/ch9.h>
#include <linux/usb/functionfs.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>

#include "daemon-tracking/source/glove_report.h"
#include "tests/hardware/devices/control.h"

using namespace handloft;
using namespace handloft::tracking;
namespace fs = std::filesystem;

namespace {

constexpr Duration period = std::chrono::milliseconds(4);
constexpr std::uint8_t hid_get_report = 1, hid_set_report = 9, hid_set_idle = 10, hid_set_protocol = 11;
constexpr std::uint16_t feature_range = 3u << 8 | glove_range_id, output_report = 2u << 8 | glove_output_id;
constexpr std::uint8_t report_descriptor_kind = 0x22;

struct HidDescriptor {
  std::uint8_t length, kind;
  std::uint16_t version;
  std::uint8_t country, count, report_kind;
  std::uint16_t report_length;
} __attribute__((packed));

struct SpeedDescriptors {
  usb_interface_descriptor interface;
  HidDescriptor hid;
  usb_endpoint_descriptor_no_audio in, out;
} __attribute__((packed));

struct Descriptors {
  usb_functionfs_descs_head_v2 head;
  std::uint32_t full_speed_count, high_speed_count;
  SpeedDescriptors full_speed, high_speed;
} __attribute__((packed));

struct Strings {
  usb_functionfs_strings_head head;
  std::uint16_t language;
  char name[6];
} __attribute__((packed));

void write_file(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  if (!file) test::give_up(path.string());
}

// The gadget in configfs: what the computer reads before it comes to our endpoints.
class Gadget {
 public:
  explicit Gadget(std::string name)
      : folder_("/sys/kernel/config/usb_gadget/" + name), endpoints_("/dev/ffs-" + name) {
    if (!fs::exists("/sys/kernel/config/usb_gadget")) {
      if (::mount("none", "/sys/kernel/config", "configfs", 0, nullptr) != 0 && errno != EBUSY)
        test::give_up("configfs");
    }
    fs::create_directories(folder_ / "strings/0x409");
    fs::create_directories(folder_ / "configs/c.1");
    fs::create_directories(folder_ / "functions/ffs.glove");
    write_file(folder_ / "idVendor", fmt::format("{:#06x}", glove_usb_vendor));
    write_file(folder_ / "idProduct", fmt::format("{:#06x}", glove_usb_product));
    write_file(folder_ / "strings/0x409/serialnumber", "GADGET1");
    write_file(folder_ / "strings/0x409/manufacturer", "Handloft");
    write_file(folder_ / "strings/0x409/product", "Handloft Glove");
    if (!fs::exists(folder_ / "configs/c.1/ffs.glove"))
      fs::create_symlink(folder_ / "functions/ffs.glove", folder_ / "configs/c.1/ffs.glove");
    fs::create_directories(endpoints_);
    if (::mount("glove", endpoints_.c_str(), "functionfs", 0, nullptr) != 0 && errno != EBUSY)
      test::give_up("functionfs");
  }
  fs::path endpoint(int number) const { return endpoints_ / fmt::format("ep{}", number); }

  bool plug() const { return bind(fs::directory_iterator("/sys/class/udc")->path().filename().string()); }
  bool unplug() const { return bind(""); }

 private:
  bool bind(const std::string& controller) const {
    const int fd = ::open((folder_ / "UDC").c_str(), O_WRONLY | O_CLOEXEC);
    const std::string text = controller + "\n";
    const bool good = fd >= 0 && ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    if (fd >= 0) ::close(fd);
    return good;
  }
  fs::path folder_, endpoints_;
};

class Glove {
 public:
  explicit Glove(const Gadget& gadget) : gadget_(gadget) {
    control_ = ::open(gadget.endpoint(0).c_str(), O_RDWR | O_CLOEXEC);
    if (control_ < 0) test::give_up("ep0");
    write_descriptors();
    in_ = ::open(gadget.endpoint(1).c_str(), O_RDWR | O_CLOEXEC);
    out_ = ::open(gadget.endpoint(2).c_str(), O_RDWR | O_CLOEXEC);
    if (in_ < 0 || out_ < 0) test::give_up("ep1, ep2");
    std::thread([this] { serve(); }).detach();
    std::thread([this] { take_outputs(); }).detach();
    std::thread([this] { send_all(); }).detach();
  }

  bool enabled() const { return enabled_.load(); }

  void command(const std::string& line) {
    std::istringstream words(line);
    std::string name;
    unsigned value = 0;
    words >> name;
    // Binding asks us for descriptors: without the lock.
    if (name == "plug")
      return test::say(gadget_.plug() ? "plugged" : fmt::format("plug failed: {}", std::strerror(errno)));
    if (name == "unplug") {
      test::say(gadget_.unplug() ? "unplugged" : fmt::format("unplug failed: {}", std::strerror(errno)));
      const std::lock_guard lock(mutex_);
      return test::say(fmt::format("sent {}", sent_));
    }
    const std::lock_guard lock(mutex_);
    if (name == "force" && words >> value) {
      report_.force = static_cast<std::uint16_t>(value);
    } else if (name == "pot" && words >> value) {
      report_.potentiometer = static_cast<std::uint16_t>(value);
    } else if (name == "contacts" && words >> value) {
      report_.contacts = static_cast<std::uint16_t>(value);
    } else if (name == "corrupt" && words >> value) {
      corrupt_ = value;
    } else if (name == "skip" && words >> value) {
      report_.sequence = static_cast<std::uint16_t>(report_.sequence + value);
    } else if (name == "restart") {
      report_.sequence = 0;
      begun_ = SystemClock().now();
      restarted_ = true;
    } else if (name == "silence") {
      std::string on;
      words >> on;
      silent_ = on == "on";
    } else {
      test::say("unknown command: " + line);
    }
  }

  // On a thread of its own: it waits while the computer fetches nothing.
  [[noreturn]] void send_all() {
    while (true) {
      next_ = std::max(next_ + period, SystemClock().now());
      std::this_thread::sleep_for(next_ - SystemClock().now());
      if (enabled()) send(SystemClock().now());
    }
  }

 private:
  void send(TimePoint now) {
    std::array<std::uint8_t, glove_report_size> bytes{};
    bool corrupted = false;
    {
      const std::lock_guard lock(mutex_);
      if (silent_) return;
      report_.device_time_us = static_cast<std::uint32_t>(
          std::chrono::duration_cast<std::chrono::microseconds>(now - begun_).count());
      report_.flags = restarted_ ? glove_restarted : 0;
      bytes = encode_glove_report(report_);
      corrupted = corrupt_ > 0;
      if (corrupted) bytes.back() ^= 0xFF;
    }
    if (::write(in_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) return;
    const std::lock_guard lock(mutex_);
    ++report_.sequence;
    ++sent_;
    if ((report_.flags & glove_restarted) != 0) restarted_ = false;
    if (corrupted) --corrupt_;
  }

  void write_descriptors() const {
    Descriptors all{};
    all.head.magic = htole32(FUNCTIONFS_DESCRIPTORS_MAGIC_V2);
    all.head.length = htole32(sizeof all);
    all.head.flags = htole32(FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC);
    all.full_speed_count = all.high_speed_count = htole32(4);
    const auto fill = [](SpeedDescriptors& speed, std::uint8_t interval) {
      speed.interface.bLength = sizeof speed.interface;
      speed.interface.bDescriptorType = USB_DT_INTERFACE;
      speed.interface.bNumEndpoints = 2;
      speed.interface.bInterfaceClass = USB_CLASS_HID;
      speed.interface.iInterface = 1;
      speed.hid = {sizeof speed.hid,
                   0x21,
                   htole16(0x0111),
                   0,
                   1,
                   report_descriptor_kind,
                   htole16(static_cast<std::uint16_t>(glove_report_descriptor().size()))};
      speed.in.bLength = speed.out.bLength = sizeof speed.in;
      speed.in.bDescriptorType = speed.out.bDescriptorType = USB_DT_ENDPOINT;
      speed.in.bEndpointAddress = 1 | USB_DIR_IN;
      speed.out.bEndpointAddress = 2 | USB_DIR_OUT;
      speed.in.bmAttributes = speed.out.bmAttributes = USB_ENDPOINT_XFER_INT;
      speed.in.wMaxPacketSize = speed.out.wMaxPacketSize = htole16(64);
      speed.in.bInterval = speed.out.bInterval = interval;
    };
    fill(all.full_speed, 1);
    fill(all.high_speed, 4);  // 2^3 microframes: 1 ms.
    if (::write(control_, &all, sizeof all) < 0) test::give_up("descriptors");
    Strings strings{};
    strings.head.magic = htole32(FUNCTIONFS_STRINGS_MAGIC);
    strings.head.length = htole32(sizeof strings);
    strings.head.str_count = strings.head.lang_count = htole32(1);
    strings.language = htole16(0x0409);
    std::memcpy(strings.name, "Glove", sizeof strings.name);
    if (::write(control_, &strings, sizeof strings) < 0) test::give_up("strings");
  }

  // The wrong direction stalls the control endpoint.
  void stall(const usb_ctrlrequest& request) const {
    char nothing = 0;
    [[maybe_unused]] const ssize_t done = (request.bRequestType & USB_DIR_IN) != 0
                                              ? ::read(control_, &nothing, 0)
                                              : ::write(control_, &nothing, 0);
  }

  void answer(std::span<const std::uint8_t> bytes, std::size_t asked) const {
    [[maybe_unused]] const ssize_t done = ::write(control_, bytes.data(), std::min(bytes.size(), asked));
  }

  void handle(const usb_ctrlrequest& request) {
    const std::uint16_t value = le16toh(request.wValue);
    const std::size_t length = le16toh(request.wLength);
    const bool of_class = (request.bRequestType & USB_TYPE_MASK) == USB_TYPE_CLASS;
    if (!of_class && request.bRequest == USB_REQ_GET_DESCRIPTOR && value >> 8 == report_descriptor_kind) {
      answer(glove_report_descriptor(), length);
    } else if (of_class && request.bRequest == hid_get_report && value == feature_range) {
      const std::lock_guard lock(mutex_);
      answer(encode_glove_range(range_), length);
    } else if (of_class && request.bRequest == hid_set_report) {
      std::array<std::uint8_t, 256> bytes{};
      const ssize_t size = ::read(control_, bytes.data(), std::min(length, bytes.size()));
      if (size > 0) take(value, std::span(bytes).first(static_cast<std::size_t>(size)));
    } else if (of_class && (request.bRequest == hid_set_idle || request.bRequest == hid_set_protocol)) {
      char nothing = 0;
      [[maybe_unused]] const ssize_t done = ::read(control_, &nothing, 0);
    } else {
      stall(request);
    }
  }

  void take(std::uint16_t value, std::span<const std::uint8_t> bytes) {
    if (value == feature_range) {
      const auto range = parse_glove_range(bytes);
      if (!range) return test::say("refused range: " + range.error().describe());
      const std::lock_guard lock(mutex_);
      range_ = *range;
      test::say(fmt::format("range {} {} {} {} {}", range_.force_zero, range_.force_full,
                            range_.potentiometer_low, range_.potentiometer_high, range_.calibrated ? 1 : 0));
    } else if (value == output_report) {
      show(bytes);
    }
  }

  static void show(std::span<const std::uint8_t> bytes) {
    const auto output = parse_glove_output(bytes);
    if (!output) return test::say("refused output: " + output.error().describe());
    test::say(fmt::format("output {} {} {} {} {}", output->red, output->green, output->blue,
                          output->vibration, output->vibration_ms));
  }

  void serve() {
    usb_functionfs_event event{};
    while (::read(control_, &event, sizeof event) == static_cast<ssize_t>(sizeof event)) {
      if (event.type == FUNCTIONFS_ENABLE) enabled_.store(true);
      if (event.type == FUNCTIONFS_DISABLE || event.type == FUNCTIONFS_UNBIND) enabled_.store(false);
      if (event.type == FUNCTIONFS_SETUP) handle(event.u.setup);
    }
  }

  void take_outputs() {
    std::array<std::uint8_t, 64> bytes{};
    while (true) {
      const ssize_t size = ::read(out_, bytes.data(), bytes.size());
      if (size > 0) {
        show(std::span(bytes).first(static_cast<std::size_t>(size)));
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));  // Unplugged.
      }
    }
  }

  const Gadget& gadget_;
  int control_ = -1, in_ = -1, out_ = -1;
  std::atomic<bool> enabled_{false};
  std::mutex mutex_;
  GloveRange range_;
  GloveReport report_;
  TimePoint begun_ = SystemClock().now();
  TimePoint next_ = begun_;  // The sending thread's.
  std::uint64_t sent_ = 0;
  unsigned corrupt_ = 0;
  bool restarted_ = true;
  bool silent_ = false;
};

}  // namespace

int main() {
  const Gadget gadget("handloft-glove");
  Glove glove(gadget);
  test::say("ready");
  test::Commands commands;
  while (!commands.ended()) {
    for (const std::string& line : commands.wait(SystemClock().now() + std::chrono::seconds(1)))
      glove.command(line);
  }
  (void)gadget.unplug();
  std::_Exit(0);  // Threads wait in the kernel.
}
