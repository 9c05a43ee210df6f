#pragma once
// The dual shape (Fuge et al., requirements A1-A12): weighted points and the polynomial surface fitted to
// them, both kept intact through every operation (A28). Immutable once in a document; documents share it.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/superellipse.h"
#include "server-model/geometry/trim_field.h"
#include "server-model/geometry/types.h"
#include "server-model/model/chunked_vector.h"
#include "server-model/model/entity.h"
#include "server-model/model/trim_curve.h"

namespace handloft::model {

/// A point with its certainty (A1).
struct DualPoint {
  static constexpr std::uint32_t no_partner = 0xffffffffU;

  double x = 0, y = 0, z = 0;  ///< World, metres.
  double pressure = 0;         ///< rho, 0..1; the weight of the fit (A6).
  std::int64_t time_ns = 0;
  std::uint32_t stroke = 0;  ///< From 1; each stroke is one gesture, its mirror image another stroke.
  /// The index of the mirror image as it was laid: in the same shape or in the partner shape, by the symmetry
  /// of that moment. Ask DualShape::mirror_partner(), which knows whether the link still holds.
  std::uint32_t partner = no_partner;

  geometry::Vec3 position() const { return {x, y, z}; }
};
using PointCloud = ChunkedVector<DualPoint>;

/// A plane with a unit normal, in which points are mirrored: p' = p - 2 ((p - o) . n) n (A12).
using MirrorPlane = geometry::Plane;

enum class SymmetryMode : std::uint8_t { off, same_shape, partner };
enum class Representation : std::uint8_t { points, surface, both };

/// What a fit left behind. Immutable and shared by all later versions of the shape until the next fit.
struct FittedSurface {
  geometry::Frame frame;                ///< Frozen at the first fit (A5); z is the direction of residuals.
  geometry::PolynomialSurface surface;  ///< z = f(x, y) in `frame` (A4).
  std::uint32_t requested_degree = 2;   ///< surface.degree() is lower where the points do not carry it (A7).
  std::vector<double> residuals_m;      ///< r_i = z_i - f(x_i, y_i) of the points there were at the fit (A8).
  geometry::ResidualStatistics statistics;
  /// Of degrees 1, 2, ... when the degree was chosen by cross-validation (automatic_degree.h), metres; -1:
  /// one that the points don't carry or could not without one of them. Else empty.
  std::vector<double> cross_validated_rms_m;
  geometry::Box2 box;          ///< Footprint of the points in the frame (A22); a side may be 0.
  double frame_drift_rad = 0;  ///< 0..pi/2 between the frozen normal and that of a fresh frame (A10).
};

struct DualShape final : Entity {
  std::uint32_t requested_degree = 2;
  PointCloud points;
  std::uint32_t stroke_count = 0;            ///< Strokes are numbered 1..stroke_count.
  std::shared_ptr<const FittedSurface> fit;  ///< Null before the first fit.
  bool stale = false;                        ///< Points changed since the fit (A9).
  SymmetryMode symmetry = SymmetryMode::off;
  MirrorPlane plane;  ///< Unit normal; meaningful unless symmetry is off.
  std::uint32_t linked_from =
      0;                ///< Points before this one are not mirrored by the present symmetry (any more).
  std::string partner;  ///< The linked mirror shape; empty: none (yet).
  double superellipse_exponent = 2.0;         ///< A22; 2 is the ellipse.
  std::shared_ptr<const TrimCurve> boundary;  ///< Trims instead of the superellipse (A24); null: none.
  Representation representation = Representation::points;

  EntityKind kind() const override { return EntityKind::dual_shape; }
  std::shared_ptr<Entity> clone() const override { return std::make_shared<DualShape>(*this); }

  bool fitted() const { return fit != nullptr; }
  /// r_i of point i, 0 when it is newer than the fit or there is none.
  double residual_m(std::size_t i) const {
    return fit && i < fit->residuals_m.size() ? fit->residuals_m[i] : 0.0;
  }
  /// Where point i's mirror image is: in this shape (same_shape) or in `partner` (partner); no_partner:
  /// nowhere.
  std::uint32_t mirror_partner(std::size_t i) const {
    return symmetry != SymmetryMode::off && i >= linked_from ? points[i].partner : DualPoint::no_partner;
  }
  /// The superellipse about the footprint (A22, A23). failed_precondition when not fitted.
  Result<geometry::Superellipse> superellipse() const;
  /// Where the fitted surface is seen: within the boundary curve, or the superellipse when there is none or
  /// it encloses nothing as seen along a base plane that was fitted again. failed_precondition when not
  /// fitted.
  Result<geometry::TrimField> trim() const;
};

using DualPtr = std::shared_ptr<const DualShape>;

/// The entity as a dual shape; null when it is null or of another kind.
inline DualPtr as_dual(const EntityPtr& entity) {
  return entity && entity->kind() == EntityKind::dual_shape
             ? std::static_pointer_cast<const DualShape>(entity)
             : nullptr;
}

std::string_view to_string(SymmetryMode mode);  ///< "off", "same_shape", "partner"

}  // namespace handloft::model
