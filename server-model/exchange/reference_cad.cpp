// STEP and IGES surfaces as triangles, through Open CASCADE.

#include <fmt/format.h>

#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <IGESControl_Reader.hxx>
#include <Interface_Static.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <cmath>

#include "server-model/exchange/occt_session.h"
#include "server-model/exchange/raw_triangles.h"

namespace handloft::exchange::detail {
namespace {

constexpr double metres_per_millimetre = 1e-3;
constexpr double angular_tolerance_rad = 0.5;  ///< The library's own default: round things look round.

template <typename Reader>
Result<TopoDS_Shape> read_with(Reader& reader, const std::filesystem::path& path, const char* what) {
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone || reader.TransferRoots() < 1 ||
      reader.OneShape().IsNull()) {
    return make_error(ErrorCode::data_corrupt, fmt::format("found no shapes, expected {} file", what),
                      "path");
  }
  return reader.OneShape();
}

Status append_face(const TopoDS_Face& face, RawTriangles& into, const ReferenceOptions& options) {
  TopLoc_Location location;
  const Handle(Poly_Triangulation) triangulation = BRep_Tool::Triangulation(face, location);
  if (triangulation.IsNull()) return {};  // The library found no triangles: a face without area.
  Status counts =
      check_counts(into.positions.size() + static_cast<std::size_t>(triangulation->NbNodes()),
                   into.indices.size() / 3 + static_cast<std::size_t>(triangulation->NbTriangles()), options);
  if (!counts) return counts;
  const auto base = static_cast<std::uint32_t>(into.positions.size());
  const gp_Trsf& placed = location.Transformation();
  for (int i = 1; i <= triangulation->NbNodes(); ++i) {
    const gp_Pnt p = triangulation->Node(i).Transformed(placed);
    into.positions.emplace_back(metres_per_millimetre * p.X(), metres_per_millimetre * p.Y(),
                                metres_per_millimetre * p.Z());
  }
  const bool reversed = (face.Orientation() == TopAbs_REVERSED) != placed.IsNegative();
  for (int i = 1; i <= triangulation->NbTriangles(); ++i) {
    int a = 0;
    int b = 0;
    int c = 0;
    triangulation->Triangle(i).Get(a, b, c);
    if (reversed) std::swap(b, c);
    for (const int corner : {a, b, c}) into.indices.push_back(base + static_cast<std::uint32_t>(corner - 1));
  }
  return {};
}

Status tessellate(const std::filesystem::path& path, ReferenceFormat format, const ReferenceOptions& options,
                  RawTriangles& into) {
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");  // Whatever the file's unit is, it comes as this.
  STEPControl_Reader step;
  IGESControl_Reader iges;
  const Result<TopoDS_Shape> shape =
      format == ReferenceFormat::step ? read_with(step, path, "a STEP") : read_with(iges, path, "an IGES");
  if (!shape) return shape.error();
  Bnd_Box box;
  BRepBndLib::Add(*shape, box);
  if (box.IsVoid() || box.IsOpen()) {
    return make_error(ErrorCode::data_corrupt, "found shapes without bounds, expected surfaces that end",
                      "path");
  }
  const double diagonal = std::sqrt(box.SquareExtent());
  const double chord =
      std::max(options.chord_tolerance_m / metres_per_millimetre, options.chord_fraction * diagonal);
  const BRepMesh_IncrementalMesh meshed(*shape, chord, Standard_False, angular_tolerance_rad, Standard_False);
  for (TopExp_Explorer faces(*shape, TopAbs_FACE); faces.More(); faces.Next()) {
    if (Status status = append_face(TopoDS::Face(faces.Current()), into, options); !status) return status;
  }
  return {};
}

}  // namespace

Result<RawTriangles> tessellate_cad_file(const std::filesystem::path& path, ReferenceFormat format,
                                         const ReferenceOptions& options) {
  RawTriangles result;
  const OcctSession session;
  Status status = guarded("reading the CAD file", [&] { return tessellate(path, format, options, result); });
  if (!status) {
    Error error = status.error();
    error.field = "path";
    return error;
  }
  return result;
}

}  // namespace handloft::exchange::detail
