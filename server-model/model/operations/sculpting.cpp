#include "server-model/model/operations/sculpting.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "server-model/geometry/bspline_refine.h"
#include "server-model/model/validate.h"

namespace handloft::model {

using geometry::BSplineSurface;
using geometry::Direction;
using geometry::KnotVector;

Result<SculptPtr> require_sculpt(const Document& document, std::string_view id, std::string_view field) {
  auto entity = require_entity(document, id, field);
  if (!entity) return entity.error();
  SculptPtr shape = as_sculpt(*entity);
  if (!shape) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found \"{}\", a {}, expected a sculpt_surface", id, to_string((*entity)->kind())),
        std::string(field));
  }
  return shape;
}

Result<std::size_t> require_icon(const SculptShape& shape, std::string_view icon, std::string_view field) {
  const SculptIcon* found = shape.find_icon(icon);
  if (found == nullptr) {
    return make_error(ErrorCode::not_found, fmt::format("\"{}\" has no icon \"{}\"", shape.id, icon),
                      std::string(field));
  }
  return static_cast<std::size_t>(found - shape.icons->data());
}

void put(Document& document, SculptShape shape) {
  std::string id = shape.id;
  document.entities.insert_or_assign(std::move(id), std::make_shared<const SculptShape>(std::move(shape)));
}

namespace {

/// Sides are held by the control points at them (D2's supports), so open directions end at full knots. The
/// same shape; the same bits where they do already.
BSplineSurface with_full_ends(BSplineSurface surface) {
  for (const Direction direction : {Direction::u, Direction::v}) {
    const KnotVector& knots = direction == Direction::u ? surface.u : surface.v;
    if (knots.is_periodic()) continue;
    std::vector<double> missing;
    for (const double end : {knots.lower(), knots.upper()}) {
      for (int i = knots.multiplicity(end); i <= knots.degree(); ++i) missing.push_back(end);
    }
    if (missing.empty()) continue;
    if (auto full = geometry::insert_knots(surface, direction, missing)) surface = *std::move(full);
  }
  return surface;
}

}  // namespace

void set_at_rest(SculptShape& shape, BSplineSurface surface, FaceTrim trim) {
  surface = with_full_ends(std::move(surface));
  const auto to_metres = [](const KnotVector& before, const KnotVector& after, double parameter) {
    return after.lower() + (parameter - before.lower()) * (after.length() / before.length());
  };
  BSplineSurface scaled = geometry::scaled_domain(surface);
  for (std::vector<TrimSpline>& loop : trim) {
    for (TrimSpline& spline : loop) {
      for (geometry::Vec2& point : spline.control) {
        point = {to_metres(surface.u, scaled.u, point.x()), to_metres(surface.v, scaled.v, point.y())};
      }
    }
  }
  shape.rest = std::make_shared<const BSplineSurface>(std::move(scaled));
  shape.initial = shape.rest;
  shape.surface = shape.rest;
  shape.trim = trim.empty() ? nullptr : std::make_shared<const FaceTrim>(std::move(trim));
}

namespace {

/// `count` knots that divide the spans evenly, the longest pieces first.
std::vector<double> more_knots(const KnotVector& knots, std::uint32_t count) {
  struct Span {
    double from = 0, length = 0;
    std::uint32_t pieces = 1;
    double piece() const { return length / pieces; }
    bool operator<(const Span& other) const {  // The longest piece first; of equal ones the lower span.
      return piece() != other.piece() ? piece() < other.piece() : from > other.from;
    }
  };
  std::vector<Span> spans;
  for (const int s : knots.spans()) {
    const double from = knots.knots()[static_cast<std::size_t>(s)];
    spans.push_back({from, knots.knots()[static_cast<std::size_t>(s) + 1] - from, 1});
  }
  std::make_heap(spans.begin(), spans.end());
  for (std::uint32_t i = 0; i < count; ++i) {
    std::pop_heap(spans.begin(), spans.end());
    ++spans.back().pieces;
    std::push_heap(spans.begin(), spans.end());
  }
  std::vector<double> added;
  for (const Span& span : spans) {
    for (std::uint32_t k = 1; k < span.pieces; ++k)
      added.push_back(span.from + span.length * k / span.pieces);
  }
  return added;
}

}  // namespace

Result<BSplineSurface> refined(const BSplineSurface& surface, std::uint32_t control_u,
                               std::uint32_t control_v, const std::string& field, const Limits& limits) {
  const auto now_u = static_cast<std::uint32_t>(surface.u.control_count());
  const auto now_v = static_cast<std::uint32_t>(surface.v.control_count());
  const std::uint64_t u = std::max(control_u, now_u), v = std::max(control_v, now_v);
  if (u * v > limits.max_control_points) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} x {} control points, expected at most {}", u, v, limits.max_control_points),
        u > now_u ? field + ".control_u" : field + ".control_v");
  }
  BSplineSurface result = surface;
  if (u > now_u) {
    auto more = geometry::insert_knots(result, Direction::u,
                                       more_knots(result.u, static_cast<std::uint32_t>(u) - now_u));
    if (!more) return more.error();
    result = std::move(*more);
  }
  if (v > now_v) {
    auto more = geometry::insert_knots(result, Direction::v,
                                       more_knots(result.v, static_cast<std::uint32_t>(v) - now_v));
    if (!more) return more.error();
    result = std::move(*more);
  }
  return result;
}

}  // namespace handloft::model
