#include "server-model/geometry/knot_vector.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

namespace handloft::geometry {
namespace {

constexpr double max_knot = 1e100;
/// Derivatives divide by powers of the domain's length.
constexpr double min_length = 1e-60;
/// Of the domain: nearer knots are one knot that was rounded.
constexpr double knot_resolution = 1e-14;
/// Of the period.
constexpr double period_tolerance = 1e-12;
constexpr auto width_limit = static_cast<std::size_t>(KnotVector::max_degree) + 1;

Error bad(std::string message, std::string field = "knots") {
  return make_error(ErrorCode::invalid_argument, std::move(message), std::move(field));
}

Status check_degree(int degree) {
  if (degree < 1 || degree > KnotVector::max_degree) {
    return bad(fmt::format("found {}, expected 1..{}", degree, KnotVector::max_degree), "degree");
  }
  return {};
}

/// Finite and ascending, with a domain that has a length; knots that differ by rounding become equal.
Status check_and_merge(int degree, std::vector<double>& knots) {
  for (std::size_t i = 0; i < knots.size(); ++i) {
    if (!(std::abs(knots[i]) <= max_knot)) {
      return bad(fmt::format("found {}, expected a finite number", knots[i]), fmt::format("knots[{}]", i));
    }
    if (i > 0 && knots[i] < knots[i - 1]) {
      return bad(fmt::format("found {} after {}, expected ascending knots", knots[i], knots[i - 1]),
                 fmt::format("knots[{}]", i));
    }
  }
  const auto p = static_cast<std::size_t>(degree);
  const double lower = knots[p];
  const double upper = knots[knots.size() - 1 - p];
  const double rounding =
      8 * std::numeric_limits<double>::epsilon() * std::max(std::abs(lower), std::abs(upper));
  if (!(upper - lower > std::max(min_length, rounding))) {
    return bad(fmt::format("found a domain from {} to {}, expected one with a length", lower, upper));
  }
  const double resolution = std::max(knot_resolution * (upper - lower), rounding);
  for (std::size_t i = 1; i < knots.size(); ++i) {
    if (knots[i] - knots[i - 1] < resolution) knots[i] = knots[i - 1];
  }
  return {};
}

/// None of the ascending knots more than `limit` times.
Status check_multiplicity(std::span<const double> knots, std::size_t limit) {
  for (std::size_t i = limit; i < knots.size(); ++i) {
    if (knots[i] == knots[i - limit]) {
      return bad(fmt::format("found {} more than {} times", knots[i], limit));
    }
  }
  return {};
}

}  // namespace

Result<KnotVector> KnotVector::open(int degree, std::vector<double> knots) {
  if (const Status status = check_degree(degree); !status) return status.error();
  const auto p = static_cast<std::size_t>(degree);
  if (knots.size() < 2 * (p + 1) || knots.size() > static_cast<std::size_t>(max_control_count) + p + 1) {
    return bad(fmt::format("found {} knots, expected {} to {}", knots.size(), 2 * (p + 1),
                           static_cast<std::size_t>(max_control_count) + p + 1));
  }
  if (const Status status = check_and_merge(degree, knots); !status) return status.error();
  if (const Status status = check_multiplicity(knots, p + 1); !status) return status.error();
  const double lower = knots[p];
  const double upper = knots[knots.size() - 1 - p];
  const auto first = std::upper_bound(knots.begin(), knots.end(), lower);
  const auto last = std::lower_bound(knots.begin(), knots.end(), upper);
  if (first < last) {
    if (const Status status = check_multiplicity({first, last}, p); !status) return status.error();
  }
  const int count = static_cast<int>(knots.size() - p - 1);
  return KnotVector(degree, false, count, std::move(knots));
}

Result<KnotVector> KnotVector::periodic(int degree, std::vector<double> knots) {
  if (const Status status = check_degree(degree); !status) return status.error();
  const auto p = static_cast<std::size_t>(degree);
  if (knots.size() < 2 * p + 3 || knots.size() > static_cast<std::size_t>(max_control_count) + 2 * p + 1) {
    return bad(fmt::format("found {} knots, expected {} to {}", knots.size(), 2 * p + 3,
                           static_cast<std::size_t>(max_control_count) + 2 * p + 1));
  }
  if (const Status status = check_and_merge(degree, knots); !status) return status.error();
  if (const Status status = check_multiplicity(knots, p); !status) return status.error();
  const std::size_t n = knots.size() - 2 * p - 1;
  const double period = knots[n + p] - knots[p];
  for (std::size_t i = 0; i + n < knots.size(); ++i) {
    if (!(std::abs(knots[i + n] - knots[i] - period) <= period_tolerance * period)) {
      return bad(
          fmt::format("found {}, expected {}: one period after knot {}", knots[i + n], knots[i] + period, i),
          fmt::format("knots[{}]", i + n));
    }
  }
  return KnotVector(degree, true, static_cast<int>(n), std::move(knots));
}

Result<KnotVector> KnotVector::uniform(int degree, int control_count) {
  if (const Status status = check_degree(degree); !status) return status.error();
  if (control_count < degree + 1 || control_count > max_control_count) {
    return bad(fmt::format("found {}, expected {} to {}", control_count, degree + 1, max_control_count),
               "control_count");
  }
  const int spans = control_count - degree;
  std::vector<double> knots;
  knots.reserve(static_cast<std::size_t>(control_count) + static_cast<std::size_t>(degree) + 1);
  for (int i = -degree; i <= spans + degree; ++i) {
    knots.push_back(static_cast<double>(std::clamp(i, 0, spans)) / spans);
  }
  return open(degree, std::move(knots));
}

Result<KnotVector> KnotVector::uniform_periodic(int degree, int control_count) {
  if (const Status status = check_degree(degree); !status) return status.error();
  if (control_count < degree + 1 || control_count > max_control_count) {
    return bad(fmt::format("found {}, expected {} to {}", control_count, degree + 1, max_control_count),
               "control_count");
  }
  std::vector<double> knots;
  knots.reserve(static_cast<std::size_t>(control_count) + 2 * static_cast<std::size_t>(degree) + 1);
  for (int i = -degree; i <= control_count + degree; ++i) {
    knots.push_back(static_cast<double>(i) / control_count);
  }
  return periodic(degree, std::move(knots));
}

double KnotVector::wrap(double u) const {
  const double low = lower();
  const double high = upper();
  if (std::isnan(u)) return low;
  if (!periodic_) return std::clamp(u, low, high);
  if (u >= low && u < high) return u;
  if (!std::isfinite(u)) return low;
  const double period = high - low;
  const double wrapped = u - period * std::floor((u - low) / period);
  return wrapped >= low && wrapped < high ? wrapped : low;
}

int KnotVector::span(double u) const {
  u = wrap(u);
  const auto first = knots_.begin() + degree_;
  const auto last = knots_.end() - degree_;
  const auto above = u >= upper() ? std::lower_bound(first, last, upper()) : std::upper_bound(first, last, u);
  return static_cast<int>(above - knots_.begin()) - 1;
}

std::vector<int> KnotVector::spans() const {
  std::vector<int> found;
  for (int s = degree_; s < function_count(); ++s) {
    if (knots_[static_cast<std::size_t>(s)] < knots_[static_cast<std::size_t>(s) + 1]) found.push_back(s);
  }
  return found;
}

int KnotVector::multiplicity(double u) const {
  if (periodic_) u = wrap(u);
  const auto [first, last] = std::equal_range(knots_.begin(), knots_.end(), u);
  return static_cast<int>(last - first);
}

double KnotVector::greville(int function) const {
  double sum = 0;
  for (int k = 1; k <= degree_; ++k)
    sum += knots_[static_cast<std::size_t>(function) + static_cast<std::size_t>(k)];
  return sum / degree_;
}

void basis_functions(const KnotVector& knots, int span, double u, int order, std::span<double> values) {
  const auto p = static_cast<std::size_t>(knots.degree());
  const auto s = static_cast<std::size_t>(span);
  const std::vector<double>& t = knots.knots();
  // Upper triangle: functions of lower degrees; below the diagonal: their knot differences. Not set to 0
  // first: every place that is read has been written.
  double triangle[width_limit][width_limit];     // NOLINT(modernize-avoid-c-arrays)
  double left[width_limit], right[width_limit];  // NOLINT(modernize-avoid-c-arrays)
  triangle[0][0] = 1;
  for (std::size_t j = 1; j <= p; ++j) {
    left[j] = u - t[s + 1 - j];
    right[j] = t[s + j] - u;
    double saved = 0;
    for (std::size_t r = 0; r < j; ++r) {
      triangle[j][r] = right[r + 1] + left[j - r];
      const double part = triangle[r][j - 1] / triangle[j][r];
      triangle[r][j] = saved + right[r + 1] * part;
      saved = left[j - r] * part;
    }
    triangle[j][j] = saved;
  }
  const std::size_t width = p + 1;
  for (std::size_t j = 0; j <= p; ++j) values[j] = triangle[j][p];
  if (order < 1) return;

  const auto highest = static_cast<std::size_t>(order);
  const std::size_t useful = std::min(highest, p);
  std::fill(values.begin() + static_cast<std::ptrdiff_t>((useful + 1) * width),
            values.begin() + static_cast<std::ptrdiff_t>((highest + 1) * width), 0.0);
  double a[2][width_limit];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t r = 0; r <= p; ++r) {
    std::size_t from = 0;
    std::size_t to = 1;
    a[0][0] = 1;
    for (std::size_t k = 1; k <= useful; ++k) {
      double sum = 0;
      const std::size_t rest = p - k;
      if (r >= k) {
        a[to][0] = a[from][0] / triangle[rest + 1][r - k];
        sum = a[to][0] * triangle[r - k][rest];
      }
      const std::size_t first = r + 1 >= k ? 1 : k - r;
      const std::size_t last = r <= rest + 1 ? k - 1 : p - r;
      for (std::size_t j = first; j <= last; ++j) {
        a[to][j] = (a[from][j] - a[from][j - 1]) / triangle[rest + 1][r + j - k];
        sum += a[to][j] * triangle[r + j - k][rest];
      }
      if (r <= rest) {
        a[to][k] = -a[from][k - 1] / triangle[rest + 1][r];
        sum += a[to][k] * triangle[r][rest];
      }
      values[k * width + r] = sum;
      std::swap(from, to);
    }
  }
  double factor = 1;
  for (std::size_t k = 1; k <= useful; ++k) {
    factor *= static_cast<double>(p + 1 - k);
    for (std::size_t j = 0; j < width; ++j) values[k * width + j] *= factor;
  }
}

BasisTable tabulate(const KnotVector& knots, std::span<const double> parameters, int order) {
  BasisTable table;
  table.degree = knots.degree();
  table.order = std::max(order, 0);
  const std::size_t stride =
      (static_cast<std::size_t>(table.order) + 1) * (static_cast<std::size_t>(table.degree) + 1);
  table.first_function.reserve(parameters.size());
  table.values.resize(parameters.size() * stride);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double u = knots.wrap(parameters[i]);
    const int s = knots.span(u);
    table.first_function.push_back(s - table.degree);
    basis_functions(knots, s, u, table.order, std::span(table.values).subspan(i * stride, stride));
  }
  return table;
}

}  // namespace handloft::geometry
