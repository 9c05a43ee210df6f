#pragma once
// From the bytes a camera delivered to planes (T1): MJPEG through libjpeg-turbo as planar YCbCr, chroma kept
// as the JPEG stores it (never through RGB), YUYV and GREY by copying. The luma plane is what tags are looked
// for in, the chroma planes what fingertips are. Hostile input gives an error, never a crash: sizes are
// checked before anything is allocated.

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

/// One plane of 8-bit samples, rows without padding.
struct Plane {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> samples;

  std::uint8_t at(int x, int y) const {
    return samples[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) +
                   static_cast<std::size_t>(x)];
  }
  bool empty() const { return samples.empty(); }
};

/// A decoded picture: luma at full size; chroma `chroma_step_x` by `chroma_step_y` times smaller (1, 2 or 4),
/// empty for a grey picture. Chroma sample i lies at full-size pixel i * step + (step - 1) / 2 (JPEG's
/// centred siting).
struct PlanarImage {
  Plane y, cb, cr;
  int chroma_step_x = 1;
  int chroma_step_y = 1;
};

/// What to decode: luma alone is cheaper where no colour is looked for.
enum class DecodePlanes { luma, luma_and_chroma };

/// Holds the decompressor and re-uses the planes' memory. Not thread-safe: one per camera.
class FrameDecoder {
 public:
  FrameDecoder();
  ~FrameDecoder();
  FrameDecoder(FrameDecoder&&) noexcept;
  FrameDecoder& operator=(FrameDecoder&&) noexcept;

  /// The picture stays valid until the next call. Errors: data_corrupt for bytes that are not a whole picture
  /// of the frame's stated size, invalid_argument for absurd sizes, unsupported for a JPEG of other than 1 or
  /// 3 channels.
  Result<const PlanarImage*> decode(const CameraFrame& frame, DecodePlanes planes);
  /// What the last call decoded; after an error, any part of it.
  const PlanarImage& picture() const { return image_; }

 private:
  Status decode_jpeg(const CameraFrame& frame, DecodePlanes planes);
  Status decode_yuyv(const CameraFrame& frame, DecodePlanes planes);
  Status decode_grey(const CameraFrame& frame);

  struct Handle;
  std::unique_ptr<Handle> handle_;
  PlanarImage image_;
};

}  // namespace handloft::tracking
