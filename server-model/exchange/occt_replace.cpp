#include "server-model/exchange/occt_replace.h"

#include <fmt/format.h>

#include <BRepBuilderAPI_Transform.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Precision.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_DataMapOfShapeShape.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Iterator.hxx>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "server-model/exchange/cad_bytes.h"
#include "server-model/exchange/cad_source.h"
#include "server-model/exchange/occt_bspline.h"
#include "server-model/exchange/occt_trimmed_face.h"

namespace handloft::exchange::detail {
namespace {

constexpr int border_samples = 33;  ///< Along each edge.

/// Metres: what rounding moves a control point by, far below what any file tells apart.
constexpr double unchanged_m = 1e-12;

/// How the edge lies in the face's parameters, whichever way it is passed.
EdgeCurves curves_of(const TopoDS_Edge& edge, const TopoDS_Face& face) {
  EdgeCurves curves;
  const TopoDS_Edge forward = TopoDS::Edge(edge.Oriented(TopAbs_FORWARD));
  curves.first = BRep_Tool::CurveOnSurface(forward, face, curves.lower, curves.upper);
  if (BRep_Tool::IsClosed(forward, face)) {
    double lower = 0;
    double upper = 0;
    curves.second =
        BRep_Tool::CurveOnSurface(TopoDS::Edge(edge.Oriented(TopAbs_REVERSED)), face, lower, upper);
  }
  return curves;
}

/// The largest distance between two surfaces along the edge.
double moved(const EdgeCurves& curves, const Handle(Geom_Surface) & before,
             const Handle(Geom_Surface) & after) {
  double most = 0;
  for (const Handle(Geom2d_Curve) & curve : {curves.first, curves.second}) {
    if (curve.IsNull()) continue;
    for (int i = 0; i < border_samples; ++i) {
      const gp_Pnt2d uv =
          curve->Value(curves.lower + (curves.upper - curves.lower) * i / (border_samples - 1));
      most = std::max(most, before->Value(uv.X(), uv.Y()).Distance(after->Value(uv.X(), uv.Y())));
    }
  }
  return most;
}

TopTools_IndexedMapOfShape edges_of(const TopoDS_Shape& shape) {
  TopTools_IndexedMapOfShape edges;
  TopExp::MapShapes(shape, TopAbs_EDGE, edges);
  return edges;
}

/// On the new surface within the same edges, which are laid on it too.
TopoDS_Face with_shared_edges(const TopoDS_Face& face, const Handle(Geom_BSplineSurface) & surface,
                              const std::vector<std::pair<TopoDS_Edge, EdgeCurves>>& border,
                              const std::vector<double>& distances) {
  const BRep_Builder builder;
  TopoDS_Face made = TopoDS::Face(face.EmptyCopied());
  builder.UpdateFace(made, surface, TopLoc_Location(), BRep_Tool::Tolerance(face));
  for (TopoDS_Iterator it(face, /*cumOri=*/Standard_False, /*cumLoc=*/Standard_False); it.More(); it.Next()) {
    builder.Add(made, it.Value());
  }
  for (std::size_t i = 0; i < border.size(); ++i) {
    const auto& [edge, curves] = border[i];
    const double tolerance = BRep_Tool::Tolerance(edge) + distances[i];
    if (curves.second.IsNull()) {
      builder.UpdateEdge(edge, curves.first, surface, TopLoc_Location(), tolerance);
    } else {
      builder.UpdateEdge(edge, curves.first, curves.second, surface, TopLoc_Location(), tolerance);
    }
    builder.Range(edge, surface, TopLoc_Location(), curves.lower, curves.upper);
    for (TopExp_Explorer it(edge, TopAbs_VERTEX); it.More(); it.Next()) {
      builder.UpdateVertex(TopoDS::Vertex(it.Current()), tolerance);
    }
  }
  return made;
}

/// On the new surface, within edges of its own that lie in the parameters as the former ones did.
TopoDS_Face with_own_edges(const TopoDS_Face& face, const Handle(Geom_BSplineSurface) & surface,
                           const std::vector<std::pair<TopoDS_Edge, EdgeCurves>>& border) {
  const BRep_Builder builder;
  // A vertex where the first edge that ends in the former one ends now.
  TopTools_DataMapOfShapeShape vertices;
  TopTools_DataMapOfShapeShape edges;
  for (const auto& [edge, curves] : border) {
    std::pair<TopoDS_Vertex, TopoDS_Vertex> ends;
    for (const bool at_end : {false, true}) {
      const TopoDS_Edge forward = TopoDS::Edge(edge.Oriented(TopAbs_FORWARD));
      const TopoDS_Vertex former = at_end ? TopExp::LastVertex(forward) : TopExp::FirstVertex(forward);
      const gp_Pnt2d uv = curves.first->Value(at_end ? curves.upper : curves.lower);
      TopoDS_Vertex& end = at_end ? ends.second : ends.first;
      if (!former.IsNull() && vertices.IsBound(former)) {
        end = TopoDS::Vertex(vertices.Find(former));
        continue;
      }
      builder.MakeVertex(end, surface->Value(uv.X(), uv.Y()), Precision::Confusion());
      if (!former.IsNull()) vertices.Bind(former, end);
    }
    TopoDS_Edge made;
    builder.MakeEdge(made);
    lay_edge(made, surface, curves, ends.first, ends.second);
    edges.Bind(edge, made);
  }
  TopoDS_Face made;
  builder.MakeFace(made, surface, Precision::Confusion());
  const TopoDS_Face forward = TopoDS::Face(face.Oriented(TopAbs_FORWARD));
  for (TopoDS_Iterator wires(forward); wires.More(); wires.Next()) {
    if (wires.Value().ShapeType() != TopAbs_WIRE) continue;
    TopoDS_Wire wire;
    builder.MakeWire(wire);
    for (TopoDS_Iterator it(wires.Value()); it.More(); it.Next()) {
      if (it.Value().ShapeType() != TopAbs_EDGE || !edges.IsBound(it.Value())) continue;
      builder.Add(wire, edges.Find(it.Value()).Oriented(it.Value().Orientation()));
    }
    wire.Closed(Standard_True);
    builder.Add(made, wire);
  }
  return made;
}

/// Whether nobody changed it: no control point lies farther off than rounding puts it, in whatever
/// parameters.
bool is_same(const geometry::BSplineSurface& a, const geometry::BSplineSurface& b) {
  if (a.u.degree() != b.u.degree() || a.v.degree() != b.v.degree() || a.control.size() != b.control.size() ||
      a.u.control_count() != b.u.control_count() || a.u.is_periodic() != b.u.is_periodic() ||
      a.v.is_periodic() != b.v.is_periodic() || a.weights != b.weights) {
    return false;
  }
  for (std::size_t i = 0; i < a.control.size(); ++i) {
    if (!((a.control[i] - b.control[i]).cwiseAbs().maxCoeff() <= unchanged_m)) return false;
  }
  return true;
}

/// The changed face, forward.
Result<TopoDS_Face> replacement(const TopoDS_Face& former, const ReplacedFace& change,
                                const CadPlacement& placement, double border_tolerance) {
  const TopoDS_Face face = TopoDS::Face(former.Oriented(TopAbs_FORWARD));
  const Handle(Geom_Surface) before = BRep_Tool::Surface(face);
  const Handle(Geom_BSplineSurface) spline =
      before.IsNull() ? Handle(Geom_BSplineSurface)() : bspline_of(before);
  if (spline.IsNull()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, which is no B-spline face", change.number), "number");
  }
  const auto as_read = to_geometry(spline, placement);
  if (as_read && is_same(*as_read, change.surface)) return face;
  auto made = to_occt(change.surface, placement);
  if (!made) {
    Error error = made.error();
    error.field = error.field.empty() ? "surface" : "surface." + error.field;
    return error;
  }
  Handle(Geom_BSplineSurface) surface = *made;
  double u0 = 0;
  double u1 = 0;
  double v0 = 0;
  double v1 = 0;
  spline->Bounds(u0, u1, v0, v1);
  set_domain(surface, u0, u1, v0, v1);

  std::vector<std::pair<TopoDS_Edge, EdgeCurves>> border;
  std::vector<double> distances;
  double most = 0;
  const TopTools_IndexedMapOfShape edges = edges_of(face);
  for (int i = 1; i <= edges.Extent(); ++i) {
    const TopoDS_Edge edge = TopoDS::Edge(edges(i));
    const EdgeCurves curves = curves_of(edge, face);
    if (curves.first.IsNull()) {
      return make_error(ErrorCode::invalid_argument, "found an edge without a curve in the parameters",
                        "number");
    }
    border.emplace_back(edge, curves);
    distances.push_back(moved(curves, spline, surface));
    most = std::max(most, distances.back());
  }
  if (most <= border_tolerance) {
    const TopoDS_Face shared = with_shared_edges(face, surface, border, distances);
    if (BRepCheck_Analyzer(shared).IsValid() || !BRepCheck_Analyzer(face).IsValid()) return shared;
  }
  return valid_or_fixed(with_own_edges(face, surface, border));
}

/// Walks through a model and builds it anew where faces changed, and only there.
class Rebuild {
 public:
  /// From a face, as it lies in the model, to what stands in its place, forward; null: nothing.
  explicit Rebuild(const TopTools_DataMapOfShapeShape& changes) : changes_(changes) {}

  /// Null when nothing is left.
  TopoDS_Shape operator()(const TopoDS_Shape& shape) const {
    if (shape.ShapeType() == TopAbs_FACE) {
      if (!changes_.IsBound(shape)) return shape;
      const TopoDS_Shape& made = changes_.Find(shape);
      return made.IsNull() ? made : made.Composed(shape.Orientation());
    }
    if (shape.ShapeType() > TopAbs_FACE) return shape;  // Wires, edges and vertices that stand alone.
    std::vector<TopoDS_Shape> parts;
    bool changed = false;
    bool all_solids = true;
    for (TopoDS_Iterator it(shape, /*cumOri=*/Standard_False, /*cumLoc=*/Standard_True); it.More();
         it.Next()) {
      const TopoDS_Shape part = (*this)(it.Value());
      changed = changed || part.IsNull() || !part.IsEqual(it.Value());
      if (part.IsNull()) continue;
      parts.push_back(part);
      all_solids = all_solids && part.ShapeType() == TopAbs_SOLID;
    }
    if (!changed) return shape;
    if (parts.empty()) return {};
    return assembled(shape, parts, all_solids).Oriented(shape.Orientation());
  }

 private:
  static TopoDS_Shape assembled(const TopoDS_Shape& former, const std::vector<TopoDS_Shape>& parts,
                                bool all_solids) {
    const BRep_Builder builder;
    bool open = false;
    if (former.ShapeType() == TopAbs_SOLID) {
      for (const TopoDS_Shape& part : parts) {
        open = open || (part.ShapeType() == TopAbs_SHELL && !BRep_Tool::IsClosed(part));
      }
      if (open && parts.size() == 1) return parts.front();
    }
    if (open || (former.ShapeType() == TopAbs_COMPSOLID && !all_solids)) {
      TopoDS_Compound loose;
      builder.MakeCompound(loose);
      for (const TopoDS_Shape& part : parts) builder.Add(loose, part);
      return loose;
    }
    TopoDS_Shape made = former.EmptyCopied();
    made.Location(TopLoc_Location());
    made.Orientation(TopAbs_FORWARD);
    for (const TopoDS_Shape& part : parts) builder.Add(made, part);
    if (made.ShapeType() == TopAbs_SHELL) made.Closed(BRep_Tool::IsClosed(made));
    return made;
  }

  const TopTools_DataMapOfShapeShape& changes_;
};

Result<TopoDS_Shape> changed(const TopoDS_Shape& whole, const ModelExport& model,
                             const CadPlacement& placement) {
  std::vector<TopoDS_Face> faces;
  for (TopExp_Explorer it(whole, TopAbs_FACE); it.More(); it.Next()) {
    faces.push_back(TopoDS::Face(it.Current()));
  }
  const auto check_number = [&](std::uint32_t number, const std::string& field) -> Status {
    if (number >= 1 && number <= faces.size()) return {};
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1..{}", number, faces.size()), field);
  };
  TopTools_DataMapOfShapeShape changes;
  for (std::size_t i = 0; i < model.replaced.size(); ++i) {
    const std::string field = fmt::format("replaced[{}]", i);
    const ReplacedFace& change = model.replaced[i];
    if (Status status = check_number(change.number, field + ".number"); !status) return status.error();
    const TopoDS_Face& face = faces[change.number - 1];
    auto made = replacement(face, change, placement, model.border_tolerance_m / model.metres_per_unit);
    if (!made) {
      Error error = made.error();
      error.message = fmt::format("face {}: {}", change.number, error.message);
      error.field = field + "." + error.field;
      return error;
    }
    changes.Bind(face, made->Oriented(TopAbs_FORWARD));
  }
  for (std::size_t i = 0; i < model.removed.size(); ++i) {
    if (Status status = check_number(model.removed[i], fmt::format("removed[{}]", i)); !status) {
      return status.error();
    }
    changes.Bind(faces[model.removed[i] - 1], TopoDS_Shape());
  }
  return Rebuild(changes)(whole);
}

}  // namespace

Result<TopoDS_Shape> make_model(const ModelExport& model) {
  if (!model.boundary_representation || !(model.metres_per_unit > 0) ||
      !std::isfinite(model.metres_per_unit) || !model.translation.allFinite() ||
      !(model.border_tolerance_m >= 0)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found a unit of {} m, expected a stored model with a unit above 0 and "
                                  "finite placement",
                                  model.metres_per_unit),
                      "metres_per_unit");
  }
  const auto whole = from_bytes(*model.boundary_representation);
  if (!whole) return whole;
  // Surfaces go back to where the model has them; the whole is moved afterwards.
  auto shape = changed(*whole, model, CadPlacement{model.metres_per_unit, model.translation});
  if (!shape) return shape;
  if (shape->IsNull()) {
    return make_error(ErrorCode::failed_precondition, "no face is left of the model", "removed");
  }
  if (model.metres_per_unit != metres_per_millimetre) {
    gp_Trsf scaled;
    scaled.SetScaleFactor(model.metres_per_unit / metres_per_millimetre);
    shape = BRepBuilderAPI_Transform(*shape, scaled, /*Copy=*/Standard_True).Shape();
  }
  gp_Trsf placed;
  const geometry::Vec3 by = model.translation / metres_per_millimetre;
  if (by.isZero(0)) return shape;
  placed.SetTranslation(gp_Vec(by.x(), by.y(), by.z()));
  return shape->Moved(TopLoc_Location(placed));
}

}  // namespace handloft::exchange::detail
