#pragma once
// How far triangles may lie from a B-spline surface: bounds of its second derivatives by spans, and where it
// has creases (Filip, Magedson and Markot, "Surface algorithms using bounds on derivatives", 1986).

#include <vector>

#include "server-model/geometry/bspline_pieces.h"

namespace handloft::geometry {

class SpanBends {
 public:
  explicit SpanBends(const BSplineSurface& surface);

  /// No triangle with its corners on the surface and in the parameters' box is farther from it than this:
  /// (a^2 Muu + 2 a b Muv + b^2 Mvv) / 8. The box must not hold a crease inside.
  double chord_bound(const Vec2& lower, const Vec2& upper) const;
  /// The two directions' shares of it.
  Vec2 shares(const Vec2& lower, const Vec2& upper) const;

  const std::vector<double>& us() const { return us_; }  ///< Where spans meet, with both ends.
  const std::vector<double>& vs() const { return vs_; }
  const std::vector<double>& creases_u() const { return creases_u_; }  ///< Knots of multiplicity p, inside.
  const std::vector<double>& creases_v() const { return creases_v_; }

 private:
  Vec3 most(const Vec2& lower, const Vec2& upper) const;

  std::vector<double> us_, vs_, creases_u_, creases_v_;
  std::vector<Vec3> bends_;  ///< Muu, Muv, Mvv by spans, in the surface's parameters.
};

}  // namespace handloft::geometry
