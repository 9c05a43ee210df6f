#pragma once
// What lies still: the wood-grey table board with its tags, and the room behind it, as reflected light.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/simulated/tag_bitmap.h"

namespace handloft::tracking {

/// Grey levels and chroma of the scene, BT.601 full range.
namespace scene_light {
inline constexpr float tag_black = 28, tag_white = 222;
inline constexpr float board_cb = 123, board_cr = 132;  ///< A greyish wood.
inline constexpr float room_y = 72, room_cb = 128, room_cr = 127;
}  // namespace scene_light

class TableScene {
 public:
  explicit TableScene(const std::vector<TagPlacement>& table_tags);

  /// Luma at a point of the plane z = 0, no blur; `room` where the board ends.
  float luma_at(double x_m, double y_m) const;
  bool on_board(double x_m, double y_m) const;
  /// Whether a tag's edge may be within `reach_m`: where a pixel needs many rays.
  bool near_tag(double x_m, double y_m, double reach_m) const;

  /// The board as a picture, each texel the mean over its area.
  struct Texture {
    double texel_m = 0.0008;
    double left_m = 0, top_m = 0;  ///< World x, y of the centre of texel (0, 0); v runs along -y.
    int width = 0, height = 0;
    std::vector<std::uint8_t> luma;
  };
  Texture texture(double texel_m) const;

 private:
  // Plain numbers: every ray of every picture asks, and an unoptimised build pays dearly for matrices.
  struct Tag {
    double centre_x_m = 0, centre_y_m = 0;
    double xx = 1, xy = 0, yx = 0, yy = 1;  ///< The rotation tag_from_world.
    double edge_m = 0;
    double reach_m = 0;  ///< Of the circle around the sheet.
    TagBitmap bitmap;

    double squared_distance(double x_m, double y_m) const {
      const double dx = x_m - centre_x_m, dy = y_m - centre_y_m;
      return dx * dx + dy * dy;
    }
  };
  std::vector<Tag> tags_;
};

}  // namespace handloft::tracking
