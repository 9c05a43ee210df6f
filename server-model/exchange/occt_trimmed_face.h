#pragma once
// Faces of Open CASCADE with edges made anew from curves in the parameters. Not for others than cad_file and
// occt_replace.

#include <Geom2d_Curve.hxx>
#include <Geom_Surface.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>

#include "common/base/result.h"
#include "server-model/exchange/cad_face.h"
#include "server-model/exchange/occt_bspline.h"

namespace handloft::exchange::detail {

/// The face in the placement's units, its loops closed where they leave gaps, checked by BRepCheck. Throws
/// the library's exceptions. Errors: invalid_argument (bad numbers, loops that bound no valid face).
Result<TopoDS_Face> make_face(const CadFace& face, const CadPlacement& placement);

/// How an edge lies in the parameters of its surface; `second` where it is a seam: then `first` is its curve
/// when it is passed forward, `second` when reversed, both along the edge.
struct EdgeCurves {
  Handle(Geom2d_Curve) first, second;
  double lower = 0, upper = 0;
};

/// Makes an edge of two vertices (one, twice, where it is closed) without curves into one on the surface: its
/// curve in space follows from the parameters; none where its image is a point (a pole). Vertices' tolerances
/// grow to reach its ends.
void lay_edge(TopoDS_Edge& edge, const Handle(Geom_Surface) & surface, const EdgeCurves& curves,
              const TopoDS_Vertex& from, const TopoDS_Vertex& to);

/// The face as it is where BRepCheck finds it valid, or as ShapeFix makes it so. Errors: invalid_argument.
Result<TopoDS_Face> valid_or_fixed(const TopoDS_Face& face);

}  // namespace handloft::exchange::detail
