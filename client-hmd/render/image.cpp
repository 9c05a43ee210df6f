#include "client-hmd/render/image.h"

#include <fmt/format.h>
#include <png.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <string>

namespace handloft::client {
namespace {

constexpr int max_side_px = 16384;

Status check_same_size(const Image& a, const Image& b) {
  if (a.width_px == b.width_px && a.height_px == b.height_px && a.rgba.size() == b.rgba.size() &&
      !a.rgba.empty()) {
    return {};
  }
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("pictures of {}x{} and {}x{} cannot be compared", a.width_px, a.height_px,
                                b.width_px, b.height_px));
}

double luma(const Image& image, int x, int y) {
  const std::size_t at = 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                              static_cast<std::size_t>(x));
  return 0.299 * image.rgba[at] + 0.587 * image.rgba[at + 1] + 0.114 * image.rgba[at + 2];
}

}  // namespace

Status write_png(const std::filesystem::path& path, const Image& image) {
  const std::size_t bytes =
      4 * static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px);
  if (image.width_px <= 0 || image.height_px <= 0 || image.rgba.size() != bytes) {
    return make_error(ErrorCode::invalid_argument, "an empty picture cannot be written");
  }
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width_px);
  png.height = static_cast<png_uint_32>(image.height_px);
  png.format = PNG_FORMAT_RGBA;
  const std::filesystem::path temporary = path.string() + fmt::format(".{}.tmp", ::getpid());
  std::error_code failure;
  if (png_image_write_to_file(&png, temporary.c_str(), 0, image.rgba.data(), 0, nullptr) == 0) {
    const std::string reason = png.message;
    std::filesystem::remove(temporary, failure);
    return make_error(ErrorCode::io, fmt::format("cannot write {}: {}", path.string(), reason));
  }
  std::filesystem::rename(temporary, path, failure);
  if (failure) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    return make_error(ErrorCode::io, fmt::format("cannot write {}: {}", path.string(), failure.message()));
  }
  return {};
}

Result<Image> read_png(const std::filesystem::path& path) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (!std::filesystem::exists(path)) {
    return make_error(ErrorCode::not_found, fmt::format("{} does not exist", path.string()));
  }
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) {
    return make_error(ErrorCode::data_corrupt, fmt::format("{}: {}", path.string(), png.message));
  }
  if (png.width > max_side_px || png.height > max_side_px) {
    png_image_free(&png);
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("{}: {}x{} is larger than {} px a side", path.string(), png.width,
                                  png.height, max_side_px));
  }
  png.format = PNG_FORMAT_RGBA;
  Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  image.rgba.resize(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, image.rgba.data(), 0, nullptr) == 0) {
    return make_error(ErrorCode::data_corrupt, fmt::format("{}: {}", path.string(), png.message));
  }
  return image;
}

Result<double> mean_absolute_difference(const Image& a, const Image& b) {
  if (const Status same = check_same_size(a, b); !same) return same.error();
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); i += 4) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      sum += std::abs(static_cast<int>(a.rgba[i + channel]) - static_cast<int>(b.rgba[i + channel]));
    }
  }
  return sum / (0.75 * static_cast<double>(a.rgba.size()));
}

Result<double> structural_similarity(const Image& a, const Image& b) {
  if (const Status same = check_same_size(a, b); !same) return same.error();
  constexpr int block = 8;
  constexpr double c1 = (0.01 * 255) * (0.01 * 255);
  constexpr double c2 = (0.03 * 255) * (0.03 * 255);
  double sum = 0.0;
  int blocks = 0;
  for (int y0 = 0; y0 + block <= a.height_px; y0 += block) {
    for (int x0 = 0; x0 + block <= a.width_px; x0 += block) {
      double sa = 0.0, sb = 0.0, saa = 0.0, sbb = 0.0, sab = 0.0;
      for (int y = y0; y < y0 + block; ++y) {
        for (int x = x0; x < x0 + block; ++x) {
          const double la = luma(a, x, y);
          const double lb = luma(b, x, y);
          sa += la;
          sb += lb;
          saa += la * la;
          sbb += lb * lb;
          sab += la * lb;
        }
      }
      constexpr double n = block * block;
      const double ma = sa / n;
      const double mb = sb / n;
      const double va = saa / n - ma * ma;
      const double vb = sbb / n - mb * mb;
      const double vab = sab / n - ma * mb;
      sum += (2 * ma * mb + c1) * (2 * vab + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
      ++blocks;
    }
  }
  if (blocks == 0) return make_error(ErrorCode::invalid_argument, "a picture below 8 px has no structure");
  return sum / blocks;
}

}  // namespace handloft::client
