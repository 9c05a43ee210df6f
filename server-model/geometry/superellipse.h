#pragma once
// The visible part of an unbounded surface (A22, eq. 6; A23, eq. 7): a superellipse about the box of the
// footprint, f = |x'/r_x|^n + |y'/r_y|^n, whose opacity T = exp(-f^6 / 10) fades outside of the box: T(f = 1)
// = 0.905, T = 1/2 at f = 1.381 (where exports trim, A26), 1/255 at f = 1.953 (where meshes end).

#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

inline constexpr double min_exponent = 0.2;  ///< A22: thinner stars than this have no area to see.
inline constexpr double max_exponent = 20;   ///< A22: a square to the eye.
/// Stands for a box side of zero length, as a fraction of the other side (A22).
inline constexpr double min_extent_fraction = 1e-3;
/// Below this a box side is taken for zero even if the other is, too: a hundredth of a millimetre.
inline constexpr double min_extent_m = 1e-5;

/// T = exp(-f^6 / 10), in 0..1; 0 for NaN.
double opacity_at_level(double f);
/// The f at which T = opacity. Precondition: 0 < opacity < 1.
double level_of_opacity(double opacity);

/// (10 ln 2)^(1/6) = 1.381: half opaque, the exported contour.
double trim_level();
/// (10 ln 255)^(1/6) = 1.953: the last level that eight bits can show.
double visible_level();

/// In the x-y plane of a surface's frame.
class Superellipse {
 public:
  /// A unit circle.
  Superellipse() = default;
  /// The exponent is clamped to [0.2, 20] and degenerate sides are widened. Errors: invalid_argument for
  /// numbers that are not finite or negative extents, or an exponent <= 0.
  static Result<Superellipse> create(const Box2& box, double exponent = 2.0);

  const Vec2& centre() const { return box_.centre; }
  /// (r_x, r_y), metres, > 0.
  const Vec2& half_extent() const { return box_.half_extent; }
  const Box2& box() const { return box_; }
  double exponent() const { return exponent_; }

  /// f of eq. 6. 0 at the centre, 1 on the superellipse that touches the box.
  double level(const Vec2& xy) const;
  double opacity(const Vec2& xy) const { return opacity_at_level(level(xy)); }

  /// The point of the contour f = level in the direction of `angle` from the centre, the angle measured after
  /// scaling the box to a square (radians).
  Vec2 contour_point(double angle, double level = 1.0) const;

  /// Half extents of the box around the contour f = level: (r_x, r_y) level^(1/n).
  Vec2 contour_half_extent(double level = 1.0) const;

  /// Area of {f <= level}: 4 r_x r_y G(1 + 1/n)^2 / G(1 + 2/n) level^(2/n).
  double area(double level = 1.0) const;

  /// A closed polyline around {f = level}, counterclockwise from +x, 4 * per_quadrant points evenly spaced by
  /// arc length within each quadrant of the scaled square; the tips are among them, the first isn't repeated.
  std::vector<Vec2> contour(double level, int per_quadrant) const;

  bool operator==(const Superellipse& other) const {
    return box_.centre == other.box_.centre && box_.half_extent == other.box_.half_extent &&
           exponent_ == other.exponent_;
  }

 private:
  Box2 box_{Vec2::Zero(), Vec2::Ones()};
  double exponent_ = 2.0;
};

}  // namespace handloft::geometry
