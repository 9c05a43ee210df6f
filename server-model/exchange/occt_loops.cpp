#include "server-model/exchange/occt_loops.h"

#include <fmt/format.h>

#include <BRepTools_WireExplorer.hxx>
#include <BRep_Tool.hxx>
#include <ShapeAnalysis.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Iterator.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server-model/exchange/occt_bspline.h"

namespace handloft::exchange::detail {
namespace {

using geometry::Vec2;
using Loop = std::vector<TrimCurve>;

/// Of the parameter rectangle: nearer than this is on it.
constexpr double on_border = 1e-9;

/// The wire's edges as it runs through them; in the order in which they are stored when the library's
/// explorer, which gives up at gaps, does not reach them all.
std::vector<TopoDS_Edge> edges_of(const TopoDS_Wire& wire, const TopoDS_Face& face) {
  std::vector<TopoDS_Edge> stored;
  for (TopoDS_Iterator it(wire); it.More(); it.Next()) {
    const TopAbs_Orientation orientation = it.Value().Orientation();
    if (it.Value().ShapeType() == TopAbs_EDGE &&
        (orientation == TopAbs_FORWARD || orientation == TopAbs_REVERSED)) {
      stored.push_back(TopoDS::Edge(it.Value()));
    }
  }
  std::vector<TopoDS_Edge> ordered;
  for (BRepTools_WireExplorer it(wire, face); it.More() && ordered.size() <= stored.size(); it.Next()) {
    ordered.push_back(it.Current());
  }
  return ordered.size() == stored.size() ? ordered : stored;
}

/// Each curve followed by the one that begins nearest to its end. Changes nothing in a loop that is in order.
void chain(Loop& loop) {
  for (std::size_t i = 0; i + 1 < loop.size(); ++i) {
    const Vec2 end = loop[i].control.back();
    const auto nearer = [&](const TrimCurve& a, const TrimCurve& b) {
      return (a.control.front() - end).squaredNorm() < (b.control.front() - end).squaredNorm();
    };
    const auto next = loop.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    std::iter_swap(next, std::min_element(next, loop.end(), nearer));
  }
}

/// Whether it runs once around the rectangle along its border: all control points are within, and the
/// polygon of them, which is the curve where that is straight, has its area.
bool is_rectangle(const Loop& loop, const geometry::BSplineSurface& surface) {
  const Vec2 lower(surface.u.lower(), surface.v.lower());
  const Vec2 size(surface.u.length(), surface.v.length());
  double area = 0;
  Vec2 before = (loop.back().control.back() - lower).cwiseQuotient(size);
  for (const TrimCurve& curve : loop) {
    for (const Vec2& control : curve.control) {
      const Vec2 p = (control - lower).cwiseQuotient(size);
      if (!(p.minCoeff() >= -on_border && p.maxCoeff() <= 1 + on_border)) return false;
      area += 0.5 * (before.x() * p.y() - before.y() * p.x());
      before = p;
    }
  }
  return std::abs(area - 1) <= 10 * on_border;
}

}  // namespace

Result<TrimLoops> read_loops(const TopoDS_Face& face, const geometry::BSplineSurface& surface,
                             std::size_t max_curves) {
  const TopoDS_Face forward = TopoDS::Face(face.Oriented(TopAbs_FORWARD));
  const TopoDS_Wire outer = ShapeAnalysis::OuterWire(forward);
  TrimLoops loops;
  std::size_t count = 0;
  for (TopoDS_Iterator it(forward); it.More(); it.Next()) {
    if (it.Value().ShapeType() != TopAbs_WIRE) continue;
    const TopoDS_Wire wire = TopoDS::Wire(it.Value());
    Loop loop;
    for (const TopoDS_Edge& edge : edges_of(wire, forward)) {
      if (++count > max_curves) {
        return make_error(ErrorCode::resource_exhausted,
                          fmt::format("found more than {} curves around a face", max_curves), "loops");
      }
      double first = 0;
      double last = 0;
      const Handle(Geom2d_Curve) curve = BRep_Tool::CurveOnSurface(edge, forward, first, last);
      auto trim = to_trim(curve, first, last,
                          edge.Orientation() == TopAbs_REVERSED ? Sense::reversed : Sense::forward);
      if (!trim) return trim.error();
      loop.push_back(std::move(*trim));
    }
    if (loop.empty()) continue;
    chain(loop);
    loops.push_back(std::move(loop));
    if (wire.IsSame(outer)) std::rotate(loops.begin(), loops.end() - 1, loops.end());
  }
  if (loops.size() == 1 && is_rectangle(loops[0], surface)) loops.clear();
  return loops;
}

}  // namespace handloft::exchange::detail
