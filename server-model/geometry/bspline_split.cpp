// Parts of B-splines: splitting, clamping, Bezier pieces.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "server-model/geometry/bspline_refine.h"
#include "server-model/geometry/bspline_strip.h"

namespace handloft::geometry {
namespace {

using detail::OpenStrip;
using detail::Strip;

Result<Strip> closed_strip(OpenStrip part, std::size_t point_width) {
  Result<KnotVector> knots = KnotVector::open(part.degree, std::move(part.knots));
  if (!knots) return knots.error();
  return Strip{*std::move(knots), part.width, point_width, std::move(part.values)};
}

bool is_clamped(const KnotVector& knots) {
  return !knots.is_periodic() && knots.multiplicity(knots.lower()) == knots.degree() + 1 &&
         knots.multiplicity(knots.upper()) == knots.degree() + 1;
}

/// One period from `from` on.
Result<Strip> cut_open(const Strip& strip, double from) {
  const int n = strip.knots.control_count();
  const long margin = strip.knots.degree();
  const OpenStrip open = detail::unroll(strip, -margin, 2L * n + 2 * margin);
  return closed_strip(detail::segment(open, from, detail::knot_image(strip.knots, from, 1)),
                      strip.point_width);
}

Result<std::vector<Strip>> split_strip(const Strip& strip, double parameter) {
  const KnotVector& knots = strip.knots;
  std::vector<Strip> parts;
  if (knots.is_periodic()) {
    if (!std::isfinite(parameter)) {
      return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "parameter");
    }
    Result<Strip> part = cut_open(strip, knots.wrap(parameter));
    if (!part) return part.error();
    parts.push_back(*std::move(part));
    return parts;
  }
  if (!(parameter > knots.lower() && parameter < knots.upper())) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected more than {} and less than {}", parameter,
                                  knots.lower(), knots.upper()),
                      "parameter");
  }
  // Once for both parts: they share the values where they meet to the bit.
  const OpenStrip open =
      detail::interpolated(detail::unroll(strip), std::array{knots.lower(), parameter, knots.upper()});
  for (const auto& [from, to] : {std::pair(knots.lower(), parameter), std::pair(parameter, knots.upper())}) {
    Result<Strip> part = closed_strip(detail::segment(open, from, to), strip.point_width);
    if (!part) return part.error();
    parts.push_back(*std::move(part));
  }
  return parts;
}

Strip clamped_strip(const Strip& strip) {
  const KnotVector& knots = strip.knots;
  Result<Strip> part =
      knots.is_periodic() ? cut_open(strip, knots.lower())
                          : closed_strip(detail::segment(detail::unroll(strip), knots.lower(), knots.upper()),
                                         strip.point_width);
  // The knots were good before; nothing was added but copies of them.
  return part ? *std::move(part) : strip;
}

/// Each span's clamped part; neighbours share their common values to the bit.
std::vector<Strip> bezier_strips(const Strip& strip) {
  const Strip open = clamped_strip(strip);
  const KnotVector& knots = open.knots;
  const auto p = static_cast<std::size_t>(knots.degree());
  std::vector<double> places;
  for (const int s : knots.spans()) places.push_back(knots.knots()[static_cast<std::size_t>(s)]);
  const OpenStrip full = detail::interpolated(detail::unroll(open), places);
  std::vector<Strip> pieces;
  for (std::size_t i = 0; i + p < full.count(); i += p) {
    OpenStrip piece;
    piece.degree = full.degree;
    piece.width = full.width;
    piece.knots.assign(p + 1, full.knots[i + p]);
    piece.knots.insert(piece.knots.end(), p + 1, full.knots[i + p + 1]);
    piece.values.assign(full.values.begin() + static_cast<std::ptrdiff_t>(i * full.width),
                        full.values.begin() + static_cast<std::ptrdiff_t>((i + p + 1) * full.width));
    if (Result<Strip> made = closed_strip(std::move(piece), open.point_width)) {
      pieces.push_back(*std::move(made));
    }
  }
  return pieces;
}

}  // namespace

Result<std::vector<BSplineCurve>> split(const BSplineCurve& curve, double parameter) {
  if (const Status status = check(curve); !status) return status.error();
  Result<std::vector<Strip>> parts = split_strip(detail::to_strip(curve), parameter);
  if (!parts) return parts.error();
  std::vector<BSplineCurve> curves;
  for (Strip& part : *parts) curves.push_back(detail::to_curve(std::move(part)));
  return curves;
}

Result<std::vector<BSplineSurface>> split(const BSplineSurface& surface, Direction direction,
                                          double parameter) {
  if (const Status status = check(surface); !status) return status.error();
  const Result<std::vector<Strip>> parts = split_strip(detail::to_strip(surface, direction), parameter);
  if (!parts) return parts.error();
  std::vector<BSplineSurface> surfaces;
  for (const Strip& part : *parts) surfaces.push_back(detail::to_surface(part, direction, surface));
  return surfaces;
}

BSplineCurve clamped(const BSplineCurve& curve) {
  if (is_clamped(curve.knots)) return curve;
  return detail::to_curve(clamped_strip(detail::to_strip(curve)));
}

BSplineSurface clamped(const BSplineSurface& surface) {
  BSplineSurface result = surface;
  for (const Direction direction : {Direction::u, Direction::v}) {
    if (is_clamped(direction == Direction::u ? result.u : result.v)) continue;
    result = detail::to_surface(clamped_strip(detail::to_strip(result, direction)), direction, result);
  }
  return result;
}

std::vector<BSplineSurface> bezier_patches(const BSplineSurface& surface) {
  std::vector<BSplineSurface> patches;
  for (const Strip& row : bezier_strips(detail::to_strip(surface, Direction::u))) {
    const BSplineSurface band = detail::to_surface(row, Direction::u, surface);
    for (const Strip& piece : bezier_strips(detail::to_strip(band, Direction::v))) {
      patches.push_back(detail::to_surface(piece, Direction::v, band));
    }
  }
  return patches;
}

}  // namespace handloft::geometry
