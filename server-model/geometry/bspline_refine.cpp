#include "server-model/geometry/bspline_refine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "server-model/geometry/bspline_strip.h"

namespace handloft::geometry {
namespace {

using detail::OpenStrip;
using detail::Strip;

/// The knots to add, ascending, each known to have a place.
Result<std::vector<double>> placed_knots(const KnotVector& into, std::span<const double> knots) {
  std::vector<double> added(knots.begin(), knots.end());
  for (std::size_t i = 0; i < added.size(); ++i) {
    if (!(added[i] >= into.lower() && added[i] <= into.upper())) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected {} to {}", added[i], into.lower(), into.upper()),
                        fmt::format("knots[{}]", i));
    }
    added[i] = into.wrap(added[i]);
  }
  std::sort(added.begin(), added.end());
  for (auto first = added.begin(); first != added.end();) {
    const auto last = std::upper_bound(first, added.end(), *first);
    const bool at_end = !into.is_periodic() && (*first == into.lower() || *first == into.upper());
    const int limit = into.degree() + (at_end ? 1 : 0);
    const auto total = into.multiplicity(*first) + (last - first);
    if (total > limit) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("{} would be a knot {} times, expected at most {}", *first, total, limit),
                        "knots");
    }
    first = last;
  }
  return added;
}

/// With the images of the knots over all of the stretch, where it is periodic.
OpenStrip insert_images(const OpenStrip& open, const KnotVector& like, const std::vector<double>& added) {
  if (!like.is_periodic()) return detail::insert(open, added);
  const auto p = static_cast<std::size_t>(open.degree);
  const double low = open.knots[p];
  const double high = open.knots[open.knots.size() - 1 - p];
  const long before = std::lround(std::ceil((like.lower() - low) / like.length())) + 1;
  const long after = std::lround(std::ceil((high - like.upper()) / like.length())) + 1;
  std::vector<double> images;
  for (long k = -before; k <= after; ++k) {
    for (const double knot : added) {
      const double image = detail::knot_image(like, knot, k);
      if (image >= low && image <= high) images.push_back(image);
    }
  }
  return detail::insert(open, images);
}

Result<Strip> insert_into(const Strip& strip, std::span<const double> knots) {
  const Result<std::vector<double>> added = placed_knots(strip.knots, knots);
  if (!added) return added.error();
  if (added->empty()) return strip;
  const std::size_t count = static_cast<std::size_t>(strip.knots.control_count()) + added->size();
  if (count > static_cast<std::size_t>(KnotVector::max_control_count) ||
      count > detail::max_strip_values / strip.width) {
    return make_error(ErrorCode::resource_exhausted, fmt::format("{} knots are too many", added->size()),
                      "knots");
  }
  return detail::through_open(strip, strip.knots.degree(), [&](const OpenStrip& open) {
    return insert_images(open, strip.knots, *added);
  });
}

/// How a strip's points are told apart: deviations in homogeneous coordinates mean metres only with the
/// weights and the extent.
struct PointScale {
  explicit PointScale(const Strip& strip) : rational(strip.point_width == 4) {
    if (!rational) return;
    centre = Vec3(strip.values[0], strip.values[1], strip.values[2]) / strip.values[3];
    least_weight = strip.values[3];
    for (std::size_t at = 0; at < strip.values.size(); at += strip.point_width) {
      const double w = strip.values[at + 3];
      least_weight = std::min(least_weight, w);
      const Vec3 p = Vec3(strip.values[at], strip.values[at + 1], strip.values[at + 2]) / w;
      radius = std::max(radius, (p - centre).norm());
    }
  }

  /// The most that a place can move when one homogeneous point does by `d`, metres.
  double moved(const double* d) const {
    const Vec3 p(d[0], d[1], d[2]);
    if (!rational) return p.norm();
    return ((p - d[3] * centre).norm() + radius * std::abs(d[3])) / least_weight;
  }

  bool rational;
  Vec3 centre = Vec3::Zero();
  double radius = 0;
  double least_weight = 1;
};

/// Removes knot `r`, the last of its `s` copies, once (The NURBS Book, A5.8), and says how far the shape may
/// have moved, metres. The stretch reaches from value r - p - 1 to r - s + 1 at least.
double remove_once(OpenStrip& strip, std::size_t r, std::size_t s, const PointScale& scale,
                   std::size_t point_width) {
  const auto p = static_cast<std::size_t>(strip.degree);
  const std::size_t width = strip.width;
  const std::vector<double>& t = strip.knots;
  const double u = t[r];
  const std::size_t first = r - p;
  const std::size_t last = r - s;
  const auto row = [&](std::size_t i) { return strip.values.data() + i * width; };
  const auto blend = [&](std::size_t i) { return (u - t[i]) / (t[i + p + 1] - t[i]); };
  // New values from the left for the lower half of first .. last, from the right for the upper half; what
  // both determine tells how well the knot can be spared.
  std::vector<double> from_left(row(first - 1), row(first));
  std::vector<double> from_right(row(last + 1), row(last + 1) + width);
  std::vector<std::vector<double>> left, right;
  std::size_t i = first;
  std::size_t j = last;
  while (i < j) {
    const double a = blend(i);
    for (std::size_t m = 0; m < width; ++m) from_left[m] = (row(i)[m] - (1 - a) * from_left[m]) / a;
    left.push_back(from_left);
    const double b = blend(j);
    for (std::size_t m = 0; m < width; ++m) from_right[m] = (row(j)[m] - b * from_right[m]) / (1 - b);
    right.push_back(from_right);
    ++i;
    --j;
  }
  // Where the halves meet: in one old value between two new ones, or (i > j) in one new value found twice.
  std::vector<double> gap(width);
  if (i == j) {
    const double a = blend(i);
    for (std::size_t m = 0; m < width; ++m) {
      gap[m] = row(i)[m] - (a * from_right[m] + (1 - a) * from_left[m]);
    }
  } else {
    for (std::size_t m = 0; m < width; ++m) gap[m] = from_left[m] - from_right[m];
    if (!left.empty()) {
      // The mean halves the error.
      for (std::size_t m = 0; m < width; ++m) left.back()[m] = (from_left[m] + from_right[m]) / 2;
      right.pop_back();
    }
  }
  double worst = 0;
  for (std::size_t at = 0; at < width; at += point_width) {
    const double distance = scale.moved(gap.data() + at);
    worst = std::isfinite(distance) ? std::max(worst, distance) : HUGE_VAL;
  }
  std::vector<double> values(strip.values.begin(),
                             strip.values.begin() + static_cast<std::ptrdiff_t>(first * width));
  for (const std::vector<double>& value : left) values.insert(values.end(), value.begin(), value.end());
  for (auto value = right.rbegin(); value != right.rend(); ++value) {
    values.insert(values.end(), value->begin(), value->end());
  }
  values.insert(values.end(), strip.values.begin() + static_cast<std::ptrdiff_t>((last + 1) * width),
                strip.values.end());
  strip.values = std::move(values);
  strip.knots.erase(strip.knots.begin() + static_cast<std::ptrdiff_t>(r));
  return worst;
}

Result<Strip> remove_from(const Strip& strip, double knot, double tolerance_m) {
  const KnotVector& knots = strip.knots;
  const int multiplicity = std::isfinite(knot) ? knots.multiplicity(knot) : 0;
  const bool inner = knots.is_periodic() ? multiplicity > 0
                                         : multiplicity > 0 && knot > knots.lower() && knot < knots.upper();
  if (!inner) {
    return make_error(ErrorCode::invalid_argument, fmt::format("{} is no inner knot", knot), "knot");
  }
  if (!(tolerance_m >= 0)) {
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected >= 0", tolerance_m),
                      "tolerance_m");
  }
  const int p = knots.degree();
  if (knots.is_periodic() && knots.control_count() < p + 2) {
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("a period of {} control values can spare none of its knots", knots.control_count()),
        "knot");
  }
  const PointScale scale(strip);
  double moved = 0;
  Result<Strip> removed = detail::through_open(strip, p, [&](const OpenStrip& whole) {
    OpenStrip open = whole;
    const double target = knots.wrap(knot);
    // From the right, so that places further left stay where they are; images near the stretch's ends are
    // out of the period's sight.
    const auto need = static_cast<std::size_t>(p) + 1;
    for (std::size_t r = open.knots.size(); r-- > need;) {
      const double at = open.knots[r];
      if (r + 1 < open.knots.size() && open.knots[r + 1] == at) continue;
      const bool image = knots.is_periodic()
                             ? std::abs(std::remainder(at - target, knots.length())) < 1e-13 * knots.length()
                             : at == target;
      if (!image) continue;
      const auto run = std::lower_bound(open.knots.begin(), open.knots.end(), at);
      const std::size_t s = r + 1 - static_cast<std::size_t>(run - open.knots.begin());
      if (r - s + 1 >= open.count()) continue;
      moved = std::max(moved, remove_once(open, r, s, scale, strip.point_width));
    }
    return open;
  });
  if (moved > tolerance_m) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("without the knot {} the shape would move by up to {} m, allowed are {} m",
                                  knot, moved, tolerance_m),
                      "knot");
  }
  if (removed && scale.rational) {
    for (std::size_t at = 3; at < removed->values.size(); at += strip.point_width) {
      if (!(removed->values[at] > 0)) {
        return make_error(ErrorCode::failed_precondition, "without the knot a weight would not be positive",
                          "knot");
      }
    }
  }
  return removed;
}

/// An operation of one direction on a curve or a surface, with what it needs of both.
template <typename Operation>
Result<BSplineCurve> on_curve(const BSplineCurve& curve, const Operation& operation) {
  if (const Status status = check(curve); !status) return status.error();
  Result<Strip> strip = operation(detail::to_strip(curve));
  if (!strip) return strip.error();
  return detail::to_curve(*std::move(strip));
}

template <typename Operation>
Result<BSplineSurface> on_surface(const BSplineSurface& surface, Direction direction,
                                  const Operation& operation) {
  if (const Status status = check(surface); !status) return status.error();
  const Result<Strip> strip = operation(detail::to_strip(surface, direction));
  if (!strip) return strip.error();
  return detail::to_surface(*strip, direction, surface);
}

}  // namespace

Result<BSplineCurve> insert_knots(const BSplineCurve& curve, std::span<const double> knots) {
  return on_curve(curve, [&](const Strip& strip) { return insert_into(strip, knots); });
}

Result<BSplineSurface> insert_knots(const BSplineSurface& surface, Direction direction,
                                    std::span<const double> knots) {
  return on_surface(surface, direction, [&](const Strip& strip) { return insert_into(strip, knots); });
}

Result<BSplineCurve> remove_knot(const BSplineCurve& curve, double knot, double tolerance_m) {
  return on_curve(curve, [&](const Strip& strip) { return remove_from(strip, knot, tolerance_m); });
}

Result<BSplineSurface> remove_knot(const BSplineSurface& surface, Direction direction, double knot,
                                   double tolerance_m) {
  return on_surface(surface, direction,
                    [&](const Strip& strip) { return remove_from(strip, knot, tolerance_m); });
}

}  // namespace handloft::geometry
