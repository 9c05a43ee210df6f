#include "server-model/model/sculpt_place.h"

#include <algorithm>
#include <cmath>

namespace handloft::model {

using geometry::BSplineCurve;
using geometry::TrimLoop;
using geometry::Vec2;
using geometry::Vec3;

namespace {

constexpr double loop_tolerance = 1e-4;
constexpr int max_pieces_per_span = 64;
/// Of the parameters' range: what importers let through (exchange/cad_face.h), with the chords' own error.
constexpr double max_outside = 1e-3 + loop_tolerance;

/// How many chords a span needs: by the largest deviation of its middles, which falls with the square.
int chords(const BSplineCurve& curve, double from, double to, double tolerance) {
  if (curve.knots.degree() == 1 && !curve.is_rational()) return 1;
  constexpr int looks = 4;
  double most = 0;
  Vec3 start = curve.evaluate(from);
  for (int i = 0; i < looks; ++i) {
    const double a = from + (to - from) * i / looks, b = from + (to - from) * (i + 1) / looks;
    const Vec3 end = i + 1 == looks ? curve.evaluate(std::nextafter(to, from)) : curve.evaluate(b);
    most = std::max(most, (curve.evaluate((a + b) / 2) - (start + end) / 2).norm());
    start = end;
  }
  const double needed = looks * std::sqrt(most / tolerance);
  return std::clamp(static_cast<int>(std::ceil(needed)), 1, max_pieces_per_span);
}

}  // namespace

std::vector<TrimLoop> trim_loops(const FaceTrim& trim, double tolerance) {
  std::vector<TrimLoop> loops;
  for (const std::vector<TrimSpline>& splines : trim) {
    TrimLoop& loop = loops.emplace_back();
    for (const TrimSpline& spline : splines) {
      BSplineCurve curve{spline.knots, {}, spline.weights};
      curve.control.reserve(spline.control.size());
      for (const Vec2& point : spline.control) curve.control.emplace_back(point.x(), point.y(), 0.0);
      for (const int s : spline.knots.spans()) {
        const double from = spline.knots.knots()[static_cast<std::size_t>(s)];
        const double to = spline.knots.knots()[static_cast<std::size_t>(s) + 1];
        const int count = chords(curve, from, to, tolerance);
        // The end is the next one's start; the loop closes itself.
        for (int i = 0; i < count; ++i)
          loop.emplace_back(curve.evaluate(from + (to - from) * i / count).head<2>());
      }
    }
  }
  return loops;
}

std::vector<TrimLoop> trim_loops(const SculptShape& shape) {
  if (!shape.trim) return {};
  const geometry::KnotVector &u = shape.rest->u, &v = shape.rest->v;
  const Vec2 lower(u.lower(), v.lower()), upper(u.upper(), v.upper()), size(u.length(), v.length());
  std::vector<TrimLoop> loops = trim_loops(*shape.trim, loop_tolerance * size.norm());
  for (TrimLoop& loop : loops) {
    for (Vec2& place : loop) {
      const Vec2 onto = place.cwiseMax(lower).cwiseMin(upper);
      if ((place - onto).cwiseQuotient(size).cwiseAbs().maxCoeff() <= max_outside) place = onto;
    }
  }
  return loops;
}

Result<geometry::SurfaceProjector> make_projector(const SculptShape& shape) {
  return geometry::SurfaceProjector::create(*shape.surface, trim_loops(shape));
}

Result<std::optional<geometry::SurfaceHit>> pick_sculpt(const SculptShape& shape, const Vec3& origin,
                                                        const Vec3& direction) {
  auto projector = make_projector(shape);
  if (!projector) return projector.error();
  return projector->ray(origin, direction);
}

}  // namespace handloft::model
