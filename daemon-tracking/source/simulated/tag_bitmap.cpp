#include "daemon-tracking/source/simulated/tag_bitmap.h"

#include <cmath>
#include <cstddef>

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

namespace handloft::tracking {
namespace {

constexpr int white_from = 128;

}  // namespace

std::optional<bool> TagBitmap::white_at(double x_m, double y_m, double edge_m) const {
  const double cell_m = edge_m / border_cells;
  const int column = static_cast<int>(std::floor(x_m / cell_m + cells / 2.0));
  const int row = static_cast<int>(std::floor(cells / 2.0 - y_m / cell_m));
  if (column < 0 || row < 0 || column >= cells || row >= cells) return std::nullopt;
  return white[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
}

std::optional<TagBitmap> tag_bitmap(int id) {
  apriltag_family_t* family = tag36h11_create();
  std::optional<TagBitmap> bitmap;
  if (id >= 0 && id < static_cast<int>(family->ncodes)) {
    image_u8_t* image = apriltag_to_image(family, id);
    if (image->width == TagBitmap::cells && image->height == TagBitmap::cells) {
      bitmap.emplace();
      for (int row = 0; row < TagBitmap::cells; ++row) {
        for (int column = 0; column < TagBitmap::cells; ++column) {
          bitmap->white[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] =
              image->buf[row * image->stride + column] >= white_from;
        }
      }
    }
    image_u8_destroy(image);
  }
  tag36h11_destroy(family);
  return bitmap;
}

}  // namespace handloft::tracking
