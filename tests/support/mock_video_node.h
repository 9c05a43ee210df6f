#pragma once
// A /dev/videoN under umockdev, with sysfs, uevents, ioctls, poll and mapped buffers, so that the real code
// runs on real system calls. Its driver is a FakeV4l2System's camera. Needs umockdev's preload library and
// our mmap_shim.

#include <memory>
#include <string>

#include "tests/support/fake_v4l2_system.h"

namespace handloft::tracking::testing {

class MockVideoNode {
 public:
  /// False where the preload libraries are missing: a test skips then.
  static bool possible();

  MockVideoNode();
  ~MockVideoNode();
  MockVideoNode(const MockVideoNode&) = delete;
  MockVideoNode& operator=(const MockVideoNode&) = delete;

  /// /dev/video0, a USB camera with serial number "MOCK1"; its driver is `driver()`'s camera of the same
  /// node.
  void plug(FakeCamera camera);
  /// The next plug(), and the destructor, only after the reader has closed its descriptor.
  void unplug();
  FakeV4l2System& driver();
  /// As FakeV4l2System's; poll() of the node wakes.
  bool deliver(const FakeFrame& frame);

  struct State;

 private:
  std::unique_ptr<State> state_;
};

}  // namespace handloft::tracking::testing
