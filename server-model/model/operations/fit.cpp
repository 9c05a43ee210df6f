// Fit (A5 - A10): the base plane is taken at the first fit and frozen; RefitPlane takes it anew.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "server-model/geometry/automatic_degree.h"
#include "server-model/geometry/pca_frame.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/residual_matching.h"
#include "server-model/geometry/symmetry.h"
#include "server-model/model/operations/fitting.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace {

// A10: beyond this the footprint is foreshortened by 6 % and more, and a surface over it begins to fold.
constexpr double drift_warning_rad = 20.0 * std::numbers::pi / 180.0;

// A degenerate spectrum says nothing about the normal.
double drift_between(const geometry::Frame& frozen, const geometry::PcaFrame& fresh) {
  if (fresh.degenerate) return 0.0;
  return std::acos(std::min(1.0, std::abs(frozen.normal().dot(fresh.frame.normal()))));
}

}  // namespace

double frame_drift_rad(const geometry::Frame& frozen, const std::vector<geometry::WeightedPoint>& points) {
  geometry::PcaOptions pca;
  pca.previous = frozen;
  const auto fresh = geometry::pca_frame(points, pca);
  return fresh ? drift_between(frozen, *fresh) : 0.0;
}

bool finite(const FittedSurface& fit) {
  const auto coefficients = fit.surface.coefficients();
  const auto good = [](double value) { return std::isfinite(value); };
  return fit.frame.origin.allFinite() && fit.frame.rotation.allFinite() && fit.box.centre.allFinite() &&
         fit.box.half_extent.allFinite() && std::all_of(coefficients.begin(), coefficients.end(), good) &&
         std::all_of(fit.residuals_m.begin(), fit.residuals_m.end(), good) && good(fit.statistics.rms) &&
         good(fit.statistics.weighted_rms) && good(fit.statistics.max);
}

namespace {

// Leaves surface, degree, statistics and scores in `result`.
Status fit_with(const DegreeChoice& choice, const std::vector<geometry::WeightedPoint>& local_points,
                FittedSurface& result) {
  geometry::FitOptions options;
  options.degree = static_cast<int>(choice.degree);
  if (choice.automatic) {
    geometry::AutomaticDegreeOptions automatic;
    automatic.highest_degree = static_cast<int>(choice.degree);
    auto fitted = geometry::fit_automatic_degree(local_points, automatic);
    if (!fitted) return fitted.error();
    for (const geometry::DegreeScore& score : fitted->scores) {
      const bool validated = score.state == geometry::DegreeScore::State::validated;
      result.cross_validated_rms_m.push_back(validated ? score.cross_validated_rms : -1.0);
    }
    result.surface = fitted->fit.surface;
    result.requested_degree = static_cast<std::uint32_t>(fitted->fit.requested_degree);
    result.statistics = fitted->fit.statistics;
    if (choice.already_chosen == 0 || choice.already_chosen == result.requested_degree) return {};
    options.degree = static_cast<int>(choice.already_chosen);
  }
  auto fitted = geometry::fit_polynomial_surface(local_points, options);
  if (!fitted) return fitted.error();
  result.surface = fitted->surface;
  result.requested_degree = static_cast<std::uint32_t>(options.degree);
  result.statistics = fitted->statistics;
  return {};
}

}  // namespace

Result<std::shared_ptr<const FittedSurface>> fit_points(const DualShape& shape, std::uint32_t degree,
                                                        BasePlane base_plane) {
  return fit_points(shape, DegreeChoice{.degree = degree}, base_plane);
}

Result<std::shared_ptr<const FittedSurface>> fit_points(const DualShape& shape, const DegreeChoice& choice,
                                                        BasePlane base_plane) {
  if (shape.points.empty()) {
    return make_error(ErrorCode::rank_deficient, fmt::format("\"{}\" has no points", shape.id));
  }
  std::vector<geometry::WeightedPoint> points;
  points.reserve(shape.points.size());
  for (std::size_t c = 0; c < shape.points.chunk_count(); ++c) {
    for (const DualPoint& point : shape.points.chunk(c)) points.push_back({point.position(), point.pressure});
  }
  geometry::PcaOptions pca;
  if (shape.fit) pca.previous = shape.fit->frame;
  auto fresh = geometry::pca_frame(points, pca);
  if (!fresh) return fresh.error();

  auto result = std::make_shared<FittedSurface>();
  const bool frozen = shape.fit && base_plane == BasePlane::frozen;
  result->frame = frozen ? shape.fit->frame : fresh->frame;
  if (frozen) result->frame_drift_rad = drift_between(result->frame, *fresh);
  for (geometry::WeightedPoint& point : points) point.position = result->frame.to_local(point.position);

  if (auto status = fit_with(choice, points, *result); !status) return status.error();
  result->residuals_m = geometry::vertical_residuals(result->surface, points);
  result->box = geometry::footprint_box(points, geometry::Frame{});
  if (!finite(*result)) {
    return make_error(
        ErrorCode::rank_deficient,
        fmt::format("the points of \"{}\" are too close together or too far apart to fit", shape.id));
  }
  return std::shared_ptr<const FittedSurface>(std::move(result));
}

std::shared_ptr<FittedSurface> mirror_image(const FittedSurface& fit, const geometry::Plane& plane) {
  auto image = std::make_shared<FittedSurface>(fit);
  image->frame = geometry::reflect_frame(fit.frame, plane);
  image->surface = fit.surface.flipped_y();
  image->box.centre.y() = -fit.box.centre.y();
  return image;
}

void take_fit(DualShape& shape, std::shared_ptr<const FittedSurface> fit, std::uint32_t degree) {
  // The first fit shows the surface beside the points, so that something is seen to have happened.
  if (!shape.fit && shape.representation == Representation::points)
    shape.representation = Representation::both;
  shape.requested_degree = degree;
  shape.fit = std::move(fit);
  shape.stale = false;
}

void note_fit(const DualShape& shape, std::vector<std::string>& notes) {
  const FittedSurface& fit = *shape.fit;
  if (fit.surface.degree() < static_cast<int>(fit.requested_degree)) {
    notes.push_back(fmt::format("\"{}\": its points carry degree {} only, not {}", shape.id,
                                fit.surface.degree(), fit.requested_degree));
  }
  if (fit.frame_drift_rad > drift_warning_rad) {
    notes.push_back(
        fmt::format("\"{}\": its points now lie at {:.0f} degrees to its base plane; consider refit_plane",
                    shape.id, fit.frame_drift_rad * 180.0 / std::numbers::pi));
  }
}

bool mirror_images(const DualShape& shape, const DualShape& partner) {
  return shape.linked_from == 0 && partner.linked_from == 0 && shape.points.size() == partner.points.size();
}

bool mirror_frames(const DualShape& shape, const DualShape& partner) {
  if (!shape.fit || !partner.fit) return true;
  // Rounding of many mirrored edits, and far less than what a person could see.
  constexpr double tolerance = 1e-11;
  const geometry::Frame image = geometry::reflect_frame(shape.fit->frame, shape.plane);
  const geometry::Frame& frame = partner.fit->frame;
  return (image.rotation - frame.rotation).cwiseAbs().maxCoeff() <= tolerance &&
         (image.origin - frame.origin).norm() <= tolerance * (1 + frame.origin.norm());
}

namespace {

Result<Outcome> fit_entity(const Document& document, const DualShape& before, const DegreeChoice& choice,
                           BasePlane base_plane, const std::string& field) {
  auto fitted = fit_points(before, choice, base_plane);
  if (!fitted) {
    Error error = fitted.error();
    error.field = field;
    return error;
  }
  const std::uint32_t degree = (*fitted)->requested_degree;
  Outcome outcome;
  outcome.document = document;
  DualShape shape = before;
  take_fit(shape, *fitted, degree);
  note_fit(shape, outcome.notes);
  if (const DualPtr linked = linked_partner(document, shape)) {
    DualShape partner = *linked;
    if (mirror_images(shape, partner) &&
        (base_plane == BasePlane::taken_anew || mirror_frames(shape, partner))) {
      auto image = mirror_image(*shape.fit, shape.plane);
      // A frozen plane stays frozen to the bit; mirroring it to and fro would let it wander by rounding.
      if (partner.fit && base_plane == BasePlane::frozen) image->frame = partner.fit->frame;
      take_fit(partner, std::move(image), degree);
      put(outcome.document, std::move(partner));
    } else if (auto own = fit_points(partner, degree, base_plane); own) {
      take_fit(partner, *own, degree);
      note_fit(partner, outcome.notes);
      put(outcome.document, std::move(partner));
    } else {
      outcome.notes.push_back(fmt::format("\"{}\" could not be fitted: {}", partner.id, own.error().message));
    }
  }
  put(outcome.document, std::move(shape));
  return outcome;
}

}  // namespace

Status refit(Document& document, std::string_view entity, std::string_view field,
             std::vector<std::string>& notes) {
  const DualPtr shape = document.find_dual(entity);
  if (!shape || !shape->fitted()) return {};
  auto outcome = fit_entity(document, *shape, DegreeChoice{.degree = shape->fit->requested_degree},
                            BasePlane::frozen, std::string(field));
  if (!outcome) return outcome.error();
  document = std::move(outcome->document);
  notes.insert(notes.end(), outcome->notes.begin(), outcome->notes.end());
  return {};
}

namespace {

Result<DegreeChoice> read_choice(const handloft::v1::Fit& request, const DualShape& shape,
                                 const Limits& limits) {
  DegreeChoice choice;
  choice.automatic = request.automatic_degree();
  if (!choice.automatic) {
    if (request.chosen_degree() != 0) {
      return make_error(ErrorCode::invalid_argument,
                        "found a degree though none is to be chosen, expected it with automatic_degree only",
                        "fit.chosen_degree");
    }
    choice.degree = request.degree() == 0 ? shape.requested_degree : request.degree();
    return choice;
  }
  choice.degree = request.degree() == 0 ? limits.max_degree : request.degree();
  choice.already_chosen = request.chosen_degree();
  if (choice.already_chosen > choice.degree) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected at most {}, the highest tried", choice.already_chosen, choice.degree),
        "fit.chosen_degree");
  }
  return choice;
}

}  // namespace

Result<Outcome> fit(const Document& document, const handloft::v1::Fit& request, const ApplyContext& context) {
  auto found = require_dual(document, request.entity(), "fit.entity");
  if (!found) return found.error();
  if (auto status = check_degree(request.degree(), "fit.degree", context.limits); !status)
    return status.error();
  std::optional<Representation> shown;
  if (request.show() != handloft::v1::REPRESENTATION_UNSPECIFIED) {
    auto read = read_representation(request.show(), "fit.show");
    if (!read) return read.error();
    shown = *read;
  }
  const DualShape& shape = **found;
  auto choice = read_choice(request, shape, context.limits);
  if (!choice) return choice.error();
  // Fitting the same points again changes nothing.
  const bool same_choice =
      choice->automatic ? shape.fitted() && shape.fit->cross_validated_rms_m.size() == choice->degree &&
                              shape.fit->requested_degree == shape.requested_degree
                        : shape.requested_degree == choice->degree;
  const bool done =
      shape.fitted() && !shape.stale && same_choice && shape.fit->requested_degree == shape.requested_degree;
  Outcome outcome;
  if (done) {
    outcome.document = document;
    note_fit(shape, outcome.notes);
  } else {
    auto fitted = fit_entity(document, shape, *choice, BasePlane::frozen, "fit.entity");
    if (!fitted) return fitted;
    outcome = std::move(*fitted);
  }
  if (shown) show(outcome.document, request.entity(), *shown);
  *outcome.effective.mutable_fit() = request;
  outcome.effective.mutable_fit()->set_degree(choice->degree);
  outcome.words = fmt::format("Fit \"{}\"", shape.name);
  if (choice->automatic) {
    const std::uint32_t chosen = outcome.document.find_dual(request.entity())->fit->requested_degree;
    outcome.effective.mutable_fit()->set_chosen_degree(chosen);
    outcome.notes.push_back(
        fmt::format("\"{}\": degree {} of 1 to {} chosen", shape.id, chosen, choice->degree));
  }
  return outcome;
}

Result<Outcome> refit_plane(const Document& document, const handloft::v1::RefitPlane& request,
                            const ApplyContext&) {
  auto found = require_dual(document, request.entity(), "refit_plane.entity");
  if (!found) return found.error();
  const DualShape& shape = **found;
  auto outcome = fit_entity(document, shape, DegreeChoice{.degree = shape.requested_degree},
                            BasePlane::taken_anew, "refit_plane.entity");
  if (!outcome) return outcome;
  *outcome->effective.mutable_refit_plane() = request;
  outcome->words = fmt::format("Take a new base plane for \"{}\"", shape.name);
  return outcome;
}

}  // namespace handloft::model
