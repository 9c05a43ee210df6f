// T1: whatever a camera's driver hands on as a frame is a picture of the stated size or an error, and what
// looks for tags and fingertips in it stays within it. Byte 0: the format and how large the frame is said to
// be; the rest is the frame's bytes (MJPEG, YUYV or grey).

#include <cstdlib>
#include <memory>
#include <vector>

#include "daemon-tracking/vision/camera_tracker.h"

using namespace handloft;
using namespace handloft::tracking;

namespace {

constexpr int sizes[][2] = {{64, 48}, {16, 16}, {160, 90}, {2, 2}, {1, 1}, {63, 47}, {640, 8}, {8192, 8192}};

Rig rig_of(int width_px, int height_px) {
  Rig rig = default_rig();
  rig.cameras.resize(1);
  rig.cameras[0].intrinsics.width_px = width_px;
  rig.cameras[0].intrinsics.height_px = height_px;
  return rig;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const auto& [width_px, height_px] = sizes[(data[0] >> 2) % std::size(sizes)];
  CameraFrame frame;
  frame.sequence = 1;
  frame.capture_time = from_ns(1'000'000'000);
  frame.format = static_cast<PixelFormat>(1 + (data[0] & 3) % 3);
  frame.width_px = width_px;
  frame.height_px = height_px;
  frame.bytes = std::make_shared<const std::vector<std::uint8_t>>(data + 1, data + size);

  static FrameDecoder decoder;  // Kept, as a camera keeps its own: a broken frame must not spoil the next.
  const auto image = decoder.decode(frame, DecodePlanes::luma_and_chroma);
  if (image) {
    const PlanarImage& planes = **image;
    if (planes.y.width_px != width_px || planes.y.height_px != height_px) std::abort();
    if (planes.y.samples.size() != static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px))
      std::abort();
  }
  if (width_px > 200) return 0;  // Looking for tags in large pictures is for the tests.
  auto tracker = CameraTracker::create(rig_of(width_px, height_px), 0);
  if (!tracker) return 0;
  const auto observation = tracker->process(frame);
  if (observation && !image) std::abort();
  return 0;
}
