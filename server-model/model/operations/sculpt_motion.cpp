// Sculpted surfaces moved by similarities (TransformEntities, Duplicate).

#include <fmt/format.h>

#include <utility>

#include "server-model/model/operations/sculpting.h"

namespace handloft::model {

using geometry::BSplineSurface;
using geometry::KnotVector;
using geometry::Vec3;

namespace {

Result<KnotVector> scaled(const KnotVector& knots, double factor) {
  std::vector<double> values = knots.knots();
  for (double& value : values) value *= factor;
  return knots.is_periodic() ? KnotVector::periodic(knots.degree(), std::move(values))
                             : KnotVector::open(knots.degree(), std::move(values));
}

using SurfacePtr = std::shared_ptr<const BSplineSurface>;

Result<SurfacePtr> moved(const BSplineSurface& before, const Similarity& similarity) {
  BSplineSurface surface = before;
  for (Vec3& point : surface.control) point = similarity(point);
  if (similarity.scale != 1) {
    auto u = scaled(before.u, similarity.scale);
    if (!u) return u.error();
    auto v = scaled(before.v, similarity.scale);
    if (!v) return v.error();
    surface.u = std::move(*u);
    surface.v = std::move(*v);
  }
  return std::make_shared<const BSplineSurface>(std::move(surface));
}

/// How the values of an icon's rows change: places move, derivatives of order k turn and go with scale^(1 -
/// k).
double derivative_factor(IconProperty property, double scale) {
  switch (property) {
    case IconProperty::second_u:
    case IconProperty::second_v:
    case IconProperty::twist:
      return 1 / scale;
    default:
      return 1;
  }
}

bool places_of(const SculptIcon& icon) {
  return icon.property == IconProperty::position || icon.role == IconRole::load;
}

SculptIcon moved(SculptIcon icon, const Similarity& similarity) {
  const auto turned = [&](const Vec3& direction) { return Vec3(similarity.rotation * direction); };
  if (icon.reference) {
    auto reference = std::make_shared<std::vector<Vec3>>(*icon.reference);
    for (Vec3& value : *reference) {
      value = places_of(icon) ? similarity(value)
                              : Vec3(derivative_factor(icon.property, similarity.scale) * turned(value));
    }
    icon.reference = std::move(reference);
  }
  for (geometry::Vec2& parameter : icon.parameters) parameter *= similarity.scale;
  // With b as it is, bending yields with the square of a length (moved() below).
  icon.stiffness /= similarity.scale * similarity.scale;
  icon.pivot = similarity(icon.pivot);
  icon.place = similarity(icon.place);
  const double factor =
      places_of(icon) ? similarity.scale : derivative_factor(icon.property, similarity.scale);
  icon.translation = factor * turned(icon.translation);
  icon.rotation = (similarity.rotation * icon.rotation * similarity.rotation.conjugate()).normalized();
  for (IconBend& bend : icon.bends) {
    bend.reach_m *= similarity.scale;
    bend.translation = similarity.scale * turned(bend.translation);
  }
  return icon;
}

}  // namespace

Result<SculptShape> moved(const SculptShape& before, const Similarity& similarity, std::string_view field,
                          const Limits& limits) {
  SculptShape shape = before;
  shape.motion = moved_on(before.motion, similarity);
  for (const Vec3& point : before.surface->control) {
    if (!(similarity(point).cwiseAbs().maxCoeff() <= limits.max_coordinate_m)) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("would move a control point of \"{}\" out of the workspace of {} m",
                                    before.id, limits.max_coordinate_m),
                        std::string(field));
    }
  }
  const auto take = [&](const SurfacePtr& from, SurfacePtr& to) -> Status {
    auto surface = moved(*from, similarity);
    if (!surface) return surface.error();
    to = std::move(*surface);
    return {};
  };
  if (auto status = take(before.initial, shape.initial); !status) return status.error();
  if (auto status = take(before.rest, shape.rest); !status) return status.error();
  if (auto status = take(before.surface, shape.surface); !status) return status.error();
  // Stretching against bending goes with the square of a length: so the larger shape yields like the smaller
  // one.
  const double square = similarity.scale * similarity.scale;
  shape.energy.a11 /= square;
  shape.energy.a12 /= square;
  shape.energy.a22 /= square;
  auto icons = std::make_shared<std::vector<SculptIcon>>();
  for (const SculptIcon& icon : *before.icons) icons->push_back(moved(icon, similarity));
  shape.icons = std::move(icons);
  if (before.trim && similarity.scale != 1) {
    FaceTrim trim = *before.trim;
    for (std::vector<TrimSpline>& loop : trim) {
      for (TrimSpline& spline : loop) {
        for (geometry::Vec2& point : spline.control) point *= similarity.scale;
      }
    }
    shape.trim = std::make_shared<const FaceTrim>(std::move(trim));
  }
  return shape;
}

}  // namespace handloft::model
