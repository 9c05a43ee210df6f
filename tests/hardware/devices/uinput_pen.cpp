// A pen tablet through /dev/uinput: real evdev. As root, in the guest. See control.h; its own commands:
//
//   pen near|away             the tool comes or goes; "rubber near|away" its other end
//   at X Y PRESSURE TILTX TILTY   one frame: units of the simulated tablet (pen_streams.h), tilt in degrees
//   button N 0|1              side button 0, 1 or 2
//   flood N                   N frames at once: more than the kernel keeps for a reader (SYN_DROPPED)
//
// The axes are those of simulated_pen_facts().

#include <linux/uinput.h>
#include <sys/ioctl.h>

#include <array>
#include <cstring>
#include <utility>

#include "daemon-tracking/source/pen/pen_streams.h"
#include "tests/hardware/devices/control.h"

using namespace handloft;

namespace {

constexpr std::array<int, 3> side_buttons{BTN_STYLUS, BTN_STYLUS2, BTN_STYLUS3};

class Pen {
 public:
  void plug() {
    fd_ = ::open("/dev/uinput", O_WRONLY | O_CLOEXEC);
    if (fd_ < 0) test::give_up("/dev/uinput");
    for (const int type : {EV_KEY, EV_ABS}) set(UI_SET_EVBIT, type);
    for (const int key : {BTN_TOOL_PEN, BTN_TOOL_RUBBER, BTN_TOUCH, BTN_STYLUS, BTN_STYLUS2, BTN_STYLUS3})
      set(UI_SET_KEYBIT, key);
    set(UI_SET_PROPBIT, INPUT_PROP_POINTER);
    const tracking::PenFacts facts = tracking::simulated_pen_facts();
    const std::array<std::pair<int, const tracking::PenAxis*>, 5> axes{{{ABS_X, &facts.x},
                                                                        {ABS_Y, &facts.y},
                                                                        {ABS_PRESSURE, &facts.pressure},
                                                                        {ABS_TILT_X, &facts.tilt_x},
                                                                        {ABS_TILT_Y, &facts.tilt_y}}};
    for (const auto& [code, axis] : axes) {
      uinput_abs_setup setup{};
      setup.code = static_cast<std::uint16_t>(code);
      setup.absinfo.minimum = axis->minimum;
      setup.absinfo.maximum = axis->maximum;
      setup.absinfo.resolution = axis->resolution;
      if (::ioctl(fd_, UI_ABS_SETUP, &setup) < 0) test::give_up("UI_ABS_SETUP");
    }
    uinput_setup setup{};
    setup.id = {BUS_USB, 0x1209, 0xBEEF, 1};
    std::memcpy(setup.name, "Acme Pen", 8);
    if (::ioctl(fd_, UI_DEV_SETUP, &setup) < 0 || ::ioctl(fd_, UI_DEV_CREATE) < 0)
      test::give_up("UI_DEV_CREATE");
    test::say("plugged");
  }
  void unplug() {
    if (fd_ < 0) return;
    ::ioctl(fd_, UI_DEV_DESTROY);
    ::close(std::exchange(fd_, -1));
    test::say("unplugged");
  }
  void frame(std::vector<std::array<int, 3>> events) {
    if (fd_ < 0) return;
    events.push_back({EV_SYN, SYN_REPORT, 0});
    std::vector<input_event> out;
    for (const auto& [type, code, value] : events) {
      input_event event{};
      event.type = static_cast<std::uint16_t>(type);
      event.code = static_cast<std::uint16_t>(code);
      event.value = value;
      out.push_back(event);
    }
    if (::write(fd_, out.data(), out.size() * sizeof(input_event)) < 0) test::give_up("uinput");
  }

  void command(const std::string& line) {
    std::istringstream words(line);
    std::string name, how;
    int a = 0, b = 0, pressure = 0, tilt_x = 0, tilt_y = 0;
    words >> name;
    if (name == "plug") {
      plug();
    } else if (name == "unplug") {
      unplug();
    } else if ((name == "pen" || name == "rubber") && words >> how) {
      frame({{EV_KEY, name == "pen" ? BTN_TOOL_PEN : BTN_TOOL_RUBBER, how == "near" ? 1 : 0}});
    } else if (name == "at" && words >> a >> b >> pressure >> tilt_x >> tilt_y) {
      frame({{EV_ABS, ABS_X, a},
             {EV_ABS, ABS_Y, b},
             {EV_ABS, ABS_PRESSURE, pressure},
             {EV_ABS, ABS_TILT_X, tilt_x},
             {EV_ABS, ABS_TILT_Y, tilt_y},
             {EV_KEY, BTN_TOUCH, pressure > 0 ? 1 : 0}});
    } else if (name == "button" && words >> a >> b && a >= 0 && a < 3) {
      frame({{EV_KEY, side_buttons[static_cast<std::size_t>(a)], b}});
    } else if (name == "flood" && words >> a) {
      for (int i = 0; i < a; ++i) frame({{EV_ABS, ABS_X, i % 20000}, {EV_ABS, ABS_Y, i % 13000}});
      test::say("flooded");
    } else {
      test::say("unknown command: " + line);
    }
  }

 private:
  void set(unsigned long request, int value) const {
    if (::ioctl(fd_, request, value) < 0) test::give_up("uinput");
  }
  int fd_ = -1;
};

}  // namespace

int main() {
  Pen pen;
  test::say("ready");
  test::Commands commands;
  while (!commands.ended()) {
    for (const std::string& line : commands.wait(SystemClock().now() + std::chrono::seconds(1)))
      pen.command(line);
  }
  pen.unplug();
  return 0;
}
