// How a SculptSystem is made of a surface or a curve, and how its answers are checked.

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "server-model/geometry/bspline_refine.h"
#include "server-model/geometry/sculpt_modes.h"
#include "server-model/geometry/sculpt_system.h"

namespace handloft::geometry {

namespace {

/// Forces below this part of |K| |x| are what rounding makes of none.
constexpr double least_force = 1e-10;

/// Of the mean span, and of the whole: files have spans of 1e-11 of their range, and the energy of a bend
/// within one is more than the rest of the surface leaves digits for.
constexpr double least_span = 0.1, least_part = 1e-4;

/// The knots over which displacements are measured: spans too short for that count as longer ones. The same,
/// to the bit, where there are none.
KnotVector measurable(const KnotVector& knots) {
  const double mean = knots.length() / static_cast<double>(knots.spans().size());
  const double least = std::min(least_span * mean, least_part * knots.length());
  const std::vector<double>& from = knots.knots();
  std::vector<double> to{from.front()};
  bool any = false;
  for (std::size_t i = 1; i < from.size(); ++i) {
    const double step = from[i] - from[i - 1];
    const bool is_short = step > 0 && step < least;
    to.push_back(to.back() + (is_short ? least : step));
    any = any || is_short;
  }
  if (!any) return knots;
  Result<KnotVector> made = knots.is_periodic() ? KnotVector::periodic(knots.degree(), std::move(to))
                                                : KnotVector::open(knots.degree(), std::move(to));
  return made ? *std::move(made) : knots;
}

Error nothing_moves() {
  return make_error(ErrorCode::invalid_argument, "found no control point that may move", "supports");
}

std::vector<std::uint32_t> among(const std::vector<std::uint32_t>& unknowns,
                                 const std::vector<std::uint32_t>& places) {
  std::vector<std::uint32_t> points;
  points.reserve(places.size());
  for (const std::uint32_t place : places) points.push_back(unknowns[place]);
  return points;
}

/// Modes whose motion of the pins is, squared, below this part of the largest are left to others.
constexpr double least_pinned = 1e-12;

/// What pins leave of the free modes: combinations that move no pin, orthonormal.
Eigen::MatrixXd loose_modes(const Eigen::MatrixXd& modes, const std::vector<std::uint32_t>& unknowns,
                            const StiffnessPins& pins) {
  if (modes.cols() == 0) return modes;
  const auto row_of = [&](std::uint32_t point) {
    return std::lower_bound(unknowns.begin(), unknowns.end(), point) - unknowns.begin();
  };
  Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(modes.cols(), modes.cols());  // Gram matrix of pins' motions.
  const auto add = [&](const Eigen::RowVectorXd& motion) { moved += motion.transpose() * motion; };
  const auto count = static_cast<Eigen::Index>(unknowns.size());
  for (const std::uint32_t point : pins.points)
    if (const auto row = row_of(point); row < count && unknowns[static_cast<std::size_t>(row)] == point)
      add(modes.row(row));
  for (const SurfaceFunctional& pin : pins.rows) {
    Eigen::RowVectorXd motion = Eigen::RowVectorXd::Zero(modes.cols());
    for (std::size_t i = 0; i < pin.point.size() && i < pin.value.size(); ++i)
      if (const auto row = row_of(pin.point[i]);
          row < count && unknowns[static_cast<std::size_t>(row)] == pin.point[i])
        motion += pin.value[i] * modes.row(row);
    add(motion);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(moved);
  const double largest = eigen.eigenvalues()[modes.cols() - 1];
  Eigen::Index loose = 0;
  while (loose < modes.cols() && !(eigen.eigenvalues()[loose] > least_pinned * largest)) ++loose;
  return modes * eigen.eigenvectors().leftCols(loose);
}

}  // namespace

Result<SculptSystem> SculptSystem::create(const BSplineSurface& rest, const SculptSetup& setup,
                                          const IterativeOptions& iteration) {
  if (const Status status = check(rest); !status) return status.error();
  if (const Status status = check(setup.energy); !status) return status.error();
  BSplineSurface scaled = scaled_domain(rest);
  scaled.u = measurable(scaled.u);
  scaled.v = measurable(scaled.v);
  StiffnessProblem problem{scaled.u, scaled.v, setup.energy, setup.supports, {}, 0, setup.held};
  for (std::size_t i = 0; i < setup.held.size(); ++i)
    if (setup.held[i] >= rest.control.size() || (i > 0 && setup.held[i] <= setup.held[i - 1]))
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found control point {}, expected ascending ones below {}", setup.held[i],
                                    rest.control.size()),
                        fmt::format("held[{}]", i));
  std::vector<std::uint32_t> movable = unknowns(problem);
  if (movable.empty()) return nothing_moves();
  Eigen::MatrixXd modes = free_modes(scaled.u, scaled.v, setup.energy, movable);
  problem.grounded = among(movable, tie_points(modes));
  const SculptEnergy& energy = setup.energy;
  problem.ground_stiffness =
      (energy.b11 + 2 * energy.b12 + energy.b22) / (scaled.u.length() * scaled.v.length()) + energy.a11 +
      energy.a22;
  const StiffnessProduct product(scaled.u, scaled.v, setup.energy);
  if (!setup.pins.empty()) {
    modes = loose_modes(modes, movable, setup.pins);
    const std::vector<std::uint32_t> tied = among(movable, tie_points(modes));
    problem.grounded.insert(problem.grounded.end(), tied.begin(), tied.end());
    std::sort(problem.grounded.begin(), problem.grounded.end());
    problem.grounded.erase(std::unique(problem.grounded.begin(), problem.grounded.end()),
                           problem.grounded.end());
    Result<std::unique_ptr<PinnedSolver>> pinned = make_pinned_solver(problem, setup.pins, tied, iteration);
    if (!pinned) return pinned.error();
    Result<SculptSystem> system =
        finish(rest.control, setup.mode, std::move(movable), std::move(*pinned), std::move(modes), product);
    if (!system) return system;
    system->pin_count_ = setup.pins.size();
    system->parallel_ = iteration.parallel;
    return system;
  }
  Result<std::unique_ptr<StiffnessSolver>> solver = make_stiffness_solver(problem, iteration);
  if (!solver) return solver.error();
  Result<SculptSystem> system =
      finish(rest.control, setup.mode, std::move(movable), std::move(*solver), std::move(modes), product);
  if (system) system->parallel_ = iteration.parallel;
  return system;
}

Result<SculptSystem> SculptSystem::create(const BSplineCurve& rest, const CurveSculptSetup& setup) {
  if (const Status status = check(rest); !status) return status.error();
  if (!(setup.alpha >= 0) || !(setup.beta >= 0) || !std::isfinite(setup.alpha + setup.beta) ||
      !(setup.alpha + setup.beta > 0))
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found alpha {}, beta {}, expected finite ones of at least 0, not both 0",
                                  setup.alpha, setup.beta),
                      "energy");
  double length = 0;
  for (std::size_t i = 1; i < rest.control.size(); ++i)
    length += (rest.control[i] - rest.control[i - 1]).norm();
  if (rest.knots.is_periodic()) length += (rest.control.front() - rest.control.back()).norm();
  // Derivatives by a parameter that is `length` long instead of the knots'.
  const double stretch = length > 0 ? rest.knots.length() / length : 1;
  const double alpha = setup.alpha * stretch;
  const double beta = setup.beta * stretch * stretch * stretch;
  const auto count = static_cast<std::uint32_t>(rest.knots.control_count());
  const std::uint32_t lower = rest.knots.is_periodic() ? 0 : static_cast<std::uint32_t>(setup.lower);
  const std::uint32_t upper = rest.knots.is_periodic() ? 0 : static_cast<std::uint32_t>(setup.upper);
  std::vector<std::uint32_t> movable;
  for (std::uint32_t i = lower; i + upper < count; ++i) movable.push_back(i);
  if (movable.empty()) return nothing_moves();
  Eigen::MatrixXd modes = free_modes(rest.knots, setup.alpha, setup.beta, movable);
  const Eigen::SparseMatrix<double> all = curve_stiffness(rest.knots, alpha, beta);
  Eigen::SparseMatrix<double> k = principal_part(all, movable);
  const double domain = rest.knots.length();
  for (const std::uint32_t tie : tie_points(modes))
    k.coeffRef(tie, tie) += alpha / domain + beta / (domain * domain * domain);
  Result<std::unique_ptr<StiffnessSolver>> solver = make_direct_solver(k);
  if (!solver) return solver.error();
  return finish(rest.control, setup.mode, std::move(movable), std::move(*solver), std::move(modes),
                [all](const Eigen::VectorXd& x) -> Eigen::VectorXd { return all * x; });
}

Result<SculptSystem> SculptSystem::finish(std::vector<Vec3> rest, SculptMode mode,
                                          std::vector<std::uint32_t> unknowns,
                                          std::unique_ptr<StiffnessSolver> solver, Eigen::MatrixXd modes,
                                          Product product) {
  SculptSystem system;
  system.columns_ = SculptColumns(std::move(solver), unknowns, rest.size(), std::move(modes));
  system.rest_ = std::move(rest);
  system.unknowns_ = std::move(unknowns);
  system.product_ = std::move(product);
  Vec3 lower = system.rest_.front();
  Vec3 upper = lower;
  for (const Vec3& point : system.rest_) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  // |K|, from the roughest displacement.
  Eigen::VectorXd rough(static_cast<Eigen::Index>(system.rest_.size()));
  for (Eigen::Index i = 0; i < rough.size(); ++i) rough[i] = i % 2 == 0 ? 1 : -1;
  system.stiffness_norm_ = system.product_(rough).norm() / rough.norm();
  if ((upper - lower).norm() > 0) system.extent_m_ = (upper - lower).norm();
  if (mode == SculptMode::absolute_fairing) {
    // x = rest + y: K y = F - K rest on the unknowns.
    const auto count = static_cast<Eigen::Index>(system.rest_.size());
    system.own_load_.resize(static_cast<Eigen::Index>(system.unknowns_.size()), 3);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Eigen::VectorXd coordinate(count);
      for (Eigen::Index i = 0; i < count; ++i)
        coordinate[i] = system.rest_[static_cast<std::size_t>(i)][axis];
      const Eigen::VectorXd force = system.product_(coordinate);
      for (std::size_t i = 0; i < system.unknowns_.size(); ++i)
        system.own_load_(static_cast<Eigen::Index>(i), axis) = -force[system.unknowns_[i]];
    }
    const Result<Eigen::MatrixXd> response = system.columns_.solve(system.own_load_);
    if (!response) return response.error();
    system.own_response_ = *response;
  }
  return system;
}

SculptResidual SculptSystem::residual(std::span<const SculptRow> rows, std::span<const SculptLoad> loads,
                                      const SculptSolution& solution) const {
  const auto n = static_cast<Eigen::Index>(unknowns_.size());
  Eigen::MatrixX3d force = Eigen::MatrixX3d::Zero(n, 3);
  Eigen::MatrixX3d holding = Eigen::MatrixX3d::Zero(n, 3);
  const auto add = [this](const SurfaceFunctional& functional, const Vec3& by, Eigen::MatrixX3d& to) {
    for (std::size_t i = 0; i < functional.point.size(); ++i) {
      const auto at = std::lower_bound(unknowns_.begin(), unknowns_.end(), functional.point[i]);
      if (at != unknowns_.end() && *at == functional.point[i])
        to.row(at - unknowns_.begin()) += functional.value[i] * by.transpose();
    }
  };
  for (const SculptLoad& load : loads) add(load.functional, load.force, force);
  if (own_load_.rows() > 0) force += own_load_;
  SculptResidual result;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    add(rows[i].functional, solution.reactions[i], holding);
    Vec3 value = rows[i].yield * solution.reactions[i] - rows[i].target;
    double magnitude = 0;
    for (std::size_t k = 0; k < rows[i].functional.point.size(); ++k) {
      value += rows[i].functional.value[k] * solution.control[rows[i].functional.point[k]];
      magnitude += std::abs(rows[i].functional.value[k]);
    }
    const double off = rows[i].along ? std::abs(rows[i].along->stableNormalized().dot(value)) : value.norm();
    if (magnitude > 0) result.constraints = std::max(result.constraints, off / (magnitude * extent_m_));
  }
  Eigen::MatrixX3d out_of_balance = -(force + holding);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    Eigen::VectorXd moved = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rest_.size()));
    for (Eigen::Index i = 0; i < n; ++i)
      moved[unknowns_[static_cast<std::size_t>(i)]] = solution.displacement(i, axis);
    const Eigen::VectorXd inner = product_(moved);
    for (Eigen::Index i = 0; i < n; ++i)
      out_of_balance(i, axis) += inner[unknowns_[static_cast<std::size_t>(i)]];
  }
  if (columns_.pinned() != nullptr) {
    Eigen::MatrixXd left = out_of_balance;
    columns_.pinned()->release(left);
    holding += Eigen::MatrixX3d(out_of_balance - left);
    out_of_balance = left;
  }
  // Where there are no forces but rounding's (a body that moves as a whole), of what K could make of it.
  const double all = force.norm() + holding.norm();
  const double most = stiffness_norm_ * solution.displacement.norm();
  const double measure = all > least_force * most ? all : most;
  if (out_of_balance.norm() > 0) result.stationarity = out_of_balance.norm() / measure;
  return result;
}

}  // namespace handloft::geometry
