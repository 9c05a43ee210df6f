#include "tests/unit/daemon-tracking/source/mock/testbed.h"

#include <linux/hidraw.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace handloft::test {

namespace {

constexpr const char* preload = "libumockdev-preload.so.0";

// Before main(): with the library, or as it was when that can't be.
__attribute__((constructor)) void start_anew(int, char** arguments, char**) {
  const char* loaded = ::getenv("LD_PRELOAD");
  if (loaded != nullptr && std::strstr(loaded, preload) != nullptr) return;
  const std::string all =
      loaded != nullptr && *loaded != '\0' ? std::string(preload) + ":" + loaded : preload;
  ::setenv("LD_PRELOAD", all.c_str(), 1);
  ::execv("/proc/self/exe", arguments);
}

void check(bool good, GError* error, const char* what) {
  if (good) return;
  const std::string text = std::string(what) + ": " + (error != nullptr ? error->message : "refused");
  g_clear_error(&error);
  throw std::runtime_error(text);
}

}  // namespace

bool is_mocked() {
  const Testbed first;  // The answer is kept for ever, and it is no before the first testbed.
  return umockdev_in_mock_environment();
}

Testbed::Testbed() : testbed_(umockdev_testbed_new()) {}
Testbed::~Testbed() {
  g_object_unref(testbed_);
}

void Testbed::add(const std::string& description) {
  GError* error = nullptr;
  const bool good = umockdev_testbed_add_from_string(testbed_, description.c_str(), &error);
  check(good, error, "add");
}

void Testbed::set_binary_attribute(const std::string& device, const char* name,
                                   std::span<const std::uint8_t> bytes) {
  umockdev_testbed_set_attribute_binary(testbed_, device.c_str(), name,
                                        const_cast<std::uint8_t*>(bytes.data()),
                                        static_cast<int>(bytes.size()));
}

void Testbed::tell(const std::string& device, const char* action) {
  umockdev_testbed_uevent(testbed_, device.c_str(), action);
}

void Testbed::remove(const std::string& device) {
  umockdev_testbed_uevent(testbed_, device.c_str(), "remove");
  umockdev_testbed_remove_device(testbed_, device.c_str());
}

Node::Node(Testbed& testbed, std::string path, IoctlAnswer answer)
    : testbed_(testbed),
      path_(std::move(path)),
      answer_(std::move(answer)),
      handler_(umockdev_ioctl_base_new()) {
  g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&Node::on_ioctl), this);
  g_signal_connect(handler_, "handle-read", G_CALLBACK(&Node::on_read), this);
  g_signal_connect(handler_, "handle-write", G_CALLBACK(&Node::on_write), this);
  GError* error = nullptr;
  const bool good = umockdev_testbed_attach_ioctl(testbed_.get(), path_.c_str(), handler_, &error);
  check(good, error, "attach");
  terminal_ = umockdev_testbed_get_dev_fd(testbed_.get(), path_.c_str());
}

Node::~Node() {
  umockdev_testbed_detach_ioctl(testbed_.get(), path_.c_str(), nullptr);
  g_object_unref(handler_);
}

void Node::push() {
  if (in_terminal_ || waiting_.empty()) return;
  const auto report = std::move(waiting_.front());
  waiting_.pop_front();
  in_terminal_ = ::write(terminal_, report.data(), report.size()) == static_cast<ssize_t>(report.size());
}

void Node::send(std::vector<std::uint8_t> report) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(report));
  push();
}

std::vector<std::uint8_t> Node::written() {
  const std::lock_guard lock(mutex_);
  return written_;
}

gboolean Node::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
  const unsigned long request = umockdev_ioctl_client_get_request(client);
  // HIDIOCGRDESC says the size of an int and means a whole descriptor.
  const std::size_t size = request == HIDIOCGRDESC ? sizeof(hidraw_report_descriptor) : _IOC_SIZE(request);
  UMockdevIoctlData* data =
      size == 0 ? nullptr
                : umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, size, nullptr);
  const std::span<std::uint8_t> bytes =
      data == nullptr ? std::span<std::uint8_t>() : std::span<std::uint8_t>(data->data, size);
  const int result = static_cast<Node*>(self)->answer_(request, bytes);
  if (data != nullptr) g_object_unref(data);
  umockdev_ioctl_client_complete(client, result < 0 ? -1 : result, result < 0 ? -result : 0);
  return TRUE;
}

gboolean Node::on_read(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
  int error = 0;
  const int size = umockdev_ioctl_client_execute(client, &error, nullptr);
  Node& node = *static_cast<Node*>(self);
  {
    const std::lock_guard lock(node.mutex_);
    if (size > 0) {
      node.in_terminal_ = false;
      node.push();
    }
  }
  umockdev_ioctl_client_complete(client, size, error);
  return TRUE;
}

gboolean Node::on_write(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
  const UMockdevIoctlData* bytes = umockdev_ioctl_client_get_arg(client);
  Node& node = *static_cast<Node*>(self);
  const int size = static_cast<int>(bytes->data_len);
  {
    const std::lock_guard lock(node.mutex_);
    node.written_.assign(bytes->data, bytes->data + size);
  }
  umockdev_ioctl_client_complete(client, size, 0);
  return TRUE;
}

}  // namespace handloft::test
