#pragma once
// What holds of every document, whatever was done to it: numbers are numbers, links lead back, images are
// mirror images (A12), and current fits are the optimum of their points (A8). Sculpted surfaces:
// sculpting_invariants.h.

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "sculpting_invariants.h"
#include "server-model/geometry/symmetry.h"
#include "server-model/model/model.h"

namespace handloft::model::test {

/// As many operations the invariants allow to have rounded the same numbers.
inline constexpr int longest_sequence = 60;

inline std::string broken_link(const Document& document, const DualShape& shape) {
  if (shape.linked_from > shape.points.size()) return "mirrored from beyond the points";
  if (shape.symmetry == SymmetryMode::off) return shape.partner.empty() ? "" : "a partner without symmetry";
  if (std::abs(shape.plane.normal.norm() - 1) > 1e-12) return "a mirror plane without a unit normal";
  const DualShape* other = &shape;
  DualPtr partner;
  if (shape.symmetry == SymmetryMode::partner) {
    if (shape.partner.empty()) return "";
    partner = document.find_dual(shape.partner);
    if (!partner) return "a partner that is not there";
    other = partner.get();
    if (other->partner != shape.id || other->symmetry != SymmetryMode::partner) return "a partner of another";
    if (other->plane.normal != shape.plane.normal || other->plane.origin != shape.plane.origin) {
      return "partners with two planes";
    }
  }
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const std::uint32_t image = shape.mirror_partner(i);
    if (image == DualPoint::no_partner) continue;
    if (image >= other->points.size()) return "an image beyond the points";
    if (other->mirror_partner(image) != i) return "an image of another point";
    const geometry::Vec3 place = shape.points[i].position();
    const geometry::Vec3 error =
        geometry::reflect_point(place, shape.plane) - other->points[image].position();
    // Sixty operations, each with rounding of the size of the workspace.
    if (!(error.norm() <= 1e-11 * (1 + place.norm() + shape.plane.origin.norm()))) {
      return "an image that is not the mirror image";
    }
    if (other->points[image].pressure != shape.points[i].pressure) return "an image of another weight";
  }
  return "";
}

/// The surface of a current fit is the optimum of its points (A8): with a_k the column sqrt(theta) u^i v^j of
/// the design and r the residuals, sqrt(theta) r is orthogonal to a_k for i + j <= N. Three errors are
/// allowed. Residual matching takes changes of r by 1e-12 of the heights z for rounding (settle() in
/// profile_edit.cpp). Householder QR is stable column by column (Higham, Accuracy and Stability,
/// theorem 20.3): what it finds is the optimum of columns that are off by n p eps of their length, and so is
/// each value f(x, y) = sum c_k a_k. An ill-conditioned design has large coefficients that cancel: the second
/// error scales with it. Besides, every operation rounds the places of points in the world, which moves them
/// over the surface and the monomials by more the smaller a shape is and the farther from the origin.
inline std::string broken_optimum(const DualShape& shape) {
  const FittedSurface& fit = *shape.fit;
  const geometry::Box2& box = fit.surface.box();
  const auto scaled_coefficients = fit.surface.scaled_coefficients();
  const std::size_t p = scaled_coefficients.size();
  std::vector<double> gradient(p, 0.0);
  std::vector<double> length(p, 0.0);
  std::vector<double> row(p);
  double heights = 0;
  double displacements = 0;
  const double eps = std::numeric_limits<double>::epsilon();
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const double theta = shape.points[i].pressure;
    if (!(theta > 0)) continue;  // It may lie anywhere, far outside of the surface's box.
    const geometry::Vec3 at = fit.frame.to_local(shape.points[i].position());
    const geometry::Vec2 uv = (at.head<2>() - box.centre).cwiseQuotient(box.half_extent);
    geometry::evaluate_monomials(fit.surface.degree(), uv.x(), uv.y(), row.data());
    for (std::size_t k = 0; k < p; ++k) {
      gradient[k] += theta * fit.residuals_m[i] * row[k];
      length[k] += theta * row[k] * row[k];
    }
    heights += theta * at.z() * at.z();
    const double rounding =
        longest_sequence * eps * (shape.points[i].position().norm() + fit.frame.origin.norm());
    const double turned = 1 + fit.surface.gradient(at.x(), at.y()).norm() +
                          fit.surface.degree() * std::abs(fit.residuals_m[i]) / box.half_extent.minCoeff();
    displacements += theta * rounding * rounding * turned * turned;
  }
  double summands = 0;  // Of f, before they cancel.
  for (std::size_t k = 0; k < p; ++k) {
    length[k] = std::sqrt(length[k]);
    summands += length[k] * std::abs(scaled_coefficients[k]);
  }
  heights = std::sqrt(heights);
  constexpr double matching = 1e-12;
  const double rounding = static_cast<double>(shape.points.size() * p) * eps;
  for (std::size_t k = 0; k < p; ++k) {
    const double allowed =
        length[k] * (matching * heights + rounding * (heights + summands) + std::sqrt(displacements));
    if (!(std::abs(gradient[k]) <= allowed)) {
      return fmt::format("a current fit that is not the optimum: gradient {} of coefficient {}, allowed {}",
                         gradient[k], k, allowed);
    }
  }
  return "";
}

inline std::string broken_fit(const DualShape& shape) {
  const FittedSurface& fit = *shape.fit;
  const geometry::Mat3& r = fit.frame.rotation;
  if (!fit.frame.origin.allFinite() || !r.allFinite()) return "a frame of no numbers";
  if ((r.transpose() * r - geometry::Mat3::Identity()).cwiseAbs().maxCoeff() > 1e-12 || r.determinant() < 0) {
    return "a frame that is not orthonormal and right-handed";
  }
  for (const double c : fit.surface.coefficients()) {
    if (!std::isfinite(c)) return "a coefficient that is no number";
  }
  for (const double residual : fit.residuals_m) {
    if (!std::isfinite(residual)) return "a residual that is no number";
  }
  if (!std::isfinite(fit.statistics.rms) || !std::isfinite(fit.statistics.max))
    return "statistics of no numbers";
  if (!(fit.box.half_extent.minCoeff() >= 0) || !fit.box.half_extent.allFinite())
    return "a box without extent";
  if (!(fit.frame_drift_rad >= 0 && fit.frame_drift_rad <= 1.6)) return "a drift that is no angle";
  if (fit.surface.degree() > static_cast<int>(fit.requested_degree)) return "a degree above the wanted one";
  if (fit.residuals_m.size() > shape.points.size()) return "residuals of points that are gone";
  if (shape.stale) return "";
  if (fit.residuals_m.size() != shape.points.size()) return "a current fit without all residuals";
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const geometry::Vec3 p = fit.frame.to_local(shape.points[i].position());
    const double r_now = p.z() - fit.surface.value(p.x(), p.y());
    const double steepness = 1 + fit.surface.gradient(p.x(), p.y()).norm();
    const double error = std::abs(r_now - fit.residuals_m[i]);
    if (!(error <= 1e-9 * (1 + p.norm()) * steepness)) {
      return fmt::format(
          "a residual that is not the point's: {} instead of {}, slope {}, degree {}, point {} of {}",
          fit.residuals_m[i], r_now, steepness, fit.surface.degree(), i, shape.points.size());
    }
  }
  return broken_optimum(shape);
}

inline std::string broken_shape(const Document& document, const DualShape& shape, const Limits& limits) {
  for (const DualPoint& point : shape.points) {
    if (!point.position().allFinite()) return "a point of no numbers";
    if (point.position().cwiseAbs().maxCoeff() > limits.max_coordinate_m * 10)
      return "a point out of the world";
    if (!(point.pressure >= 0 && point.pressure <= 1)) return "a weight outside of 0..1";
    if (point.stroke == 0 || point.stroke > shape.stroke_count) return "a point of no stroke";
  }
  if (shape.requested_degree < 1 || shape.requested_degree > limits.max_degree)
    return "a degree outside of 1..6";
  if (!(shape.superellipse_exponent >= limits.min_superellipse_exponent &&
        shape.superellipse_exponent <= limits.max_superellipse_exponent)) {
    return "an exponent out of range";
  }
  if (!shape.fit && shape.stale) return "stale without a fit";
  if (!shape.fit && shape.representation == Representation::surface) return "shown as a surface it has not";
  if (shape.fit) {
    if (const std::string broken = broken_fit(shape); !broken.empty()) return broken;
  }
  return broken_link(document, shape);
}

/// What is wrong with the document, or nothing.
inline std::string broken_invariant(const Document& document, const Limits& limits) {
  if (document.present >= document.alternatives->size()) return "no present alternative";
  for (std::size_t i = 0; i < document.alternatives->size(); ++i) {
    const bool kept = (*document.alternatives)[i].entities != nullptr;
    if (kept == (i == document.present)) return "not exactly the present alternative without kept entities";
  }
  for (const auto& [id, entity] : document.entities) {
    if (!entity || entity->id != id) return id + ": under another id";
    if (!document.used_ids->contains(id)) return id + ": an id that was never given";
    if (const DualPtr shape = as_dual(entity)) {
      const std::string broken = broken_shape(document, *shape, limits);
      if (!broken.empty()) return fmt::format("{}: {}", id, broken);
    }
    if (const SculptPtr shape = as_sculpt(entity)) {
      const std::string broken = broken_sculpt(*shape);
      if (!broken.empty()) return fmt::format("{}: {}", id, broken);
    }
  }
  return "";
}

}  // namespace handloft::model::test
