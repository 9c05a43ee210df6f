#include "server-model/model/query.h"

#include <fmt/format.h>

#include <cmath>

#include "server-model/geometry/surface_pick.h"
#include "server-model/model/annotations.h"
#include "server-model/model/canonical.h"
#include "server-model/model/comparison.h"
#include "server-model/model/control_net.h"
#include "server-model/model/difference_words.h"
#include "server-model/model/reference_distance.h"
#include "server-model/model/sculpt_place.h"
#include "server-model/model/sculpt_query.h"
#include "server-model/model/validate.h"
#include "server-model/model/vector_message.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

v1::Representation to_proto(Representation representation) {
  switch (representation) {
    case Representation::points:
      return v1::REPRESENTATION_POINTS;
    case Representation::surface:
      return v1::REPRESENTATION_SURFACE;
    case Representation::both:
      return v1::REPRESENTATION_BOTH;
  }
  return v1::REPRESENTATION_UNSPECIFIED;
}

Error not_fitted(const DualShape& shape, std::string field) {
  return make_error(ErrorCode::failed_precondition, fmt::format("\"{}\" is not fitted yet", shape.id),
                    std::move(field));
}

Result<v1::QueryResult> surface(const v1::SurfaceQuery& query, const Document& document) {
  auto found = require_dual(document, query.entity(), "surface.entity");
  if (!found) return found.error();
  const DualShape& shape = **found;
  if (!shape.fit) return not_fitted(shape, "surface.entity");
  const FittedSurface& fit = *shape.fit;
  v1::QueryResult result;
  v1::SurfaceResult& out = *result.mutable_surface();
  out.set_entity(shape.id);
  write_vector(fit.frame.origin, *out.mutable_frame()->mutable_origin());
  write_vector(fit.frame.x_axis(), *out.mutable_frame()->mutable_x());
  write_vector(fit.frame.y_axis(), *out.mutable_frame()->mutable_y());
  write_vector(fit.frame.normal(), *out.mutable_frame()->mutable_z());
  out.set_degree(static_cast<std::uint32_t>(fit.surface.degree()));
  out.set_requested_degree(fit.requested_degree);
  for (const double coefficient : fit.surface.coefficients()) out.add_coefficients(coefficient);
  auto& residuals = *out.mutable_residuals();
  residuals.set_count(static_cast<std::uint32_t>(fit.statistics.count));
  residuals.set_rms_m(fit.statistics.rms);
  residuals.set_weighted_rms_m(fit.statistics.weighted_rms);
  residuals.set_max_m(fit.statistics.max);
  out.set_point_count(static_cast<std::uint32_t>(shape.points.size()));
  out.set_stale(shape.stale);
  out.set_superellipse_exponent(shape.superellipse_exponent);
  write_vector(fit.box.centre, *out.mutable_box_centre());
  write_vector(fit.box.half_extent, *out.mutable_box_half_extent());
  out.set_frame_drift_rad(fit.frame_drift_rad);
  for (const double rms : fit.cross_validated_rms_m) out.add_cross_validated_rms_m(rms);
  const auto trim = shape.trim();
  if (!trim) return trim.error();
  out.set_trim(trim->boundary() != nullptr ? "boundary" : "superellipse");
  return result;
}

Result<v1::QueryResult> evaluate(const v1::EvaluateQuery& query, const Document& document,
                                 const Limits& limits) {
  if (const SculptPtr surface = as_sculpt(document.find(query.entity()))) {
    return evaluate_sculpt(query, *surface, limits);
  }
  auto found = require_dual(document, query.entity(), "evaluate.entity");
  if (!found) return found.error();
  const DualShape& shape = **found;
  if (!shape.fit) return not_fitted(shape, "evaluate.entity");
  auto trim = shape.trim();
  if (!trim) return trim.error();
  if (static_cast<std::size_t>(query.at_size()) > limits.max_points_per_query) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} places, expected at most {}", query.at_size(), limits.max_points_per_query),
        "evaluate.at");
  }
  const FittedSurface& fit = *shape.fit;
  v1::QueryResult result;
  v1::EvaluateResult& out = *result.mutable_evaluate();
  out.set_entity(shape.id);
  for (int i = 0; i < query.at_size(); ++i) {
    const double x = query.at(i).x();
    const double y = query.at(i).y();
    for (const auto& [value, name] : {std::pair{x, "x"}, std::pair{y, "y"}}) {
      // The path is only spelled out for a bad one.
      if (std::isfinite(value) && std::abs(value) <= limits.max_coordinate_m) continue;
      return check_coordinate(value, fmt::format("evaluate.at[{}].{}", i, name), limits).error();
    }
    const geometry::Vec3 position = fit.surface.world_point(fit.frame, x, y);
    const geometry::Vec3 normal = fit.surface.world_normal(fit.frame, x, y);
    if (!position.allFinite() || !normal.allFinite()) {
      return make_error(ErrorCode::invalid_argument,
                        "found a place where the surface leaves the range of numbers",
                        fmt::format("evaluate.at[{}]", i));
    }
    write_vector(position, *out.add_positions());
    write_vector(normal, *out.add_normals());
    out.add_opacity(trim->opacity({x, y}));
  }
  return result;
}

Result<v1::QueryResult> pick(const v1::PickQuery& query, const Document& document, const Limits& limits) {
  const geometry::Vec3 origin(query.origin().x(), query.origin().y(), query.origin().z());
  const geometry::Vec3 direction(query.direction().x(), query.direction().y(), query.direction().z());
  for (const double value : origin) {
    if (Status status = check_coordinate(value, "pick.origin", limits); !status.ok()) return status.error();
  }
  if (!direction.allFinite() || direction.isZero(0)) {
    return make_error(ErrorCode::invalid_argument, "found no direction, expected finite numbers, not all 0",
                      "pick.direction");
  }
  v1::QueryResult result;
  v1::PickResult& out = *result.mutable_pick();
  for (const auto& [id, entity] : document.entities) {
    if (const SculptPtr surface = as_sculpt(entity)) {
      auto hit = pick_sculpt(*surface, origin, direction);
      if (!hit) return hit.error();
      if (!*hit || (!out.entity().empty() && (*hit)->distance_m >= out.distance_m())) continue;
      out.set_entity(id);
      write_vector((*hit)->place, *out.mutable_position());
      write_vector(surface->surface->normal((*hit)->uv.x(), (*hit)->uv.y()), *out.mutable_normal());
      out.set_distance_m((*hit)->distance_m);
      continue;
    }
    const DualPtr shape = as_dual(entity);
    if (!shape || !shape->fit || shape->representation == Representation::points) continue;
    const auto trim = shape->trim();
    if (!trim) return trim.error();
    const auto hit = geometry::pick_surface(shape->fit->surface, shape->fit->frame, *trim, origin, direction);
    if (!hit || (!out.entity().empty() && hit->distance_m >= out.distance_m())) continue;
    out.set_entity(id);
    write_vector(hit->position, *out.mutable_position());
    write_vector(hit->normal, *out.mutable_normal());
    out.set_distance_m(hit->distance_m);
  }
  return result;
}

Result<v1::QueryResult> points(const v1::PointsQuery& query, const Document& document, const Limits& limits) {
  auto found = require_dual(document, query.entity(), "points.entity");
  if (!found) return found.error();
  const DualShape& shape = **found;
  if (shape.points.size() > limits.max_points_per_query) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("\"{}\" has {} points, expected at most {}", shape.id, shape.points.size(),
                                  limits.max_points_per_query),
                      "points.entity");
  }
  v1::QueryResult result;
  v1::PointsResult& out = *result.mutable_points();
  out.set_entity(shape.id);
  out.set_fitted(shape.fitted());
  out.mutable_points()->Reserve(static_cast<int>(shape.points.size()));
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const DualPoint& point = shape.points[i];
    v1::PointResult& to = *out.add_points();
    write_vector(point.position(), *to.mutable_position());
    to.set_pressure(point.pressure);
    to.set_residual_m(shape.residual_m(i));
    to.set_stroke(point.stroke);
  }
  return result;
}

v1::QueryResult entities(const Document& document, const RevisionOf& revision) {
  v1::QueryResult result;
  v1::EntitiesResult& out = *result.mutable_entities();
  for (const auto& [id, entity] : document.entities) {
    v1::EntityInfo& info = *out.add_entities();
    info.set_id(id);
    info.set_name(entity->name);
    info.set_kind(std::string(to_string(entity->kind())));
    info.set_revision(revision ? revision(id) : 0);
    const DualPtr shape = as_dual(entity);
    if (!shape) continue;
    info.set_representation(to_proto(shape->representation));
    info.set_point_count(static_cast<std::uint32_t>(shape->points.size()));
    info.set_fitted(shape->fitted());
    info.set_degree(shape->fit ? static_cast<std::uint32_t>(shape->fit->surface.degree())
                               : shape->requested_degree);
    info.set_symmetry(std::string(to_string(shape->symmetry)));
    info.set_partner(shape->partner);
  }
  return result;
}

v1::QueryResult history_of(const History& history, std::uint64_t client_id) {
  v1::QueryResult result;
  v1::HistoryResult& out = *result.mutable_history();
  for (const History::Entry& entry : history.entries()) {
    const StepInfo& info = entry.step->info;
    if (!entry.undone) out.add_applied(info.words);
    v1::HistoryStep& step = *out.add_steps();
    step.set_words(info.words);
    step.set_client_id(info.client_id);
    step.set_author(info.author);
    step.set_made_ns(info.made_ns);
    step.set_sequence(info.sequence);
    step.set_undone(entry.undone);
  }
  out.set_undo_steps(static_cast<std::uint32_t>(history.undo_steps(client_id)));
  out.set_redo_steps(static_cast<std::uint32_t>(history.redo_steps(client_id)));
  out.set_next_undo(history.next_undo(client_id));
  out.set_next_redo(history.next_redo(client_id));
  return result;
}

}  // namespace

Result<v1::QueryResult> answer(const v1::Query& query, const Document& document, const History& history,
                               const RevisionOf& revision, const Limits& limits, std::uint64_t client_id) {
  switch (query.body_case()) {
    case v1::Query::kSurface:
      return surface(query.surface(), document);
    case v1::Query::kEvaluate:
      return evaluate(query.evaluate(), document, limits);
    case v1::Query::kPoints:
      return points(query.points(), document, limits);
    case v1::Query::kEntities:
      return entities(document, revision);
    case v1::Query::kHash: {
      v1::QueryResult result;
      result.mutable_hash()->set_sha256(document_hash(document));
      return result;
    }
    case v1::Query::kHistory:
      return history_of(history, client_id);
    case v1::Query::kAlternatives: {
      v1::QueryResult result;
      result.mutable_alternatives()->set_present(document.present_alternative());
      for (const Alternative& each : *document.alternatives)
        result.mutable_alternatives()->add_names(each.name);
      return result;
    }
    case v1::Query::kCompare:
      return compare(query.compare(), document);
    case v1::Query::kDistance:
      return distance_to_reference(query.distance(), document);
    case v1::Query::kSculpt:
      return sculpt(query.sculpt(), document);
    case v1::Query::kPick:
      return pick(query.pick(), document, limits);
    case v1::Query::kControlNet:
      return control_net(query.control_net(), document);
    case v1::Query::kVersions: {
      v1::QueryResult result;
      write_versions(document, *result.mutable_versions()->mutable_versions());
      return result;
    }
    case v1::Query::kDifference:
      return difference_in_words(query.difference(), document, history);
    case v1::Query::kComments: {
      v1::QueryResult result;
      write_comments(document, query.comments().resolved() ? Resolved::among_them : Resolved::left_out,
                     *result.mutable_comments()->mutable_comments());
      return result;
    }
    case v1::Query::kPeople: {
      v1::QueryResult result;  // A model by itself has nobody.
      result.mutable_people();
      return result;
    }
    case v1::Query::kModels: {
      v1::QueryResult result;
      result.mutable_models();
      return result;
    }
    case v1::Query::BODY_NOT_SET:
      break;
  }
  return make_error(ErrorCode::invalid_argument, "found no query that this build knows, expected one",
                    "query");
}

}  // namespace handloft::model
