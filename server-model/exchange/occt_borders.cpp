#include "server-model/exchange/occt_borders.h"

#include <fmt/format.h>

#include <BRepCheck_Analyzer.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Precision.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Iterator.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "server-model/exchange/occt_trimmed_face.h"

namespace handloft::exchange::detail {
namespace {

constexpr int border_samples = 33;  ///< Along each edge.

/// An edge of a changed face.
struct Border {
  TopoDS_Edge former;  ///< Forward.
  EdgeCurves curves;
  std::vector<gp_Vec> movement;  ///< Of its places, those of a seam's second side behind those of the first.
  double moved = 0;              ///< The longest of these.
  int edge = 0;                  ///< Its number among the model's edges that are looked at.
  std::optional<TopoDS_Edge> made;  ///< None: it keeps the former.
};

struct Face {
  ChangedFace* change = nullptr;
  std::vector<Border> borders;
  bool alone = false;  ///< Shares no edge.
};

/// A border among those of all changed faces.
struct Use {
  int face = 0, border = 0;
};

/// How the edge lies in the face's parameters, whichever way it is passed.
EdgeCurves curves_of(const TopoDS_Edge& forward, const TopoDS_Face& face) {
  EdgeCurves curves;
  curves.first = BRep_Tool::CurveOnSurface(forward, face, curves.lower, curves.upper);
  if (BRep_Tool::IsClosed(forward, face)) {
    double lower = 0;
    double upper = 0;
    curves.second =
        BRep_Tool::CurveOnSurface(TopoDS::Edge(forward.Oriented(TopAbs_REVERSED)), face, lower, upper);
  }
  return curves;
}

gp_Pnt2d place(const EdgeCurves& curves, const Handle(Geom2d_Curve) & curve, int i) {
  return curve->Value(curves.lower + (curves.upper - curves.lower) * i / (border_samples - 1));
}

gp_Pnt on(const Handle(Geom_BSplineSurface) & surface, const gp_Pnt2d& uv) {
  return surface->Value(uv.X(), uv.Y());
}

std::vector<gp_Vec> movement_of(const EdgeCurves& curves, const ChangedFace& change) {
  std::vector<gp_Vec> movement;
  for (const Handle(Geom2d_Curve) & curve : {curves.first, curves.second}) {
    if (curve.IsNull()) continue;
    for (int i = 0; i < border_samples; ++i) {
      const gp_Pnt2d uv = place(curves, curve, i);
      movement.emplace_back(on(change.before, uv), on(change.after, uv));
    }
  }
  return movement;
}

/// Of two movements along one edge, or along both sides of a seam.
double difference(const std::vector<gp_Vec>& a, const std::vector<gp_Vec>& b) {
  double most = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    most = std::max(most, (a[i] - b[i]).Magnitude());
  }
  return most;
}

/// How far the two sides of a seam came apart.
double opened(const Border& border) {
  if (border.curves.second.IsNull()) return 0;
  const auto middle = border.movement.begin() + border_samples;
  return difference({border.movement.begin(), middle}, {middle, border.movement.end()});
}

/// Between the images of an edge on two surfaces.
double distance(const Border& a, const Face& of_a, const Border& b, const Face& of_b) {
  double most = 0;
  for (int i = 0; i < border_samples; ++i) {
    most = std::max(most, on(of_a.change->after, place(a.curves, a.curves.first, i))
                              .Distance(on(of_b.change->after, place(b.curves, b.curves.first, i))));
  }
  return most;
}

void lay_on(const TopoDS_Edge& edge, const Handle(Geom_BSplineSurface) & surface, const EdgeCurves& curves,
            double tolerance) {
  const BRep_Builder builder;
  const TopLoc_Location here;
  if (curves.second.IsNull()) {
    builder.UpdateEdge(edge, curves.first, surface, here, tolerance);
  } else {
    builder.UpdateEdge(edge, curves.first, curves.second, surface, here, tolerance);
  }
  builder.Range(edge, surface, here, curves.lower, curves.upper);
  for (TopoDS_Iterator it(edge); it.More(); it.Next()) {
    if (it.Value().ShapeType() == TopAbs_VERTEX) {
      builder.UpdateVertex(TopoDS::Vertex(it.Value()), tolerance);
    }
  }
}

/// Vertices of the model as they stand in the faces: one that an edge is shared by is the same in both, and
/// where an edge is kept its vertices are.
class Corners {
 public:
  static constexpr int model = -1;  ///< As a face: the vertex as it was.

  int number(const TopoDS_Vertex& vertex) { return former_.Add(vertex); }

  void join(int face, int with, int vertex) {
    const int a = root(node(face, vertex));
    const int b = root(node(with, vertex));
    if (a != b) parent_[static_cast<std::size_t>(a)] = b;
  }

  /// Made where the first that asks has it.
  TopoDS_Vertex at(int face, int vertex, const gp_Pnt& where) {
    const int group = root(node(face, vertex));
    if (group == root(node(model, vertex))) return TopoDS::Vertex(former_(vertex));
    const auto [found, is_new] = made_.try_emplace(group);
    if (is_new) BRep_Builder().MakeVertex(found->second, where, Precision::Confusion());
    return found->second;
  }

 private:
  int node(int face, int vertex) {
    const auto [found, is_new] = nodes_.try_emplace({face, vertex}, static_cast<int>(parent_.size()));
    if (is_new) parent_.push_back(found->second);
    return found->second;
  }
  int root(int node) const {
    while (parent_[static_cast<std::size_t>(node)] != node) node = parent_[static_cast<std::size_t>(node)];
    return node;
  }

  TopTools_IndexedMapOfShape former_;
  std::map<std::pair<int, int>, int> nodes_;
  std::vector<int> parent_;
  std::map<int, TopoDS_Vertex> made_;
};

std::array<TopoDS_Vertex, 2> ends_of(const TopoDS_Edge& forward) {
  return {TopExp::FirstVertex(forward), TopExp::LastVertex(forward)};
}

/// Borders of the changed faces, and what shall stand for each.
class Borders {
 public:
  Borders(double tolerance, std::vector<ChangedFace>& changed) : tolerance_(tolerance) {
    for (ChangedFace& change : changed) faces_.push_back({&change, {}, false});
  }

  Status find() {
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      Face& face = faces_[f];
      TopTools_IndexedMapOfShape edges;
      TopExp::MapShapes(face.change->former, TopAbs_EDGE, edges);
      for (int i = 1; i <= edges.Extent(); ++i) {
        Border border;
        border.former = TopoDS::Edge(edges(i).Oriented(TopAbs_FORWARD));
        border.curves = curves_of(border.former, face.change->former);
        if (border.curves.first.IsNull()) {
          return make_error(
              ErrorCode::invalid_argument,
              fmt::format("face {}: found an edge without a curve in the parameters", face.change->number),
              "number");
        }
        border.movement = movement_of(border.curves, *face.change);
        for (const gp_Vec& step : border.movement) border.moved = std::max(border.moved, step.Magnitude());
        border.edge = edges_.Add(border.former);
        uses_.resize(static_cast<std::size_t>(edges_.Extent()));
        uses_[static_cast<std::size_t>(border.edge - 1)].push_back(
            {static_cast<int>(f), static_cast<int>(face.borders.size())});
        face.borders.push_back(std::move(border));
      }
    }
    return {};
  }

  Status make() {
    const std::set<int> all = [&] {
      std::set<int> numbers;
      for (std::size_t f = 0; f < faces_.size(); ++f) numbers.insert(static_cast<int>(f));
      return numbers;
    }();
    lay(all);
    std::set<int> invalid;
    for (const int f : all) {
      Face& face = faces_[static_cast<std::size_t>(f)];
      face.change->made = made(face);
      const bool keeps_all = std::none_of(face.borders.begin(), face.borders.end(),
                                          [](const Border& border) { return border.made.has_value(); });
      if (!BRepCheck_Analyzer(face.change->made).IsValid() &&
          !(keeps_all && !BRepCheck_Analyzer(face.change->former).IsValid())) {
        invalid.insert(f);
      }
    }
    for (const int f : invalid) {
      Face& face = faces_[static_cast<std::size_t>(f)];
      face.alone = true;
      lay({f});
      auto valid = valid_or_fixed(made(face));
      if (!valid) {
        Error error = valid.error();
        error.message = fmt::format("face {}: {}", face.change->number, error.message);
        return error;
      }
      face.change->made = *valid;
    }
    return {};
  }

  std::vector<OpenedEdge> opened_edges(const std::vector<TopoDS_Face>& all) const {
    std::map<std::pair<std::uint32_t, std::uint32_t>, double> pairs;
    const auto note = [&](std::uint32_t a, std::uint32_t b, double gap) {
      double& most = pairs[std::minmax(a, b)];
      most = std::max(most, gap);
    };
    std::map<std::uint32_t, const Face*> changed;
    for (const Face& face : faces_) {
      changed.emplace(face.change->number, &face);
      for (const Border& border : face.borders) {
        if (const double gap = opened(border); gap > tolerance_) {
          note(face.change->number, face.change->number, gap);
        }
      }
    }
    for (std::size_t n = 1; n <= all.size(); ++n) {
      const auto number = static_cast<std::uint32_t>(n);
      if (changed.contains(number)) continue;
      TopTools_IndexedMapOfShape edges;
      TopExp::MapShapes(all[n - 1], TopAbs_EDGE, edges);
      for (int i = 1; i <= edges.Extent(); ++i) {
        const int edge = edges_.FindIndex(edges(i));
        if (edge == 0) continue;
        for (const Use& use : uses_[static_cast<std::size_t>(edge - 1)]) {
          const Face& face = face_of(use);
          if (face.change->former.IsSame(all[n - 1])) continue;  // Stands in the model twice.
          if (face.alone || border_of(use).made) note(number, face.change->number, border_of(use).moved);
        }
      }
    }
    for (const std::vector<Use>& uses : uses_) {
      for (std::size_t i = 0; i < uses.size(); ++i) {
        for (std::size_t j = i + 1; j < uses.size(); ++j) {
          const Border& a = border_of(uses[i]);
          const Border& b = border_of(uses[j]);
          const bool share = !face_of(uses[i]).alone && !face_of(uses[j]).alone &&
                             (a.made ? b.made && a.made->IsSame(*b.made) : !b.made);
          if (share) continue;
          note(face_of(uses[i]).change->number, face_of(uses[j]).change->number,
               difference(a.movement, b.movement));
        }
      }
    }
    std::vector<OpenedEdge> result;
    result.reserve(pairs.size());
    for (const auto& [faces, gap] : pairs) result.push_back({faces.first, faces.second, gap});
    return result;
  }

 private:
  Face& face_of(const Use& use) { return faces_[static_cast<std::size_t>(use.face)]; }
  const Face& face_of(const Use& use) const { return faces_[static_cast<std::size_t>(use.face)]; }
  Border& border_of(const Use& use) { return face_of(use).borders[static_cast<std::size_t>(use.border)]; }
  const Border& border_of(const Use& use) const {
    return face_of(use).borders[static_cast<std::size_t>(use.border)];
  }

  /// Decides which borders of these faces stay and which are one, and lays their edges.
  void lay(const std::set<int>& faces) {
    Corners corners;
    std::vector<std::vector<Use>> groups;  // Of borders that become one new edge each.
    for (const std::vector<Use>& uses : uses_) {
      const std::size_t first_group = groups.size();
      for (const Use& use : uses) {
        if (!faces.contains(use.face)) continue;
        const Border& border = border_of(use);
        if (border.moved <= tolerance_ && !face_of(use).alone) {
          join(corners, use, Corners::model);
          continue;
        }
        const auto group = std::find_if(groups.begin() + static_cast<std::ptrdiff_t>(first_group),
                                        groups.end(), [&](const std::vector<Use>& other) {
                                          return difference(border_of(other.front()).movement,
                                                            border.movement) <= tolerance_;
                                        });
        if (group == groups.end()) {
          groups.push_back({use});
        } else {
          join(corners, use, group->front().face);
          group->push_back(use);
        }
      }
    }
    for (const std::vector<Use>& uses : uses_) {
      for (const Use& use : uses) {
        const Border& border = border_of(use);
        if (!faces.contains(use.face) || border.moved > tolerance_ || face_of(use).alone) continue;
        lay_on(border.former, face_of(use).change->after, border.curves,
               BRep_Tool::Tolerance(border.former) + border.moved);
      }
    }
    for (const std::vector<Use>& group : groups) lay_new(group, corners);
  }

  void join(Corners& corners, const Use& use, int with) {
    for (const TopoDS_Vertex& end : ends_of(border_of(use).former)) {
      if (!end.IsNull()) corners.join(use.face, with, corners.number(end));
    }
  }

  void lay_new(const std::vector<Use>& group, Corners& corners) {
    const BRep_Builder builder;
    const Use& first = group.front();
    const Border& border = border_of(first);
    std::array<TopoDS_Vertex, 2> ends;
    for (std::size_t k = 0; k < 2; ++k) {
      const TopoDS_Vertex former = ends_of(border.former)[k];
      const gp_Pnt where = on(face_of(first).change->after,
                              place(border.curves, border.curves.first, k == 0 ? 0 : border_samples - 1));
      if (former.IsNull()) {
        builder.MakeVertex(ends[k], where, Precision::Confusion());
      } else {
        ends[k] = corners.at(first.face, corners.number(former), where);
      }
    }
    TopoDS_Edge edge;
    builder.MakeEdge(edge);
    lay_edge(edge, face_of(first).change->after, border.curves, ends[0], ends[1]);
    for (const Use& use : group) {
      border_of(use).made = edge;
      if (&use == &first) continue;
      const double apart = distance(border, face_of(first), border_of(use), face_of(use));
      lay_on(edge, face_of(use).change->after, border_of(use).curves, BRep_Tool::Tolerance(edge) + apart);
    }
  }

  /// Within the edges that are laid; in the model's coordinates.
  TopoDS_Face made(const Face& face) const {
    const BRep_Builder builder;
    TopoDS_Face made;
    const TopoDS_Face& former = face.change->former;
    builder.MakeFace(made, face.change->after, BRep_Tool::Tolerance(former));
    builder.NaturalRestriction(made, BRep_Tool::NaturalRestriction(former));
    const auto border_like = [&](const TopoDS_Shape& edge) {
      return std::find_if(face.borders.begin(), face.borders.end(),
                          [&](const Border& border) { return border.made && border.former.IsSame(edge); });
    };
    for (TopoDS_Iterator parts(former); parts.More(); parts.Next()) {
      bool is_other = false;
      for (TopoDS_Iterator it(parts.Value()); it.More() && !is_other; it.Next()) {
        is_other = border_like(it.Value()) != face.borders.end();
      }
      if (!is_other || parts.Value().ShapeType() != TopAbs_WIRE) {
        if (parts.Value().ShapeType() == TopAbs_WIRE || !face.alone) builder.Add(made, parts.Value());
        continue;
      }
      TopoDS_Wire wire;
      builder.MakeWire(wire);
      for (TopoDS_Iterator it(parts.Value()); it.More(); it.Next()) {
        const auto border = border_like(it.Value());
        builder.Add(wire, border == face.borders.end() ? it.Value()
                                                       : border->made->Oriented(it.Value().Orientation()));
      }
      wire.Closed(Standard_True);
      builder.Add(made, wire);
    }
    return made;
  }

  double tolerance_;
  std::vector<Face> faces_;
  TopTools_IndexedMapOfShape edges_;
  std::vector<std::vector<Use>> uses_;  ///< By the edge's number.
};

}  // namespace

Result<std::vector<OpenedEdge>> lay_borders(const std::vector<TopoDS_Face>& faces, double tolerance,
                                            std::vector<ChangedFace>& changed) {
  Borders borders(tolerance, changed);
  if (Status found = borders.find(); !found) return found.error();
  if (Status made = borders.make(); !made) return made.error();
  return borders.opened_edges(faces);
}

}  // namespace handloft::exchange::detail
