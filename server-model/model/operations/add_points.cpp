#include <fmt/format.h>

#include <cmath>

#include "server-model/geometry/symmetry.h"
#include "server-model/model/operations/fitting.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace {

// Index of the newest point of a stroke, nullopt when it has none. The stroke being laid is the newest, so
// the search ends at once except when an older stroke is taken up again.
std::optional<std::size_t> last_of_stroke(const PointCloud& points, std::uint32_t stroke) {
  for (std::size_t i = points.size(); i-- > 0;) {
    if (points[i].stroke == stroke) return i;
  }
  return std::nullopt;
}

// A1: a point is kept when it lies at least min_spacing from the last one kept of its stroke.
std::vector<DualPoint> thin(const std::vector<DualPoint>& points, std::optional<geometry::Vec3> last,
                            double min_spacing_m) {
  std::vector<DualPoint> kept;
  kept.reserve(points.size());
  for (const DualPoint& point : points) {
    if (min_spacing_m > 0 && last && (point.position() - *last).norm() < min_spacing_m) continue;
    kept.push_back(point);
    last = point.position();
  }
  return kept;
}

DualPoint mirrored(DualPoint point, const geometry::Plane& plane) {
  const geometry::Vec3 image = geometry::reflect_point(point.position(), plane);
  point.x = image.x();
  point.y = image.y();
  point.z = image.z();
  return point;
}

Status check_room(const DualShape& shape, std::size_t added, const Limits& limits) {
  if (shape.points.size() + added > limits.max_points_per_shape) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("\"{}\" would hold {} points, expected at most {}", shape.id,
                                  shape.points.size() + added, limits.max_points_per_shape),
                      "points");
  }
  if (shape.stroke_count > limits.max_strokes_per_shape) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("\"{}\" would hold more than {} strokes", shape.id, limits.max_strokes_per_shape),
        "stroke");
  }
  return {};
}

// The stroke of `into` that mirrors stroke `stroke` of `from`, or a new one.
std::uint32_t mirror_stroke(const DualShape& from, std::optional<std::size_t> last, DualShape& into) {
  if (last) {
    const std::uint32_t partner = from.mirror_partner(*last);
    if (partner != DualPoint::no_partner && partner < into.points.size()) return into.points[partner].stroke;
  }
  return ++into.stroke_count;
}

DualShape make_partner(const Document& document, const DualShape& shape, const Limits& limits) {
  constexpr std::string_view suffix = "-mirror";
  constexpr std::size_t number_room = 8;
  const std::string stem =
      shape.id.substr(0, limits.max_id_bytes - suffix.size() - number_room).append(suffix);
  DualShape partner;
  partner.id = stem;
  for (int n = 2; document.used_ids->contains(partner.id); ++n) partner.id = fmt::format("{}-{}", stem, n);
  // A name that would grow too long is not decorated.
  partner.name = shape.name.size() + 9 <= limits.max_name_bytes ? shape.name + " (mirror)" : shape.name;
  partner.requested_degree = shape.requested_degree;
  partner.symmetry = SymmetryMode::partner;
  partner.plane = shape.plane;
  partner.partner = shape.id;
  partner.superellipse_exponent = shape.superellipse_exponent;
  partner.boundary = mirrored(shape.boundary, shape.plane);
  // It has no surface yet: shown as one it would vanish.
  partner.representation =
      shape.representation == Representation::surface ? Representation::points : shape.representation;
  return partner;
}

}  // namespace

DualPtr linked_partner(const Document& document, const DualShape& shape) {
  return shape.partner.empty() ? nullptr : document.find_dual(shape.partner);
}

Result<Document> extend_stroke(const Document& document, std::string_view entity, std::uint32_t stroke,
                               const std::vector<DualPoint>& points, double min_spacing_m,
                               const Limits& limits) {
  auto found = require_dual(document, entity, "entity");
  if (!found) return found.error();
  DualShape shape = **found;
  if (stroke == 0 || stroke > shape.stroke_count + 1) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected one of the strokes 1..{}, the next one, or 0 for the next one",
                    stroke, shape.stroke_count),
        "stroke");
  }
  const auto last = stroke <= shape.stroke_count ? last_of_stroke(shape.points, stroke) : std::nullopt;
  std::vector<DualPoint> kept =
      thin(points, last ? std::optional(shape.points[*last].position()) : std::nullopt, min_spacing_m);
  if (kept.empty()) return document;
  shape.stroke_count = std::max(shape.stroke_count, stroke);
  shape.stale = shape.fitted();

  Document result = document;
  const auto first = static_cast<std::uint32_t>(shape.points.size());
  if (shape.symmetry == SymmetryMode::same_shape) {
    // Each point is followed by its image, so that pieces and the whole give the same order.
    const std::uint32_t image_stroke = mirror_stroke(shape, last, shape);
    if (auto status = check_room(shape, 2 * kept.size(), limits); !status) return status.error();
    std::vector<DualPoint> pairs;
    pairs.reserve(2 * kept.size());
    for (DualPoint& point : kept) {
      const std::uint32_t index = first + static_cast<std::uint32_t>(pairs.size());
      DualPoint image = mirrored(point, shape.plane);
      point.stroke = stroke;
      point.partner = index + 1;
      image.stroke = image_stroke;
      image.partner = index;
      pairs.push_back(point);
      pairs.push_back(image);
    }
    shape.points.append(pairs);
  } else if (shape.symmetry == SymmetryMode::partner) {
    const DualPtr linked = linked_partner(document, shape);
    DualShape partner = linked ? *linked : make_partner(document, shape, limits);
    if (!linked) {
      shape.partner = partner.id;
      shape.linked_from = first;
    }
    const auto partner_first = static_cast<std::uint32_t>(partner.points.size());
    const std::uint32_t image_stroke = mirror_stroke(shape, last, partner);
    for (const DualShape* one : {&shape, &partner}) {
      if (auto status = check_room(*one, kept.size(), limits); !status) return status.error();
    }
    std::vector<DualPoint> images;
    images.reserve(kept.size());
    for (DualPoint& point : kept) {
      const auto k = static_cast<std::uint32_t>(images.size());
      images.push_back(mirrored(point, shape.plane));
      images.back().stroke = image_stroke;
      images.back().partner = first + k;
      point.stroke = stroke;
      point.partner = partner_first + k;
    }
    shape.points.append(kept);
    partner.points.append(images);
    partner.stale = partner.fitted();
    if (linked) {
      put(result, std::move(partner));
    } else if (auto status = add_entity(result, std::move(partner), "entity", limits); !status) {
      return status.error();
    }
  } else {
    if (auto status = check_room(shape, kept.size(), limits); !status) return status.error();
    for (DualPoint& point : kept) point.stroke = stroke;
    shape.points.append(kept);
  }
  put(result, std::move(shape));
  return result;
}

namespace {

// `create` and `symmetry` of a first stroke: done before the points, in the same step. Leaves the id in
// `effective`.
Status prepare_shape(Outcome& outcome, const ApplyContext& context) {
  auto& request = *outcome.effective.mutable_add_points();
  const auto same_entity = [&](const std::string& id) { return id.empty() || id == request.entity(); };
  if (request.has_create()) {
    auto& create = *request.mutable_create();
    if (request.entity().empty()) request.set_entity(create.id());
    if (!same_entity(create.id())) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found \"{}\", expected the same id as entity, or none", create.id()),
                        "create.id");
    }
    create.set_id(request.entity());
    auto created = create_dual_shape(outcome.document, create, context);
    if (!created) return created.error();
    outcome.document = std::move(created->document);
    create = created->effective.create_dual_shape();
    request.set_entity(create.id());
  }
  if (request.has_symmetry()) {
    auto& symmetry = *request.mutable_symmetry();
    if (!same_entity(symmetry.entity())) {
      return make_error(ErrorCode::invalid_argument,
                        "found another entity, expected the one of the points, or none", "symmetry.entity");
    }
    symmetry.set_entity(request.entity());
    auto set = set_symmetry(outcome.document, symmetry, context);
    if (!set) return set.error();
    outcome.document = std::move(set->document);
  }
  return {};
}

}  // namespace

Result<Outcome> add_points(const Document& document, const handloft::v1::AddPoints& request,
                           const ApplyContext& context) {
  const double spacing = request.min_spacing_m();
  if (!(spacing >= 0 && spacing <= context.limits.max_coordinate_m)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected metres, 0 or more", spacing),
                      "add_points.min_spacing_m");
  }
  auto points = read_points(request.points(), "add_points.points", context.limits);
  if (!points) return points.error();
  const auto in_request = [](Error error) {
    error.field = "add_points." + error.field;
    return error;
  };

  Outcome outcome;
  outcome.document = document;
  auto& effective = *outcome.effective.mutable_add_points();
  effective = request;
  if (auto status = prepare_shape(outcome, context); !status) return in_request(status.error());
  auto found = require_dual(outcome.document, effective.entity(), "entity");
  if (!found) return in_request(found.error());
  if (effective.stroke() == 0) effective.set_stroke((*found)->stroke_count + 1);
  auto extended = extend_stroke(outcome.document, effective.entity(), effective.stroke(), *points, spacing,
                                context.limits);
  if (!extended) return in_request(extended.error());
  outcome.document = std::move(*extended);
  if (request.refit()) {
    // Points that a surface can't be fitted to are worth keeping all the same.
    if (auto status = refit(outcome.document, effective.entity(), "entity", outcome.notes); !status) {
      outcome.notes.push_back(
          fmt::format("\"{}\" could not be fitted again: {}", effective.entity(), status.error().message));
    }
  }
  const std::size_t count = points->size();
  outcome.words = fmt::format("{} {} point{} {} \"{}\"", request.has_create() ? "Lay" : "Add", count,
                              count == 1 ? "" : "s", request.has_create() ? "as" : "to", (*found)->name);
  return outcome;
}

}  // namespace handloft::model
