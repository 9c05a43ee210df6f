// Fitting surfaces to grids, one direction after the other.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "server-model/geometry/bspline_fit.h"
#include "server-model/geometry/bspline_fit_detail.h"
#include "server-model/geometry/bspline_grid.h"

namespace handloft::geometry {
namespace {

using detail::Rows;

/// Rows times columns, 2^40 apart from overflow.
constexpr std::size_t max_side = std::size_t{1} << 20;

Status check_grid(const PointGrid& grid, int degree_u, int degree_v) {
  if (degree_u < 1 || degree_u > KnotVector::max_degree || degree_v < 1 ||
      degree_v > KnotVector::max_degree) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {} and {}, expected 1..{}", degree_u, degree_v, KnotVector::max_degree), "degree");
  }
  if (grid.rows > max_side || grid.columns > max_side || grid.rows * grid.columns != grid.points.size()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} points for {} rows and {} columns", grid.points.size(), grid.rows,
                                  grid.columns),
                      "points");
  }
  if (grid.rows <= static_cast<std::size_t>(degree_u) || grid.columns <= static_cast<std::size_t>(degree_v)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} rows and {} columns, expected at least {} and {}", grid.rows,
                                  grid.columns, degree_u + 1, degree_v + 1),
                      "points");
  }
  return detail::check_points(grid.points, "points");
}

/// Mean chord lengths along lines of `count` points `step` apart; the lines start `stride` apart.
Result<std::vector<double>> mean_parameters(std::span<const Vec3> points, std::size_t count, std::size_t step,
                                            std::size_t lines, std::size_t stride, const char* what) {
  std::vector<double> sums(count, 0.0);
  std::size_t used = 0;
  for (std::size_t line = 0; line < lines; ++line) {
    const auto at = [&](std::size_t k) -> const Vec3& { return points[line * stride + k * step]; };
    double length = 0;
    for (std::size_t k = 1; k < count; ++k) length += (at(k) - at(k - 1)).stableNorm();
    if (!(length > 0)) continue;
    ++used;
    double reached = 0;
    for (std::size_t k = 1; k < count; ++k) {
      reached += (at(k) - at(k - 1)).stableNorm();
      sums[k] += reached / length;
    }
  }
  for (std::size_t k = 1; k < count; ++k) {
    if (!(sums[k] > sums[k - 1])) {
      return make_error(ErrorCode::invalid_argument, fmt::format("{} {} and {} are the same", what, k - 1, k),
                        "points");
    }
  }
  for (double& sum : sums) sum /= static_cast<double>(used);
  sums.back() = 1;
  return sums;
}

struct Parameters {
  std::vector<double> u, v;
};

Result<Parameters> parameters_of(const PointGrid& grid) {
  auto u = mean_parameters(grid.points, grid.rows, grid.columns, grid.columns, 1, "rows");
  if (!u) return u.error();
  auto v = mean_parameters(grid.points, grid.columns, 1, grid.rows, grid.columns, "columns");
  if (!v) return v.error();
  return Parameters{*std::move(u), *std::move(v)};
}

/// [rows * columns][3] -> [columns][rows * 3].
Rows columns_first(const Vec3* points, std::size_t rows, std::size_t columns) {
  Rows out(static_cast<Eigen::Index>(columns), static_cast<Eigen::Index>(3 * rows));
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      out.row(static_cast<Eigen::Index>(c)).segment<3>(static_cast<Eigen::Index>(3 * r)) =
          points[r * columns + c].transpose();
    }
  }
  return out;
}

/// [count][rows * 3] -> [rows][count * 3].
Rows turned(const Rows& in) {
  Rows out(in.cols() / 3, in.rows() * 3);
  for (Eigen::Index i = 0; i < in.rows(); ++i) {
    for (Eigen::Index j = 0; j < out.rows(); ++j) out.row(j).segment<3>(3 * i) = in.row(i).segment<3>(3 * j);
  }
  return out;
}

BSplineSurface assembled(const KnotVector& u, const KnotVector& v, const Rows& control) {
  BSplineSurface surface{u, v, {}, {}};
  surface.control.reserve(static_cast<std::size_t>(control.size()) / 3);
  for (Eigen::Index i = 0; i < control.rows(); ++i) {
    for (Eigen::Index j = 0; j < control.cols(); j += 3) {
      surface.control.emplace_back(control.row(i).segment<3>(j).transpose());
    }
  }
  return surface;
}

/// The largest distance between data and the fit in each span, 0 where it is below `enough`.
std::vector<double> span_errors(const KnotVector& knots, std::span<const double> parameters,
                                const Rows& control, const Rows& data, double enough) {
  std::vector<double> errors(static_cast<std::size_t>(knots.function_count()), 0.0);
  const BasisTable table = tabulate(knots, parameters, 0);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    Eigen::RowVectorXd rest = data.row(static_cast<Eigen::Index>(k));
    const std::span<const double> values = table.at(k, 0);
    for (std::size_t j = 0; j < values.size(); ++j) {
      rest -= values[j] * control.row(table.first_function[k] + static_cast<Eigen::Index>(j));
    }
    double worst = 0;
    for (Eigen::Index m = 0; m < rest.size(); m += 3) worst = std::max(worst, rest.segment<3>(m).norm());
    double& error =
        errors[static_cast<std::size_t>(table.first_function[k]) + static_cast<std::size_t>(knots.degree())];
    if (worst > enough) error = std::max(error, worst);
  }
  return errors;
}

FitError error_of(const BSplineSurface& surface, const PointGrid& grid, const Parameters& parameters) {
  std::vector<Vec3> places;
  evaluate_grid(surface, parameters.u, parameters.v, places);
  FitError error;
  double squares = 0;
  for (std::size_t r = 0; r < grid.rows; ++r) {
    for (std::size_t c = 0; c < grid.columns; ++c) {
      const std::size_t i = r * grid.columns + c;
      Vec2 uv(parameters.u[r], parameters.v[c]);
      double distance = (places[i] - grid.points[i]).norm();
      // What is rounding stays it.
      constexpr double rounding = 1e-14;
      if (distance > rounding * grid.points[i].norm()) {
        distance = detail::distance_near(surface, grid.points[i], uv);
      }
      error.max_m = std::max(error.max_m, distance);
      squares += distance * distance;
    }
  }
  error.rms_m = std::sqrt(squares / static_cast<double>(grid.points.size()));
  return error;
}

/// Functions that `parameters` can tell apart, or the interpolating ones when that is all of them.
Result<KnotVector> refined(const KnotVector& knots, std::span<const double> parameters,
                           std::span<const double> wanted, std::size_t max_count) {
  const std::size_t most = std::min(max_count, parameters.size());
  const std::vector<double> inner =
      detail::halved_inner_knots(knots, parameters, wanted, static_cast<int>(most));
  if (!inner.empty()) return detail::clamped_knots(knots.degree(), knots.lower(), knots.upper(), inner);
  const bool asked = std::any_of(wanted.begin(), wanted.end(), [](double w) { return w > 0; });
  if (asked && parameters.size() <= max_count &&
      static_cast<std::size_t>(knots.control_count()) < parameters.size()) {
    return detail::averaged_knots(parameters, knots.degree());
  }
  return knots;
}

}  // namespace

Result<BSplineSurface> interpolate_grid(const PointGrid& grid, int degree_u, int degree_v) {
  if (const Status status = check_grid(grid, degree_u, degree_v); !status) return status.error();
  const Result<Parameters> parameters = parameters_of(grid);
  if (!parameters) return parameters.error();
  const Result<KnotVector> u = detail::averaged_knots(parameters->u, degree_u);
  if (!u) return u.error();
  const Result<KnotVector> v = detail::averaged_knots(parameters->v, degree_v);
  if (!v) return v.error();
  const Result<Rows> rows =
      detail::interpolate_rows(*v, parameters->v, columns_first(grid.points.data(), grid.rows, grid.columns));
  if (!rows) return rows.error();
  const Result<Rows> control = detail::interpolate_rows(*u, parameters->u, turned(*rows));
  if (!control) return control.error();
  return assembled(*u, *v, *control);
}

Result<SurfaceFit> approximate_grid(const PointGrid& grid, const BSplineFitOptions& options) {
  if (const Status status = detail::check_options(options); !status) return status.error();
  if (const Status status = check_grid(grid, options.degree_u, options.degree_v); !status)
    return status.error();
  const Result<Parameters> parameters = parameters_of(grid);
  if (!parameters) return parameters.error();
  Result<KnotVector> u = detail::clamped_knots(options.degree_u, 0, 1, {});
  Result<KnotVector> v = detail::clamped_knots(options.degree_v, 0, 1, {});
  if (!u) return u.error();
  if (!v) return v.error();
  const auto cap = static_cast<std::size_t>(options.max_control_points);
  if (static_cast<std::size_t>(u->control_count()) * static_cast<std::size_t>(v->control_count()) > cap) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, fewer than one patch of these degrees has", cap),
                      "options.max_control_points");
  }
  const Rows data = columns_first(grid.points.data(), grid.rows, grid.columns);
  std::optional<SurfaceFit> best;
  for (;;) {
    const Result<Rows> rows = detail::approximate_rows(*v, parameters->v, data);
    if (!rows) return best ? Result<SurfaceFit>(*std::move(best)) : rows.error();
    const Rows across = turned(*rows);
    const Result<Rows> control = detail::approximate_rows(*u, parameters->u, across);
    if (!control) return best ? Result<SurfaceFit>(*std::move(best)) : control.error();
    SurfaceFit fit{assembled(*u, *v, *control), {}, false};
    fit.error = error_of(fit.surface, grid, *parameters);
    fit.within_tolerance = fit.error.max_m <= options.tolerance_m;
    if (!best || fit.error.max_m < best->error.max_m) best = std::move(fit);
    if (best->within_tolerance) break;
    // The two directions' errors add up to no less than the whole: one exceeds half of the tolerance.
    const double enough = options.tolerance_m / 2;
    const auto in_v = span_errors(*v, parameters->v, *rows, data, enough);
    const auto in_u = span_errors(*u, parameters->u, *control, across, enough);
    const auto count_u = static_cast<std::size_t>(u->control_count());
    const auto count_v = static_cast<std::size_t>(v->control_count());
    v = refined(*v, parameters->v, in_v, cap / count_u);
    if (!v) return v.error();
    u = refined(*u, parameters->u, in_u, cap / static_cast<std::size_t>(v->control_count()));
    if (!u) return u.error();
    if (static_cast<std::size_t>(u->control_count()) == count_u &&
        static_cast<std::size_t>(v->control_count()) == count_v) {
      break;
    }
  }
  return *std::move(best);
}

}  // namespace handloft::geometry
