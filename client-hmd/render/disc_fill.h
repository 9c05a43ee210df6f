#pragma once
// What the discs of fuzzy points cost a picture, and how many of them it draws when they cost too much: a
// server may send millions that each fill the screen, and a frame must end all the same (V3, V5). Pure: no
// OpenGL here.

#include <cstddef>
#include <glm/glm.hpp>
#include <span>

#include "client-hmd/mirror/scene.h"

namespace handloft::client {

/// What a picture sees of discs.
struct DiscView {
  glm::mat4 eye_from_world{1.0F};
  glm::mat4 clip_from_eye{1.0F};
  glm::vec2 viewport_px{1.0F};
  float focal_px = 1.0F;
  float smallest_px = 0.0F;  ///< Radius that smaller ones are drawn with.
};

/// How often the discs of a frame may cover all of its picture together. Ordinary ones do so once or twice.
inline constexpr float most_coverings_of_a_frame = 256.0F;
inline constexpr float most_coverings_of_a_still = 512.0F;

/// Pixels that a disc is worked on for: of its square as far as it is in the picture, and what any disc
/// costs.
float disc_cost_px(const glm::vec3& place, float radius_m, const DiscView& view);

/// Of all `points` together, from an even sample of them. Their styles must be indices into `styles`.
double cost_px(std::span<const FuzzyPoint> points, std::span<const ShellStyle> styles, const DiscView& view);

/// Which share of discs that cost `cost_px` is drawn when they may cover the picture `coverings` times; 0..1.
double share_within(double cost_px, const DiscView& view, float coverings);

/// Every n-th of points that are in no order: as many as `share` of them, each for `boost` (point_cells.h).
struct EveryNth {
  std::size_t n = 1;
  std::size_t count = 0;
  float boost = 1.0F;
};
EveryNth every_nth(std::size_t points, double share);

}  // namespace handloft::client
