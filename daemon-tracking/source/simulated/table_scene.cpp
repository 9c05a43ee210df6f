#include "daemon-tracking/source/simulated/table_scene.h"

#include <algorithm>
#include <cmath>

#include "daemon-tracking/source/simulated/random.h"

namespace handloft::tracking {
namespace {

constexpr double board_half_width_m = 0.46, board_half_depth_m = 0.36;
constexpr double board_shift_x_m = 0.05;  ///< The palette lies on the right.
/// Rays per texel and axis near a tag.
constexpr int texel_rays = 8;
constexpr double half_diagonal = 0.75;  ///< Of a square of edge 1, rounded up.

/// Smooth noise on a grid of 1, in -1..1.
double value_noise(double x, double y, std::uint64_t stream) {
  const double fx = std::floor(x), fy = std::floor(y);
  const double u = x - fx, v = y - fy;
  const auto corner = [&](double i, double j) {
    const auto key = static_cast<std::uint64_t>(static_cast<std::int64_t>(fx + i) * 7919 +
                                                static_cast<std::int64_t>(fy + j) + (1 << 20));
    return 2 * uniform(0x7AB1E, stream, key) - 1;
  };
  const double su = u * u * (3 - 2 * u), sv = v * v * (3 - 2 * v);
  return (corner(0, 0) * (1 - su) + corner(1, 0) * su) * (1 - sv) +
         (corner(0, 1) * (1 - su) + corner(1, 1) * su) * sv;
}

float wood(double x_m, double y_m) {
  // Long grain along x, 5 mm apart, on broad lighter and darker boards.
  const double grain = value_noise(x_m * 14, y_m * 210, 1), board = value_noise(x_m * 4, y_m * 16, 2);
  return static_cast<float>(148 + 5.0 * grain + 7.0 * board);
}

}  // namespace

TableScene::TableScene(const std::vector<TagPlacement>& table_tags) {
  for (const TagPlacement& placement : table_tags) {
    const auto bitmap = tag_bitmap(placement.id);
    if (!bitmap) continue;
    Tag tag;
    tag.centre_x_m = placement.body_from_tag.translation().x();
    tag.centre_y_m = placement.body_from_tag.translation().y();
    const Eigen::Matrix2d tag_from_world = placement.body_from_tag.linear().topLeftCorner<2, 2>().transpose();
    tag.xx = tag_from_world(0, 0), tag.xy = tag_from_world(0, 1);
    tag.yx = tag_from_world(1, 0), tag.yy = tag_from_world(1, 1);
    tag.edge_m = placement.edge_m;
    tag.reach_m = TagBitmap::sheet_edge_m(tag.edge_m) * half_diagonal;
    tag.bitmap = *bitmap;
    tags_.push_back(tag);
  }
}

bool TableScene::on_board(double x_m, double y_m) const {
  return std::abs(x_m - board_shift_x_m) <= board_half_width_m && std::abs(y_m) <= board_half_depth_m;
}

bool TableScene::near_tag(double x_m, double y_m, double reach_m) const {
  return std::any_of(tags_.begin(), tags_.end(), [&](const Tag& tag) {
    const double reach = tag.reach_m + reach_m;
    return tag.squared_distance(x_m, y_m) <= reach * reach;
  });
}

float TableScene::luma_at(double x_m, double y_m) const {
  if (!on_board(x_m, y_m)) return scene_light::room_y;
  for (const Tag& tag : tags_) {
    if (tag.squared_distance(x_m, y_m) > tag.reach_m * tag.reach_m) continue;
    const double dx = x_m - tag.centre_x_m, dy = y_m - tag.centre_y_m;
    if (const auto white =
            tag.bitmap.white_at(tag.xx * dx + tag.xy * dy, tag.yx * dx + tag.yy * dy, tag.edge_m)) {
      return *white ? scene_light::tag_white : scene_light::tag_black;
    }
  }
  return wood(x_m, y_m);
}

TableScene::Texture TableScene::texture(double texel_m) const {
  Texture texture;
  texture.texel_m = texel_m;
  const double margin_m = 4 * texel_m;
  texture.left_m = board_shift_x_m - board_half_width_m - margin_m;
  texture.top_m = board_half_depth_m + margin_m;
  texture.width = static_cast<int>(std::ceil(2 * (board_half_width_m + margin_m) / texel_m));
  texture.height = static_cast<int>(std::ceil(2 * (board_half_depth_m + margin_m) / texel_m));
  texture.luma.resize(static_cast<std::size_t>(texture.width) * static_cast<std::size_t>(texture.height));
  std::size_t index = 0;
  for (int row = 0; row < texture.height; ++row) {
    for (int column = 0; column < texture.width; ++column, ++index) {
      const double x = texture.left_m + column * texel_m, y = texture.top_m - row * texel_m;
      const int rays = near_tag(x, y, texel_m) ? texel_rays : 1;
      float sum = 0;
      for (int j = 0; j < rays; ++j) {
        for (int i = 0; i < rays; ++i) {
          sum += luma_at(x + ((i + 0.5) / rays - 0.5) * texel_m, y + ((j + 0.5) / rays - 0.5) * texel_m);
        }
      }
      texture.luma[index] = static_cast<std::uint8_t>(std::lround(sum / static_cast<float>(rays * rays)));
    }
  }
  return texture;
}

}  // namespace handloft::tracking
