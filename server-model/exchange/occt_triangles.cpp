#include "server-model/exchange/occt_triangles.h"

#include <BRepBndLib.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <Poly_Triangulation.hxx>
#include <TopLoc_Location.hxx>
#include <algorithm>
#include <cmath>
#include <utility>

#include "server-model/exchange/cad_source.h"

namespace handloft::exchange::detail {

Result<double> chord_of(const TopoDS_Shape& shape, double chord_tolerance_m, double chord_fraction) {
  Bnd_Box box;
  BRepBndLib::Add(shape, box);
  if (box.IsVoid() || box.IsOpen()) {
    return make_error(ErrorCode::data_corrupt, "found shapes without bounds, expected surfaces that end",
                      "path");
  }
  const double diagonal = std::sqrt(box.SquareExtent());
  return std::max(chord_tolerance_m / metres_per_millimetre, chord_fraction * diagonal);
}

Status append_triangles(const TopoDS_Face& face, RawTriangles& into, const ReferenceOptions& options) {
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

}  // namespace handloft::exchange::detail
