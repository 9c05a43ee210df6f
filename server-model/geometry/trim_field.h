#pragma once
// What of an unbounded surface is seen, whichever way it is trimmed: by a superellipse about its footprint
// (A22, A23) or by a drawn curve (A24). In the x-y plane of the surface's frame. A cheap value: curves are
// shared.

#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "server-model/geometry/boundary_trim.h"
#include "server-model/geometry/superellipse.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// Exports trim here (A26), and what is fainter is not hit by rays and hands.
inline constexpr double solid_opacity = 0.5;

class TrimField {
 public:
  /// A unit circle as a superellipse.
  TrimField() = default;
  TrimField(const Superellipse& superellipse) : trim_(superellipse) {}  // NOLINT: is one.
  /// Precondition: not null.
  TrimField(std::shared_ptr<const BoundaryTrim> boundary) : trim_(std::move(boundary)) {}  // NOLINT

  /// T, 0..1.
  double opacity(const Vec2& xy) const;
  /// T >= 1/2.
  bool solid(const Vec2& xy) const { return opacity(xy) >= solid_opacity; }

  /// The box around all that is solid: footprint of exports and rays.
  Box2 solid_box() const;
  /// A box at and beyond whose border nothing has an opacity above 1/255: footprint of meshes.
  Box2 visible_box() const;
  /// A place where the surface is as opaque as anywhere.
  Vec2 core() const;
  /// The closed contour T = 1/2, the first point not repeated: a boundary curve itself, a superellipse with
  /// 4 * per_quadrant points.
  std::vector<Vec2> outline(int per_quadrant = 64) const;

  /// Null when the trim is of the other kind.
  const Superellipse* superellipse() const { return std::get_if<Superellipse>(&trim_); }
  const BoundaryTrim* boundary() const;

 private:
  std::variant<Superellipse, std::shared_ptr<const BoundaryTrim>> trim_;
};

}  // namespace handloft::geometry
