#pragma once
// Pictures in memory: 8-bit RGBA, sRGB, rows from the top. Screenshots (V8) and image tests use them.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/base/result.h"

namespace handloft::client {

struct Image {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> rgba;  ///< 4 * width * height
};

/// Writes under a temporary name and renames, so that an older picture survives a full disk.
/// Errors: io with the system's reason; invalid_argument for an empty picture.
Status write_png(const std::filesystem::path& path, const Image& image);

/// Errors: not_found, data_corrupt; resource_exhausted above 16384 px a side.
Result<Image> read_png(const std::filesystem::path& path);

/// Mean absolute difference of R, G and B in 0..255. Errors: invalid_argument when the sizes differ.
Result<double> mean_absolute_difference(const Image& a, const Image& b);

/// Mean structural similarity (Wang et al. 2004) of the luma over 8x8 blocks, 1: equal. Errors: as above.
Result<double> structural_similarity(const Image& a, const Image& b);

}  // namespace handloft::client
