// The direct solver of stiffness_solver.h: Eigen's LDL^T, and substitutions of our own that take several
// columns through the factor at once (it is read from memory once for all) without their bits knowing it.

#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <new>

#include "server-model/geometry/stiffness_solver.h"

namespace handloft::geometry {

namespace {

/// A pivot below this part of its diagonal element has lost all its digits to rounding: something moves
/// without resistance. Plates of a thousand spans a side have 1e-6.
constexpr double smallest_pivot = 1e-13;

class DirectSolver final : public StiffnessSolver {
 public:
  static Result<std::unique_ptr<StiffnessSolver>> create(const Eigen::SparseMatrix<double>& k);

  Eigen::Index size() const override { return k_.rows(); }
  Result<Eigen::MatrixXd> solve(const Eigen::MatrixXd& f) const override;
  Report report() const override { return report_; }

 private:
  template <int lanes>
  void solve_columns(const Eigen::MatrixXd& f, Eigen::Index first, Eigen::MatrixXd& x) const;

  Eigen::SparseMatrix<double> k_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  Eigen::VectorXd pivots_;
  mutable std::vector<double> work_;
  mutable Report report_;
};

Result<std::unique_ptr<StiffnessSolver>> DirectSolver::create(const Eigen::SparseMatrix<double>& k) {
  auto solver = std::make_unique<DirectSolver>();
  solver->k_ = k;
  try {
    solver->factor_.compute(k);
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("no memory to factorise {} unknowns", k.rows()), "surface");
  }
  const auto loose = [] {
    return make_error(ErrorCode::failed_precondition,
                      "found parts that move without resistance, expected bending or stretching terms that "
                      "hold every control point to its neighbours",
                      "energy");
  };
  if (solver->factor_.info() != Eigen::Success) return loose();
  solver->pivots_ = solver->factor_.vectorD();
  const auto& place = solver->factor_.permutationP().indices();
  for (Eigen::Index i = 0; i < k.rows(); ++i) {
    const double pivot = solver->pivots_[place[i]];
    if (!(pivot > smallest_pivot * k.coeff(i, i)) || !std::isfinite(pivot)) return loose();
  }
  return std::unique_ptr<StiffnessSolver>(std::move(solver));
}

// Interleaved: lane l of unknown i at work[i * lanes + l]. Each lane goes through the same operations in the
// same order whatever its neighbours are; subtracting a product with zero changes nothing, so that a row may
// be skipped when all lanes are zero there (most are, while a place's few functions go down the tree).
template <int lanes>
void DirectSolver::solve_columns(const Eigen::MatrixXd& f, Eigen::Index first, Eigen::MatrixXd& x) const {
  const Eigen::Index n = size();
  const auto& place = factor_.permutationP().indices();
  const Eigen::SparseMatrix<double>& lower = factor_.matrixL().nestedExpression();
  const int* start = lower.outerIndexPtr();
  const int* rows = lower.innerIndexPtr();
  const double* values = lower.valuePtr();
  work_.resize(static_cast<std::size_t>(n * lanes));
  double* work = work_.data();
  for (Eigen::Index i = 0; i < n; ++i)
    for (int l = 0; l < lanes; ++l) work[place[i] * lanes + l] = f(i, first + l) + 0.0;  // No -0.
  std::array<double, lanes> here;
  for (Eigen::Index j = 0; j < n; ++j) {
    bool any = false;
    for (int l = 0; l < lanes; ++l) {
      here[static_cast<std::size_t>(l)] = work[j * lanes + l];
      any = any || here[static_cast<std::size_t>(l)] != 0;
    }
    if (!any) continue;
    for (int p = start[j]; p < start[j + 1]; ++p) {
      if (rows[p] == j) continue;  // The unit diagonal, where it is kept.
      double* below = work + static_cast<Eigen::Index>(rows[p]) * lanes;
      for (int l = 0; l < lanes; ++l) below[l] -= values[p] * here[static_cast<std::size_t>(l)];
    }
  }
  for (Eigen::Index j = n; j-- > 0;) {
    for (int l = 0; l < lanes; ++l) here[static_cast<std::size_t>(l)] = work[j * lanes + l] / pivots_[j];
    for (int p = start[j]; p < start[j + 1]; ++p) {
      if (rows[p] == j) continue;
      const double* below = work + static_cast<Eigen::Index>(rows[p]) * lanes;
      for (int l = 0; l < lanes; ++l) here[static_cast<std::size_t>(l)] -= values[p] * below[l];
    }
    for (int l = 0; l < lanes; ++l) work[j * lanes + l] = here[static_cast<std::size_t>(l)];
  }
  for (Eigen::Index i = 0; i < n; ++i)
    for (int l = 0; l < lanes; ++l) x(i, first + l) = work[place[i] * lanes + l];
}

Result<Eigen::MatrixXd> DirectSolver::solve(const Eigen::MatrixXd& f) const {
  if (f.rows() != size())
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} rows, expected {}", f.rows(), size()), "f");
  if (!f.allFinite())
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "f");
  Eigen::MatrixXd x(f.rows(), f.cols());
  Eigen::Index column = 0;
  for (; column + 4 <= f.cols(); column += 4) solve_columns<4>(f, column, x);
  for (; column + 2 <= f.cols(); column += 2) solve_columns<2>(f, column, x);
  for (; column < f.cols(); ++column) solve_columns<1>(f, column, x);
  report_ = {};
  for (column = 0; column < f.cols(); ++column) {
    const double size = f.col(column).norm();
    if (size > 0)
      report_.relative_residual =
          std::max(report_.relative_residual, (k_ * x.col(column) - f.col(column)).norm() / size);
  }
  return x;
}

Status check_points(const std::vector<std::uint32_t>& points, std::size_t count, const char* field) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i] >= count || (i > 0 && points[i] <= points[i - 1]))
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found point {}, expected ascending ones below {}", points[i], count),
                        fmt::format("{}[{}]", field, i));
  }
  return {};
}

std::size_t place_in(const std::vector<std::uint32_t>& sorted, std::uint32_t value) {
  return static_cast<std::size_t>(std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin());
}

}  // namespace

UnknownGrid grid_of(const std::vector<std::uint32_t>& unknowns, const KnotVector& v) {
  UnknownGrid grid;
  const auto columns = static_cast<std::uint32_t>(v.control_count());
  std::vector<bool> seen(columns, false);
  for (const std::uint32_t point : unknowns) {
    if (grid.rows.empty() || grid.rows.back() != point / columns) grid.rows.push_back(point / columns);
    seen[point % columns] = true;
  }
  for (std::uint32_t j = 0; j < columns; ++j)
    if (seen[j]) grid.columns.push_back(j);
  grid.full = grid.rows.size() * grid.columns.size() == unknowns.size();
  return grid;
}

std::vector<std::uint32_t> unknowns(const StiffnessProblem& problem) {
  const std::vector<std::uint32_t> movable = movable_points(problem.u, problem.v, problem.supports);
  std::vector<std::uint32_t> rest;
  std::set_difference(movable.begin(), movable.end(), problem.held.begin(), problem.held.end(),
                      std::back_inserter(rest));
  return rest;
}

Eigen::SparseMatrix<double> principal_part(const Eigen::SparseMatrix<double>& k,
                                           const std::vector<std::uint32_t>& points) {
  std::vector<Eigen::Index> place(static_cast<std::size_t>(k.rows()), -1);
  for (std::size_t i = 0; i < points.size(); ++i) place[points[i]] = static_cast<Eigen::Index>(i);
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::SparseMatrix<double> part(n, n);
  part.reserve(k.nonZeros());
  for (Eigen::Index column = 0; column < n; ++column) {
    part.startVec(column);
    for (Eigen::SparseMatrix<double>::InnerIterator at(k, points[static_cast<std::size_t>(column)]); at;
         ++at) {
      const Eigen::Index row = place[static_cast<std::size_t>(at.row())];
      if (row >= 0) part.insertBack(row, column) = at.value();
    }
  }
  part.finalize();
  return part;
}

Result<std::unique_ptr<StiffnessSolver>> make_direct_solver(const Eigen::SparseMatrix<double>& k) {
  if (k.rows() == 0 || k.rows() != k.cols())
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} x {}, expected a square matrix of unknowns", k.rows(), k.cols()),
                      "supports");
  if (static_cast<std::size_t>(k.rows()) > max_direct_unknowns)
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} unknowns, expected at most {}", k.rows(), max_direct_unknowns),
                      "surface");
  return DirectSolver::create(k);
}

Result<std::unique_ptr<StiffnessSolver>> make_direct_solver(const StiffnessProblem& problem) {
  if (const Status status = check(problem.energy); !status) return status.error();
  const auto count = static_cast<std::size_t>(problem.u.control_count()) *
                     static_cast<std::size_t>(problem.v.control_count());
  if (const Status status = check_points(problem.held, count, "held"); !status) return status.error();
  if (const Status status = check_points(problem.grounded, count, "grounded"); !status) return status.error();
  const std::vector<std::uint32_t> points = unknowns(problem);
  if (points.size() > max_direct_unknowns)
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} unknowns, expected at most {}", points.size(), max_direct_unknowns), "surface");
  // Of the rows and columns of control points that have unknowns alone: a small region of a large surface.
  const UnknownGrid grid = grid_of(points, problem.v);
  Eigen::SparseMatrix<double> k = stiffness(problem.u, problem.v, problem.energy, grid.rows, grid.columns);
  if (!grid.full) {
    std::vector<std::uint32_t> places;
    places.reserve(points.size());
    const auto columns = static_cast<std::uint32_t>(problem.v.control_count());
    for (const std::uint32_t point : points)
      places.push_back(static_cast<std::uint32_t>(place_in(grid.rows, point / columns) * grid.columns.size() +
                                                  place_in(grid.columns, point % columns)));
    k = principal_part(k, places);
  }
  for (const std::uint32_t point : problem.grounded) {
    const auto at = std::lower_bound(points.begin(), points.end(), point);
    if (at == points.end() || *at != point)
      return make_error(ErrorCode::invalid_argument, fmt::format("found point {}, which is held", point),
                        "grounded");
    k.coeffRef(at - points.begin(), at - points.begin()) += problem.ground_stiffness;
  }
  return make_direct_solver(k);
}

}  // namespace handloft::geometry
