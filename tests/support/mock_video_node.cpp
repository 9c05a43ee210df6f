#include "tests/support/mock_video_node.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/mman.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <mutex>

namespace handloft::tracking::testing {

namespace {

constexpr const char* usb_device = "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-3";
constexpr const char* description =
    "P: /devices/pci0000:00/0000:00:14.0/usb1/1-3\n"
    "E: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\n"
    "A: idVendor=046d\\n\nA: idProduct=082d\\n\nA: serial=MOCK1\\n\nA: busnum=1\\n\nA: speed=480\\n\n"
    "\n"
    "P: /devices/pci0000:00/0000:00:14.0/usb1/1-3/1-3:1.0/video4linux/video{0}\n"
    "N: video{0}\n"
    "E: SUBSYSTEM=video4linux\nE: DEVNAME=/dev/video{0}\nE: MAJOR=81\nE: MINOR={0}\n"
    "E: ID_PATH=pci-0000:00:14.0-usb-0:3:1.0\n"
    "A: name=Mock camera\\n\nA: index=0\\n\n"
    "\n";
// A slot of the shared file a buffer: 640 x 480 YUYV and more.
constexpr std::size_t slot_bytes = 1u << 20;
constexpr std::size_t slots = 8;

}  // namespace

struct MockVideoNode::State {
  UMockdevTestbed* testbed = umockdev_testbed_new();
  UMockdevIoctlBase* handler = umockdev_ioctl_base_new();
  FakeV4l2System driver;
  std::mutex mutex;
  int driver_fd = -1;
  int controller = -1;  ///< The terminal's other end: a byte a frame makes the node readable.
  int reader = -1;      ///< Takes the bytes out again.
  std::uint8_t* shared = nullptr;
  bool attached = false;
  int plugs = 0;
  std::string node;    ///< "/dev/video3" the fourth time: a umockdev testbed gives each number once.
  std::string device;  ///< Its folder in sysfs.

  int answer(unsigned long request, void* argument);
  void release();
  void detach();
};

// Not before the client has closed the node: umockdev ends a program that is in the middle of a call.
void MockVideoNode::State::detach() {
  if (!attached) return;
  umockdev_testbed_detach_ioctl(testbed, node.c_str(), nullptr);
  attached = false;
  driver.close(driver_fd);
}

void MockVideoNode::State::release() {
  const std::lock_guard lock(mutex);
  if (shared != nullptr) ::munmap(shared, slots * slot_bytes);
  shared = nullptr;
  if (reader >= 0) ::close(reader);
  reader = -1;
  controller = -1;
}

int MockVideoNode::State::answer(unsigned long request, void* argument) {
  const std::lock_guard lock(mutex);
  const int status = driver.ioctl(driver_fd, request, argument);
  if (status < 0 || shared == nullptr) return status;
  if (request == VIDIOC_QUERYBUF) {
    auto& buffer = *static_cast<v4l2_buffer*>(argument);
    buffer.m.offset = static_cast<std::uint32_t>(buffer.index * slot_bytes);
  }
  if (request == VIDIOC_DQBUF) {
    const auto& buffer = *static_cast<v4l2_buffer*>(argument);
    char byte = 0;
    [[maybe_unused]] const ssize_t got = ::read(reader, &byte, 1);
    if (const std::uint8_t* filled = driver.map(driver_fd, buffer.length, buffer.index)) {
      std::copy_n(filled, std::min<std::size_t>(buffer.length, slot_bytes),
                  shared + buffer.index * slot_bytes);
      driver.unmap(filled, buffer.length);
    }
  }
  return status;
}

namespace {

gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer state) {
  const unsigned long request = umockdev_ioctl_client_get_request(client);
  UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
  UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, _IOC_SIZE(request), nullptr);
  int status = -EFAULT;
  if (data != nullptr) {
    status = static_cast<MockVideoNode::State*>(state)->answer(request, data->data);
    g_object_unref(data);
  }
  umockdev_ioctl_client_complete(client, status < 0 ? -1 : 0, status < 0 ? -status : 0);
  return TRUE;
}

}  // namespace

bool MockVideoNode::possible() {
  const char* preloaded = std::getenv("LD_PRELOAD");
  if (preloaded == nullptr || std::string(preloaded).find("mmap_shim") == std::string::npos) return false;
  // The answer is remembered from the first question on: a testbed has to be there.
  UMockdevTestbed* testbed = umockdev_testbed_new();
  const bool mock = umockdev_in_mock_environment() != FALSE;
  g_object_unref(testbed);
  return mock;
}

MockVideoNode::MockVideoNode() : state_(std::make_unique<State>()) {
  g_signal_connect(state_->handler, "handle-ioctl", G_CALLBACK(on_ioctl), state_.get());
}

MockVideoNode::~MockVideoNode() {
  unplug();
  state_->detach();
  g_object_unref(state_->handler);
  g_object_unref(state_->testbed);
}

FakeV4l2System& MockVideoNode::driver() {
  return state_->driver;
}

void MockVideoNode::plug(FakeCamera camera) {
  State& state = *state_;
  state.detach();
  const int number = state.plugs++;
  state.node = fmt::format("/dev/video{}", number);
  state.device = fmt::format("{}/1-3:1.0/video4linux/video{}", usb_device, number);
  camera.node.node = state.node;
  state.driver.plug(std::move(camera));
  state.driver_fd = state.driver.open(state.node);
  if (umockdev_testbed_add_from_string(state.testbed, fmt::format(fmt::runtime(description), number).c_str(),
                                       nullptr) == FALSE)
    std::abort();
  state.controller = umockdev_testbed_get_dev_fd(state.testbed, state.node.c_str());
  const std::string terminal = ::ptsname(state.controller);
  gchar* root = umockdev_testbed_get_root_dir(state.testbed);
  const std::filesystem::path folder = std::filesystem::path(root) / "mmap";
  g_free(root);
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / std::filesystem::path(terminal).filename();
  const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0 || ::ftruncate(fd, static_cast<off_t>(slots * slot_bytes)) != 0) std::abort();
  void* mapped = ::mmap(nullptr, slots * slot_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  ::close(fd);
  if (mapped == MAP_FAILED) std::abort();
  {
    const std::lock_guard lock(state.mutex);
    state.shared = static_cast<std::uint8_t*>(mapped);
    state.reader = ::open(terminal.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  }
  if (umockdev_testbed_attach_ioctl(state.testbed, state.node.c_str(), state.handler, nullptr) == FALSE)
    std::abort();
  state.attached = true;
  // umockdev announced it before it had a driver: once more.
  umockdev_testbed_uevent(state.testbed, state.device.c_str(), "remove");
  umockdev_testbed_uevent(state.testbed, state.device.c_str(), "add");
}

void MockVideoNode::unplug() {
  State& state = *state_;
  if (state.shared == nullptr) return;
  state.driver.unplug(state.node);
  // Wakes the reader, which learns ENODEV from its next call.
  [[maybe_unused]] const ssize_t written = ::write(state.controller, "x", 1);
  umockdev_testbed_uevent(state.testbed, state.device.c_str(), "remove");
  umockdev_testbed_remove_device(state.testbed, state.device.c_str());
  umockdev_testbed_remove_device(state.testbed, usb_device);
  state.release();
}

bool MockVideoNode::deliver(const FakeFrame& frame) {
  State& state = *state_;
  const std::lock_guard lock(state.mutex);
  if (!state.driver.deliver(state.node, frame)) return false;
  return ::write(state.controller, "x", 1) == 1;
}

}  // namespace handloft::tracking::testing
