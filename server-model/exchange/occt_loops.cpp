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

/// Of the parameter range: by so much trims of files stand out of their surfaces (0.00005 of the hammer of
/// occt-misc's). What stands out farther, as a trim across a seam does, is no trim that others would take.
constexpr double max_outside = 1e-3;

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

/// By whole periods to where the middle of the loop is in the domain.
void bring_home(Loop& loop, const geometry::BSplineSurface& surface) {
  Vec2 lower = loop.front().control.front();
  Vec2 upper = lower;
  for (const TrimCurve& curve : loop) {
    for (const Vec2& p : curve.control) {
      lower = lower.cwiseMin(p);
      upper = upper.cwiseMax(p);
    }
  }
  const Vec2 middle = 0.5 * (lower + upper);
  Vec2 by = Vec2::Zero();
  if (surface.u.is_periodic()) {
    by.x() = -surface.u.length() * std::floor((middle.x() - surface.u.lower()) / surface.u.length());
  }
  if (surface.v.is_periodic()) {
    by.y() = -surface.v.length() * std::floor((middle.y() - surface.v.lower()) / surface.v.length());
  }
  if (by.isZero(0)) return;
  for (TrimCurve& curve : loop) {
    for (Vec2& p : curve.control) p += by;
  }
}

/// How far the curves' ends stand out of the parameters, as a part of their range.
double stands_out(const Loop& loop, const geometry::BSplineSurface& surface) {
  double most = 0;
  for (const TrimCurve& curve : loop) {
    for (const Vec2& p : {curve.control.front(), curve.control.back()}) {
      most = std::max({most, (surface.u.lower() - p.x()) / surface.u.length(),
                       (p.x() - surface.u.upper()) / surface.u.length(),
                       (surface.v.lower() - p.y()) / surface.v.length(),
                       (p.y() - surface.v.upper()) / surface.v.length()});
    }
  }
  return most;
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
    bring_home(loop, surface);
    if (const double out = stands_out(loop, surface); !(out <= max_outside)) {
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("found a trim that stands out of the surface by {:.3g} of it", out),
                        "loops");
    }
    loops.push_back(std::move(loop));
    if (wire.IsSame(outer)) std::rotate(loops.begin(), loops.end() - 1, loops.end());
  }
  if (loops.size() == 1 && is_rectangle(loops[0], surface)) loops.clear();
  return loops;
}

}  // namespace handloft::exchange::detail
