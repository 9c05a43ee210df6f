#include "server-model/exchange/occt_replace.h"

#include <fmt/format.h>

#include <BRepBuilderAPI_Transform.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_DataMapOfShapeInteger.hxx>
#include <TopTools_DataMapOfShapeShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Iterator.hxx>
#include <TopoDS_Shell.hxx>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "server-model/exchange/cad_bytes.h"
#include "server-model/exchange/cad_source.h"
#include "server-model/exchange/occt_borders.h"
#include "server-model/exchange/occt_bspline.h"

namespace handloft::exchange::detail {
namespace {

/// Metres: what rounding moves a control point by, far below what any file tells apart.
constexpr double unchanged_m = 1e-12;

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

/// The face with the other surface, in the former one's parameters; none where nobody changed it.
Result<std::optional<ChangedFace>> change_of(const TopoDS_Face& former, const ReplacedFace& replaced,
                                             const CadPlacement& placement) {
  ChangedFace change;
  change.number = replaced.number;
  change.former = TopoDS::Face(former.Oriented(TopAbs_FORWARD));
  const Handle(Geom_Surface) before = BRep_Tool::Surface(change.former);
  if (!before.IsNull()) change.before = bspline_of(before);
  if (change.before.IsNull()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, which is no B-spline face", replaced.number), "number");
  }
  const auto as_read = to_geometry(change.before, placement);
  if (as_read && is_same(*as_read, replaced.surface)) return std::optional<ChangedFace>();
  auto made = to_occt(replaced.surface, placement);
  if (!made) {
    Error error = made.error();
    error.field = error.field.empty() ? "surface" : "surface." + error.field;
    return error;
  }
  change.after = *made;
  double u0 = 0;
  double u1 = 0;
  double v0 = 0;
  double v1 = 0;
  change.before->Bounds(u0, u1, v0, v1);
  set_domain(change.after, u0, u1, v0, v1);
  return std::optional<ChangedFace>(std::move(change));
}

/// The faces of a shell as shells that hang together.
std::vector<TopoDS_Shape> connected(const TopoDS_Shape& shell) {
  std::vector<TopoDS_Shape> faces;
  for (TopoDS_Iterator it(shell); it.More(); it.Next()) faces.push_back(it.Value());
  std::vector<std::size_t> parent(faces.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  TopTools_DataMapOfShapeInteger first_with;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (TopExp_Explorer it(faces[f], TopAbs_EDGE); it.More(); it.Next()) {
      if (!first_with.IsBound(it.Current())) {
        first_with.Bind(it.Current(), static_cast<int>(f));
      } else {
        const std::size_t a = root(f);
        const std::size_t b = root(static_cast<std::size_t>(first_with.Find(it.Current())));
        parent[std::max(a, b)] = std::min(a, b);
      }
    }
  }
  const BRep_Builder builder;
  std::map<std::size_t, TopoDS_Shape> shells;  // Ascending: as their first faces stand in the model.
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto [found, is_new] = shells.try_emplace(root(f));
    if (is_new) {
      TopoDS_Shell made;
      builder.MakeShell(made);
      found->second = made;
    }
    builder.Add(found->second, faces[f]);
  }
  std::vector<TopoDS_Shape> result;
  for (auto& [first, made] : shells) {
    made.Closed(BRep_Tool::IsClosed(made));
    result.push_back(made);
  }
  return result;
}

/// Walks through a model and builds it anew where faces changed, and only there.
class Rebuild {
 public:
  /// From a face, as it lies in the model, to what stands in its place, forward; null: nothing.
  explicit Rebuild(TopTools_DataMapOfShapeShape changes) : changes_(std::move(changes)) {}

  /// Null when nothing is left.
  TopoDS_Shape operator()(const TopoDS_Shape& shape) {
    if (shape.ShapeType() > TopAbs_FACE) return shape;  // Wires, edges and vertices that stand alone.
    if (changes_.IsBound(shape)) {
      const TopoDS_Shape& made = changes_.Find(shape);
      return made.IsNull() ? made : made.Composed(shape.Orientation());
    }
    if (shape.ShapeType() == TopAbs_FACE) return shape;
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
    const TopoDS_Shape made = parts.empty() ? TopoDS_Shape() : assembled(shape, parts, all_solids);
    changes_.Bind(shape, made);
    return made.IsNull() ? made : made.Composed(shape.Orientation());
  }

  /// What became of a part of the model; null when nothing did.
  TopoDS_Shape now(const TopoDS_Shape& part) const {
    return changes_.IsBound(part) ? changes_.Find(part) : part;
  }

 private:
  static TopoDS_Shape loose(const std::vector<TopoDS_Shape>& parts) {
    const BRep_Builder builder;
    TopoDS_Compound compound;
    builder.MakeCompound(compound);
    for (const TopoDS_Shape& part : parts) builder.Add(compound, part);
    return compound;
  }

  static TopoDS_Shape assembled(const TopoDS_Shape& former, const std::vector<TopoDS_Shape>& parts,
                                bool all_solids) {
    if (former.ShapeType() == TopAbs_SOLID) {
      // A shell that fell apart is a compound now.
      const bool open = std::any_of(parts.begin(), parts.end(), [](const TopoDS_Shape& part) {
        return part.ShapeType() == TopAbs_COMPOUND ||
               (part.ShapeType() == TopAbs_SHELL && !BRep_Tool::IsClosed(part));
      });
      if (open && parts.size() == 1) return parts.front();
      if (open) return loose(parts);
    }
    if (former.ShapeType() == TopAbs_COMPSOLID && !all_solids) return loose(parts);
    TopoDS_Shape made = former.EmptyCopied();
    made.Location(TopLoc_Location());
    made.Orientation(TopAbs_FORWARD);
    for (const TopoDS_Shape& part : parts) BRep_Builder().Add(made, part);
    if (made.ShapeType() == TopAbs_SHELL) {
      const std::vector<TopoDS_Shape> shells = connected(made);
      if (shells.size() > 1) return loose(shells);
      made.Closed(BRep_Tool::IsClosed(made));
    }
    return made;
  }

  TopTools_DataMapOfShapeShape changes_;  ///< Rebuilt parts of all kinds, as they went in, to the new ones.
};

/// The part of each label, and what it became.
std::vector<LabelledPart> labelled(const StoredModel& stored, const Rebuild& rebuild) {
  std::vector<LabelledPart> parts;
  for (const auto& [part, label] : parts_of(stored.shape, stored.labels)) {
    const TopoDS_Shape now = rebuild.now(part);
    if (now.IsNull()) continue;
    const bool is_loose = now.ShapeType() == TopAbs_COMPOUND && label.kind != TopAbs_COMPOUND;
    if (!is_loose) {
      parts.push_back({now, label});
      continue;
    }
    // A solid that fell apart: each piece is called as it was, and so is the product of all.
    parts.push_back({now, label});
    parts.back().label.name.clear();
    for (TopoDS_Iterator it(now); it.More(); it.Next()) parts.push_back({it.Value(), label});
  }
  return parts;
}

Result<MadeModel> changed(const StoredModel& stored, const ModelExport& model,
                          const CadPlacement& placement) {
  std::vector<TopoDS_Face> faces;
  for (TopExp_Explorer it(stored.shape, TopAbs_FACE); it.More(); it.Next()) {
    faces.push_back(TopoDS::Face(it.Current()));
  }
  const auto check_number = [&](std::uint32_t number, const std::string& field) -> Status {
    if (number >= 1 && number <= faces.size()) return {};
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1..{}", number, faces.size()), field);
  };
  std::vector<ChangedFace> changes;
  TopTools_DataMapOfShapeInteger known;  // A face may stand in a model twice: the last change counts.
  for (std::size_t i = 0; i < model.replaced.size(); ++i) {
    const std::string field = fmt::format("replaced[{}]", i);
    const ReplacedFace& replaced = model.replaced[i];
    if (Status status = check_number(replaced.number, field + ".number"); !status) return status.error();
    const TopoDS_Face& face = faces[replaced.number - 1];
    auto change = change_of(face, replaced, placement);
    if (!change) {
      Error error = change.error();
      error.message = fmt::format("face {}: {}", replaced.number, error.message);
      error.field = field + "." + error.field;
      return error;
    }
    if (!*change) continue;
    if (known.IsBound(face)) {
      changes[static_cast<std::size_t>(known.Find(face))] = std::move(**change);
    } else {
      known.Bind(face, static_cast<int>(changes.size()));
      changes.push_back(std::move(**change));
    }
  }
  auto opened = lay_borders(faces, model.border_tolerance_m / model.metres_per_unit, changes);
  if (!opened) {
    Error error = opened.error();
    error.field = "replaced." + error.field;
    return error;
  }
  TopTools_DataMapOfShapeShape parts;
  for (const ChangedFace& change : changes) {
    parts.Bind(faces[change.number - 1], change.made.Oriented(TopAbs_FORWARD));
  }
  for (std::size_t i = 0; i < model.removed.size(); ++i) {
    if (Status status = check_number(model.removed[i], fmt::format("removed[{}]", i)); !status) {
      return status.error();
    }
    parts.Bind(faces[model.removed[i] - 1], TopoDS_Shape());
  }
  Rebuild rebuild(std::move(parts));
  MadeModel made;
  made.shape = rebuild(stored.shape);
  made.parts = labelled(stored, rebuild);
  if (opened->empty()) return made;
  const FaceNames names(stored.shape, stored.labels);
  const std::set<std::uint32_t> removed(model.removed.begin(), model.removed.end());
  for (const OpenedEdge& edge : *opened) {
    if (removed.contains(edge.face) || removed.contains(edge.neighbour)) continue;
    made.gaps.push_back({0, edge.face, edge.neighbour, names.of(faces[edge.face - 1]),
                         names.of(faces[edge.neighbour - 1]), edge.gap * model.metres_per_unit});
  }
  return made;
}

}  // namespace

Result<MadeModel> make_model(const ModelExport& model) {
  if (!model.boundary_representation || !(model.metres_per_unit > 0) ||
      !std::isfinite(model.metres_per_unit) || !model.translation.allFinite() ||
      !(model.border_tolerance_m >= 0)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found a unit of {} m, expected a stored model with a unit above 0 and "
                                  "finite placement",
                                  model.metres_per_unit),
                      "metres_per_unit");
  }
  const auto stored = from_bytes(*model.boundary_representation);
  if (!stored) return stored.error();
  // Surfaces go back to where the model has them; the whole is moved afterwards.
  auto made = changed(*stored, model, CadPlacement{model.metres_per_unit, model.translation});
  if (!made) return made;
  if (made->shape.IsNull()) {
    return make_error(ErrorCode::failed_precondition, "no face is left of the model", "removed");
  }
  if (model.metres_per_unit != metres_per_millimetre) {
    gp_Trsf scaled;
    scaled.SetScaleFactor(model.metres_per_unit / metres_per_millimetre);
    BRepBuilderAPI_Transform transform(made->shape, scaled, /*theCopyGeom=*/Standard_True);
    made->shape = transform.Shape();
    for (LabelledPart& part : made->parts) part.shape = transform.ModifiedShape(part.shape);
  }
  gp_Trsf placed;
  const geometry::Vec3 by = model.translation / metres_per_millimetre;
  if (by.isZero(0)) return made;
  placed.SetTranslation(gp_Vec(by.x(), by.y(), by.z()));
  const TopLoc_Location there(placed);
  made->shape.Move(there);
  for (LabelledPart& part : made->parts) part.shape.Move(there);
  return made;
}

}  // namespace handloft::exchange::detail
