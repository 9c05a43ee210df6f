// STEP and IGES surfaces as triangles, through Open CASCADE.

#include <fmt/format.h>

#include <BRepMesh_IncrementalMesh.hxx>
#include <IGESControl_Reader.hxx>
#include <STEPControl_Reader.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>

#include "server-model/exchange/cad_source.h"
#include "server-model/exchange/occt_session.h"
#include "server-model/exchange/occt_triangles.h"
#include "server-model/exchange/raw_triangles.h"

namespace handloft::exchange::detail {
namespace {

Status tessellate(const std::filesystem::path& path, ReferenceFormat format, const ReferenceOptions& options,
                  RawTriangles& into) {
  STEPControl_Reader step;
  IGESControl_Reader iges;
  const Result<WholeCad> whole = format == ReferenceFormat::step ? read_whole(step, path, CadFormat::step)
                                                                 : read_whole(iges, path, CadFormat::iges);
  if (!whole) return whole.error();
  const TopoDS_Shape& shape = whole->shape;
  const Result<double> chord = chord_of(shape, options.chord_tolerance_m, options.chord_fraction);
  if (!chord) return chord.error();
  const BRepMesh_IncrementalMesh meshed(shape, *chord, Standard_False, angular_tolerance_rad, Standard_False);
  for (TopExp_Explorer faces(shape, TopAbs_FACE); faces.More(); faces.Next()) {
    if (Status status = append_triangles(TopoDS::Face(faces.Current()), into, options); !status)
      return status;
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
