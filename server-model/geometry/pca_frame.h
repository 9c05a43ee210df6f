#pragma once
// The local frame of a point cloud by principal component analysis (A5): x and y are the directions of
// largest and second largest variance, z (the residual axis) that of the smallest. Signs and degenerate
// spectra, on which the paper is silent, are resolved here so that the same cloud always gives the same
// frame.

#include <optional>
#include <span>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

enum class PcaWeighting {
  unweighted,   ///< Every point counts alike: the literal reading of the paper.
  by_pressure,  ///< Point i counts theta_i.
};

struct PcaOptions {
  PcaWeighting weighting = PcaWeighting::unweighted;
  /// The normal is turned towards this direction (from the cloud to the viewer, or the palm's normal; any
  /// length). Without it, and without a previous frame, each axis's largest component is positive.
  std::optional<Vec3> towards_viewer;
  /// The frame before a refit: every axis keeps within 90 degrees of its former direction, and where two
  /// variances are equal the former x axis is projected. Takes precedence over `towards_viewer`.
  std::optional<Frame> previous;
  /// Two variances closer than this fraction of the largest count as equal. The eigenvectors of so close a
  /// pair are noise (their error is eps / gap), and 1e-9 keeps the frame good to 1e-7.
  double degenerate_gap = 1e-9;
};

struct PcaFrame {
  Frame frame;  ///< Origin: the (weighted) centroid.
  /// Variances along x, y, z in m^2, falling.
  Vec3 variance = Vec3::Zero();
  /// True where an axis was chosen by rule, since the spectrum leaves it open.
  bool degenerate = false;
};

/// The frame of at least one point. Collinear or coincident points give a valid frame with `degenerate` set.
/// Errors: invalid_argument for no points, a coordinate or weight that is not finite, a negative weight or
/// only zero weights (with by_pressure).
Result<PcaFrame> pca_frame(std::span<const WeightedPoint> points, const PcaOptions& options = {});

/// The bounding box of the points in the frame's x-y plane (A22). Empty input gives an empty box at the
/// origin.
Box2 footprint_box(std::span<const WeightedPoint> points, const Frame& frame);

}  // namespace handloft::geometry
