// A HID device without a bus, through /dev/uhid: real hid-generic and hidraw, no USB. As root, in the guest.
// See control.h. `uhid_device space_mouse [split|combined]`: a SpaceExplorer or a SpaceMouse (the
// SpaceNavigator's numbers are for the kernel's driver of Logitech's USB devices, which wants a bus). Its own
// commands:
//
//   axes X Y Z RX RY RZ   one sample, raw values of the cap's axes
//   buttons BITS
//
// `uhid_device foreign`: something that bears the glove's numbers and isn't one.

#include <fmt/format.h>
#include <linux/input.h>
#include <linux/uhid.h>

#include <array>
#include <cstring>
#include <span>

#include "daemon-tracking/source/glove_report.h"
#include "tests/hardware/devices/control.h"

using namespace handloft;

namespace {

// clang-format off
// Multi-axis controllers: three axes in each of two reports, or six in one; buttons in report 3.
constexpr std::uint8_t split_descriptor[] = {
    0x05, 0x01, 0x09, 0x08, 0xA1, 0x01,                          // Generic desktop, multi-axis controller
    0x16, 0xA2, 0xFE, 0x26, 0x5E, 0x01, 0x75, 0x10, 0x95, 0x03,  // -350..350, 3 of 16 bits
    0x85, 0x01, 0x09, 0x30, 0x09, 0x31, 0x09, 0x32, 0x81, 0x02,  // X, Y, Z
    0x85, 0x02, 0x09, 0x33, 0x09, 0x34, 0x09, 0x35, 0x81, 0x02,  // Rx, Ry, Rz
    0x85, 0x03, 0x05, 0x09, 0x19, 0x01, 0x29, 0x10, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x10, 0x81, 0x02,
    0xC0};
constexpr std::uint8_t combined_descriptor[] = {
    0x05, 0x01, 0x09, 0x08, 0xA1, 0x01,
    0x16, 0xA2, 0xFE, 0x26, 0x5E, 0x01, 0x75, 0x10, 0x95, 0x06,
    0x85, 0x01, 0x09, 0x30, 0x09, 0x31, 0x09, 0x32, 0x09, 0x33, 0x09, 0x34, 0x09, 0x35, 0x81, 0x02,
    0x85, 0x03, 0x05, 0x09, 0x19, 0x01, 0x29, 0x10, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x10, 0x81, 0x02,
    0xC0};
constexpr std::uint8_t foreign_descriptor[] = {
    0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01, 0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, 0x08, 0x09, 0x02,
    0x81, 0x02, 0xC0};
// clang-format on

struct Kind {
  std::string name;
  std::uint16_t vendor, product;
  std::span<const std::uint8_t> descriptor;
};

class Device {
 public:
  explicit Device(Kind kind)
      : kind_(std::move(kind)), fd_(::open("/dev/uhid", O_RDWR | O_CLOEXEC | O_NONBLOCK)) {
    if (fd_ < 0) test::give_up("/dev/uhid");
  }
  int fd() const { return fd_; }

  void plug() {
    uhid_event event{};
    event.type = UHID_CREATE2;
    auto& create = event.u.create2;
    std::memcpy(create.name, kind_.name.c_str(), std::min(kind_.name.size(), sizeof create.name - 1));
    std::memcpy(create.uniq, "UHID1", 5);
    std::memcpy(create.rd_data, kind_.descriptor.data(), kind_.descriptor.size());
    create.rd_size = static_cast<std::uint16_t>(kind_.descriptor.size());
    create.bus = BUS_USB;
    create.vendor = kind_.vendor;
    create.product = kind_.product;
    put(event);
    test::say("plugged");
  }
  void unplug() {
    uhid_event event{};
    event.type = UHID_DESTROY;
    put(event);
    test::say("unplugged");
  }
  void send(std::span<const std::uint8_t> report) {
    uhid_event event{};
    event.type = UHID_INPUT2;
    event.u.input2.size = static_cast<std::uint16_t>(report.size());
    std::memcpy(event.u.input2.data, report.data(), report.size());
    put(event);
  }
  // What the kernel asks: there are no features.
  void serve() {
    uhid_event event{};
    while (::read(fd_, &event, sizeof event) > 0) {
      uhid_event reply{};
      if (event.type == UHID_GET_REPORT) {
        reply.type = UHID_GET_REPORT_REPLY;
        reply.u.get_report_reply.id = event.u.get_report.id;
        reply.u.get_report_reply.err = EIO;
        put(reply);
      } else if (event.type == UHID_SET_REPORT) {
        reply.type = UHID_SET_REPORT_REPLY;
        reply.u.set_report_reply.id = event.u.set_report.id;
        reply.u.set_report_reply.err = EIO;
        put(reply);
      }
    }
  }

 private:
  void put(const uhid_event& event) const {
    if (::write(fd_, &event, sizeof event) < 0) test::give_up("uhid");
  }
  Kind kind_;
  int fd_;
};

void put_axes(std::vector<std::uint8_t>& to, std::span<const int> axes) {
  for (const int axis : axes) {
    to.push_back(static_cast<std::uint8_t>(axis & 0xFF));
    to.push_back(static_cast<std::uint8_t>(axis >> 8 & 0xFF));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const bool combined = argc > 2 && std::string(argv[2]) == "combined";
  if (what != "space_mouse" && what != "foreign") {
    std::fputs("uhid_device space_mouse [split|combined] | foreign\n", stderr);
    return 2;
  }
  Device device(what == "foreign" ? Kind{"Acme Thing", tracking::glove_usb_vendor,
                                         tracking::glove_usb_product, foreign_descriptor}
                : combined        ? Kind{"SpaceMouse Compact", 0x256F, 0xC635, combined_descriptor}
                                  : Kind{"SpaceExplorer", 0x046D, 0xC627, split_descriptor});
  test::say("ready");
  test::Commands commands;
  bool plugged = false;
  while (!commands.ended()) {
    const TimePoint soon = SystemClock().now() + std::chrono::milliseconds(100);
    for (const std::string& line : commands.wait(soon, device.fd())) {
      std::istringstream words(line);
      std::string name;
      words >> name;
      std::array<int, 6> axes{};
      unsigned bits = 0;
      if (name == "plug") {
        device.plug();
        plugged = true;
      } else if (name == "unplug") {
        device.unplug();
        plugged = false;
      } else if (name == "axes" && words >> axes[0] >> axes[1] >> axes[2] >> axes[3] >> axes[4] >> axes[5]) {
        std::vector<std::uint8_t> report{1};
        if (combined) {
          put_axes(report, axes);
          device.send(report);
        } else {
          put_axes(report, std::span(axes).first(3));
          device.send(report);
          report = {2};
          put_axes(report, std::span(axes).last(3));
          device.send(report);
        }
      } else if (name == "buttons" && words >> bits) {
        const std::uint8_t report[] = {3, static_cast<std::uint8_t>(bits & 0xFF),
                                       static_cast<std::uint8_t>(bits >> 8 & 0xFF)};
        device.send(report);
      } else {
        test::say("unknown command: " + line);
      }
    }
    device.serve();
  }
  if (plugged) device.unplug();
  return 0;
}
