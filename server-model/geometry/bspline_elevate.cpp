// Degree elevation. The control value of the higher degree is the mean of values of the old blossom, one of
// its p + 1 arguments left out in turn (Prautzsch, "Degree elevation of B-spline curves", CAGD 1984); each of
// these is a control value of the old shape with some knots inserted, so that all sums are convex.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server-model/geometry/bspline_refine.h"
#include "server-model/geometry/bspline_strip.h"

namespace handloft::geometry {
namespace {

using detail::OpenStrip;
using detail::Strip;

/// The value with inner knots `inner` (p of them, ascending) as a sum of old ones, first .. first + size - 1.
struct Blend {
  std::size_t first = 0;
  std::vector<double> factors;
};

class Blossom {
 public:
  explicit Blossom(const OpenStrip& strip) : strip_(strip) {}

  /// By insertion into the few knots around; the old values there are rows of an identity matrix.
  Blend operator()(std::span<const double> inner) const {
    const auto p = static_cast<std::size_t>(strip_.degree);
    const std::vector<double>& t = strip_.knots;
    // The old values whose inner knots begin no later, and end no earlier.
    std::size_t first = 0;
    std::size_t last = strip_.count() - 1;
    {
      const auto begin = std::upper_bound(t.begin(), t.end(), inner.front()) - t.begin();
      const auto at = static_cast<std::size_t>(begin);  // t[at - 1] <= inner.front() < t[at]
      if (at > p + 1) first = at - p - 2;
      const auto end =
          static_cast<std::size_t>(std::lower_bound(t.begin(), t.end(), inner.back()) - t.begin());
      last = std::min(last, end);  // t[end - 1] < inner.back() <= t[end]
      first = std::min(first, last);
    }
    const std::size_t size = last - first + 1;
    std::vector<double> knots(t.begin() + static_cast<std::ptrdiff_t>(first),
                              t.begin() + static_cast<std::ptrdiff_t>(last + p + 2));
    std::vector<double> rows(size * size, 0.0);
    for (std::size_t i = 0; i < size; ++i) rows[i * size + i] = 1;
    for (std::size_t i = 0; i < p;) {
      std::size_t wanted = 0;
      const double x = inner[i];
      for (; i < p && inner[i] == x; ++i) ++wanted;
      const auto [low, high] = std::equal_range(knots.begin(), knots.end(), x);
      for (auto have = static_cast<std::size_t>(high - low); have < wanted; ++have) {
        insert_one(x, knots, rows, size);
      }
    }
    Blend blend;
    blend.first = first;
    // The last place where the p knots stand side by side.
    for (std::size_t j = knots.size() - p - 1; j-- > 0;) {
      if (!std::equal(inner.begin(), inner.end(), knots.begin() + static_cast<std::ptrdiff_t>(j + 1)))
        continue;
      blend.factors.assign(rows.begin() + static_cast<std::ptrdiff_t>(j * size),
                           rows.begin() + static_cast<std::ptrdiff_t>((j + 1) * size));
      break;
    }
    return blend;
  }

 private:
  /// Boehm's insertion of one knot. Rows whose neighbours lie outside are not asked for later.
  void insert_one(double x, std::vector<double>& knots, std::vector<double>& rows, std::size_t size) const {
    const auto p = static_cast<std::size_t>(strip_.degree);
    const std::size_t count = knots.size() - p - 1;
    const auto above = std::upper_bound(knots.begin(), knots.end(), x);
    const auto s = static_cast<std::size_t>(above - knots.begin());  // knots[s - 1] <= x < knots[s]
    std::vector<double> out((count + 1) * size, 0.0);
    for (std::size_t i = 0; i <= count; ++i) {
      const bool from_left = i + p < s;  // i <= (s - 1) - p
      const bool from_right = i >= s;
      double factor = from_left ? 1 : 0;
      if (!from_left && !from_right && i + p < knots.size()) {
        const double length = knots[i + p] - knots[i];
        factor = length > 0 ? std::clamp((x - knots[i]) / length, 0.0, 1.0) : 0;
      }
      if (i == count) factor = 0;
      if (i == 0) factor = 1;
      for (std::size_t m = 0; m < size; ++m) {
        const double own = i < count ? rows[i * size + m] : 0;
        const double left = i > 0 ? rows[(i - 1) * size + m] : 0;
        out[i * size + m] = factor * own + (1 - factor) * left;
      }
    }
    rows = std::move(out);
    knots.insert(above, x);
  }

  const OpenStrip& strip_;
};

OpenStrip elevate_once(const OpenStrip& strip) {
  const auto p = static_cast<std::size_t>(strip.degree);
  OpenStrip out;
  out.degree = strip.degree + 1;
  out.width = strip.width;
  for (std::size_t i = 0; i < strip.knots.size(); ++i) {
    out.knots.push_back(strip.knots[i]);
    if (i + 1 == strip.knots.size() || strip.knots[i + 1] != strip.knots[i]) {
      out.knots.push_back(strip.knots[i]);
    }
  }
  const Blossom blossom(strip);
  const std::size_t count = out.count();
  out.values.assign(count * out.width, 0.0);
  std::vector<double> inner(p);
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<double> factors;
    std::size_t first = 0;
    // Leaving out either of two equal arguments gives the same value.
    for (std::size_t omitted = 1; omitted <= p + 1;) {
      std::size_t next = omitted + 1;
      while (next <= p + 1 && out.knots[i + next] == out.knots[i + omitted]) ++next;
      std::size_t at = 0;
      for (std::size_t k = 1; k <= p + 1; ++k) {
        if (k != omitted) inner[at++] = out.knots[i + k];
      }
      const Blend blend = blossom(inner);
      if (!blend.factors.empty()) {
        if (factors.empty()) first = blend.first;
        // Windows differ by their ends.
        if (blend.first < first) {
          factors.insert(factors.begin(), first - blend.first, 0.0);
          first = blend.first;
        }
        const std::size_t shift = blend.first - first;
        factors.resize(std::max(factors.size(), shift + blend.factors.size()), 0.0);
        const double share = static_cast<double>(next - omitted) / static_cast<double>(p + 1);
        for (std::size_t m = 0; m < blend.factors.size(); ++m) factors[shift + m] += share * blend.factors[m];
      }
      omitted = next;
    }
    double* const to = out.values.data() + i * out.width;
    for (std::size_t k = 0; k < factors.size(); ++k) {
      if (factors[k] == 0) continue;
      const double* const from = strip.values.data() + (first + k) * strip.width;
      for (std::size_t m = 0; m < out.width; ++m) to[m] += factors[k] * from[m];
    }
  }
  return out;
}

Result<Strip> elevate_strip(Strip strip, int by) {
  if (by < 1 || by > KnotVector::max_degree || strip.knots.degree() + by > KnotVector::max_degree) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected 1 to {}", by, KnotVector::max_degree - strip.knots.degree()), "by");
  }
  for (; by > 0; --by) {
    const std::size_t count = 2 * static_cast<std::size_t>(strip.knots.control_count());
    if (count > detail::max_strip_values / strip.width) {
      return make_error(ErrorCode::resource_exhausted, "the surface would be too large", "by");
    }
    Result<Strip> next = detail::through_open(strip, strip.knots.degree() + 1, elevate_once);
    if (!next) return next.error();
    strip = *std::move(next);
  }
  return strip;
}

}  // namespace

Result<BSplineCurve> elevate_degree(const BSplineCurve& curve, int by) {
  if (const Status status = check(curve); !status) return status.error();
  Result<Strip> strip = elevate_strip(detail::to_strip(curve), by);
  if (!strip) return strip.error();
  return detail::to_curve(*std::move(strip));
}

Result<BSplineSurface> elevate_degree(const BSplineSurface& surface, Direction direction, int by) {
  if (const Status status = check(surface); !status) return status.error();
  const Result<Strip> strip = elevate_strip(detail::to_strip(surface, direction), by);
  if (!strip) return strip.error();
  return detail::to_surface(*strip, direction, surface);
}

}  // namespace handloft::geometry
