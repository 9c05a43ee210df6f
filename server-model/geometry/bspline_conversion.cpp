#include "server-model/geometry/bspline_conversion.h"

#include <utility>
#include <vector>

#include "server-model/geometry/bezier_patch.h"

namespace handloft::geometry {

Result<BSplineSurface> to_bspline_surface(const PolynomialSurface& surface, const Frame& frame,
                                          const Box2& box) {
  Result<BezierPatch> patch = to_bezier_patch(surface, frame, box);
  if (!patch) return patch.error();
  const auto order = static_cast<std::size_t>(patch->degree) + 1;
  const auto knots = [&](int axis) {
    std::vector<double> ends(order, box.lower()[axis]);
    ends.insert(ends.end(), order, box.upper()[axis]);
    return KnotVector::open(patch->degree, std::move(ends));
  };
  Result<KnotVector> u = knots(0);
  Result<KnotVector> v = knots(1);
  if (!u || !v) {
    return make_error(ErrorCode::invalid_argument, "found a box without a measurable area", "box");
  }
  BSplineSurface result{*std::move(u), *std::move(v), std::move(patch->control), {}};
  if (const Status status = check(result); !status) return status.error();
  return result;
}

}  // namespace handloft::geometry
