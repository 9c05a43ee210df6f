#pragma once
// A picture as the JPEG stores it: luma at full and chroma at half horizontal resolution (4:2:2), one byte
// each.

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace handloft::tracking {

struct ImagePlanes {
  int width = 0, height = 0;  ///< Width is even.
  std::vector<std::uint8_t> y, cb, cr;

  ImagePlanes() = default;
  ImagePlanes(int width_px, int height_px);
  int chroma_width() const { return width / 2; }
};

/// Adds sensor noise that depends on nothing but `key` (seed, camera and frame).
class SensorNoise {
 public:
  SensorNoise(double luma_sigma, double chroma_sigma);
  void add(ImagePlanes& image, std::uint64_t key) const;

 private:
  void add_plane(std::vector<std::uint8_t>& plane, int width, const std::vector<std::int8_t>& noise,
                 std::uint64_t key) const;
  std::vector<std::int8_t> luma_, chroma_;  ///< Long tables of normal values; each row begins somewhere else.
};

/// A baseline JPEG, 4:2:2. Errors: internal when the library refuses.
class JpegEncoder {
 public:
  explicit JpegEncoder(int quality);
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;
  Result<std::vector<std::uint8_t>> encode(const ImagePlanes& image);

 private:
  void* handle_ = nullptr;
  std::vector<std::uint8_t> buffer_;
  int quality_;
};

}  // namespace handloft::tracking
