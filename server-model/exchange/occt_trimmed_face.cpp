#include "server-model/exchange/occt_trimmed_face.h"

#include <fmt/format.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepLib.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Geom2d_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Precision.hxx>
#include <ShapeFix_Face.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <vector>

namespace handloft::exchange::detail {
namespace {

constexpr int samples =
    9;  ///< Along a curve: enough to tell a pole from a line, and a seam from a neighbour.

/// Of the period: curves nearer than this are the two sides of one seam.
constexpr double seam_tolerance = 1e-7;

gp_Pnt on(const Handle(Geom_Surface) & surface, const gp_Pnt2d& uv) {
  return surface->Value(uv.X(), uv.Y());
}

gp_Pnt2d along(const Handle(Geom2d_Curve) & curve, double lower, double upper, int i) {
  return curve->Value(lower + (upper - lower) * i / (samples - 1));
}

/// Vertices by place: those nearer than the tolerance are one, which grows to hold them.
class Vertices {
 public:
  explicit Vertices(double tolerance) : tolerance_(tolerance) {}
  TopoDS_Vertex at(const gp_Pnt& place) {
    for (const TopoDS_Vertex& vertex : found_) {
      if (BRep_Tool::Pnt(vertex).Distance(place) <= tolerance_) return vertex;
    }
    TopoDS_Vertex vertex;
    const BRep_Builder builder;
    builder.MakeVertex(vertex, place, Precision::Confusion());
    found_.push_back(vertex);
    return vertex;
  }

 private:
  double tolerance_;
  std::deque<TopoDS_Vertex> found_;
};

struct Piece {
  Handle(Geom2d_BSplineCurve) curve;
  int partner = -1;  ///< The other side of a seam.
  TopoDS_Edge edge;  ///< As the loop runs through it.
};

/// Whether `b` runs back along `a`, a period away.
bool is_seam(const Handle(Geom_Surface) & surface, const Handle(Geom2d_BSplineCurve) & a,
             const Handle(Geom2d_BSplineCurve) & b) {
  double u0 = 0;
  double u1 = 0;
  double v0 = 0;
  double v1 = 0;
  surface->Bounds(u0, u1, v0, v1);
  for (const gp_Vec2d& period : {gp_Vec2d(u1 - u0, 0), gp_Vec2d(0, v1 - v0)}) {
    if (period.X() != 0 ? !surface->IsUClosed() : !surface->IsVClosed()) continue;
    for (const double sign : {1.0, -1.0}) {
      bool same = true;
      for (int i = 0; i < samples && same; ++i) {
        const gp_Pnt2d p = along(a, a->FirstParameter(), a->LastParameter(), i);
        const gp_Pnt2d q = along(b, b->FirstParameter(), b->LastParameter(), samples - 1 - i);
        same = p.Translated(sign * period).Distance(q) <= seam_tolerance * period.Magnitude() &&
               on(surface, p).Distance(on(surface, q)) <= 100 * Precision::Confusion();
      }
      if (same) return true;
    }
  }
  return false;
}

/// The same curve, run backwards over the knots' range of another.
Handle(Geom2d_BSplineCurve)
    reversed_over(const Handle(Geom2d_BSplineCurve) & curve, double lower, double upper) {
  Handle(Geom2d_BSplineCurve) result = Handle(Geom2d_BSplineCurve)::DownCast(curve->Reversed());
  TColStd_Array1OfReal knots = result->Knots();
  const double from = knots.First();
  const double to = knots.Last();
  for (double& knot : knots) {
    knot = knot == to ? upper : lower + (knot - from) * (upper - lower) / (to - from);
  }
  result->SetKnots(knots);
  return result;
}

void lay_pieces(std::vector<std::vector<Piece>>& loops, const Handle(Geom_Surface) & surface,
                double gap_tolerance) {
  const BRep_Builder builder;
  Vertices vertices(gap_tolerance);
  for (std::vector<Piece>& loop : loops) {
    const std::size_t n = loop.size();
    std::vector<TopoDS_Vertex> starts(n);
    for (std::size_t i = 0; i < n; ++i) starts[i] = vertices.at(on(surface, loop[i].curve->StartPoint()));
    for (std::size_t i = 0; i < n; ++i) {
      Piece& piece = loop[i];
      if (piece.partner >= 0 && static_cast<std::size_t>(piece.partner) < i) {
        piece.edge = TopoDS::Edge(loop[static_cast<std::size_t>(piece.partner)].edge.Reversed());
        continue;
      }
      EdgeCurves curves{piece.curve, {}, piece.curve->FirstParameter(), piece.curve->LastParameter()};
      if (piece.partner >= 0) {
        curves.second =
            reversed_over(loop[static_cast<std::size_t>(piece.partner)].curve, curves.lower, curves.upper);
      }
      builder.MakeEdge(piece.edge);
      lay_edge(piece.edge, surface, curves, starts[i], starts[(i + 1) % n]);
    }
  }
}

}  // namespace

void lay_edge(TopoDS_Edge& edge, const Handle(Geom_Surface) & surface, const EdgeCurves& curves,
              const TopoDS_Vertex& from, const TopoDS_Vertex& to) {
  const BRep_Builder builder;
  const TopLoc_Location here;
  double tolerance = Precision::Confusion();
  double reach = 0;
  const gp_Pnt first = on(surface, along(curves.first, curves.lower, curves.upper, 0));
  for (int i = 1; i < samples; ++i) {
    reach = std::max(reach, first.Distance(on(surface, along(curves.first, curves.lower, curves.upper, i))));
  }
  if (!curves.second.IsNull()) {
    for (int i = 0; i < samples; ++i) {
      const gp_Pnt2d p = along(curves.first, curves.lower, curves.upper, i);
      const gp_Pnt2d q = along(curves.second, curves.lower, curves.upper, i);
      tolerance = std::max(tolerance, 1.1 * on(surface, p).Distance(on(surface, q)));
    }
  }
  const bool is_pole = reach <= Precision::Confusion();
  if (curves.second.IsNull()) {
    builder.UpdateEdge(edge, curves.first, surface, here, tolerance);
  } else {
    builder.UpdateEdge(edge, curves.first, curves.second, surface, here, tolerance);
  }
  builder.Add(edge, from.Oriented(TopAbs_FORWARD));
  builder.Add(edge, to.Oriented(TopAbs_REVERSED));
  builder.Range(edge, surface, here, curves.lower, curves.upper);
  builder.Degenerated(edge, is_pole);
  if (!is_pole) {
    BRepLib::BuildCurve3d(edge);
    builder.Range(edge, curves.lower, curves.upper);
    BRepLib::SameParameter(edge, Precision::Confusion());
  }
  const gp_Pnt last = on(surface, along(curves.first, curves.lower, curves.upper, samples - 1));
  const double edge_tolerance = BRep_Tool::Tolerance(edge);
  for (const auto& [vertex, place] : {std::pair{from, first}, std::pair{to, last}}) {
    builder.UpdateVertex(
        vertex, std::max(edge_tolerance, 1.1 * BRep_Tool::Pnt(vertex).Distance(place) + edge_tolerance));
  }
}

Result<TopoDS_Face> valid_or_fixed(const TopoDS_Face& face) {
  if (BRepCheck_Analyzer(face).IsValid()) return face;
  ShapeFix_Face fix(face);
  fix.Perform();
  const TopoDS_Shape fixed = fix.Result();
  TopoDS_Face found;
  for (TopExp_Explorer it(fixed, TopAbs_FACE); it.More(); it.Next()) {
    if (!found.IsNull()) {
      found.Nullify();
      break;
    }
    found = TopoDS::Face(it.Current());
  }
  if (found.IsNull() || !BRepCheck_Analyzer(found).IsValid()) {
    return make_error(ErrorCode::invalid_argument, "the surface with its trim makes no valid CAD face",
                      "surface");
  }
  return found;
}

Result<TopoDS_Face> make_face(const CadFace& face, const CadPlacement& placement) {
  auto surface = to_occt(face.surface, placement);
  if (!surface) {
    Error error = surface.error();
    error.field = error.field.empty() ? "surface" : "surface." + error.field;
    return error;
  }
  TopoDS_Face made;
  if (face.loops.empty()) {
    made = BRepBuilderAPI_MakeFace(*surface, Precision::Confusion()).Face();
  } else {
    std::vector<std::vector<Piece>> loops;
    double widest_gap = 0;
    for (const auto& loop : face.loops) {
      if (loop.empty()) {
        return make_error(ErrorCode::invalid_argument, "found a loop without curves", "loops");
      }
      std::vector<Piece>& pieces = loops.emplace_back();
      for (const TrimCurve& curve : loop) {
        auto spline = to_occt(curve);
        if (!spline) return spline.error();
        pieces.push_back({*spline, -1, {}});
      }
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        const gp_Pnt end = on(*surface, pieces[i].curve->EndPoint());
        const gp_Pnt next = on(*surface, pieces[(i + 1) % pieces.size()].curve->StartPoint());
        widest_gap = std::max(widest_gap, end.Distance(next));
        for (std::size_t j = i + 1; j < pieces.size() && pieces[i].partner < 0; ++j) {
          if (pieces[j].partner < 0 && is_seam(*surface, pieces[i].curve, pieces[j].curve)) {
            pieces[i].partner = static_cast<int>(j);
            pieces[j].partner = static_cast<int>(i);
          }
        }
      }
    }
    constexpr double least_gap = 10;  // Confusions: what two exact curves may miss each other by.
    lay_pieces(loops, *surface, std::max(1.1 * widest_gap, least_gap * Precision::Confusion()));
    const BRep_Builder builder;
    builder.MakeFace(made, *surface, Precision::Confusion());
    for (const std::vector<Piece>& pieces : loops) {
      TopoDS_Wire wire;
      builder.MakeWire(wire);
      for (const Piece& piece : pieces) builder.Add(wire, piece.edge);
      wire.Closed(Standard_True);
      builder.Add(made, wire);
    }
  }
  auto valid = valid_or_fixed(made);
  if (!valid) return valid;
  return face.reversed ? TopoDS::Face(valid->Reversed()) : *valid;
}

}  // namespace handloft::exchange::detail
