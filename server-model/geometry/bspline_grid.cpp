#include "server-model/geometry/bspline_grid.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace handloft::geometry {
namespace {

/// row[j] = sum_i in_u[i] field[control(i), j], by functions of v: those of a period's end repeat its start.
/// `width` numbers a control point.
void sum_along_u(const KnotVector& u, const KnotVector& v, int first_function, std::span<const double> basis,
                 const double* field, std::size_t width, double* row) {
  const std::size_t length = static_cast<std::size_t>(v.control_count()) * width;
  int control = u.control_of(first_function);
  for (std::size_t i = 0; i < basis.size(); ++i) {
    const double* const from = field + static_cast<std::size_t>(control) * length;
    const double factor = basis[i];
    if (i == 0) {
      for (std::size_t j = 0; j < length; ++j) row[j] = factor * from[j];
    } else {
      for (std::size_t j = 0; j < length; ++j) row[j] += factor * from[j];
    }
    if (++control == u.control_count()) control = 0;
  }
  const std::size_t extended = static_cast<std::size_t>(v.function_count()) * width;
  for (std::size_t j = length; j < extended; ++j) row[j] = row[j - length];
}

/// The sum along v at one place; `Width` numbers, 0: as `width` says.
template <std::size_t Width>
void sum_along_v(const double* row, std::span<const double> basis, std::size_t width, double* out) {
  if constexpr (Width > 0) width = Width;
  for (std::size_t m = 0; m < width; ++m) {
    double total = basis[0] * row[m];
    for (std::size_t j = 1; j < basis.size(); ++j) total += basis[j] * row[j * width + m];
    out[m] = total;
  }
}

/// Fixed degrees unroll: the common cubic costs half.
template <std::size_t Width, std::size_t Order>
void row_along_v(const BasisTable& table, const double* row, std::size_t width, double* out) {
  if constexpr (Width > 0) width = Width;
  for (std::size_t c = 0; c < table.size(); ++c) {
    const std::span<const double> basis = table.at(c, 0);
    const double* const from = row + static_cast<std::size_t>(table.first_function[c]) * width;
    if constexpr (Order > 0) {
      sum_along_v<Width>(from, std::span<const double, Order>(basis.data(), Order), width, out + c * width);
    } else {
      sum_along_v<Width>(from, basis, width, out + c * width);
    }
  }
}

/// Homogeneous place and tangents at once.
struct Tangents {
  Eigen::Vector4d s = Eigen::Vector4d::Zero(), su = Eigen::Vector4d::Zero(), sv = Eigen::Vector4d::Zero();
};
Tangents sums_at(const double* row, const double* slope, std::span<const double> basis,
                 std::span<const double> derivative) {
  Tangents sums;
  for (std::size_t j = 0; j < basis.size(); ++j) {
    const Eigen::Map<const Eigen::Vector4d> p(row + 4 * j);
    const Eigen::Map<const Eigen::Vector4d> d(slope + 4 * j);
    sums.s += basis[j] * p;
    sums.su += basis[j] * d;
    sums.sv += derivative[j] * p;
  }
  return sums;
}

using RowFunction = void (*)(const BasisTable&, const double*, std::size_t, double*);

template <std::size_t Width>
RowFunction row_function(int degree) {
  switch (degree) {
    case 1:
      return row_along_v<Width, 2>;
    case 2:
      return row_along_v<Width, 3>;
    case 3:
      return row_along_v<Width, 4>;
    case 5:
      return row_along_v<Width, 6>;
    default:
      return row_along_v<Width, 0>;
  }
}

RowFunction row_function(int degree, std::size_t width) {
  switch (width) {
    case 1:
      return row_function<1>(degree);
    case 3:
      return row_function<3>(degree);
    default:
      return row_function<0>(degree);
  }
}

}  // namespace

GridEvaluator::GridEvaluator(const BSplineSurface& surface, std::span<const double> us,
                             std::span<const double> vs)
    : u_(surface.u),
      v_(surface.v),
      us_(us.begin(), us.end()),
      vs_(vs.begin(), vs.end()),
      in_u_(tabulate(surface.u, us, 1)),
      in_v_(tabulate(surface.v, vs, 1)) {
  if (!surface.is_rational()) return;
  std::vector<double> denominators(size());
  // With no weights held yet, this is the plain sum.
  if (!evaluate(surface.weights, 1, denominators)) return;
  for (double& w : denominators) w = 1 / w;
  weights_ = surface.weights;
  reciprocal_ = std::move(denominators);
}

Status GridEvaluator::check_rows(std::size_t field, std::size_t k, std::size_t first, std::size_t count,
                                 std::size_t values) const {
  const std::size_t points =
      static_cast<std::size_t>(u_.control_count()) * static_cast<std::size_t>(v_.control_count());
  if (k < 1 || field / k != points || field % k != 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} numbers, {} a control point, for {} points", field, k, points),
                      "field");
  }
  if (first > rows() || count > rows() - first) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} rows from {}, of {}", count, first, rows()), "rows");
  }
  if (values != count * columns() * k) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} places for numbers, expected {}", values, count * columns() * k),
                      "values");
  }
  return {};
}

Status GridEvaluator::evaluate(std::span<const double> field, std::size_t k, std::span<double> values) const {
  return evaluate(field, k, 0, rows(), values);
}

Status GridEvaluator::evaluate(std::span<const double> field, std::size_t k, std::size_t first,
                               std::size_t count, std::span<double> values) const {
  if (Status status = check_rows(field.size(), k, first, count, values.size()); !status) return status;
  std::vector<double> weighted;
  if (!weights_.empty()) {
    weighted.resize(field.size());
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      for (std::size_t m = 0; m < k; ++m) weighted[i * k + m] = weights_[i] * field[i * k + m];
    }
    field = weighted;
  }
  std::vector<double> row(static_cast<std::size_t>(v_.function_count()) * k);
  const RowFunction along_v = row_function(v_.degree(), k);
  for (std::size_t r = first; r < first + count; ++r) {
    sum_along_u(u_, v_, in_u_.first_function[r], in_u_.at(r, 0), field.data(), k, row.data());
    double* const out = values.data() + (r - first) * columns() * k;
    along_v(in_v_, row.data(), k, out);
    if (weights_.empty()) continue;
    for (std::size_t c = 0; c < columns(); ++c) {
      const double factor = reciprocal_[r * columns() + c];
      for (std::size_t m = 0; m < k; ++m) out[c * k + m] *= factor;
    }
  }
  return {};
}

Status GridEvaluator::evaluate(const BSplineSurface& surface, std::vector<Vec3>& places) const {
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  places.resize(size());
  return evaluate(
      std::span(reinterpret_cast<const double*>(surface.control.data()), 3 * surface.control.size()), 3,
      std::span(reinterpret_cast<double*>(places.data()), 3 * places.size()));
}

Status GridEvaluator::evaluate(const BSplineSurface& surface, std::vector<Vec3>& places,
                               std::vector<Vec3>& normals) const {
  places.resize(size());
  normals.resize(size());
  if (Status status = check_rows(3 * surface.control.size(), 3, 0, rows(), 3 * size()); !status)
    return status;
  // Homogeneous coordinates, four numbers a point.
  constexpr std::size_t width = 4;
  std::vector<double> field(width * surface.control.size());
  for (std::size_t i = 0; i < surface.control.size(); ++i) {
    const double w = weights_.empty() ? 1 : weights_[i];
    const Vec3 p = w * surface.control[i];
    std::copy(p.data(), p.data() + 3, field.begin() + static_cast<std::ptrdiff_t>(width * i));
    field[width * i + 3] = w;
  }
  std::vector<double> row(static_cast<std::size_t>(v_.function_count()) * width);
  std::vector<double> slope(row.size());
  constexpr double safe_sine_squared = 1e-12;
  constexpr double least = 1e-100, most = 1e100;
  // A tangent that is shorter, of the extent over the domain, may be rounding.
  constexpr double safe_tangent = 1e-8;
  Vec3 low = surface.control.front();
  Vec3 high = low;
  for (const Vec3& p : surface.control) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double noise = safe_tangent * (high - low).maxCoeff();
  const double least_u = noise * noise / (u_.length() * u_.length());
  const double least_v = noise * noise / (v_.length() * v_.length());
  for (std::size_t r = 0; r < rows(); ++r) {
    sum_along_u(u_, v_, in_u_.first_function[r], in_u_.at(r, 0), field.data(), width, row.data());
    sum_along_u(u_, v_, in_u_.first_function[r], in_u_.at(r, 1), field.data(), width, slope.data());
    for (std::size_t c = 0; c < columns(); ++c) {
      const std::size_t first = static_cast<std::size_t>(in_v_.first_function[c]) * width;
      auto [s, su, sv] = sums_at(row.data() + first, slope.data() + first, in_v_.at(c, 0), in_v_.at(c, 1));
      const std::size_t place = r * columns() + c;
      if (weights_.empty()) {
        places[place] = s.head<3>();
      } else {
        places[place] = s.head<3>() * reciprocal_[place];
        su.head<3>() -= su[3] * places[place];
        sv.head<3>() -= sv[3] * places[place];
      }
      const Vec3 a = su.head<3>();
      const Vec3 b = sv.head<3>();
      const Vec3 normal = a.cross(b);
      const double squared = normal.squaredNorm();
      // Far from poles and from overflow: the careful way gives the same there.
      const double a2 = a.squaredNorm();
      const double b2 = b.squaredNorm();
      const bool plain = a2 > least_u && b2 > least_v && squared > safe_sine_squared * a2 * b2 &&
                         squared > least && squared < most;
      normals[place] = plain ? Vec3(normal / std::sqrt(squared)) : surface.normal(us_[r], vs_[c]);
    }
  }
  return {};
}

void evaluate_grid(const BSplineSurface& surface, std::span<const double> us, std::span<const double> vs,
                   std::vector<Vec3>& places, std::vector<Vec3>* normals) {
  const GridEvaluator grid(surface, us, vs);
  // Sizes fit, as the surface is its own.
  const Status status =
      normals != nullptr ? grid.evaluate(surface, places, *normals) : grid.evaluate(surface, places);
  if (!status) places.clear();
}

}  // namespace handloft::geometry
