// Parameters as long as the surface is.
#include <algorithm>
#include <utility>

#include "server-model/geometry/bspline_refine.h"

namespace handloft::geometry {
namespace {

KnotVector scaled_knots(const KnotVector& knots, double length) {
  std::vector<double> scaled;
  scaled.reserve(knots.knots().size());
  for (const double knot : knots.knots()) scaled.push_back((knot - knots.lower()) / knots.length() * length);
  Result<KnotVector> made = knots.is_periodic() ? KnotVector::periodic(knots.degree(), std::move(scaled))
                                                : KnotVector::open(knots.degree(), std::move(scaled));
  // A direction without a length keeps its parameters.
  return made ? *std::move(made) : knots;
}

}  // namespace

double mean_row_length(const BSplineSurface& surface, Direction direction) {
  const bool along_u = direction == Direction::u;
  const KnotVector& along = along_u ? surface.u : surface.v;
  const KnotVector& across = along_u ? surface.v : surface.u;
  const int steps = along.is_periodic() ? along.control_count() : along.control_count() - 1;
  double total = 0;
  for (int j = 0; j < across.control_count(); ++j) {
    for (int i = 0; i < steps; ++i) {
      const int next = (i + 1) % along.control_count();
      const Vec3& a = along_u ? surface.at(i, j) : surface.at(j, i);
      const Vec3& b = along_u ? surface.at(next, j) : surface.at(j, next);
      total += (b - a).norm();
    }
  }
  return total / across.control_count();
}

BSplineSurface scaled_domain(const BSplineSurface& surface) {
  return {scaled_knots(surface.u, mean_row_length(surface, Direction::u)),
          scaled_knots(surface.v, mean_row_length(surface, Direction::v)), surface.control, surface.weights};
}

}  // namespace handloft::geometry
