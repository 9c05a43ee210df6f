#include "server-model/exchange/occt_face.h"

#include <fmt/format.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeVertex.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepLib.hxx>
#include <BRep_Builder.hxx>
#include <Geom2d_BSplineCurve.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Precision.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TColgp_Array1OfPnt2d.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <vector>

#include "server-model/exchange/contour_curve.h"
#include "server-model/exchange/region_face.h"
#include "server-model/geometry/bezier_patch.h"

namespace handloft::exchange::detail {
namespace {

using geometry::Box2;
using geometry::Vec2;
using geometry::Vec3;

constexpr double millimetres_per_metre = 1000.0;  ///< Per metre.

/// The surface reaches this much beyond the contour, so that the boundary never touches its edge.
constexpr double surface_margin = 1.05;

/// Curves in the plane and in space may differ by this, in metres: a tenth of OCCT's own confusion is no use.
constexpr double space_tolerance_m = 2e-9;

gp_Pnt to_mm(const Vec3& p) {
  return {millimetres_per_metre * p.x(), millimetres_per_metre * p.y(), millimetres_per_metre * p.z()};
}

/// The patch as a B-spline surface without inner knots, whose parameters are millimetres from the box's
/// corner.
Handle(Geom_BSplineSurface) make_surface(const geometry::BezierPatch& patch, const Box2& box) {
  const int n = patch.degree;
  TColgp_Array2OfPnt poles(1, n + 1, 1, n + 1);
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) poles.SetValue(i + 1, j + 1, to_mm(patch.at(i, j)));
  }
  TColStd_Array1OfReal u_knots(1, 2);
  TColStd_Array1OfReal v_knots(1, 2);
  u_knots(1) = v_knots(1) = 0;
  u_knots(2) = 2 * millimetres_per_metre * box.half_extent.x();
  v_knots(2) = 2 * millimetres_per_metre * box.half_extent.y();
  TColStd_Array1OfInteger multiplicities(1, 2);
  multiplicities.Init(n + 1);
  return new Geom_BSplineSurface(poles, u_knots, v_knots, multiplicities, multiplicities, n, n);
}

TColStd_Array1OfReal knots_of(const std::vector<double>& knots) {
  TColStd_Array1OfReal result(1, static_cast<int>(knots.size()));
  for (int i = 1; i <= result.Length(); ++i) {
    result(i) = millimetres_per_metre * knots[static_cast<std::size_t>(i - 1)];
  }
  return result;
}

TColStd_Array1OfInteger multiplicities_of(const std::vector<double>& knots) {
  TColStd_Array1OfInteger result(1, static_cast<int>(knots.size()));
  result.Init(2);
  result(1) = result(result.Length()) = 4;
  return result;
}

Handle(Geom2d_BSplineCurve) make_pcurve(const CubicSpline<Vec2>& spline, const Box2& box) {
  TColgp_Array1OfPnt2d poles(1, static_cast<int>(spline.poles.size()));
  for (int i = 1; i <= poles.Length(); ++i) {
    const Vec2 uv = millimetres_per_metre * (spline.poles[static_cast<std::size_t>(i - 1)] - box.lower());
    poles(i) = gp_Pnt2d(uv.x(), uv.y());
  }
  return new Geom2d_BSplineCurve(poles, knots_of(spline.knots), multiplicities_of(spline.knots), 3);
}

Handle(Geom_BSplineCurve) make_curve(const CubicSpline<Vec3>& spline) {
  TColgp_Array1OfPnt poles(1, static_cast<int>(spline.poles.size()));
  for (int i = 1; i <= poles.Length(); ++i) poles(i) = to_mm(spline.poles[static_cast<std::size_t>(i - 1)]);
  return new Geom_BSplineCurve(poles, knots_of(spline.knots), multiplicities_of(spline.knots), 3);
}

Result<TopoDS_Face> trimmed_face(const SurfaceExport& item, const Handle(Geom_BSplineSurface) & surface,
                                 const Box2& box, double contour_tolerance) {
  const double size = item.superellipse.contour_half_extent(geometry::trim_level()).maxCoeff();
  const std::vector<ContourArc> arcs =
      contour_arcs(item, geometry::trim_level(), {contour_tolerance * size, space_tolerance_m});

  std::vector<TopoDS_Vertex> tips(arcs.size());
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    tips[i] = BRepBuilderAPI_MakeVertex(to_mm(arcs[i].space.poles.front())).Vertex();
  }
  BRep_Builder builder;
  BRepBuilderAPI_MakeWire wire;
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    const ContourArc& arc = arcs[i];
    const double last = millimetres_per_metre * arc.space.knots.back();
    TopoDS_Edge edge;
    builder.MakeEdge(edge, make_curve(arc.space), Precision::Confusion());
    builder.UpdateEdge(edge, make_pcurve(arc.plane, box), surface, TopLoc_Location(), Precision::Confusion());
    builder.Add(edge, tips[i].Oriented(TopAbs_FORWARD));
    builder.Add(edge, tips[(i + 1) % arcs.size()].Oriented(TopAbs_REVERSED));
    builder.Range(edge, 0.0, last);
    wire.Add(edge);
  }
  if (!wire.IsDone()) {
    return make_error(ErrorCode::invalid_argument, "the contour makes no closed boundary", "superellipse");
  }
  BRepBuilderAPI_MakeFace face(surface, wire.Wire(), /*Inside=*/Standard_False);
  if (!face.IsDone()) {
    return make_error(ErrorCode::invalid_argument, "the contour makes no face", "superellipse");
  }
  TopoDS_Face result = face.Face();
  // Measures the distance between the two curves of each edge and sets the tolerances accordingly.
  BRepLib::SameParameter(result, Precision::Confusion(), /*theForced=*/Standard_True);
  return result;
}

}  // namespace

Result<TopoDS_Face> make_face(const SurfaceExport& item, double contour_tolerance) {
  Box2 box{item.superellipse.centre(), item.superellipse.contour_half_extent(geometry::trim_level())};
  if (item.trim == Trim::contour) {
    box.half_extent = surface_margin * boundary_half_extent(item.superellipse, geometry::trim_level());
  }
  if (!item.region.outer.empty()) {
    box = region_box(item.region);
    if (item.trim == Trim::region) box.half_extent *= surface_margin;
  }
  const Result<geometry::BezierPatch> patch = geometry::to_bezier_patch(item.surface, item.frame, box);
  if (!patch.ok()) return patch.error();
  const Handle(Geom_BSplineSurface) surface = make_surface(*patch, box);

  TopoDS_Face face;
  if (item.trim == Trim::contour) {
    Result<TopoDS_Face> trimmed = trimmed_face(item, surface, box, contour_tolerance);
    if (!trimmed.ok()) return trimmed;
    face = *trimmed;
  } else if (item.trim == Trim::region) {
    Result<TopoDS_Face> trimmed = region_face(item, surface, box);
    if (!trimmed.ok()) return trimmed;
    face = *trimmed;
  } else {
    face = BRepBuilderAPI_MakeFace(surface, Precision::Confusion()).Face();
  }
  if (!BRepCheck_Analyzer(face).IsValid()) {
    if (item.trim == Trim::box) {
      return make_error(ErrorCode::invalid_argument, "the surface makes no valid CAD face", "surface");
    }
    if (item.trim == Trim::region) {
      return make_error(
          ErrorCode::invalid_argument,
          "the surface, trimmed at its boundary curve, makes no valid CAD face; draw the curve without "
          "touching itself, or export untrimmed",
          "surface");
    }
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("the surface, trimmed at the contour of its superellipse of exponent {}, makes "
                    "no valid CAD face; an untrimmed export has no such boundary",
                    item.superellipse.exponent()),
        "surface");
  }
  return face;
}

}  // namespace handloft::exchange::detail
