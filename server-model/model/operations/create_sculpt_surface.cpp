// A surface to be sculpted: given, flat, or from a shape that is already there.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "server-model/geometry/bezier_patch.h"
#include "server-model/geometry/bspline_fit.h"
#include "server-model/geometry/pca_frame.h"
#include "server-model/model/bspline_message.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/sculpting.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;
using geometry::BSplineSurface;
using geometry::KnotVector;
using geometry::Vec3;

namespace {

constexpr std::uint32_t default_degree = 3;
constexpr std::size_t least_spans = 4;  ///< With clamped sides fewer would leave next to nothing to move.
constexpr double max_extent_m = 1000;
constexpr double min_extent_m = 1e-6;

Status check_extent(double value, const std::string& field) {
  if (value >= min_extent_m && value <= max_extent_m) return {};
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found {} m, expected {}..{}", value, min_extent_m, max_extent_m), field);
}

/// As asked for; 0: as there are, or as many more as there are spans too few.
std::uint32_t control_count(std::uint32_t asked, const KnotVector& knots) {
  if (asked > 0) return asked;
  const std::size_t spans = knots.spans().size();
  const std::size_t missing = spans < least_spans ? least_spans - spans : 0;
  return static_cast<std::uint32_t>(static_cast<std::size_t>(knots.control_count()) + missing);
}

Result<BSplineSurface> flat(const v1::Rectangle& rectangle, const std::string& field, const Limits& limits) {
  auto orientation = read_rotation(rectangle.pose().orientation(), rectangle.pose().has_orientation(),
                                   field + ".pose.orientation");
  if (!orientation) return orientation.error();
  auto centre = read_vector(rectangle.pose().position(), field + ".pose.position", limits);
  if (!centre) return centre.error();
  if (auto status = check_extent(rectangle.width_m(), field + ".width_m"); !status) return status.error();
  if (auto status = check_extent(rectangle.depth_m(), field + ".depth_m"); !status) return status.error();
  const std::uint32_t degree = rectangle.degree() == 0 ? default_degree : rectangle.degree();
  if (degree > static_cast<std::uint32_t>(KnotVector::max_degree)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1..{}", degree, KnotVector::max_degree),
                      field + ".degree");
  }
  const int p = static_cast<int>(degree);
  auto knots = KnotVector::uniform(p, p + 1);
  if (!knots) return knots.error();
  BSplineSurface surface{*knots, *knots, {}, {}};
  for (int i = 0; i <= p; ++i) {
    for (int j = 0; j <= p; ++j) {
      const Vec3 local((static_cast<double>(i) / p - 0.5) * rectangle.width_m(),
                       (static_cast<double>(j) / p - 0.5) * rectangle.depth_m(), 0);
      surface.control.emplace_back(*centre + *orientation * local);
    }
  }
  return surface;
}

/// The frame along whose normal a patch is seen: its own mean normal.
Result<geometry::Frame> patch_frame(const ReferenceMesh& mesh, const std::vector<Vec3>& places,
                                    const std::string& field) {
  Vec3 normal = Vec3::Zero(), centre = Vec3::Zero();
  for (const auto& [a, b, c] : mesh.triangles) normal += (places[b] - places[a]).cross(places[c] - places[a]);
  for (const Vec3& place : places) centre += place / static_cast<double>(places.size());
  if (!(normal.norm() > 0)) {
    return make_error(ErrorCode::invalid_argument, "found a mesh without a mean normal, expected a patch",
                      field);
  }
  geometry::Frame frame;
  frame.origin = centre;
  const Vec3 z = normal.normalized();
  Eigen::Index least = 0;
  z.cwiseAbs().minCoeff(&least);
  const Vec3 x = Vec3::Unit(least).cross(z).normalized();
  frame.rotation << x, z.cross(x), z;
  for (const auto& [a, b, c] : mesh.triangles) {
    if ((places[b] - places[a]).cross(places[c] - places[a]).dot(z) < 0) {
      return make_error(ErrorCode::invalid_argument,
                        "found a mesh that folds as seen along its mean normal, expected a patch", field);
    }
  }
  return frame;
}

Result<BSplineSurface> approximated(const Document& document, const v1::CreateSculptSurface& request,
                                    const std::string& field, const Limits& limits,
                                    std::vector<std::string>& notes) {
  std::vector<geometry::SurfaceSample> samples;
  std::string where;
  if (request.source_case() == v1::CreateSculptSurface::kPoints) {
    where = field + ".points";
    auto dual = require_dual(document, request.points(), where);
    if (!dual) return dual.error();
    std::vector<geometry::WeightedPoint> points;
    std::vector<Vec3> places;
    for (const DualPoint& point : (*dual)->points) {
      points.push_back({point.position(), point.pressure});
      places.push_back(point.position());
    }
    auto frame = geometry::pca_frame(points);
    if (!frame) {
      Error error = frame.error();
      error.field = where;
      return error;
    }
    samples = geometry::projected_on(frame->frame, places);
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i].weight = points[i].weight;
  } else {
    where = field + ".mesh";
    auto entity = require_entity(document, request.mesh(), where);
    if (!entity) return entity.error();
    const ReferencePtr reference = as_reference(*entity);
    if (!reference) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found \"{}\", a {}, expected a reference", request.mesh(),
                                    to_string((*entity)->kind())),
                        where);
    }
    std::vector<Vec3> places;
    for (const auto& [x, y, z] : reference->mesh->positions) places.emplace_back(x, y, z);
    auto frame = patch_frame(*reference->mesh, places, where);
    if (!frame) return frame.error();
    samples = geometry::projected_on(*frame, places);
    std::vector<std::uint32_t> indices;
    for (const auto& triangle : reference->mesh->triangles)
      indices.insert(indices.end(), triangle.begin(), triangle.end());
    if (auto status = geometry::weigh_by_area(indices, samples); !status) return status.error();
  }
  geometry::BSplineFitOptions options;
  if (request.tolerance_m() > 0) options.tolerance_m = request.tolerance_m();
  options.max_control_points = static_cast<int>(
      std::min<std::size_t>(static_cast<std::size_t>(options.max_control_points), limits.max_control_points));
  auto fit = geometry::approximate_points(samples, options);
  if (!fit) {
    Error error = fit.error();
    error.field = where;
    return error;
  }
  notes.push_back(fmt::format("the surface is within {:.3g} mm of all {} points, {:.3g} mm in the mean{}",
                              1000 * fit->error.max_m, samples.size(), 1000 * fit->error.rms_m,
                              fit->within_tolerance ? "" : ", which is more than asked for"));
  return std::move(fit->surface);
}

}  // namespace

Result<SculptShape> make_sculpt_surface(const Document& document, const v1::CreateSculptSurface& request,
                                        const std::string& field, const ApplyContext& context,
                                        std::vector<std::string>& notes) {
  const Limits& limits = context.limits;
  SculptShape shape;
  shape.id = request.id().empty() ? free_id(document, "surface") : request.id();
  if (auto status = check_id(shape.id, field + ".id", limits); !status) return status.error();
  if (auto status = check_name(request.name(), field + ".name", limits); !status) return status.error();
  shape.name = request.name().empty() ? shape.id : request.name();
  if (!(request.tolerance_m() >= 0 && request.tolerance_m() <= max_extent_m)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 0..{}", request.tolerance_m(), max_extent_m),
                      field + ".tolerance_m");
  }
  auto made = [&]() -> Result<BSplineSurface> {
    switch (request.source_case()) {
      case v1::CreateSculptSurface::kSurface:
        return read_surface(request.surface(), field + ".surface", limits);
      case v1::CreateSculptSurface::kRectangle:
        return flat(request.rectangle(), field + ".rectangle", limits);
      case v1::CreateSculptSurface::kFitted: {
        auto dual = require_dual(document, request.fitted(), field + ".fitted");
        if (!dual) return dual.error();
        if (!(*dual)->fitted()) {
          return make_error(ErrorCode::failed_precondition,
                            fmt::format("\"{}\" has no fitted surface", request.fitted()), field + ".fitted");
        }
        const FittedSurface& fit = *(*dual)->fit;
        auto patch = geometry::to_bezier_patch(fit.surface, fit.frame, fit.box);
        if (!patch) return patch.error();
        auto knots = KnotVector::uniform(patch->degree, patch->degree + 1);
        if (!knots) return knots.error();
        return BSplineSurface{*knots, *knots, std::move(patch->control), {}};
      }
      case v1::CreateSculptSurface::kPoints:
      case v1::CreateSculptSurface::kMesh:
        return approximated(document, request, field, limits, notes);
      case v1::CreateSculptSurface::SOURCE_NOT_SET:
        break;
    }
    return make_error(ErrorCode::invalid_argument,
                      "found no source, expected surface, rectangle, fitted, points or mesh", field);
  }();
  if (!made) return made.error();
  auto surface = refined(*made, control_count(request.control_u(), made->u),
                         control_count(request.control_v(), made->v), field, limits);
  if (!surface) return surface.error();
  set_at_rest(shape, std::move(*surface));
  return shape;
}

Result<Outcome> create_sculpt_surface(const Document& document, const v1::CreateSculptSurface& request,
                                      const ApplyContext& context) {
  Outcome outcome;
  auto shape = make_sculpt_surface(document, request, "create_sculpt_surface", context, outcome.notes);
  if (!shape) return shape.error();
  outcome.document = document;
  *outcome.effective.mutable_create_sculpt_surface() = request;
  outcome.effective.mutable_create_sculpt_surface()->set_id(shape->id);
  outcome.words = fmt::format("Make surface \"{}\" of {} x {} control points", shape->name,
                              shape->rest->u.control_count(), shape->rest->v.control_count());
  auto entity = std::make_shared<const SculptShape>(std::move(*shape));
  if (auto status = add_entity(outcome.document, entity, "create_sculpt_surface.id", context.limits);
      !status) {
    return status.error();
  }
  return outcome;
}

}  // namespace handloft::model
