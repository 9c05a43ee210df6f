#include "server-model/geometry/region_border.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace handloft::geometry {

namespace {

/// Of the mean span: a side that is as near to a knot is there.
constexpr double snap_part = 0.02;
/// As sculpt_setup.cpp measures: of the mean span, and of the whole.
constexpr double least_span = 0.1, least_part = 1e-4;

double tolerance_of(const KnotVector& knots) {
  return same_parameter * knots.length();
}

/// The shortest span that is worth having.
double shortest(const KnotVector& knots) {
  const double mean = knots.length() / static_cast<double>(knots.spans().size());
  return std::max(snap_part * mean, std::min(least_span * mean, least_part * knots.length()));
}

struct Interval {
  double lower = 0, upper = 0;
};

Interval interval_of(const KnotVector& knots, double one, double other) {
  Interval result{std::min(one, other), std::max(one, other)};
  if (!knots.is_periodic())
    return {std::max(result.lower, knots.lower()), std::min(result.upper, knots.upper())};
  if (result.upper - result.lower >= knots.length() - tolerance_of(knots))
    return {knots.lower(), knots.upper()};
  const double length = result.upper - result.lower;
  if (result.lower >= knots.lower() && result.lower < knots.upper()) return result;
  const double start = knots.wrap(result.lower);
  return {start, start + length};
}

bool is_all(const KnotVector& knots, const Interval& interval) {
  return interval.upper - interval.lower >= knots.length() - tolerance_of(knots);
}

/// The knot (or end of an open direction) nearest to a parameter, on the same turn as it.
double nearest_knot(const KnotVector& knots, double parameter) {
  const double at = knots.wrap(parameter);
  const double turn = parameter - at;
  const auto first = knots.knots().begin() + knots.degree(), last = knots.knots().end() - knots.degree();
  const auto above = std::lower_bound(first, last, at);
  double nearest = above == last ? knots.upper() : *above;
  if (above != first && at - *(above - 1) < std::abs(nearest - at)) nearest = *(above - 1);
  return turn == 0 ? nearest : nearest + turn;
}

bool is_knot(const KnotVector& knots, double parameter) {
  return std::abs(nearest_knot(knots, parameter) - parameter) <= tolerance_of(knots);
}

/// What one direction needs; none when its interval is a sliver.
struct Side {
  Interval interval;
  std::vector<double> knots;
  bool is_sliver = false;
};

Side side_of(const KnotVector& knots, const Interval& asked, int inner_spans) {
  Side side{asked, {}, false};
  const double least = shortest(knots);
  std::vector<double> breaks;
  if (!is_all(knots, asked)) {
    for (double* end : {&side.interval.lower, &side.interval.upper}) {
      const double knot = nearest_knot(knots, *end);
      if (std::abs(knot - *end) < least) *end = knot;
    }
    if (side.interval.upper - side.interval.lower < least) return {asked, {}, true};
    // Moved onto a knot beyond the seam.
    const Interval moved = interval_of(knots, side.interval.lower, side.interval.upper);
    side.interval = moved;
    for (const double end : {moved.lower, moved.upper})
      if (!is_knot(knots, end)) side.knots.push_back(knots.wrap(end));
  }
  breaks = {side.interval.lower};
  const auto between = knots_between(knots, side.interval.lower, side.interval.upper,
                                     static_cast<std::size_t>(std::max(inner_spans, 0)));
  breaks.insert(breaks.end(), between.begin(), between.end());
  breaks.push_back(side.interval.upper);
  while (static_cast<int>(breaks.size()) <= inner_spans) {
    std::size_t longest = 1;
    for (std::size_t i = 2; i < breaks.size(); ++i)
      if (breaks[i] - breaks[i - 1] > (1 + same_parameter) * (breaks[longest] - breaks[longest - 1]))
        longest = i;
    const double middle = (breaks[longest - 1] + breaks[longest]) / 2;
    if (breaks[longest] - middle < least) break;
    breaks.insert(breaks.begin() + static_cast<std::ptrdiff_t>(longest), middle);
    side.knots.push_back(knots.wrap(middle));
  }
  std::sort(side.knots.begin(), side.knots.end());
  return side;
}

Status check_extent(const UvRectangle& region) {
  if (region.lower.allFinite() && region.upper.allFinite() && region.lower.x() < region.upper.x() &&
      region.lower.y() < region.upper.y())
    return {};
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found [{}, {}] x [{}, {}], expected an extent within the surface",
                                region.lower.x(), region.upper.x(), region.lower.y(), region.upper.y()),
                    "region");
}

/// Evenly spaced within each span of [lower, upper], the ends of spans once.
std::vector<double> even_places(const KnotVector& knots, double lower, double upper) {
  std::vector<double> breaks{lower};
  const std::vector<double> between = knots_between(knots, lower, upper, max_curve_places);
  breaks.insert(breaks.end(), between.begin(), between.end());
  breaks.push_back(upper);
  std::vector<double> places{lower};
  const int pieces = knots.degree();
  for (std::size_t i = 1; i < breaks.size(); ++i)
    for (int k = 1; k <= pieces; ++k)
      places.push_back(k == pieces ? breaks[i] : breaks[i - 1] + (breaks[i] - breaks[i - 1]) * k / pieces);
  return places;
}

}  // namespace

std::vector<double> knots_between(const KnotVector& knots, double lower, double upper, std::size_t most) {
  std::vector<double> found;
  const double eps = tolerance_of(knots);
  const double from = lower + eps, to = upper - eps;
  const auto first = knots.knots().begin() + knots.degree(), last = knots.knots().end() - knots.degree();
  const double period = knots.length();
  const double first_turn = knots.is_periodic() ? std::floor((lower - knots.lower()) / period) : 0;
  for (double turn = first_turn;; ++turn) {
    const double shift = knots.is_periodic() ? turn * period : 0;
    if (!(knots.lower() + shift < to)) break;
    for (auto at = std::upper_bound(first, last, from - shift); at != last && *at + shift < to; ++at) {
      const double knot = *at + shift;
      if (!(knot > from) || (!found.empty() && knot - found.back() <= eps)) continue;
      found.push_back(knot);
      if (found.size() >= most) return found;
    }
    if (!knots.is_periodic()) break;
  }
  return found;
}

Result<UvRectangle> region_of(const BSplineSurface& rest, const Vec2& one, const Vec2& other) {
  if (!one.allFinite() || !other.allFinite())
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "region");
  const Interval u = interval_of(rest.u, one.x(), other.x()), v = interval_of(rest.v, one.y(), other.y());
  const UvRectangle region{{u.lower, v.lower}, {u.upper, v.upper}};
  if (const Status status = check_extent(region); !status) return status.error();
  return region;
}

std::vector<Vec2> without_jumps(const BSplineSurface& rest, std::span<const Vec2> places) {
  std::vector<Vec2> result(places.begin(), places.end());
  for (std::size_t i = 1; i < result.size(); ++i) {
    const auto follow = [](const KnotVector& knots, double before, double& at) {
      if (knots.is_periodic()) at += knots.length() * std::round((before - at) / knots.length());
    };
    follow(rest.u, result[i - 1].x(), result[i].x());
    follow(rest.v, result[i - 1].y(), result[i].y());
  }
  return result;
}

bool on_knots(const BSplineSurface& rest, const UvRectangle& region) {
  const auto ends = [](const KnotVector& knots, double lower, double upper) {
    return is_all(knots, {lower, upper}) || (is_knot(knots, lower) && is_knot(knots, upper));
  };
  return ends(rest.u, region.lower.x(), region.upper.x()) && ends(rest.v, region.lower.y(), region.upper.y());
}

Result<RegionBorder> region_border(const BSplineSurface& rest, const UvRectangle& region, int inner_spans) {
  if (const Status status = check_extent(region); !status) return status.error();
  const Side u = side_of(rest.u, {region.lower.x(), region.upper.x()}, inner_spans);
  const Side v = side_of(rest.v, {region.lower.y(), region.upper.y()}, inner_spans);
  RegionBorder border;
  border.region = region;
  border.is_sliver = u.is_sliver || v.is_sliver;
  if (!border.is_sliver) {
    border.region = {{u.interval.lower, v.interval.lower}, {u.interval.upper, v.interval.upper}};
    border.u = u.knots;
    border.v = v.knots;
  }
  border.control_u = static_cast<std::size_t>(rest.u.control_count()) + border.u.size();
  border.control_v = static_cast<std::size_t>(rest.v.control_count()) + border.v.size();
  return border;
}

Result<std::vector<CurvePlace>> region_places(const BSplineSurface& rest, const UvRectangle& region) {
  if (const Status status = check_extent(region); !status) return status.error();
  const std::vector<double> us = even_places(rest.u, region.lower.x(), region.upper.x());
  const std::vector<double> vs = even_places(rest.v, region.lower.y(), region.upper.y());
  if (us.size() * vs.size() > max_curve_places)
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} places, expected at most {}: a smaller region or fewer knots",
                                  us.size() * vs.size(), max_curve_places),
                      "region");
  std::vector<CurvePlace> places;
  for (const double u : us)
    for (const double v : vs) places.push_back({0, {u, v}, 0});
  return places;
}

}  // namespace handloft::geometry
