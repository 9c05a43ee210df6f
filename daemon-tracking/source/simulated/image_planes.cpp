#include "daemon-tracking/source/simulated/image_planes.h"

#include <turbojpeg.h>

#include <algorithm>
#include <cmath>

#include "daemon-tracking/source/simulated/random.h"

namespace handloft::tracking {
namespace {

/// Long enough that no two rows of a frame are likely to begin near each other.
constexpr std::size_t noise_table_size = 1u << 18;
constexpr std::uint64_t noise_seed = 0x4E015E;

std::vector<std::int8_t> noise_table(double sigma, std::uint64_t stream) {
  std::vector<std::int8_t> table(noise_table_size);
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double value = std::clamp(sigma * normal(noise_seed, stream, i), -127.0, 127.0);
    table[i] = static_cast<std::int8_t>(std::lround(value));
  }
  return table;
}

}  // namespace

ImagePlanes::ImagePlanes(int width_px, int height_px) : width(width_px), height(height_px) {
  const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  y.resize(pixels);
  cb.resize(pixels / 2);
  cr.resize(pixels / 2);
}

SensorNoise::SensorNoise(double luma_sigma, double chroma_sigma)
    : luma_(noise_table(luma_sigma, 0)), chroma_(noise_table(chroma_sigma, 1)) {}

void SensorNoise::add(ImagePlanes& image, std::uint64_t key) const {
  add_plane(image.y, image.width, luma_, hash_bits(key, 0, 0));
  add_plane(image.cb, image.chroma_width(), chroma_, hash_bits(key, 1, 0));
  add_plane(image.cr, image.chroma_width(), chroma_, hash_bits(key, 2, 0));
}

void SensorNoise::add_plane(std::vector<std::uint8_t>& plane, int width,
                            const std::vector<std::int8_t>& noise, std::uint64_t key) const {
  const auto columns = static_cast<std::size_t>(width);
  const std::size_t places = noise.size() - columns;
  for (std::size_t row = 0; row * columns < plane.size(); ++row) {
    const std::int8_t* from = noise.data() + hash_bits(key, row, 0) % places;
    std::uint8_t* to = plane.data() + row * columns;
    for (std::size_t i = 0; i < columns; ++i) {
      to[i] = static_cast<std::uint8_t>(std::clamp(to[i] + from[i], 0, 255));
    }
  }
}

JpegEncoder::JpegEncoder(int quality) : handle_(tjInitCompress()), quality_(std::clamp(quality, 1, 100)) {}

JpegEncoder::~JpegEncoder() {
  if (handle_ != nullptr) tjDestroy(handle_);
}

Result<std::vector<std::uint8_t>> JpegEncoder::encode(const ImagePlanes& image) {
  if (handle_ == nullptr) return make_error(ErrorCode::internal, "the JPEG encoder could not be made");
  buffer_.resize(tjBufSize(image.width, image.height, TJSAMP_422));
  const unsigned char* planes[3] = {image.y.data(), image.cb.data(), image.cr.data()};
  const int strides[3] = {image.width, image.chroma_width(), image.chroma_width()};
  unsigned char* out = buffer_.data();
  unsigned long size = buffer_.size();
  if (tjCompressFromYUVPlanes(handle_, planes, image.width, strides, image.height, TJSAMP_422, &out, &size,
                              quality_, TJFLAG_NOREALLOC) != 0) {
    return make_error(ErrorCode::internal, tjGetErrorStr2(handle_));
  }
  return std::vector<std::uint8_t>(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(size));
}

}  // namespace handloft::tracking
