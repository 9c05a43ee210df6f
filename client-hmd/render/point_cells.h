#pragma once
// Large clouds of fuzzy points in cells (V3): what a frame needs to leave out what is not seen and to thin
// out what lies many times over each other. Every cell holds its points in an order of which any beginning is
// spread evenly over the cell, at 8 bytes each (positions in 1/65535 of the cell).
//
// Where discs cover a place of the picture `layers` times on average, a share of them is enough: n discs of
// opacity a let (1 - a)^n through, a share p of them the same when each has the opacity 1 - (1 - a)^(1/p)
// (Cook et al., "Stochastic simplification of aggregate detail", SIGGRAPH 2007, for opacity instead of area).
// Their colours are averaged anyway (V2). Pure: no OpenGL here.

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "client-hmd/mirror/scene.h"
#include "client-hmd/render/disc_fill.h"

namespace handloft::client {

struct PackedPoint {
  std::uint16_t x = 0, y = 0, z = 0;  ///< Share of the cell's box.
  std::uint16_t style = 0;
};

struct PointCell {
  std::uint32_t first = 0, count = 0;  ///< Of PointCells::points.
  glm::vec3 low{0.0F}, size{0.0F};     ///< Its points' box, metres.
  float disc_area_m2 = 0.0F;           ///< Sum of all discs' areas.
  float largest_radius_m = 0.0F;
};

struct PointCells {
  std::vector<PackedPoint> points;
  std::vector<PointCell> cells;
};

/// More styles than a packed point can name are not put into cells.
inline constexpr std::size_t max_packed_styles = 65536;
/// Fewer points are drawn as they come.
inline constexpr std::size_t fewest_points_in_cells = 20'000;

/// The first `count` points of `set`. nullopt: more styles than max_packed_styles, or nothing to do.
std::optional<PointCells> into_cells(const PointSet& set, std::size_t count);

/// What a picture sees of a cell.
struct CellView {
  glm::mat4 clip_from_world{1.0F};
  glm::vec3 eye{0.0F};
  float focal_px = 1.0F;
  float most_layers = 24.0F;  ///< Discs over each other from which on some are left out: the rest is opaque.
};

/// How many of a cell's points to draw, and each for how many: 0 where it is out of sight.
struct CellShare {
  std::uint32_t count = 0;
  float boost = 1.0F;  ///< 1/p.
};
CellShare share_of(const PointCell& cell, const CellView& view);
/// `share` (0..1) of what is drawn of a cell; never nothing.
CellShare thinned(const CellShare& of_cell, double share);

/// What one of the cell's discs costs on average (disc_fill.h), from a few of them. Their styles must be
/// indices into `styles`.
float mean_disc_cost_px(const PointCell& cell, const PointCells& of, std::span<const ShellStyle> styles,
                        const DiscView& view);

}  // namespace handloft::client
