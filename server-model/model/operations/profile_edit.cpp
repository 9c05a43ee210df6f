#include "server-model/model/operations/profile_edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "server-model/geometry/pca_frame.h"
#include "server-model/geometry/residual_matching.h"
#include "server-model/geometry/symmetry.h"
#include "server-model/model/operations/fitting.h"
#include "server-model/model/operations/operations.h"

namespace handloft::model {

namespace {

using geometry::Curve;
using geometry::Vec3;
using geometry::WeightedPoint;

struct Edited {
  DualShape shape;
  std::vector<Curve> kept;  ///< Points on the surface that are to join the shape, world.
  double kept_pressure = 0;
};

std::vector<WeightedPoint> local_points(const DualShape& shape) {
  std::vector<WeightedPoint> points;
  points.reserve(shape.points.size());
  for (std::size_t c = 0; c < shape.points.chunk_count(); ++c) {
    for (const DualPoint& point : shape.points.chunk(c)) {
      points.push_back({shape.fit->frame.to_local(point.position()), point.pressure});
    }
  }
  return points;
}

Status refit_alone(DualShape& shape) {
  const std::uint32_t degree = shape.fit->requested_degree;
  auto fitted = fit_points(shape, degree, BasePlane::frozen);
  if (!fitted) return fitted.error();
  take_fit(shape, *fitted, degree);
  return {};
}

/// The shape's points factored with its surface; a fit that is not their optimum is made anew first (A9).
Result<geometry::ProfileFitter> current_fitter(DualShape& shape, std::vector<WeightedPoint>& points) {
  if (shape.stale) {
    if (auto status = refit_alone(shape); !status) return status.error();
  }
  points = local_points(shape);
  auto fitter = geometry::ProfileFitter::create(points, shape.fit->surface);
  if (fitter || fitter.error().code != ErrorCode::failed_precondition) return fitter;
  // Far from the world's origin, rounding alone may have moved the points; and where the optimum is the base
  // plane itself, all of its heights are rounding. A fit just made is the optimum, whatever they are.
  if (auto status = refit_alone(shape); !status) return status.error();
  geometry::ProfileFitter::Options just_fitted;
  just_fitted.optimum_tolerance = std::numeric_limits<double>::max();
  return geometry::ProfileFitter::create(points, shape.fit->surface, just_fitted);
}

std::vector<Curve> to_local(const std::vector<Curve>& strokes, const geometry::Frame& frame) {
  std::vector<Curve> local = strokes;
  for (Curve& curve : local) {
    for (Vec3& point : curve) point = frame.to_local(point);
  }
  return local;
}

/// The temporary points of the strokes, in the shape's frame, as many as the shape has points (A19); with
/// mirrored ones half of them are images.
Result<std::vector<Vec3>> temporary_points(const DualShape& shape, const std::vector<Curve>& curves) {
  const std::size_t count = shape.points.size();
  const bool mirrored = shape.symmetry == SymmetryMode::same_shape;
  auto points = geometry::points_along(curves, mirrored ? (count + 1) / 2 : count);
  if (!points || !mirrored) return points;
  const geometry::Frame& frame = shape.fit->frame;
  const std::size_t drawn = points->size();
  for (std::size_t i = 0; i < drawn; ++i) {
    const Vec3 image = geometry::reflect_point(frame.to_world((*points)[i]), shape.plane);
    points->push_back(frame.to_local(image));
  }
  return points;
}

geometry::ResidualStatistics statistics_of(const DualShape& shape, const std::vector<double>& residuals) {
  geometry::ResidualStatistics statistics;
  statistics.count = shape.points.size();
  double sum = 0;
  double weighted = 0;
  double weights = 0;
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const double r = residuals[i];
    const double weight = shape.points[i].pressure;
    sum += r * r;
    weighted += weight * (r * r);
    weights += weight;
    statistics.max = std::max(statistics.max, std::abs(r));
  }
  if (statistics.count > 0) statistics.rms = std::sqrt(sum / static_cast<double>(statistics.count));
  if (weights > 0) statistics.weighted_rms = std::sqrt(weighted / weights);
  return statistics;
}

Status check_inside(const Vec3& place, const DualShape& shape, const Limits& limits) {
  if (place.cwiseAbs().maxCoeff() <= limits.max_coordinate_m) return {};
  return make_error(
      ErrorCode::invalid_argument,
      fmt::format("a point of \"{}\" would leave the workspace of +-{} metres, expected a nearer curve",
                  shape.id, limits.max_coordinate_m));
}

void place(DualPoint& point, const Vec3& position) {
  point.x = position.x();
  point.y = position.y();
  point.z = position.z();
}

/// z' = f1 + r for every point, by the change f1 - f0 along the frame's normal, so that x and y stay (A8).
Result<PointCloud> follow(const DualShape& shape, const std::vector<WeightedPoint>& local,
                          const geometry::PolynomialSurface& after, const Limits& limits) {
  const geometry::PolynomialSurface& before = shape.fit->surface;
  std::vector<double> change(after.scaled_coefficients().begin(), after.scaled_coefficients().end());
  for (std::size_t k = 0; k < change.size(); ++k) change[k] -= before.scaled_coefficients()[k];
  auto difference = geometry::PolynomialSurface::from_scaled(after.degree(), after.box(), change);
  if (!difference) return difference.error();
  const Vec3 normal = shape.fit->frame.normal();
  PointCloud moved;
  std::vector<DualPoint> chunk;
  std::size_t i = 0;
  for (std::size_t c = 0; c < shape.points.chunk_count(); ++c) {
    const auto points = shape.points.chunk(c);
    chunk.assign(points.begin(), points.end());
    for (DualPoint& point : chunk) {
      const Vec3& at = local[i++].position;
      const Vec3 to = point.position() + difference->value(at.x(), at.y()) * normal;
      if (auto status = check_inside(to, shape, limits); !status) return status.error();
      place(point, to);
    }
    moved.append(chunk);
  }
  return moved;
}

/// Frame, degree and residuals stay. How the degree was chosen held of the points before.
std::shared_ptr<FittedSurface> fit_after(const FittedSurface& before, const DualShape& shape,
                                         const geometry::PolynomialSurface& surface) {
  auto fit = std::make_shared<FittedSurface>(before);
  fit->surface = surface;
  fit->cross_validated_rms_m.clear();
  std::vector<WeightedPoint> points;
  points.reserve(shape.points.size());
  for (std::size_t c = 0; c < shape.points.chunk_count(); ++c) {
    for (const DualPoint& point : shape.points.chunk(c)) points.push_back({point.position(), point.pressure});
  }
  fit->frame_drift_rad = frame_drift_rad(fit->frame, points);
  return fit;
}

/// Takes the residuals as they now are. To rounding they should be those that leave the surface the optimum:
/// the former ones, and 0 of new points. They are not where base plane or points are not symmetric, so that
/// no surface is its own mirror image, nor where points that hardly determine the surface let a curve lift it
/// to heights beside which they are rounding: there the shape is fitted again.
Status settle(DualShape& shape) {
  // Of the heights, both as eq. 3 weighs them. A change of the residuals by this much turns the optimum's
  // coefficients by at most the design's condition number as much: 1e-9 (A8) to conditions of 1000, and the
  // fit that is made beyond is as good as any.
  constexpr double rounding = 1e-12;
  const std::vector<WeightedPoint> points = local_points(shape);
  auto fit = std::make_shared<FittedSurface>(*shape.fit);
  fit->residuals_m = geometry::vertical_residuals(fit->surface, points);
  double heights = 0;
  double changes = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double change = fit->residuals_m[i] - shape.residual_m(i);
    heights += points[i].weight * points[i].position.z() * points[i].position.z();
    changes += points[i].weight * change * change;
  }
  if (!(changes <= rounding * rounding * heights)) return refit_alone(shape);
  fit->box = geometry::footprint_box(points, geometry::Frame{});
  fit->statistics = statistics_of(shape, fit->residuals_m);
  shape.fit = std::move(fit);
  shape.stale = false;
  return {};
}

/// Under same-shape symmetry, every linked image exactly at the mirror image of its original (A12): the
/// surface is its own mirror image to rounding only, or not at all when there are other points besides.
Status mirror_within(DualShape& shape, const Limits& limits) {
  if (shape.symmetry != SymmetryMode::same_shape) return {};
  std::vector<DualPoint> points(shape.points.begin(), shape.points.end());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t image = shape.mirror_partner(i);
    if (image == DualPoint::no_partner || image < i) continue;
    const Vec3 position = geometry::reflect_point(points[i].position(), shape.plane);
    if (auto status = check_inside(position, shape, limits); !status) return status.error();
    place(points[image], position);
  }
  shape.points = PointCloud{};
  shape.points.append(points);
  return {};
}

Result<Edited> edit_shape(const DualPtr& original, const ProfileEdit& edit, const Limits& limits,
                          ProfileSolvers& solvers) {
  const auto solver = solvers.of(original);
  if (!solver) return solver.error();
  const std::vector<WeightedPoint>& points = (*solver)->points;
  Edited result;
  result.shape = (*solver)->shape;
  DualShape& shape = result.shape;
  const std::shared_ptr<const FittedSurface> before = shape.fit;
  auto curves = geometry::prepare_strokes(to_local(edit.strokes, before->frame));
  if (!curves) return curves.error();
  auto temporary = temporary_points(shape, *curves);
  if (!temporary) return temporary.error();
  auto surface = (*solver)->fitter.fit_with(*temporary);
  if (!surface) return surface.error();
  auto moved = follow(shape, points, *surface, limits);
  if (!moved) return moved.error();

  shape.points = std::move(*moved);
  auto fit = fit_after(*before, shape, *surface);
  if (!finite(*fit)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("the curve is too far away from \"{}\" to compute with", shape.id));
  }
  shape.fit = std::move(fit);
  if (auto status = mirror_within(shape, limits); !status) return status.error();
  if (auto status = settle(shape); !status) return status.error();

  if (edit.keep == KeptCurves::as_points) {
    std::size_t count = geometry::kept_point_count(shape.points.size());
    if (shape.symmetry == SymmetryMode::same_shape) count = (count + 1) / 2;  // Their images join as well.
    auto kept = geometry::curves_on_surface(shape.fit->surface, *curves, count);
    if (!kept) return kept.error();
    for (Curve& curve : *kept) {
      if (curve.empty()) continue;
      for (Vec3& point : curve) point = before->frame.to_world(point);
      result.kept.push_back(std::move(curve));
    }
    result.kept_pressure = geometry::mean_weight(points);
  }
  return result;
}

/// The partner as the mirror image of the edited shape; nothing when their points did not come in pairs, in
/// the same order.
std::optional<DualShape> image_of(const DualShape& shape, const DualShape& partner) {
  if (!mirror_images(shape, partner) || !mirror_frames(shape, partner)) return std::nullopt;
  DualShape image = partner;
  image.points = PointCloud{};
  std::vector<DualPoint> chunk;
  std::size_t i = 0;
  for (std::size_t c = 0; c < partner.points.chunk_count(); ++c) {
    const auto points = partner.points.chunk(c);
    chunk.assign(points.begin(), points.end());
    for (DualPoint& point : chunk) {
      const DualPoint& original = shape.points[i];
      if (original.partner != i || point.partner != i || point.pressure != original.pressure) {
        return std::nullopt;
      }
      place(point, geometry::reflect_point(original.position(), shape.plane));
      ++i;
    }
    image.points.append(chunk);
  }
  auto fit = mirror_image(*shape.fit, shape.plane);
  fit->frame = partner.fit->frame;  // Frozen to the bit.
  image.fit = std::move(fit);
  image.stale = false;
  return image;
}

/// Linked points of a partner that has others besides, or no surface, at the mirror images of the shape's
/// (A12).
Status follow_linked(const DualShape& shape, DualShape& partner, const Limits& limits) {
  PointCloud points;
  std::vector<DualPoint> chunk;
  std::size_t i = 0;
  for (std::size_t c = 0; c < partner.points.chunk_count(); ++c) {
    const auto before = partner.points.chunk(c);
    chunk.assign(before.begin(), before.end());
    for (DualPoint& point : chunk) {
      const std::uint32_t original = partner.mirror_partner(i++);
      if (original >= shape.points.size()) continue;
      const Vec3 position = geometry::reflect_point(shape.points[original].position(), shape.plane);
      if (auto status = check_inside(position, partner, limits); !status) return status.error();
      place(point, position);
    }
    points.append(chunk);
  }
  partner.points = std::move(points);
  return {};
}

ProfileEdit mirrored(const ProfileEdit& edit, const geometry::Plane& plane) {
  ProfileEdit image = edit;
  image.keep = KeptCurves::none;  // The images of the shape's kept points join the partner.
  for (Curve& curve : image.strokes) {
    for (Vec3& point : curve) point = geometry::reflect_point(point, plane);
  }
  return image;
}

/// The kept points as strokes of the shape, with their mirror images as its symmetry says (A12).
Status add_kept(Document& document, const Edited& edited, const ProfileEdit& edit, const Limits& limits) {
  for (const Curve& curve : edited.kept) {
    std::vector<DualPoint> points;
    points.reserve(curve.size());
    for (const Vec3& position : curve) {
      // The surface is unbounded (A11), and a curve may pass where it rises far.
      if (auto status = check_inside(position, edited.shape, limits); !status) return status;
      if (edited.shape.symmetry != SymmetryMode::off) {
        const Vec3 image = geometry::reflect_point(position, edited.shape.plane);
        if (auto status = check_inside(image, edited.shape, limits); !status) return status;
      }
      DualPoint point;
      place(point, position);
      point.pressure = edited.kept_pressure;
      point.time_ns = edit.time_ns;
      points.push_back(point);
    }
    const std::uint32_t stroke = document.find_dual(edited.shape.id)->stroke_count + 1;
    auto extended = extend_stroke(document, edited.shape.id, stroke, points, 0.0, limits);
    if (!extended) return extended.error();
    document = std::move(*extended);
  }
  return {};
}

/// Kept points lie on the surface and leave it the optimum: the fit takes them in without a refit (A20).
/// Mirror images that do not lie there, as no surface over this base plane is its own image, do need one.
Status take_in_kept(Document& document, std::string_view entity) {
  DualShape shape = *document.find_dual(entity);
  shape.fit = fit_after(*shape.fit, shape, shape.fit->surface);
  if (auto status = settle(shape); !status) return status.error();
  put(document, std::move(shape));
  return {};
}

Status edit_with_partner(Document& document, const DualPtr& original, const ProfileEdit& edit,
                         const Limits& limits, ProfileSolvers& solvers, std::vector<std::string>& notes) {
  const DualShape& shape = *original;
  auto edited = edit_shape(original, edit, limits, solvers);
  if (!edited) return edited.error();
  note_fit(edited->shape, notes);
  put(document, edited->shape);

  const DualPtr partner = linked_partner(document, shape);
  bool is_image = false;
  if (partner && partner->fitted()) {
    if (auto image = image_of(edited->shape, *partner)) {
      is_image = true;
      if (auto status = settle(*image); !status) return status;
      put(document, std::move(*image));
    } else {
      auto own = edit_shape(partner, mirrored(edit, shape.plane), limits, solvers);
      if (!own) return own.error();
      if (auto status = follow_linked(edited->shape, own->shape, limits); !status) return status;
      if (auto status = refit_alone(own->shape); !status) return status;
      note_fit(own->shape, notes);
      put(document, std::move(own->shape));
    }
  } else if (partner) {
    DualShape own = *partner;
    if (auto status = follow_linked(edited->shape, own, limits); !status) return status;
    put(document, std::move(own));
  }

  if (edited->kept.empty()) return {};
  if (auto status = add_kept(document, *edited, edit, limits); !status) return status;
  if (auto status = take_in_kept(document, shape.id); !status) return status;
  if (!partner || !partner->fitted()) return {};
  if (is_image) {
    return take_in_kept(document, partner->id);
  }
  DualShape own = *document.find_dual(partner->id);
  if (auto status = refit_alone(own); !status) return status;
  put(document, std::move(own));
  return {};
}

}  // namespace

Result<std::shared_ptr<const ProfileSolver>> ProfileSolvers::of(const DualPtr& shape) {
  const auto found = kept_.find(shape->id);
  if (found != kept_.end() && found->second.shape == shape) return found->second.solver;
  DualShape ready = *shape;
  std::vector<WeightedPoint> points;
  auto fitter = current_fitter(ready, points);
  if (!fitter) return fitter.error();
  auto solver = std::make_shared<const ProfileSolver>(
      ProfileSolver{std::move(ready), std::move(points), *std::move(fitter)});
  kept_.insert_or_assign(shape->id, Kept{shape, solver});
  return solver;
}

Status edit_profile(Document& document, std::string_view entity, const ProfileEdit& edit,
                    std::string_view field, const Limits& limits, ProfileSolvers& solvers,
                    std::vector<std::string>& notes) {
  const DualPtr shape = document.find_dual(entity);
  if (!shape || !shape->fitted() || edit.strokes.empty()) return {};
  auto status = edit_with_partner(document, shape, edit, limits, solvers, notes);
  if (status) return status;
  Error error = status.error();
  error.field = std::string(field);
  return error;
}

}  // namespace handloft::model
