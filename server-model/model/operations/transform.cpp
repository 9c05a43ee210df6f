#include "server-model/model/operations/transform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "server-model/model/operations/fitting.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/sculpting.h"
#include "server-model/model/trim_curve.h"
#include "server-model/model/validate.h"

namespace handloft::model {

std::shared_ptr<const Similarity> moved_on(const std::shared_ptr<const Similarity>& motion,
                                           const Similarity& similarity) {
  const Similarity both = motion ? similarity.after(*motion) : similarity;
  const bool usable = both.finite() && both.inverse().finite();
  return usable ? std::make_shared<const Similarity>(both) : nullptr;
}

namespace {

bool is_turned(const Similarity& similarity) {
  return similarity.rotation.vec() != geometry::Vec3::Zero();
}

std::shared_ptr<const FittedSurface> moved(const FittedSurface& before, const Similarity& similarity) {
  auto fit = std::make_shared<FittedSurface>(before);
  fit->frame.origin = similarity(before.frame.origin);
  if (is_turned(similarity)) {
    // Through a unit quaternion, so that many turns leave the axes orthonormal.
    fit->frame.rotation =
        (similarity.rotation * Eigen::Quaterniond(before.frame.rotation)).normalized().toRotationMatrix();
  }
  const double scale = similarity.scale;
  if (scale == 1) return fit;
  std::vector<double> coefficients(before.surface.scaled_coefficients().begin(),
                                   before.surface.scaled_coefficients().end());
  for (double& c : coefficients) c *= scale;
  geometry::Box2 scaling = before.surface.box();
  scaling.centre *= scale;
  scaling.half_extent *= scale;
  auto surface = geometry::PolynomialSurface::from_scaled(before.surface.degree(), scaling, coefficients);
  if (!surface) return nullptr;
  fit->surface = *surface;
  for (double& r : fit->residuals_m) r *= scale;
  for (double& rms : fit->cross_validated_rms_m) rms = rms < 0 ? rms : rms * scale;
  fit->statistics.rms *= scale;
  fit->statistics.weighted_rms *= scale;
  fit->statistics.max *= scale;
  fit->box.centre *= scale;
  fit->box.half_extent *= scale;
  return finite(*fit) ? fit : nullptr;
}

}  // namespace

Result<DualShape> moved(const DualShape& before, const Similarity& similarity, SymmetryPlane plane,
                        std::string_view field, const Limits& limits) {
  DualShape shape = before;
  shape.motion = moved_on(before.motion, similarity);
  const auto outside = [&](const geometry::Vec3& p) {
    return !(p.cwiseAbs().maxCoeff() <= limits.max_coordinate_m);
  };
  const auto refused = [&](std::string_view what) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("would move {} of \"{}\" out of the workspace of {} m", what, before.id,
                                  limits.max_coordinate_m),
                      std::string(field));
  };
  std::vector<DualPoint> points(before.points.begin(), before.points.end());
  for (DualPoint& point : points) {
    const geometry::Vec3 place = similarity(point.position());
    if (outside(place)) return refused("a point");
    point.x = place.x();
    point.y = place.y();
    point.z = place.z();
  }
  shape.points = PointCloud();
  shape.points.append(points);
  if (before.fit) {
    shape.fit = moved(*before.fit, similarity);
    if (!shape.fit) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("would make \"{}\" too small or too large to compute with", before.id),
                        std::string(field));
    }
    if (outside(shape.fit->frame.origin)) return refused("the base plane");
  }
  if (before.boundary) {
    std::vector<geometry::Vec3> curve = before.boundary->points();
    for (geometry::Vec3& p : curve) {
      p = similarity(p);
      if (outside(p)) return refused("the boundary curve");
    }
    shape.boundary = std::make_shared<const TrimCurve>(std::move(curve));
  }
  if (before.symmetry != SymmetryMode::off && plane == SymmetryPlane::goes_along) {
    shape.plane.origin = similarity(before.plane.origin);
    if (outside(shape.plane.origin)) return refused("the symmetry plane");
    if (is_turned(similarity)) shape.plane.normal = (similarity.rotation * before.plane.normal).normalized();
  }
  return shape;
}

namespace {

// 1000 at a time is more than any hand means, and keeps all numbers far from the ends of double.
constexpr double max_scale = 1000;

/// The centre of the box about all points and control points; of shapes without any, the origin.
geometry::Vec3 centre_of(const std::vector<DualPtr>& shapes, const std::vector<SculptPtr>& surfaces) {
  Eigen::AlignedBox3d box;
  for (const DualPtr& shape : shapes) {
    for (const DualPoint& point : shape->points) box.extend(point.position());
  }
  for (const SculptPtr& surface : surfaces) {
    for (const geometry::Vec3& point : surface->surface->control) box.extend(point);
  }
  return box.isEmpty() ? geometry::Vec3(geometry::Vec3::Zero()) : geometry::Vec3(box.center());
}

}  // namespace

Result<Outcome> transform_entities(const Document& document, const handloft::v1::TransformEntities& request,
                                   const ApplyContext& context) {
  if (request.entities().empty()) {
    return make_error(ErrorCode::invalid_argument, "found none, expected at least one", "transform.entities");
  }
  std::vector<DualPtr> shapes;
  std::vector<SculptPtr> surfaces;
  std::set<std::string, std::less<>> named;
  for (const std::string& id : request.entities()) {
    const std::string field = fmt::format("transform.entities[{}]", named.size());
    auto found = require_entity(document, id, field);
    if (!found) return found.error();
    DualPtr shape = as_dual(*found);
    SculptPtr surface = as_sculpt(*found);
    if (!shape && !surface) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found \"{}\", a {}, expected a dual_shape or sculpt_surface", id,
                                    to_string((*found)->kind())),
                        field);
    }
    if (!named.insert(id).second) {
      return make_error(ErrorCode::invalid_argument, fmt::format("found \"{}\" twice", id), field);
    }
    if (shape) shapes.push_back(std::move(shape));
    if (surface) surfaces.push_back(std::move(surface));
  }
  auto translation = read_vector(request.translation(), "transform.translation", context.limits);
  if (!translation) return translation.error();
  auto rotation = read_rotation(request.rotation(), request.has_rotation(), "transform.rotation");
  if (!rotation) return rotation.error();
  const double scale = request.scale() == 0 ? 1.0 : request.scale();
  if (!(scale >= 1 / max_scale && scale <= max_scale)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected {}..{}, or 0 for 1", scale, 1 / max_scale, max_scale),
                      "transform.scale");
  }
  auto pivot = read_vector(request.pivot(), "transform.pivot", context.limits);
  if (!pivot) return pivot.error();
  if (!request.has_pivot()) pivot = centre_of(shapes, surfaces);

  Outcome outcome;
  outcome.document = document;
  auto& effective = *outcome.effective.mutable_transform();
  effective = request;
  effective.set_scale(scale);
  effective.mutable_pivot()->set_x(pivot->x());
  effective.mutable_pivot()->set_y(pivot->y());
  effective.mutable_pivot()->set_z(pivot->z());
  outcome.words = named.size() == 1
                      ? fmt::format("Transform \"{}\"", document.find(request.entities(0))->name)
                      : fmt::format("Transform {} shapes", named.size());
  Similarity similarity{scale, *rotation, geometry::Vec3::Zero()};
  if (scale == 1 && !is_turned(similarity)) {
    if (translation->isZero(0)) return outcome;
    similarity.shift = *translation;  // Without the pivot's rounding.
  } else {
    similarity.shift = *translation + *pivot - scale * (*rotation * *pivot);
  }
  for (const DualPtr& before : shapes) {
    const DualPtr partner = linked_partner(document, *before);
    const bool together = !partner || named.contains(partner->id);
    auto shape = moved(*before, similarity, together ? SymmetryPlane::goes_along : SymmetryPlane::stays,
                       "transform", context.limits);
    if (!shape) return shape.error();
    if (!together) {
      auto image = moved(*partner, similarity.mirrored(before->plane), SymmetryPlane::stays, "transform",
                         context.limits);
      if (!image) return image.error();
      put(outcome.document, std::move(*image));
    }
    put(outcome.document, std::move(*shape));
  }
  for (const SculptPtr& before : surfaces) {
    auto surface = moved(*before, similarity, "transform", context.limits);
    if (!surface) return surface.error();
    put(outcome.document, std::move(*surface));
  }
  return outcome;
}

}  // namespace handloft::model
