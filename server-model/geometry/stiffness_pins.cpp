#include "server-model/geometry/stiffness_pins.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <new>
#include <optional>
#include <utility>

#include "server-model/geometry/stiffness_iteration.h"

namespace handloft::geometry {

namespace {

using Vector = std::vector<double>;

/// Where a row's part of movable control points is less than this, it is one of held points.
constexpr double least_grip = 1e-9;
/// So often a projection is repeated on what it left, at most, until that is less than this part.
constexpr int refinements = 3;
constexpr double well = 1e-9;

/// Marks what is within `reach` places of a mark, along one direction of a grid; round where it is cyclic.
std::vector<bool> spread(const std::vector<bool>& marks, std::size_t count, std::size_t stride,
                         std::size_t other_count, std::size_t other_stride, std::size_t reach, bool cyclic) {
  std::vector<bool> result(marks.size(), false);
  for (std::size_t line = 0; line < other_count; ++line) {
    const std::size_t base = line * other_stride;
    for (std::size_t i = 0; i < count; ++i) {
      if (!marks[base + i * stride]) continue;
      for (std::size_t step = 0; step <= 2 * reach; ++step) {
        if (i + step < reach && !cyclic) continue;
        std::size_t at = i + step + (cyclic ? count * (reach / count + 1) : 0) - reach;
        if (cyclic) at %= count;
        if (at < count) result[base + at * stride] = true;
      }
    }
  }
  return result;
}

class ProjectedSolver final : public PinnedSolver {
 public:
  ProjectedSolver(IterationParts parts, const IterativeOptions& options)
      : points_(std::move(parts.points)),
        k_(std::move(parts.k)),
        preconditioner_(std::move(parts.preconditioner)),
        options_(options),
        sums_(k_.size(), options.parallel) {}

  Status pin(const StiffnessProblem& problem, const StiffnessPins& pins);

  Eigen::Index size() const override { return static_cast<Eigen::Index>(k_.size()); }
  Result<Eigen::MatrixXd> solve(const Eigen::MatrixXd& f) const override;
  Result<Eigen::MatrixXd> follow(const Eigen::MatrixXd& values) const override;
  Report report() const override { return {residual_, iterations_}; }
  const std::vector<std::size_t>& dependent() const override { return dependent_; }
  double freedom(const std::vector<Eigen::Index>& at, const std::vector<double>& value) const override;
  void release(Eigen::MatrixXd& forces) const override;

 private:
  /// A part of a row that its pinned points tell: `weight` times the value of a pin.
  struct Known {
    std::size_t pin;
    double weight;
  };

  Result<Report> solve_column(std::span<const double> f, const Eigen::VectorXd& values, Vector& x) const;
  int reduce(Vector& r, double target_part, double size, int iterations, Vector& x) const;
  Eigen::VectorXd project(Vector& r, Vector& z) const;
  Eigen::VectorXd project_well(Vector& r, Vector& z) const;
  void meet(const Eigen::VectorXd& values, Vector& x) const;
  void subtract(const Eigen::VectorXd& forces, std::span<double> from) const;

  std::vector<std::uint32_t> points_;
  StiffnessOperator k_;
  ModePreconditioner preconditioner_;
  IterativeOptions options_;
  ChunkedSums sums_;
  std::size_t pin_count_ = 0;
  std::vector<std::pair<std::size_t, std::size_t>> inner_;  // Unknown and pin: nothing loose is beside it.
  std::vector<bool> is_pinned_, is_inner_;                  // By unknown.
  std::vector<SparseRow> c_;                                // The rows that bear.
  std::vector<std::size_t> pin_of_;                         // By row of C.
  std::vector<std::vector<Known>> known_;                   // By row of C.
  ModeRows modes_;
  ConstraintFactor factor_;
  std::vector<std::size_t> dependent_;
  mutable std::atomic<double> residual_ = 0;
  mutable std::atomic<int> iterations_ = 0;
};

// Pinned points that have only pinned ones within the functions' reach do not touch the rest of the surface:
// they are put where they belong, and only the others bear.
Status ProjectedSolver::pin(const StiffnessProblem& problem, const StiffnessPins& pins) {
  pin_count_ = pins.size();
  const auto columns = static_cast<std::size_t>(problem.v.control_count());
  const auto rows = static_cast<std::size_t>(problem.u.control_count());
  const std::size_t none = points_.size();
  std::vector<std::size_t> place(rows * columns, none), pin_at(rows * columns, pin_count_);
  for (std::size_t i = 0; i < points_.size(); ++i) place[points_[i]] = i;
  std::vector<bool> loose(rows * columns, false);
  for (const std::uint32_t point : points_) loose[point] = true;
  is_pinned_.assign(points_.size(), false);
  is_inner_ = is_pinned_;
  for (std::size_t k = 0; k < pins.points.size(); ++k) {
    const std::uint32_t point = pins.points[k];
    if (point >= place.size() || (k > 0 && point <= pins.points[k - 1]))
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found point {}, expected ascending ones below {}", point, place.size()),
                        fmt::format("pins.points[{}]", k));
    loose[point] = false;
    pin_at[point] = k;
    if (place[point] == none) {
      dependent_.push_back(k);
    } else {
      is_pinned_[place[point]] = true;
    }
  }
  const auto degree_u = static_cast<std::size_t>(problem.u.degree());
  const auto degree_v = static_cast<std::size_t>(problem.v.degree());
  const std::vector<bool> beside =
      spread(spread(loose, columns, 1, rows, columns, degree_v, problem.v.is_periodic()), rows, columns,
             columns, 1, degree_u, problem.u.is_periodic());
  for (std::size_t k = 0; k < pins.points.size(); ++k) {
    const std::size_t at = place[pins.points[k]];
    if (at == none) continue;
    if (beside[pins.points[k]]) {
      c_.push_back({{at}, {1.0}});
      known_.emplace_back();
      pin_of_.push_back(k);
    } else {
      inner_.emplace_back(at, k);
      is_inner_[at] = true;
    }
  }
  for (std::size_t k = 0; k < pins.rows.size(); ++k) {
    const SurfaceFunctional& row = pins.rows[k];
    if (row.point.size() != row.value.size())
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found {} values of {} control points", row.value.size(), row.point.size()),
          fmt::format("pins.rows[{}]", k));
    SparseRow grip;
    std::vector<Known> known;
    double gripped = 0, all = 0;
    for (std::size_t i = 0; i < row.point.size(); ++i) {
      if (row.point[i] >= place.size() || (i > 0 && row.point[i] <= row.point[i - 1]) ||
          !std::isfinite(row.value[i]))
        return make_error(ErrorCode::invalid_argument,
                          fmt::format("found {} of point {}, expected ascending ones below {}, finite",
                                      row.value[i], row.point[i], place.size()),
                          fmt::format("pins.rows[{}]", k));
      const std::size_t at = place[row.point[i]];
      all += std::abs(row.value[i]);
      if (at == none) continue;
      if (is_inner_[at]) {
        known.push_back({pin_at[row.point[i]], row.value[i]});
        continue;
      }
      if (!is_pinned_[at]) gripped += std::abs(row.value[i]);
      grip.at.push_back(at);
      grip.value.push_back(row.value[i]);
    }
    if (!(gripped > least_grip * all)) {
      dependent_.push_back(pins.points.size() + k);
      continue;
    }
    c_.push_back(std::move(grip));
    known_.push_back(std::move(known));
    pin_of_.push_back(pins.points.size() + k);
  }
  if (c_.size() > max_pins)
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} places on curves and along borders of regions, expected at most {}", c_.size(),
                    max_pins),
        "pins");
  std::vector<bool> soft;  // A curve has more places than the surface can meet.
  soft.reserve(c_.size());
  for (const std::size_t pin : pin_of_) soft.push_back(pin >= pins.points.size());
  modes_ = preconditioner_.rows(c_);
  factor_ = ConstraintFactor(preconditioner_.gram(modes_, options_.parallel),
                             Eigen::MatrixXd(static_cast<Eigen::Index>(c_.size()), 0), std::move(soft));
  for (const Eigen::Index row : factor_.dependent())
    dependent_.push_back(pin_of_[static_cast<std::size_t>(row)]);
  std::sort(dependent_.begin(), dependent_.end());
  return {};
}

void ProjectedSolver::subtract(const Eigen::VectorXd& forces, std::span<double> from) const {
  for (std::size_t row = 0; row < c_.size(); ++row)
    for (std::size_t i = 0; i < c_[row].at.size(); ++i)
      from[c_[row].at[i]] -= forces[static_cast<Eigen::Index>(row)] * c_[row].value[i];
}

// r -= C^T l such that C P^-1 r = 0, z = P^-1 r; returns l.
Eigen::VectorXd ProjectedSolver::project(Vector& r, Vector& z) const {
  const Eigen::MatrixXd no_loads(0, 1);
  const auto bear = [&](const Eigen::VectorXd& values) -> Eigen::VectorXd {
    return factor_.solve(values, no_loads).rows;
  };
  Eigen::VectorXd forces = preconditioner_.apply_bearing(r, modes_, bear, z, options_.parallel);
  subtract(forces, r);
  return forces;
}

// The same to as many digits as the forces have. The bands of the preconditioner are those of bending beams,
// whose condition goes with the fourth power of the knots' number: what a thousand of them bear comes out
// with six digits, and what is left is projected again (Gould, Hribar and Nocedal refine alike).
Eigen::VectorXd ProjectedSolver::project_well(Vector& r, Vector& z) const {
  Eigen::VectorXd forces = project(r, z);
  for (int again = 0; again < refinements; ++again) {
    const Eigen::VectorXd more = project(r, z);
    forces += more;
    if (!(more.norm() > well * forces.norm())) break;
  }
  return forces;
}

// x += what takes its rows to the values, with the least energy to the preconditioner.
void ProjectedSolver::meet(const Eigen::VectorXd& values, Vector& x) const {
  for (int again = 0; again <= refinements; ++again) {
    Eigen::VectorXd off = values, size = values.cwiseAbs();
    for (std::size_t row = 0; row < c_.size(); ++row) {
      const auto at = static_cast<Eigen::Index>(row);
      for (std::size_t i = 0; i < c_[row].at.size(); ++i) {
        const double part = c_[row].value[i] * x[c_[row].at[i]];
        off[at] -= part;
        size[at] += std::abs(part);
      }
    }
    for (const Eigen::Index row : factor_.dependent()) off[row] = 0;
    if (!(off.norm() > well * size.norm())) return;
    Vector forces(k_.size(), 0.0), by(k_.size());
    subtract(-Eigen::VectorXd(factor_.solve(off, Eigen::MatrixXd(0, 1)).rows), forces);
    preconditioner_.apply(forces, by, options_.parallel);
    sums_.in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) x[i] += by[i];
    });
  }
}

int ProjectedSolver::reduce(Vector& r, double target_part, double size, int iterations, Vector& x) const {
  Vector z(k_.size()), p(k_.size(), 0.0), q(k_.size());
  double rz = 0;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    project(r, z);
    if (sums_.norm(r) <= target_part * size) return iteration;
    const double next = sums_.dot(r, z);
    const double beta = iteration == 0 ? 0.0 : next / rz;
    rz = next;
    sums_.in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) p[i] = z[i] + beta * p[i];
    });
    k_.apply(p, q, options_.parallel);
    const double alpha = rz / sums_.dot(p, q);
    if (!std::isfinite(alpha) || !(alpha > 0)) return iteration + 1;
    sums_.in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) x[i] += alpha * p[i];
      for (std::size_t i = first; i < last; ++i) r[i] -= alpha * q[i];
    });
  }
  return iterations;
}

// `values` by row of C.
Result<StiffnessSolver::Report> ProjectedSolver::solve_column(std::span<const double> f,
                                                              const Eigen::VectorXd& values,
                                                              Vector& x) const {
  Report report;
  x.assign(k_.size(), 0.0);
  Vector r(k_.size()), z(k_.size());
  Vector best = x;
  double before = std::numeric_limits<double>::infinity(), best_size = 0;
  for (int restart = 0;; ++restart) {
    meet(values, x);
    k_.apply(x, r, options_.parallel);
    sums_.in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) r[i] = f[i] - r[i];
    });
    const Eigen::VectorXd forces = project_well(r, z);
    Vector borne(k_.size(), 0.0);
    subtract(forces, borne);
    const double size = sums_.norm(f) + sums_.norm(borne), residual = sums_.norm(r);
    if (!std::isfinite(size) || !std::isfinite(residual))
      return make_error(ErrorCode::invalid_argument, "found numbers too large to square", "f");
    if (!(residual < before)) {
      x = best;
      break;
    }
    const bool pays = residual < 0.5 * before;
    best = x;
    before = residual;
    best_size = size;
    if (residual <= options_.relative_residual * size || !pays || restart == max_restarts ||
        report.iterations >= options_.max_iterations)
      break;
    report.iterations +=
        reduce(r, 0.5 * options_.relative_residual, size, options_.max_iterations - report.iterations, x);
  }
  report.relative_residual = best_size > 0 ? before / best_size : 0.0;
  if (report.relative_residual > std::max(options_.relative_residual, options_.acceptable_residual) &&
      !(before <= rounding_units * rounding(k_, x, options_.parallel)))
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("found a residual of {:.3g} after {} iterations, expected {:.3g}: does "
                                  "anything hold the surface?",
                                  report.relative_residual, report.iterations, options_.relative_residual),
                      "f");
  return report;
}

Result<Eigen::MatrixXd> ProjectedSolver::solve(const Eigen::MatrixXd& f) const {
  if (f.rows() != size())
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} rows, expected {}", f.rows(), size()), "f");
  if (!f.allFinite())
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "f");
  Eigen::MatrixXd x(f.rows(), f.cols());
  Report all;
  for (Eigen::Index column = 0; column < f.cols(); ++column) {
    Vector force(f.col(column).data(), f.col(column).data() + f.rows()), moved;
    for (const auto& [at, pin] : inner_) force[at] = 0;
    const Result<Report> report =
        solve_column(force, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(c_.size())), moved);
    if (!report) return report.error();
    for (std::size_t i = 0; i < moved.size(); ++i)
      x(static_cast<Eigen::Index>(i), column) = is_pinned_[i] ? 0.0 : moved[i];
    all.relative_residual = std::max(all.relative_residual, report->relative_residual);
    all.iterations = std::max(all.iterations, report->iterations);
  }
  residual_ = all.relative_residual;
  iterations_ = all.iterations;
  return x;
}

Result<Eigen::MatrixXd> ProjectedSolver::follow(const Eigen::MatrixXd& values) const {
  if (values.rows() != static_cast<Eigen::Index>(pin_count_))
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} rows, expected {}", values.rows(), pin_count_), "values");
  if (!values.allFinite())
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "values");
  Eigen::MatrixXd x(size(), values.cols());
  Report all;
  const Vector nothing(k_.size(), 0.0);
  for (Eigen::Index column = 0; column < values.cols(); ++column) {
    const auto given = values.col(column);
    Eigen::VectorXd wanted(static_cast<Eigen::Index>(c_.size()));
    for (std::size_t row = 0; row < c_.size(); ++row) {
      double value = given[static_cast<Eigen::Index>(pin_of_[row])];
      for (const Known& part : known_[row]) value -= part.weight * given[static_cast<Eigen::Index>(part.pin)];
      wanted[static_cast<Eigen::Index>(row)] = value;
    }
    Vector moved;
    const Result<Report> report = solve_column(nothing, wanted, moved);
    if (!report) return report.error();
    for (std::size_t i = 0; i < moved.size(); ++i) x(static_cast<Eigen::Index>(i), column) = moved[i];
    for (const auto& [at, pin] : inner_)
      x(static_cast<Eigen::Index>(at), column) = given[static_cast<Eigen::Index>(pin)];
    for (std::size_t row = 0; row < c_.size(); ++row)  // Exact, where the projection is so but for rounding.
      if (known_[row].empty() && c_[row].at.size() == 1 && is_pinned_[c_[row].at.front()])
        x(static_cast<Eigen::Index>(c_[row].at.front()), column) = wanted[static_cast<Eigen::Index>(row)];
    all.relative_residual = std::max(all.relative_residual, report->relative_residual);
    all.iterations = std::max(all.iterations, report->iterations);
  }
  residual_ = all.relative_residual;
  iterations_ = all.iterations;
  return x;
}

double ProjectedSolver::freedom(const std::vector<Eigen::Index>& at, const std::vector<double>& value) const {
  Vector force(k_.size(), 0.0), moved(k_.size());
  for (std::size_t i = 0; i < at.size(); ++i)
    if (!is_pinned_[static_cast<std::size_t>(at[i])]) force[static_cast<std::size_t>(at[i])] = value[i];
  const Vector given = force;
  preconditioner_.apply(force, moved, options_.parallel);
  const double all = sums_.dot(given, moved);
  project_well(force, moved);
  return all > 0 ? std::max(0.0, sums_.dot(given, moved) / all) : 0.0;
}

void ProjectedSolver::release(Eigen::MatrixXd& forces) const {
  Vector z(k_.size());
  for (Eigen::Index column = 0; column < forces.cols(); ++column) {
    auto force = forces.col(column);
    for (std::size_t i = 0; i < is_pinned_.size(); ++i)
      if (is_pinned_[i]) force[static_cast<Eigen::Index>(i)] = 0;
    Vector left(force.data(), force.data() + force.size());
    project_well(left, z);
    for (std::size_t i = 0; i < left.size(); ++i)
      force[static_cast<Eigen::Index>(i)] = is_pinned_[i] ? 0.0 : left[i];
  }
}

}  // namespace

bool StiffnessPins::operator==(const StiffnessPins& other) const {
  return points == other.points && std::equal(rows.begin(), rows.end(), other.rows.begin(), other.rows.end(),
                                              [](const SurfaceFunctional& a, const SurfaceFunctional& b) {
                                                return a.point == b.point && a.value == b.value;
                                              });
}

Result<std::unique_ptr<PinnedSolver>> make_pinned_solver(const StiffnessProblem& problem,
                                                         const StiffnessPins& pins,
                                                         const std::vector<std::uint32_t>& loose,
                                                         const IterativeOptions& options) {
  try {
    Result<IterationParts> parts = iteration_parts(problem, loose, options);
    if (!parts) return parts.error();
    auto solver = std::make_unique<ProjectedSolver>(std::move(*parts), options);
    if (const Status status = solver->pin(problem, pins); !status) return status.error();
    return std::unique_ptr<PinnedSolver>(std::move(solver));
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::resource_exhausted, "no memory for a surface this large", "surface");
  }
}

}  // namespace handloft::geometry
