#pragma once
// Cameras that exist only in a test: a V4l2System whose drivers answer, refuse and lie as the test says.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "daemon-tracking/source/camera/v4l2_modes.h"
#include "daemon-tracking/source/camera/v4l2_system.h"

namespace handloft::tracking::testing {

struct FakeControl {
  std::int32_t minimum = 0, maximum = 1, step = 1, value = 0;
  std::uint32_t flags = 0;
  bool stubborn = false;  ///< Accepts every value and keeps its own.
};

/// One /dev/videoN and its driver.
struct FakeCamera {
  V4l2Node node;
  std::string card = "Fake camera";
  std::uint32_t device_caps = 0;  ///< 0: video capture with streaming.
  std::vector<VideoSize> sizes{{PixelFormat::mjpeg, 640, 480, {30}}};
  std::map<std::uint32_t, FakeControl> controls;
  std::uint32_t buffers_given = 4;  ///< What REQBUFS gives back of any count.
  std::uint32_t row_padding = 0;    ///< Bytes more a line than the picture needs.
};

/// A frame as the driver would fill it into its next buffer.
struct FakeFrame {
  std::vector<std::uint8_t> bytes;
  std::uint32_t sequence = 0;
  std::int64_t timestamp_ns = 0;
  std::uint32_t flags = 0;
  std::optional<std::uint32_t> bytesused;  ///< Nullopt: as many as `bytes`.
};

class FakeV4l2System final : public V4l2System {
 public:
  ~FakeV4l2System() override;

  void plug(FakeCamera camera);
  /// From now on every call on it says ENODEV, and poll() that there is an error.
  void unplug(const std::string& node);

  /// False when it isn't streaming or no buffer is queued: a real driver loses the frame then.
  bool deliver(const std::string& node, const FakeFrame& frame);
  bool streaming(const std::string& node);
  /// poll() tells an error once, without a reason.
  void poll_error(const std::string& node);

  /// The next `count` calls of `request` give -`error`.
  void fail(unsigned long request, int error, int count = 1);
  /// open() of `node` gives -`error` until it is 0 again.
  void fail_open(const std::string& node, int error);
  /// Seen by every ioctl after the driver answered it; may change the answer.
  void set_liar(std::function<void(unsigned long request, void* argument)> liar);

  std::int32_t control(const std::string& node, std::uint32_t id);
  void set_control(const std::string& node, std::uint32_t id, std::int32_t value);
  int open_count() const;
  /// Mapped and not unmapped yet: 0 when all was given back.
  int mapped_count() const;

  std::vector<V4l2Node> nodes() override;
  int open(const std::string& node) override;
  void close(int fd) override;
  int ioctl(int fd, unsigned long request, void* argument) override;
  const std::uint8_t* map(int fd, std::size_t length, std::int64_t offset) override;
  void unmap(const std::uint8_t* start, std::size_t length) override;
  int poll(std::span<pollfd> what, int timeout_ms) override;

 private:
  struct Opened {
    std::string node;
    bool streaming = false;
    bool gone = false;
    bool error = false;
    PixelFormat format = PixelFormat::mjpeg;
    std::uint32_t width = 0, height = 0;
    double rate_hz = 30;
    std::vector<std::vector<std::uint8_t>> buffers;
    std::deque<std::uint32_t> queued;
    std::deque<std::pair<std::uint32_t, FakeFrame>> filled;
  };
  int answer(Opened& opened, int fd, unsigned long request, void* argument);
  int answer_control(FakeCamera& camera, unsigned long request, void* argument);
  int answer_enumeration(FakeCamera& camera, unsigned long request, void* argument);
  Opened* opened(const std::string& node);
  std::uint32_t buffer_bytes(const Opened& opened) const;

  mutable std::mutex mutex_;
  std::map<std::string, FakeCamera> cameras_;
  std::map<int, Opened> opened_;
  std::map<unsigned long, std::deque<int>> failures_;
  std::map<std::string, int> open_failures_;
  std::function<void(unsigned long, void*)> liar_;
  int opens_ = 0;
  int mapped_ = 0;
};

/// The smallest that passes for a JPEG on the way to the decoder: markers around `length` bytes.
std::vector<std::uint8_t> fake_jpeg(std::size_t length = 200, std::uint8_t fill = 0x55);

/// A MONOTONIC, start-of-exposure flag word as uvcvideo sets it.
extern const std::uint32_t good_stamp_flags;

}  // namespace handloft::tracking::testing
