#pragma once
// Devices of umockdev's making for the real device code: sysfs, uevents, device nodes and answers to ioctls,
// in this process. A program that uses it starts itself anew with umockdev's library loaded before all
// others.

#include <umockdev.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace handloft::test {

/// Whether umockdev answers for the system here; without it tests skip.
bool is_mocked();

class Testbed {
 public:
  Testbed();
  ~Testbed();
  Testbed(const Testbed&) = delete;
  Testbed& operator=(const Testbed&) = delete;

  /// In umockdev's own format; tells the monitors that the device was added.
  void add(const std::string& description);
  void set_binary_attribute(const std::string& device, const char* name, std::span<const std::uint8_t> bytes);
  /// "add" or "remove", for a device that stays in sysfs.
  void tell(const std::string& device, const char* action);
  void remove(const std::string& device);
  UMockdevTestbed* get() const { return testbed_; }

 private:
  UMockdevTestbed* testbed_;
};

/// Answers an ioctl: the result, 0 or more, or a negative errno. `bytes` is what the caller's argument points
/// to.
using IoctlAnswer = std::function<int(unsigned long request, std::span<std::uint8_t> bytes)>;

/// A node's other side. One report at a time lies in the node's pseudo terminal, since that keeps no borders.
class Node {
 public:
  Node(Testbed& testbed, std::string path, IoctlAnswer answer);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Hands the reader a report, when it has read those before it.
  void send(std::vector<std::uint8_t> report);
  /// What was written to the node last.
  std::vector<std::uint8_t> written();

 private:
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self);
  static gboolean on_read(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self);
  static gboolean on_write(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self);
  void push();

  Testbed& testbed_;
  std::string path_;
  IoctlAnswer answer_;
  UMockdevIoctlBase* handler_;
  int terminal_ = -1;
  std::mutex mutex_;
  std::deque<std::vector<std::uint8_t>> waiting_;
  bool in_terminal_ = false;
  std::vector<std::uint8_t> written_;
};

}  // namespace handloft::test
