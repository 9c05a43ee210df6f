// T1, T3, T4, T9: the real device code (libudev, libusb, hidapi over hidraw, libevdev) on devices of
// umockdev's.

#include <gtest/gtest.h>
#include <linux/hidraw.h>
#include <linux/input.h>
#include <sys/ioctl.h>

#include <condition_variable>
#include <cstring>
#include <mutex>
#include <set>
#include <thread>

#include "daemon-tracking/source/glove/hid_glove.h"
#include "daemon-tracking/source/hotplug.h"
#include "daemon-tracking/source/pen/evdev_pen.h"
#include "daemon-tracking/source/pen/pen_events.h"
#include "daemon-tracking/source/pen/pen_streams.h"
#include "daemon-tracking/source/space_mouse/hid_space_mouse.h"
#include "tests/unit/daemon-tracking/source/mock/testbed.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 20s;

std::string hid_description(const std::string& port, const std::string& vendor, const std::string& product,
                            const std::string& name, const std::string& node) {
  const std::string usb = "/devices/pci0000:00/usb1/" + port;
  const std::string hid = usb + "/" + port + ":1.0/0003:" + vendor + ":" + product + ".0001";
  return "P: " + usb + "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nA: idVendor=" + vendor +
         "\\n\nA: idProduct=" + product + "\\n\nA: product=" + name + "\\n\nA: serial=MOCK1\\n\n\nP: " + usb +
         "/" + port +
         ":1.0\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\nA: bInterfaceNumber=00\\n\n\nP: " + hid +
         "\nE: SUBSYSTEM=hid\nE: HID_ID=0003:0000" + vendor + ":0000" + product + "\nE: HID_NAME=" + name +
         "\nE: HID_UNIQ=MOCK1\n\nP: " + hid + "/hidraw/" + node + "\nN: " + node +
         "\nE: SUBSYSTEM=hidraw\nE: DEVNAME=/dev/" + node +
         "\nE: ID_PATH=pci-0000:00-usb-0:2:1.0\nL: device=../../../0003:" + vendor + ":" + product +
         ".0001\n";
}

class MockDevices : public testing::Test {
 protected:
  void SetUp() override {
    static const bool mocked = test::is_mocked();
    if (!mocked) GTEST_SKIP() << "umockdev's library could not be loaded before this program";
    testbed_.emplace();
  }
  void TearDown() override {
    hotplug_.reset();
    testbed_.reset();
  }
  void watch(std::vector<std::string> subsystems, UsbWatch usb = UsbWatch::off) {
    auto opened = open_system_hotplug({std::move(subsystems), usb}, log_);
    ASSERT_TRUE(opened.ok()) << opened.error().describe();
    hotplug_ = std::move(*opened);
  }
  SampleSink sink() {
    return [this](Sample sample) {
      const std::lock_guard lock(mutex_);
      if (const auto* presence = std::get_if<DevicePresence>(&sample)) {
        presences_.push_back(presence->present);
      } else {
        samples_.push_back(std::move(sample));
      }
      changed_.notify_all();
    };
  }
  template <typename Predicate>
  bool wait(const Predicate& predicate) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, predicate);
  }

  SystemClock clock_;
  Logger log_{"test", LogLevel::off};
  std::optional<test::Testbed> testbed_;
  std::unique_ptr<HotplugMonitor> hotplug_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<bool> presences_;
  std::vector<Sample> samples_;
};

// The glove's feature report by hidraw's ioctls.
struct MockGlove {
  std::array<std::uint8_t, glove_range_size> range = encode_glove_range({12, 890, 0, 1023, true});
  std::mutex mutex;

  int answer(unsigned long request, std::span<std::uint8_t> bytes) {
    const std::lock_guard lock(mutex);
    const std::size_t size = std::min(bytes.size(), range.size());
    if (_IOC_TYPE(request) == 'H' && _IOC_NR(request) == 0x07) {  // HIDIOCGFEATURE
      std::copy_n(range.begin(), size, bytes.begin());
      return static_cast<int>(size);
    }
    if (_IOC_TYPE(request) == 'H' && _IOC_NR(request) == 0x06) {  // HIDIOCSFEATURE
      std::copy_n(bytes.begin(), size, range.begin());
      return static_cast<int>(bytes.size());
    }
    if (request == HIDIOCGRDESCSIZE) {
      const int length = static_cast<int>(glove_report_descriptor().size());
      std::memcpy(bytes.data(), &length, sizeof length);
      return 0;
    }
    return -EINVAL;
  }
};

TEST_F(MockDevices, AGloveOverHidrawT9) {
  const std::string hid = "/sys/devices/pci0000:00/usb1/1-2/1-2:1.0/0003:1209:0001.0001";
  testbed_->add(hid_description("1-2", "1209", "0001", "Handloft Glove", "hidraw0"));
  testbed_->set_binary_attribute(hid, "report_descriptor", glove_report_descriptor());
  MockGlove mock;
  test::Node node(*testbed_, "/dev/hidraw0", [&](unsigned long request, std::span<std::uint8_t> bytes) {
    return mock.answer(request, bytes);
  });
  watch({"hidraw"});
  const auto glove = make_hid_glove({}, *hotplug_, make_hidapi_system(), clock_, log_);
  ASSERT_TRUE(glove->start(sink()).ok());
  ASSERT_TRUE(wait([&] { return presences_ == std::vector<bool>{true}; })) << glove->status().problem;
  EXPECT_EQ(glove->status().identity,
            "1209:0001 Handloft Glove, serial MOCK1, at pci-0000:00-usb-0:2:1.0 (/dev/hidraw0)");
  constexpr std::size_t count = 300;
  for (std::size_t i = 0; i < count; ++i) {
    GloveReport report;
    report.sequence = static_cast<std::uint16_t>(i);
    const auto bytes = encode_glove_report(report);
    node.send({bytes.begin(), bytes.end()});
  }
  ASSERT_TRUE(wait([&] { return samples_.size() == count + 1; })) << "with its range";
  EXPECT_EQ(parse_glove_range(std::get<GloveBytes>(samples_[0]).bytes)->force_full, 890);
  for (std::size_t i = 0; i < count; ++i) {
    const auto report = parse_glove_report(std::get<GloveBytes>(samples_[i + 1]).bytes);
    ASSERT_TRUE(report.ok()) << report.error().describe();
    EXPECT_EQ(report->sequence, i) << "in order, none twice";
  }
  glove->show({1, 2, 3, 4, 5});
  const auto expected = encode_glove_output({1, 2, 3, 4, 5});
  const TimePoint until = clock_.now() + patience;
  while (node.written().size() != expected.size() && clock_.now() < until) std::this_thread::yield();
  EXPECT_EQ(node.written(), std::vector<std::uint8_t>(expected.begin(), expected.end()));
  const Status stored = glove->set_range({5, 500, 1, 1000, true});
  EXPECT_TRUE(stored.ok()) << stored.error().describe();

  for (int i = 0; i < 3; ++i) {
    testbed_->tell(hid + "/hidraw/hidraw0", "remove");
    ASSERT_TRUE(wait([&] { return !presences_.back(); })) << i;
    testbed_->tell(hid + "/hidraw/hidraw0", "add");
    ASSERT_TRUE(wait([&] { return presences_.back(); })) << i;
  }
  EXPECT_EQ(presences_.size(), 7u);
}

TEST_F(MockDevices, A3dMouseOverHidraw) {
  const std::string hid = "/sys/devices/pci0000:00/usb1/1-3/1-3:1.0/0003:046D:C626.0001";
  testbed_->add(hid_description("1-3", "046D", "C626", "SpaceNavigator", "hidraw1"));
  const std::uint8_t descriptor[] = {0x05, 0x01, 0x09, 0x08, 0xA1, 0x01, 0x75, 0x10, 0x95, 0x03, 0x85, 0x01,
                                     0x09, 0x30, 0x81, 0x02, 0x85, 0x02, 0x09, 0x33, 0x81, 0x02, 0xC0};
  testbed_->set_binary_attribute(hid, "report_descriptor", descriptor);
  test::Node node(*testbed_, "/dev/hidraw1", [&](unsigned long request, std::span<std::uint8_t> bytes) {
    if (request != HIDIOCGRDESCSIZE) return -EINVAL;  // All that hidapi asks when it opens.
    const int length = static_cast<int>(sizeof descriptor);
    std::memcpy(bytes.data(), &length, sizeof length);
    return 0;
  });
  watch({"hidraw"});
  const auto mouse = make_hid_space_mouse({}, *hotplug_, make_hidapi_system(), clock_, log_);
  ASSERT_TRUE(mouse->start(sink()).ok());
  ASSERT_TRUE(wait([&] { return presences_ == std::vector<bool>{true}; })) << mouse->status().problem;
  node.send({1, 10, 0, 20, 0, 30, 0});
  node.send({2, 40, 0, 50, 0, 60, 0});
  ASSERT_TRUE(wait([&] { return samples_.size() == 2; }));
  EXPECT_EQ(std::get<DeviceBytes>(samples_[1]).bytes, (std::vector<std::uint8_t>{2, 40, 0, 50, 0, 60, 0}));
  testbed_->tell(hid + "/hidraw/hidraw1", "remove");
  ASSERT_TRUE(wait([&] { return !presences_.back(); }));
}

/// A tablet's state behind EVIOC*.
struct MockTablet {
  std::mutex mutex;
  std::set<int> pressed;
  std::array<int, ABS_CNT> values{};
  int clock = -1;

  static void set_bit(std::span<std::uint8_t> bytes, int number) {
    const auto bit = static_cast<unsigned>(number);
    if (bit / 8 < bytes.size()) bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] | 1u << (bit % 8));
  }

  int answer(unsigned long request, std::span<std::uint8_t> bytes) {
    const std::lock_guard lock(mutex);
    if (_IOC_TYPE(request) != 'E') return -ENOTTY;
    const unsigned number = _IOC_NR(request);
    const int size = static_cast<int>(bytes.size());
    if (request == EVIOCSCLOCKID) {
      std::memcpy(&clock, bytes.data(), sizeof clock);
      return 0;
    }
    if (request == EVIOCGVERSION) {
      const int version = EV_VERSION;
      std::memcpy(bytes.data(), &version, sizeof version);
      return 0;
    }
    if (request == EVIOCGID) {
      const input_id id{BUS_USB, 0x1209, 0xBEEF, 1};
      std::memcpy(bytes.data(), &id, sizeof id);
      return 0;
    }
    if (number == 0x06) {  // Name
      const char name[] = "Mock Pen";
      std::memcpy(bytes.data(), name, std::min(sizeof name, bytes.size()));
      return static_cast<int>(sizeof name);
    }
    if (number == 0x07 || number == 0x08) return -ENOENT;  // Place, unique id
    std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});
    if (number == 0x18) {  // Pressed keys
      for (const int key : pressed) set_bit(bytes, key);
      return size;
    }
    if (number == 0x09 || (number > 0x18 && number <= 0x1B)) return size;
    if (number >= 0x20 && number < 0x40) {  // What it has
      if (number == 0x20)
        for (const int type : {EV_SYN, EV_KEY, EV_ABS}) set_bit(bytes, type);
      if (number == 0x20 + EV_KEY)
        for (const int key : {BTN_TOOL_PEN, BTN_TOUCH, BTN_STYLUS}) set_bit(bytes, key);
      if (number == 0x20 + EV_ABS)
        for (const int axis : {ABS_X, ABS_Y, ABS_PRESSURE}) set_bit(bytes, axis);
      return size;
    }
    if (number >= 0x40 && number < 0x40 + ABS_CNT) {
      const PenFacts facts = simulated_pen_facts();
      const unsigned axis = number - 0x40;
      const PenAxis& known = axis == ABS_X ? facts.x : axis == ABS_Y ? facts.y : facts.pressure;
      const input_absinfo info{values[axis], known.minimum, known.maximum, 0, 0, known.resolution};
      std::memcpy(bytes.data(), &info, sizeof info);
      return 0;
    }
    return -EINVAL;
  }
};

std::vector<std::uint8_t> event_bytes(TimePoint time, unsigned type, unsigned code, int value) {
  input_event event{};
  event.input_event_sec = to_ns(time) / 1'000'000'000;
  event.input_event_usec = to_ns(time) / 1000 % 1'000'000;
  event.type = static_cast<std::uint16_t>(type);
  event.code = static_cast<std::uint16_t>(code);
  event.value = value;
  std::vector<std::uint8_t> out(sizeof event);
  std::memcpy(out.data(), &event, sizeof event);
  return out;
}

TEST_F(MockDevices, APenOverEvdevIsResyncedAfterDroppedEventsT4) {
  testbed_->add(
      "P: /devices/usb1/1-4/input/input7\nE: SUBSYSTEM=input\nA: name=Mock Pen\\n\nA: id/vendor=1209\\n\nA: "
      "id/product=beef\\n\n\nP: /devices/usb1/1-4/input/input7/event7\nN: input/event7\nE: "
      "SUBSYSTEM=input\nE: "
      "DEVNAME=/dev/input/event7\nE: ID_INPUT=1\nE: ID_INPUT_TABLET=1\n");
  MockTablet tablet;
  tablet.pressed = {BTN_TOOL_PEN};  // The pen lies on the tablet when it is opened.
  tablet.values[ABS_X] = 4242;
  test::Node node(*testbed_, "/dev/input/event7", [&](unsigned long request, std::span<std::uint8_t> bytes) {
    return tablet.answer(request, bytes);
  });
  watch({"input"});
  const auto pen = make_evdev_pen({}, *hotplug_, clock_, log_);
  ASSERT_TRUE(pen->start(sink()).ok());
  ASSERT_TRUE(wait([&] { return samples_.size() >= 2; })) << pen->status().problem;
  EXPECT_EQ(tablet.clock, CLOCK_MONOTONIC);
  const auto& first = std::get<DeviceBytes>(samples_[0]);
  ASSERT_EQ(first.kind, DeviceData::pen_facts);
  EXPECT_EQ(parse_pen_facts(first.bytes)->x.maximum, 21600);
  // What the pen does already.
  const auto find = [&](std::size_t sample, unsigned type, unsigned code) -> std::optional<PenEvent> {
    const auto events = parse_pen_events(std::get<DeviceBytes>(samples_[sample]).bytes);
    if (!events) return std::nullopt;
    for (const PenEvent& event : *events)
      if (event.type == type && event.code == code) return event;
    return std::nullopt;
  };
  EXPECT_EQ(find(1, EV_KEY, BTN_TOOL_PEN)->value, 1);
  EXPECT_EQ(find(1, EV_ABS, ABS_X)->value, 4242);

  const TimePoint time = from_ns(to_ns(clock_.now()) / 1000 * 1000);
  node.send(event_bytes(time, EV_ABS, ABS_PRESSURE, 4000));
  node.send(event_bytes(time, EV_SYN, SYN_REPORT, 0));
  ASSERT_TRUE(wait([&] { return samples_.size() >= 3; }));
  EXPECT_EQ(find(2, EV_ABS, ABS_PRESSURE)->value, 4000);
  EXPECT_EQ(find(2, EV_ABS, ABS_PRESSURE)->time, time) << "the kernel's time, not the arrival";

  {
    // Meanwhile much happened that nobody will be told.
    const std::lock_guard lock(tablet.mutex);
    tablet.pressed = {BTN_STYLUS};
    tablet.values[ABS_X] = 777;
    tablet.values[ABS_PRESSURE] = 0;
  }
  node.send(event_bytes(time + 5ms, EV_SYN, SYN_DROPPED, 0));
  node.send(event_bytes(time + 5ms, EV_SYN, SYN_REPORT, 0));
  ASSERT_TRUE(wait([&] { return samples_.size() >= 4; }));
  ASSERT_TRUE(find(3, EV_SYN, SYN_DROPPED).has_value());
  EXPECT_EQ(find(3, EV_KEY, BTN_TOOL_PEN)->value, 0);
  EXPECT_EQ(find(3, EV_KEY, BTN_STYLUS)->value, 1);
  EXPECT_EQ(find(3, EV_ABS, ABS_X)->value, 777);
  EXPECT_EQ(find(3, EV_ABS, ABS_PRESSURE)->value, 0);
  EXPECT_EQ(pen->status().lost, 1u);

  testbed_->tell("/sys/devices/usb1/1-4/input/input7/event7", "remove");
  ASSERT_TRUE(wait([&] { return presences_ == (std::vector<bool>{true, false}); }));
  testbed_->tell("/sys/devices/usb1/1-4/input/input7/event7", "add");
  ASSERT_TRUE(wait([&] { return presences_ == (std::vector<bool>{true, false, true}); }));
}

TEST_F(MockDevices, HotPlugIsToldByUdevAndByLibusbT3) {
  // libusb wants a bus before it begins.
  testbed_->add(
      "P: /devices/usb1\nN: bus/usb/001/001\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: "
      "DEVNAME=/dev/bus/usb/001/001\n"
      "A: busnum=1\\n\nA: devnum=1\\n\nA: bConfigurationValue=1\\n\nA: speed=480\\n\nH: "
      "descriptors=12010002090001406b1d020001060302010109021900010100e0000904000001090000000705810304000c\n");
  watch({"hidraw", "tty"}, UsbWatch::libusb);
  std::vector<std::string> told;
  const auto all = hotplug_->subscribe("", [&](PlugChange change, const PluggedDevice& device) {
    const std::lock_guard lock(mutex_);
    told.push_back((change == PlugChange::added ? "+" : "-") + device.devnode);
    changed_.notify_all();
  });
  const auto heard = [&](const std::string& word) {
    return wait([&] { return std::find(told.begin(), told.end(), word) != told.end(); });
  };
  testbed_->add("P: /devices/serial/tty/ttyUSB0\nN: ttyUSB0\nE: SUBSYSTEM=tty\nE: DEVNAME=/dev/ttyUSB0\n");
  EXPECT_TRUE(heard("+/dev/ttyUSB0"));
  testbed_->add(
      "P: /devices/usb1/1-1\nN: bus/usb/001/002\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: BUSNUM=001\nE: "
      "DEVNUM=002\nE: DEVNAME=/dev/bus/usb/001/002\nA: idVendor=1209\\n\nA: idProduct=0001\\n\nA: "
      "busnum=1\\n\nA: "
      "devnum=2\\n\nA: bConfigurationValue=1\\n\nA: speed=480\\n\nA: serial=USB9\\n\nH: "
      "descriptors="
      "120100020000004009120100020101020301090222000101008032090400000103000000092111010001222800070581034000"
      "04\n");
  EXPECT_TRUE(heard("+/dev/bus/usb/001/002"));
  const auto present = hotplug_->present("usb");
  const auto glove = std::find_if(present.begin(), present.end(), [](const PluggedDevice& device) {
    return device.vendor_id == glove_usb_vendor;
  });
  ASSERT_NE(glove, present.end());
  EXPECT_EQ(glove->product_id, glove_usb_product);
  testbed_->remove("/sys/devices/usb1/1-1");
  EXPECT_TRUE(heard("-/dev/bus/usb/001/002"));
  testbed_->remove("/sys/devices/serial/tty/ttyUSB0");
  EXPECT_TRUE(heard("-/dev/ttyUSB0"));
}

}  // namespace
}  // namespace handloft::tracking
