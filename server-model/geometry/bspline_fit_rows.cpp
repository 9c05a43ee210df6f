// The linear algebra of fitting one direction, and the checks that all fits share.
#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "server-model/geometry/bspline_fit_detail.h"
#include "server-model/geometry/fit_checks.h"

namespace handloft::geometry::detail {
namespace {

/// Beyond this a solution is no interpolation: the parameters lie too close together. Of the data's size.
constexpr double interpolation_tolerance = 1e-6;

Eigen::SparseMatrix<double> collocation(const KnotVector& knots, std::span<const double> parameters) {
  const BasisTable table = tabulate(knots, parameters, 0);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(table.values.size());
  for (std::size_t k = 0; k < table.size(); ++k) {
    const std::span<const double> values = table.at(k, 0);
    for (std::size_t j = 0; j < values.size(); ++j) {
      if (values[j] == 0) continue;
      entries.emplace_back(static_cast<int>(k), table.first_function[k] + static_cast<int>(j), values[j]);
    }
  }
  Eigen::SparseMatrix<double> matrix(static_cast<int>(parameters.size()), knots.control_count());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Whether each function can be given a parameter of its own inside its support (Schoenberg and Whitney).
bool determined(std::span<const double> knots, int degree, std::span<const double> parameters) {
  const auto p = static_cast<std::size_t>(degree);
  const std::size_t count = knots.size() - p - 1;
  std::size_t next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    // The ends' functions reach their ends.
    while (next < parameters.size() && i > 0 && parameters[next] <= knots[i]) ++next;
    if (next == parameters.size()) return false;
    if (i + 1 < count && parameters[next] >= knots[i + p + 1]) return false;
    ++next;
  }
  return true;
}

}  // namespace

Status check_options(const BSplineFitOptions& o) {
  const auto bad = [](const char* field, double found, const char* expected) -> Status {
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected {}", found, expected),
                      fmt::format("options.{}", field));
  };
  if (o.degree_u < 1 || o.degree_u > KnotVector::max_degree) return bad("degree_u", o.degree_u, "1..24");
  if (o.degree_v < 1 || o.degree_v > KnotVector::max_degree) return bad("degree_v", o.degree_v, "1..24");
  if (!(o.tolerance_m > 0) || !std::isfinite(o.tolerance_m)) {
    return bad("tolerance_m", o.tolerance_m, "a length above 0");
  }
  constexpr int most = 1'000'000;
  if (o.max_control_points < 1 || o.max_control_points > most) {
    return bad("max_control_points", o.max_control_points, "1..1000000");
  }
  if (!(o.smoothing > 0) || !std::isfinite(o.smoothing)) return bad("smoothing", o.smoothing, "above 0");
  constexpr int most_spans = 1000;
  if (o.first_spans_u < 1 || o.first_spans_u > most_spans)
    return bad("first_spans_u", o.first_spans_u, "1..1000");
  if (o.first_spans_v < 1 || o.first_spans_v > most_spans)
    return bad("first_spans_v", o.first_spans_v, "1..1000");
  constexpr int most_corrections = 100;
  if (o.parameter_corrections < 0 || o.parameter_corrections > most_corrections) {
    return bad("parameter_corrections", o.parameter_corrections, "0..100");
  }
  return {};
}

Status check_points(std::span<const Vec3> points, const char* field) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(points[i].cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= max_coordinate_m)) {
      return make_error(ErrorCode::invalid_argument, "found a coordinate that is no finite length",
                        fmt::format("{}[{}]", field, i));
    }
  }
  return {};
}

Result<KnotVector> clamped_knots(int degree, double lower, double upper, std::span<const double> inner) {
  const std::size_t order = static_cast<std::size_t>(degree) + 1;
  std::vector<double> knots(order, lower);
  knots.insert(knots.end(), inner.begin(), inner.end());
  knots.insert(knots.end(), order, upper);
  return KnotVector::open(degree, std::move(knots));
}

std::vector<double> inner_knots(const KnotVector& knots) {
  const auto order = knots.degree() + 1;
  return {knots.knots().begin() + order, knots.knots().end() - order};
}

Result<KnotVector> averaged_knots(std::span<const double> parameters, int degree) {
  const auto p = static_cast<std::size_t>(degree);
  std::vector<double> inner;
  for (std::size_t j = 1; j + p < parameters.size(); ++j) {
    double sum = 0;
    for (std::size_t k = j; k < j + p; ++k) sum += parameters[k];
    inner.push_back(sum / static_cast<double>(p));
  }
  return clamped_knots(degree, parameters.front(), parameters.back(), inner);
}

Result<Rows> interpolate_rows(const KnotVector& knots, std::span<const double> parameters, const Rows& data) {
  const Eigen::SparseMatrix<double> matrix = collocation(knots, parameters);
  Eigen::SparseLU<Eigen::SparseMatrix<double>> factor;
  factor.compute(matrix);
  Rows control;
  if (factor.info() == Eigen::Success) {
    const Eigen::MatrixXd right = data;
    Eigen::MatrixXd found = factor.solve(right);
    // One step of refinement: the factor loses a few digits at high degrees.
    const Eigen::MatrixXd rest = right - matrix * found;
    found += Eigen::MatrixXd(factor.solve(rest));
    control = found;
  }
  const double size = data.rowwise().operator-(data.row(0)).cwiseAbs().maxCoeff();
  if (control.size() == 0 || !control.allFinite() ||
      !((matrix * control - data).cwiseAbs().maxCoeff() <= interpolation_tolerance * size)) {
    return make_error(ErrorCode::invalid_argument, "found points too close together to lie on one curve",
                      "points");
  }
  // To the bit: a clamped curve ends in its last control points.
  control.row(0) = data.row(0);
  control.row(control.rows() - 1) = data.row(data.rows() - 1);
  return control;
}

Result<Rows> approximate_rows(const KnotVector& knots, std::span<const double> parameters, const Rows& data) {
  const Eigen::Index n = knots.control_count();
  if (n == data.rows()) return interpolate_rows(knots, parameters, data);
  const Eigen::SparseMatrix<double> all = collocation(knots, parameters);
  Rows control(n, data.cols());
  control.row(0) = data.row(0);
  control.row(n - 1) = data.row(data.rows() - 1);
  if (n == 2) return control;
  const Eigen::SparseMatrix<double> matrix = all.middleCols(1, n - 2);
  const Eigen::MatrixXd rest = data - all.col(0) * control.row(0) - all.col(n - 1) * control.row(n - 1);
  const Eigen::SparseMatrix<double> normal = matrix.transpose() * matrix;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);
  if (factor.info() != Eigen::Success) {
    return make_error(ErrorCode::rank_deficient, "found too few points for the knots", "points");
  }
  const Eigen::MatrixXd right = matrix.transpose() * rest;
  Eigen::MatrixXd inner = factor.solve(right);
  inner += factor.solve(Eigen::MatrixXd(right - normal * inner));
  control.middleRows(1, n - 2) = inner;
  if (!control.allFinite()) {
    return make_error(ErrorCode::rank_deficient, "found too few points for the knots", "points");
  }
  return control;
}

std::vector<double> halved_inner_knots(const KnotVector& knots, std::span<const double> parameters,
                                       std::span<const double> wanted, int max_count) {
  std::vector<std::size_t> order;
  for (std::size_t s = 0; s < wanted.size(); ++s) {
    if (wanted[s] > 0) order.push_back(s);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return wanted[a] > wanted[b]; });
  std::vector<double> best = knots.knots();
  const std::size_t order_p = static_cast<std::size_t>(knots.degree()) + 1;
  const std::size_t old_size = best.size();
  for (const std::size_t s : order) {
    if (best.size() - order_p >= static_cast<std::size_t>(std::max(max_count, 0))) break;
    const double low = knots.knots()[s];
    const double high = knots.knots()[s + 1];
    const auto first = std::lower_bound(parameters.begin(), parameters.end(), low);
    const auto last =
        high == knots.upper() ? parameters.end() : std::lower_bound(first, parameters.end(), high);
    if (last - first < 2) continue;
    // Between the middle two, near to the span's middle if that has parameters on both sides.
    double middle = low + (high - low) / 2;
    if (!(*first < middle && *(last - 1) >= middle)) {
      const auto half = first + (last - first) / 2;
      middle = *(half - 1) + (*half - *(half - 1)) / 2;
    }
    if (!(middle > low && middle < high)) continue;
    std::vector<double> tried = best;
    tried.insert(std::upper_bound(tried.begin(), tried.end(), middle), middle);
    if (determined(tried, knots.degree(), parameters)) best = std::move(tried);
  }
  if (best.size() == old_size) return {};
  return {best.begin() + static_cast<std::ptrdiff_t>(order_p),
          best.end() - static_cast<std::ptrdiff_t>(order_p)};
}

namespace {

/// Newton steps before a foot point is good enough; each halved so often if it leads away.
constexpr int max_steps = 8, max_halvings = 4;

}  // namespace

double distance_near(const BSplineCurve& curve, const Vec3& place, double& u) {
  double best = (curve.evaluate(u) - place).norm();
  for (int step = 0; step < max_steps; ++step) {
    const auto c = curve.derivatives(u, 2);
    const Vec3 away = c[0] - place;
    const double slope = away.dot(c[1]);
    double bend = c[1].squaredNorm() + away.dot(c[2]);
    if (!(bend > 0)) bend = c[1].squaredNorm();
    double move = -slope / bend;
    bool nearer = false;
    for (int half = 0; half <= max_halvings && std::isfinite(move) && !nearer; ++half, move /= 2) {
      const double next = curve.knots.wrap(u + move);
      const double distance = (curve.evaluate(next) - place).norm();
      if (distance < best) {
        best = distance;
        u = next;
        nearer = true;
      }
    }
    if (!nearer) break;
  }
  return best;
}

double distance_near(const BSplineSurface& surface, const Vec3& place, Vec2& uv) {
  double best = (surface.evaluate(uv.x(), uv.y()) - place).norm();
  for (int step = 0; step < max_steps; ++step) {
    const SurfaceDerivatives d = surface.derivatives(uv.x(), uv.y(), 2);
    const Vec3 away = d.s - place;
    const Vec2 slope(away.dot(d.su), away.dot(d.sv));
    const double guu = d.su.squaredNorm(), guv = d.su.dot(d.sv), gvv = d.sv.squaredNorm();
    double a = guu + away.dot(d.suu), b = guv + away.dot(d.suv), c = gvv + away.dot(d.svv);
    if (!(a > 0 && a * c - b * b > 0)) {
      a = guu;
      b = guv;
      c = gvv;
    }
    const double determinant = a * c - b * b;
    Vec2 move = -Vec2(c * slope.x() - b * slope.y(), a * slope.y() - b * slope.x()) / determinant;
    bool nearer = false;
    for (int half = 0; half <= max_halvings && move.allFinite() && !nearer; ++half, move /= 2) {
      const Vec2 next(surface.u.wrap(uv.x() + move.x()), surface.v.wrap(uv.y() + move.y()));
      const double distance = (surface.evaluate(next.x(), next.y()) - place).norm();
      if (distance < best) {
        nearer = distance < best * (1 - 1e-6);
        best = distance;
        uv = next;
        if (!nearer) return best;
      }
    }
    if (!nearer) break;
  }
  return best;
}

}  // namespace handloft::geometry::detail
