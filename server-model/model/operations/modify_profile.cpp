// ModifyProfile (A18 - A21): validation, the division of strokes among shapes, and what the log is to say of
// it. The effective operation names every division, so that a replay decides nothing anew.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server-model/geometry/resample.h"
#include "server-model/geometry/stroke_partition.h"
#include "server-model/geometry/symmetry.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/profile_edit.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

using geometry::Curve;
using geometry::Vec2;
using geometry::Vec3;

/// A part of a stroke shorter than this draws nothing: what a cut at an end leaves over.
constexpr double shortest_part_m = 1e-9;

Result<DualPtr> require_fitted(const Document& document, std::string_view id, const std::string& field) {
  auto shape = require_dual(document, id, field);
  if (shape && !(*shape)->fitted()) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("\"{}\" is not fitted yet, expected a surface", (*shape)->id), field);
  }
  return shape;
}

Result<Curve> read_curve(const v1::ProfileCurve& request, const std::string& field, const Limits& limits) {
  auto points = read_points(request.points(), field + ".points", limits);
  if (!points) return points.error();
  Curve curve;
  curve.reserve(points->size());
  for (const DualPoint& point : *points) curve.push_back(point.position());
  const double length = geometry::curve_length(curve);
  if (!(length > shortest_part_m)) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {} points over a length of {} metres, expected a curve", curve.size(), length),
        field + ".points");
  }
  return curve;
}

Status check_division(const Document& document, const v1::ProfileCurve& curve, const std::string& field) {
  if (!curve.entity().empty()) {
    if (auto shape = require_fitted(document, curve.entity(), field + ".entity"); !shape) {
      return shape.error();
    }
    if (curve.split_entities_size() > 0 || curve.split_at_size() > 0) {
      return make_error(ErrorCode::invalid_argument,
                        "found an entity for the whole curve and a division, expected one of the two",
                        field + ".entity");
    }
    return {};
  }
  if (curve.split_entities_size() == 0 && curve.split_at_size() == 0) return {};
  if (curve.split_entities_size() != curve.split_at_size() + 1) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} entities for {} parts, expected one each",
                                  curve.split_entities_size(), curve.split_at_size() + 1),
                      field + ".split_entities");
  }
  double former = 0;
  for (int k = 0; k < curve.split_at_size(); ++k) {
    const double at = curve.split_at(k);
    if (!(at >= former && at <= 1)) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found {}, expected {}..1: fractions of the length, ascending", at, former),
          fmt::format("{}.split_at[{}]", field, k));
    }
    former = at;
  }
  for (int k = 0; k < curve.split_entities_size(); ++k) {
    if (curve.split_entities(k).empty()) continue;
    auto shape =
        require_fitted(document, curve.split_entities(k), fmt::format("{}.split_entities[{}]", field, k));
    if (!shape) return shape.error();
  }
  return {};
}

/// The shapes among which curves divide themselves, in the order of their ids.
Result<std::vector<DualPtr>> candidates_of(const Document& document, const v1::ModifyProfile& request) {
  std::map<std::string_view, DualPtr> shapes;
  for (int k = 0; k < request.entities_size(); ++k) {
    auto shape = require_fitted(document, request.entities(k), fmt::format("modify_profile.entities[{}]", k));
    if (!shape) return shape.error();
    shapes.emplace((*shape)->id, *shape);
  }
  if (request.entities_size() == 0) {
    for (const auto& [id, entity] : document.entities) {
      const DualPtr shape = as_dual(entity);
      if (shape && shape->fitted()) shapes.emplace(shape->id, shape);
    }
  }
  std::vector<DualPtr> result;
  result.reserve(shapes.size());
  for (const auto& [id, shape] : shapes) result.push_back(shape);
  return result;
}

Result<std::vector<geometry::ProfileCandidate>> geometry_of(const std::vector<DualPtr>& shapes) {
  std::vector<geometry::ProfileCandidate> result;
  for (const DualPtr& shape : shapes) {
    auto trim = shape->trim();
    if (!trim) return trim.error();
    geometry::ProfileCandidate candidate;
    candidate.frame = shape->fit->frame;
    candidate.surface = shape->fit->surface;
    candidate.outside_m = [trim = *trim](const Vec2& xy) {
      if (const geometry::BoundaryTrim* boundary = trim.boundary()) {
        return std::max(0.0, -boundary->signed_distance(xy));
      }
      return geometry::distance_outside(*trim.superellipse(), xy);
    };
    result.push_back(std::move(candidate));
  }
  return result;
}

/// Writes the division of a curve into the effective message.
void name_owners(const geometry::StrokeDivision& division, const std::vector<DualPtr>& shapes,
                 v1::ProfileCurve& curve) {
  const auto name = [&](std::size_t owner) {
    return owner == geometry::nobody ? std::string() : shapes[owner]->id;
  };
  if (division.owners.size() == 1 && division.owners.front() != geometry::nobody) {
    curve.set_entity(name(division.owners.front()));
    return;
  }
  for (const double at : division.split_at) curve.add_split_at(at);
  for (const std::size_t owner : division.owners) curve.add_split_entities(name(owner));
}

/// What nobody was near enough for, in words.
void note_nobody(const geometry::StrokeDivision& division, int index, std::vector<std::string>& notes) {
  double unowned = 0;
  for (std::size_t k = 0; k < division.owners.size(); ++k) {
    if (division.owners[k] != geometry::nobody) continue;
    const double from = k == 0 ? 0 : division.split_at[k - 1];
    const double to = k == division.split_at.size() ? 1 : division.split_at[k];
    unowned += to - from;
  }
  if (unowned <= 0) return;
  if (division.owners.size() == 1) {
    notes.push_back(
        fmt::format("curve {} changes nothing: the nearest surface is {:.0f} mm away, more than the {:.0f} "
                    "mm within which "
                    "a curve is taken for a shape's profile",
                    index + 1, 1e3 * division.nearest_m, 1e3 * geometry::PartitionOptions{}.reach_m));
  } else {
    notes.push_back(
        fmt::format("{:.0f} % of curve {} lie near no surface and change nothing", 100 * unowned, index + 1));
  }
}

/// The strokes of every shape, in the order in which the message comes to the shapes.
class StrokesByShape {
 public:
  void add(const std::string& id, Curve curve) {
    if (id.empty() || !(geometry::curve_length(curve) > shortest_part_m)) return;
    if (!strokes_.contains(id)) order_.push_back(id);
    strokes_[id].push_back(std::move(curve));
  }
  const std::vector<std::string>& order() const { return order_; }
  /// Takes a shape's strokes out.
  std::vector<Curve> take(const std::string& id) {
    const auto found = strokes_.find(id);
    if (found == strokes_.end()) return {};
    std::vector<Curve> curves = std::move(found->second);
    strokes_.erase(found);
    return curves;
  }

 private:
  std::vector<std::string> order_;
  std::map<std::string, std::vector<Curve>> strokes_;
};

Status distribute(const v1::ProfileCurve& curve, const Curve& points, const std::string& field,
                  StrokesByShape& strokes) {
  if (!curve.entity().empty()) {
    strokes.add(curve.entity(), points);
    return {};
  }
  const std::vector<double> fractions(curve.split_at().begin(), curve.split_at().end());
  auto parts = geometry::split_curve(points, fractions);
  if (!parts) {
    Error error = parts.error();
    error.field = field + ".split_at";
    return error;
  }
  for (std::size_t k = 0; k < parts->size(); ++k) {
    strokes.add(curve.split_entities(static_cast<int>(k)), std::move((*parts)[k]));
  }
  return {};
}

/// Reads and divides all curves; `effective` gets the divisions.
Result<StrokesByShape> divide(const Document& document, v1::ModifyProfile& effective, const Limits& limits,
                              std::vector<std::string>& notes) {
  auto shapes = candidates_of(document, effective);
  if (!shapes) return shapes.error();
  std::optional<std::vector<geometry::ProfileCandidate>> candidates;  // Made when a curve needs them.
  StrokesByShape strokes;
  std::size_t total = 0;
  for (int i = 0; i < effective.curves_size(); ++i) {
    v1::ProfileCurve& curve = *effective.mutable_curves(i);
    const std::string field = fmt::format("modify_profile.curves[{}]", i);
    auto points = read_curve(curve, field, limits);
    if (!points) return points.error();
    total += points->size();
    if (total > limits.max_points_per_operation) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("found {} points so far, expected at most {} in all curves", total,
                                    limits.max_points_per_operation),
                        field + ".points");
    }
    if (auto status = check_division(document, curve, field); !status) return status.error();
    if (curve.entity().empty() && curve.split_entities_size() == 0) {
      if (shapes->empty()) {
        return make_error(ErrorCode::failed_precondition,
                          "no shape is fitted, expected one whose profile the curve draws",
                          "modify_profile.entities");
      }
      if (!candidates) {
        auto made = geometry_of(*shapes);
        if (!made) return made.error();
        candidates = *std::move(made);
      }
      auto division = geometry::divide_stroke(*points, *candidates);
      if (!division) return division.error();
      name_owners(*division, *shapes, curve);
      note_nobody(*division, i, notes);
    }
    if (auto status = distribute(curve, *points, field, strokes); !status) return status.error();
  }
  return strokes;
}

std::int64_t latest_time_ns(const v1::ModifyProfile& request) {
  std::int64_t latest = 0;
  for (const auto& curve : request.curves()) {
    for (const auto& point : curve.points()) latest = std::max(latest, point.time_ns());
  }
  return latest;
}

}  // namespace

Result<Outcome> modify_profile(const Document& document, const v1::ModifyProfile& request,
                               const ApplyContext& context) {
  const int count = request.curves_size();
  if (count == 0) {
    return make_error(ErrorCode::invalid_argument, "found no curves, expected at least one",
                      "modify_profile.curves");
  }
  if (static_cast<std::size_t>(count) > context.limits.max_curves_per_operation) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} curves, expected at most {}", count, context.limits.max_curves_per_operation),
        "modify_profile.curves");
  }
  Outcome outcome;
  outcome.document = document;
  v1::ModifyProfile& effective = *outcome.effective.mutable_modify_profile();
  effective = request;
  auto strokes = divide(document, effective, context.limits, outcome.notes);
  if (!strokes) return strokes.error();

  ProfileEdit edit;
  edit.keep = request.keep_as_points() ? KeptCurves::as_points : KeptCurves::none;
  edit.time_ns = latest_time_ns(request);
  std::string names;
  ProfileSolvers of_this_operation;
  ProfileSolvers& solvers = context.profile_solvers ? *context.profile_solvers : of_this_operation;
  for (const std::string& id : strokes->order()) {
    edit.strokes = strokes->take(id);
    if (edit.strokes.empty()) continue;  // Drawn already, as the mirror image of its partner's.
    const DualPtr shape = outcome.document.find_dual(id);
    // A stroke over a shape and its mirror image is one edit of the pair.
    if (const DualPtr partner = linked_partner(document, *shape)) {
      for (Curve& curve : strokes->take(partner->id)) {
        for (Vec3& point : curve) point = geometry::reflect_point(point, shape->plane);
        edit.strokes.push_back(std::move(curve));
      }
    }
    if (auto status = edit_profile(outcome.document, id, edit, "modify_profile.curves", context.limits,
                                   solvers, outcome.notes);
        !status) {
      return status.error();
    }
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", shape->name);
  }
  outcome.words = names.empty() ? "Draw a profile" : fmt::format("Draw the profile of {}", names);
  return outcome;
}

}  // namespace handloft::model
