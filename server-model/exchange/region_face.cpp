#include "server-model/exchange/region_face.h"

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeVertex.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepLib.hxx>
#include <BRep_Builder.hxx>
#include <Eigen/LU>
#include <Geom2d_BSplineCurve.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Precision.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TColgp_Array1OfPnt2d.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace handloft::exchange::detail {
namespace {

using geometry::Box2;
using geometry::Vec2;
using geometry::Vec3;

constexpr double millimetres_per_metre = 1000.0;

gp_Pnt to_mm(const Vec3& p) {
  return {millimetres_per_metre * p.x(), millimetres_per_metre * p.y(), millimetres_per_metre * p.z()};
}

class Borders {
 public:
  Borders(const SurfaceExport& item, const Handle(Geom_BSplineSurface) & surface, const Box2& box)
      : item_(item), surface_(surface), box_(box), degree_(item.surface.degree()) {
    // From values at even steps to Bezier control points.
    const int count = degree_ + 1;
    Eigen::MatrixXd bernstein(count, count);
    for (int i = 0; i < count; ++i) {
      const double t = static_cast<double>(i) / degree_;
      double choose = 1;
      for (int k = 0; k < count; ++k) {
        bernstein(i, k) = choose * std::pow(t, k) * std::pow(1 - t, degree_ - k);
        choose = choose * (degree_ - k) / (k + 1);
      }
    }
    to_control_ = bernstein.inverse();
  }

  Result<TopoDS_Wire> wire(const std::vector<Vec2>& loop) {
    BRepBuilderAPI_MakeWire wire;
    for (std::size_t i = 0; i < loop.size(); ++i) wire.Add(edge(loop[i], loop[(i + 1) % loop.size()]));
    if (!wire.IsDone()) {
      return make_error(ErrorCode::invalid_argument, "the boundary curve makes no closed border", "surface");
    }
    return wire.Wire();
  }

 private:
  /// Borders that touch share the vertex.
  TopoDS_Vertex vertex(const Vec2& xy) {
    TopoDS_Vertex& found = vertices_[{xy.x(), xy.y()}];
    if (found.IsNull()) {
      found =
          BRepBuilderAPI_MakeVertex(to_mm(item_.surface.world_point(item_.frame, xy.x(), xy.y()))).Vertex();
    }
    return found;
  }

  TopoDS_Edge edge(const Vec2& from, const Vec2& to) {
    const double length = millimetres_per_metre * (to - from).norm();
    TColStd_Array1OfReal knots(1, 2);
    knots(1) = 0;
    knots(2) = length;
    TColStd_Array1OfInteger ends(1, 2);

    TColgp_Array1OfPnt2d line(1, 2);
    const Vec2 uv_from = millimetres_per_metre * (from - box_.lower());
    const Vec2 uv_to = millimetres_per_metre * (to - box_.lower());
    line(1) = gp_Pnt2d(uv_from.x(), uv_from.y());
    line(2) = gp_Pnt2d(uv_to.x(), uv_to.y());
    ends.Init(2);
    const Handle(Geom2d_BSplineCurve) plane = new Geom2d_BSplineCurve(line, knots, ends, 1);

    Eigen::MatrixXd places(degree_ + 1, 3);
    for (int i = 0; i <= degree_; ++i) {
      const Vec2 xy = from + static_cast<double>(i) / degree_ * (to - from);
      places.row(i) = item_.surface.world_point(item_.frame, xy.x(), xy.y()).transpose();
    }
    const Eigen::MatrixXd control = to_control_ * places;
    TColgp_Array1OfPnt poles(1, degree_ + 1);
    for (int i = 0; i <= degree_; ++i) poles(i + 1) = to_mm(control.row(i).transpose());
    ends.Init(degree_ + 1);
    const Handle(Geom_BSplineCurve) space = new Geom_BSplineCurve(poles, knots, ends, degree_);

    BRep_Builder builder;
    TopoDS_Edge edge;
    builder.MakeEdge(edge, space, Precision::Confusion());
    builder.UpdateEdge(edge, plane, surface_, TopLoc_Location(), Precision::Confusion());
    builder.Add(edge, vertex(from).Oriented(TopAbs_FORWARD));
    builder.Add(edge, vertex(to).Oriented(TopAbs_REVERSED));
    builder.Range(edge, 0.0, length);
    return edge;
  }

  const SurfaceExport& item_;
  const Handle(Geom_BSplineSurface) & surface_;
  Box2 box_;
  int degree_;
  Eigen::MatrixXd to_control_;
  std::map<std::pair<double, double>, TopoDS_Vertex> vertices_;
};

}  // namespace

Box2 region_box(const geometry::PlanarFace& region) {
  Vec2 lower = region.outer.front();
  Vec2 upper = lower;
  for (const Vec2& p : region.outer) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  return {0.5 * (lower + upper), 0.5 * (upper - lower)};
}

Result<TopoDS_Face> region_face(const SurfaceExport& item, const Handle(Geom_BSplineSurface) & surface,
                                const Box2& box) {
  Borders borders(item, surface, box);
  const Result<TopoDS_Wire> outer = borders.wire(item.region.outer);
  if (!outer.ok()) return outer.error();
  BRepBuilderAPI_MakeFace face(surface, *outer, /*Inside=*/Standard_False);
  for (const std::vector<Vec2>& hole : item.region.holes) {
    const Result<TopoDS_Wire> inner = borders.wire(hole);
    if (!inner.ok()) return inner.error();
    face.Add(*inner);
  }
  if (!face.IsDone()) {
    return make_error(ErrorCode::invalid_argument, "the boundary curve makes no face", "surface");
  }
  TopoDS_Face result = face.Face();
  BRepLib::SameParameter(result, Precision::Confusion(), /*theForced=*/Standard_True);
  return result;
}

}  // namespace handloft::exchange::detail
