#include "server-model/exchange/step_reader.h"

#include <fmt/format.h>

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRepTools.hxx>
#include <BRepTopAdaptor_FClass2d.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <Geom2d_Curve.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <IGESControl_Reader.hxx>
#include <Interface_Static.hxx>
#include <Precision.hxx>
#include <STEPControl_Reader.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <functional>
#include <string>
#include <system_error>

#include "server-model/exchange/cad_labels.h"
#include "server-model/exchange/cad_source.h"
#include "server-model/exchange/occt_session.h"

namespace handloft::exchange {
namespace {

using detail::metres_per_millimetre;

geometry::Vec3 to_metres(const gp_Pnt& p) {
  return {metres_per_millimetre * p.X(), metres_per_millimetre * p.Y(), metres_per_millimetre * p.Z()};
}

StepFace describe(const TopoDS_Face& shape, const StepReadOptions& options) {
  StepFace face;
  face.valid = BRepCheck_Analyzer(shape).IsValid();
  const BRepAdaptor_Surface surface(shape);
  face.is_bspline = surface.GetType() == GeomAbs_BSplineSurface || surface.GetType() == GeomAbs_BezierSurface;
  if (face.is_bspline) {
    face.degree_u = surface.UDegree();
    face.degree_v = surface.VDegree();
  }
  GProp_GProps properties;
  constexpr double area_precision = 1e-8;  // Relative; without it the library stops at some 1e-5.
  BRepGProp::SurfaceProperties(shape, properties, area_precision);
  face.area_m2 = properties.Mass() * metres_per_millimetre * metres_per_millimetre;

  double u0 = 0;
  double u1 = 0;
  double v0 = 0;
  double v1 = 0;
  BRepTools::UVBounds(shape, u0, u1, v0, v1);
  BRepTopAdaptor_FClass2d classifier(shape, Precision::Confusion());
  for (int i = 0; i < options.samples_per_side; ++i) {
    for (int j = 0; j < options.samples_per_side; ++j) {
      // Cell middles: never on the boundary of a rectangle.
      const double u = u0 + (u1 - u0) * (i + 0.5) / options.samples_per_side;
      const double v = v0 + (v1 - v0) * (j + 0.5) / options.samples_per_side;
      if (classifier.Perform(gp_Pnt2d(u, v)) == TopAbs_IN)
        face.samples.push_back(to_metres(surface.Value(u, v)));
    }
  }

  face.has_pcurves = true;
  for (TopExp_Explorer edges(shape, TopAbs_EDGE); edges.More(); edges.Next()) {
    const TopoDS_Edge edge = TopoDS::Edge(edges.Current());
    double first = 0;
    double last = 0;
    if (BRep_Tool::CurveOnSurface(edge, shape, first, last).IsNull()) face.has_pcurves = false;
    if (BRep_Tool::Degenerated(edge)) continue;
    const BRepAdaptor_Curve curve(edge);
    for (int i = 0; i < options.samples_per_edge; ++i) {
      const double t = curve.FirstParameter() +
                       (curve.LastParameter() - curve.FirstParameter()) * i / options.samples_per_edge;
      face.boundary.push_back(to_metres(curve.Value(t)));
    }
  }
  return face;
}

std::size_t free_edges_of(const TopoDS_Shape& whole) {
  TopTools_IndexedDataMapOfShapeListOfShape faces_of;
  TopExp::MapShapesAndAncestors(whole, TopAbs_EDGE, TopAbs_FACE, faces_of);
  std::size_t count = 0;
  for (int i = 1; i <= faces_of.Extent(); ++i) {
    const TopoDS_Edge edge = TopoDS::Edge(faces_of.FindKey(i));
    const TopTools_ListOfShape& faces = faces_of(i);
    // A seam's face stands in the list for both of its sides.
    if (faces.Extent() == 1 && !BRep_Tool::Degenerated(edge)) ++count;
  }
  return count;
}

Status read(XSControl_Reader& reader, const char* format, const std::filesystem::path& path,
            const StepReadOptions& options, StepContent& content) {
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone || reader.TransferRoots() < 1) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("{} is no {} file with shapes", path.string(), format), "path");
  }
  const TopoDS_Shape whole = reader.OneShape();
  if (whole.IsNull()) {
    return make_error(ErrorCode::data_corrupt, fmt::format("{} has no shape", path.string()), "path");
  }
  content.valid = BRepCheck_Analyzer(whole).IsValid();
  content.free_edges = free_edges_of(whole);
  for (TopExp_Explorer it(whole, TopAbs_SOLID); it.More(); it.Next()) ++content.solids;
  for (TopExp_Explorer it(whole, TopAbs_SHELL); it.More(); it.Next()) {
    if (BRep_Tool::IsClosed(it.Current())) ++content.closed_shells;
  }
  const detail::FaceNames names(whole, detail::labels_of(reader, whole));
  for (TopExp_Explorer faces(whole, TopAbs_FACE); faces.More(); faces.Next()) {
    if (content.faces.size() >= options.max_faces) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("{} has more than {} faces", path.string(), options.max_faces), "path");
    }
    content.faces.push_back(describe(TopoDS::Face(faces.Current()), options));
    content.faces.back().name = names.of(faces.Current());
  }
  if (content.faces.empty()) {
    return make_error(ErrorCode::data_corrupt, fmt::format("{} has no face", path.string()), "path");
  }
  return {};
}

Result<StepContent> read_any(const char* format, const std::filesystem::path& path,
                             const StepReadOptions& options,
                             const std::function<Status(StepContent&)>& read_content) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    return make_error(ErrorCode::not_found, fmt::format("there is no file {}", path.string()), "path");
  }
  if (!std::filesystem::is_regular_file(path, error)) {
    return make_error(ErrorCode::io, fmt::format("{} is not a file", path.string()), "path");
  }
  if (options.samples_per_side < 1 || options.samples_per_edge < 1) {
    return make_error(ErrorCode::invalid_argument, "expected at least one sample per side and edge",
                      "options");
  }
  const detail::OcctSession session;
  StepContent content;
  Status status =
      detail::guarded(fmt::format("reading {}", format).c_str(), [&] { return read_content(content); });
  if (!status.ok()) return status.error();
  return content;
}

}  // namespace

Result<StepContent> read_step(const std::filesystem::path& path, const StepReadOptions& options) {
  return read_any("STEP", path, options, [&](StepContent& content) {
    STEPControl_Reader reader;
    return read(reader, "STEP", path, options, content);
  });
}

Result<StepContent> read_iges(const std::filesystem::path& path, const StepReadOptions& options) {
  return read_any("IGES", path, options, [&](StepContent& content) {
    IGESControl_Reader reader;
    return read(reader, "IGES", path, options, content);
  });
}

}  // namespace handloft::exchange
