#include "tests/unit/server-model/exchange/cad_models.h"

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <BRepLib.hxx>
#include <BRep_Builder.hxx>
#include <Geom2d_Circle.hxx>
#include <Geom2d_Line.hxx>
#include <GeomConvert.hxx>
#include <Geom_SphericalSurface.hxx>
#include <IGESControl_Writer.hxx>
#include <Interface_Static.hxx>
#include <Precision.hxx>
#include <STEPControl_Writer.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Wire.hxx>
#include <array>
#include <cmath>
#include <numbers>

#include "server-model/exchange/occt_session.h"

namespace handloft::exchange::test {
namespace {

constexpr int degree = 3;

void clamped_knots(int n, double length, TColStd_Array1OfReal& knots,
                   TColStd_Array1OfInteger& multiplicities) {
  const int spans = n - degree;
  multiplicities.Init(1);
  multiplicities(1) = multiplicities(spans + 1) = degree + 1;
  for (int i = 0; i <= spans; ++i) knots(i + 1) = length * i / spans;
}

TopoDS_Face planar(const std::array<gp_Pnt, 4>& corners) {
  BRepBuilderAPI_MakePolygon polygon(corners[0], corners[1], corners[2], corners[3], Standard_True);
  return BRepBuilderAPI_MakeFace(polygon.Wire(), Standard_True).Face();
}

}  // namespace

Handle(Geom_BSplineSurface) sheet(int n, double size, double bulge) {
  TColgp_Array2OfPnt poles(1, n, 1, n);
  for (int i = 1; i <= n; ++i) {
    for (int j = 1; j <= n; ++j) {
      const double x = (i - 1.0) / (n - 1);
      const double y = (j - 1.0) / (n - 1);
      const bool border = i == 1 || j == 1 || i == n || j == n;
      const double z = border ? 0.0 : bulge * std::sin(std::numbers::pi * x) * std::sin(std::numbers::pi * y);
      poles.SetValue(i, j, gp_Pnt(size * x, size * y, z));
    }
  }
  TColStd_Array1OfReal knots(1, n - degree + 1);
  TColStd_Array1OfInteger multiplicities(1, n - degree + 1);
  clamped_knots(n, 1.0, knots, multiplicities);
  return new Geom_BSplineSurface(poles, knots, knots, multiplicities, multiplicities, degree, degree);
}

TopoDS_Shape box_with_freeform_top(double size, double bulge) {
  const double s = size;
  BRepBuilderAPI_Sewing sewing(1e-6);
  Handle(Geom_BSplineSurface) top = sheet(8, s, bulge);
  top->Translate(gp_Vec(0, 0, s));
  sewing.Add(BRepBuilderAPI_MakeFace(top, Precision::Confusion()).Face());
  const auto at = [s](double x, double y, double z) { return gp_Pnt(s * x, s * y, s * z); };
  sewing.Add(planar({at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0)}));
  sewing.Add(planar({at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)}));
  sewing.Add(planar({at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)}));
  sewing.Add(planar({at(1, 1, 0), at(0, 1, 0), at(0, 1, 1), at(1, 1, 1)}));
  sewing.Add(planar({at(0, 1, 0), at(0, 0, 0), at(0, 0, 1), at(0, 1, 1)}));
  sewing.Perform();
  for (TopExp_Explorer it(sewing.SewedShape(), TopAbs_SHELL); it.More(); it.Next()) {
    const BRep_Builder builder;
    TopoDS_Solid solid;
    builder.MakeSolid(solid);
    builder.Add(solid, it.Current());
    BRepLib::OrientClosedSolid(solid);
    return solid;
  }
  return {};
}

TopoDS_Face periodic_tube(double radius, double height) {
  constexpr int around = 12;
  TColgp_Array2OfPnt poles(1, around, 1, 4);
  for (int i = 1; i <= around; ++i) {
    const double angle = 2 * std::numbers::pi * (i - 1) / around;
    for (int j = 1; j <= 4; ++j) {
      poles.SetValue(i, j, gp_Pnt(radius * std::cos(angle), radius * std::sin(angle), height * (j - 1) / 3));
    }
  }
  TColStd_Array1OfReal u(1, around + 1);
  TColStd_Array1OfInteger u_multiplicities(1, around + 1);
  u_multiplicities.Init(1);
  for (int i = 0; i <= around; ++i) u(i + 1) = i;
  TColStd_Array1OfReal v(1, 2);
  TColStd_Array1OfInteger v_multiplicities(1, 2);
  v(1) = 0;
  v(2) = height;
  v_multiplicities.Init(4);
  const Handle(Geom_BSplineSurface) tube =
      new Geom_BSplineSurface(poles, u, v, u_multiplicities, v_multiplicities, 3, 3, Standard_True);
  return BRepBuilderAPI_MakeFace(tube, Precision::Confusion()).Face();
}

TopoDS_Face rational_sphere(double radius) {
  const Handle(Geom_SphericalSurface) sphere = new Geom_SphericalSurface(gp_Ax3(), radius);
  return BRepBuilderAPI_MakeFace(GeomConvert::SurfaceToBSplineSurface(sphere), Precision::Confusion()).Face();
}

TopoDS_Face sheet_with_two_holes(double size, double bulge) {
  const Handle(Geom_BSplineSurface) surface = sheet(10, size, bulge);
  BRepBuilderAPI_MakeFace face(surface, Precision::Confusion());
  const Handle(Geom2d_Circle) circle = new Geom2d_Circle(gp_Ax2d(gp_Pnt2d(0.3, 0.3), gp_Dir2d(1, 0)), 0.15);
  const TopoDS_Edge round = BRepBuilderAPI_MakeEdge(circle, surface).Edge();
  face.Add(TopoDS::Wire(BRepBuilderAPI_MakeWire(round).Wire().Reversed()));
  const std::array<gp_Pnt2d, 4> corners{gp_Pnt2d(0.6, 0.6), gp_Pnt2d(0.6, 0.8), gp_Pnt2d(0.8, 0.8),
                                        gp_Pnt2d(0.8, 0.6)};
  BRepBuilderAPI_MakeWire square;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const gp_Pnt2d from = corners[i];
    const gp_Pnt2d to = corners[(i + 1) % corners.size()];
    const Handle(Geom2d_Line) line = new Geom2d_Line(from, gp_Dir2d(gp_Vec2d(from, to)));
    square.Add(BRepBuilderAPI_MakeEdge(line, surface, 0.0, from.Distance(to)).Edge());
  }
  face.Add(square.Wire());
  TopoDS_Face made = face.Face();
  BRepLib::BuildCurves3d(made);
  return made;
}

void write_step_file(const std::filesystem::path& path, const std::vector<TopoDS_Shape>& shapes,
                     const std::string& unit) {
  const detail::OcctSession session;
  Interface_Static::SetCVal("write.step.unit", unit.c_str());
  STEPControl_Writer writer;
  for (const TopoDS_Shape& shape : shapes) writer.Transfer(shape, STEPControl_AsIs);
  writer.Write(path.c_str());
  Interface_Static::SetCVal("write.step.unit", "MM");
}

void write_iges_file(const std::filesystem::path& path, const std::vector<TopoDS_Shape>& shapes) {
  const detail::OcctSession session;
  IGESControl_Writer writer("MM", 0);
  for (const TopoDS_Shape& shape : shapes) writer.AddShape(shape);
  writer.ComputeModel();
  writer.Write(path.c_str());
}

}  // namespace handloft::exchange::test
