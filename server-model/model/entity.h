#pragma once
// The dual shape (Fuge et al., requirements A1-A12): weighted points and the polynomial surface fitted to
// them, both kept intact through every operation (A28). Immutable once in a document; documents share it.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server-model/geometry/frame.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/model/chunked_vector.h"

namespace handloft::model {

/// A point with its certainty (A1). `mirror_partner` is the index of its mirror image: in the same shape for
/// Symmetry::same_shape, in the partner shape for Symmetry::partner; no_partner when it was laid without
/// symmetry.
struct DualPoint {
  static constexpr std::uint32_t no_partner = 0xffffffffU;

  double x = 0, y = 0, z = 0;  ///< World, metres.
  double pressure = 0;         ///< rho, 0..1; the weight of the fit (A6).
  std::int64_t time_ns = 0;
  std::uint32_t stroke = 0;  ///< From 1; each stroke is one gesture.
  std::uint32_t mirror_partner = no_partner;

  Eigen::Vector3d position() const { return {x, y, z}; }
};
using PointCloud = ChunkedVector<DualPoint>;

/// The plane through `origin` with unit `normal`.
struct MirrorPlane {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();

  /// A12: p' = p - 2 ((p - o) . n) n. Twice is the identity to rounding.
  Eigen::Vector3d mirror(const Eigen::Vector3d& point) const;
  Eigen::Vector3d mirror_direction(const Eigen::Vector3d& direction) const;
};

enum class SymmetryMode : std::uint8_t { off, same_shape, partner };
enum class Representation : std::uint8_t { points, surface, both };

struct ResidualStatistics {
  std::uint32_t count = 0;
  double rms_m = 0;
  double weighted_rms_m = 0;  ///< sqrt(sum rho r^2 / sum rho)
  double max_m = 0;           ///< Largest magnitude.
};

/// What a fit left behind. Immutable and shared by all later versions of the shape until the next fit.
struct FittedSurface {
  geometry::Frame frame;                ///< Frozen at the first fit (A5); z is the direction of residuals.
  geometry::PolynomialSurface surface;  ///< z = f(x, y) in `frame` (A4).
  std::uint32_t requested_degree = 2;   ///< surface.degree() is lower where the points do not carry it (A7).
  std::vector<double>
      residuals_m;  ///< r_i = z_i - f(x_i, y_i) of the points [0, size) there were at the fit (A8).
  ResidualStatistics statistics;
  Eigen::Vector2d box_centre =
      Eigen::Vector2d::Zero();  ///< Footprint of the points in the frame (A22), metres.
  Eigen::Vector2d box_half_extent = Eigen::Vector2d::Zero();  ///< Both > 0.
  double frame_drift_rad = 0;  ///< Between the frozen normal and that of the points' fresh frame (A10).
};

struct DualShape {
  std::string id;
  std::string name;
  std::uint32_t requested_degree = 2;
  PointCloud points;
  std::uint32_t stroke_count = 0;            ///< Strokes are numbered 1..stroke_count.
  std::shared_ptr<const FittedSurface> fit;  ///< Null before the first fit.
  bool stale = false;                        ///< Points changed since the fit (A9).
  SymmetryMode symmetry = SymmetryMode::off;
  MirrorPlane plane;                   ///< Meaningful unless symmetry is off.
  std::string partner;                 ///< The linked mirror shape; empty: none (yet).
  double superellipse_exponent = 2.0;  ///< A22; 2 is the ellipse.
  Representation representation = Representation::points;

  bool fitted() const { return fit != nullptr; }
  /// r_i of point i, 0 when it is newer than the fit or there is none.
  double residual_m(std::size_t i) const {
    return fit && i < fit->residuals_m.size() ? fit->residuals_m[i] : 0.0;
  }
};

using EntityPtr = std::shared_ptr<const DualShape>;

}  // namespace handloft::model
