#pragma once
// Problems for the tests of the stiffness solvers: knots equal or graded, all supports, loads.

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "server-model/geometry/stiffness_solver.h"

namespace handloft::geometry {

/// Spans over [0, 1] that grow from the first to the last by `ratio`.
inline KnotVector graded_knots(int degree, int control_count, double ratio, bool periodic = false) {
  const int spans = periodic ? control_count : control_count - degree;
  std::vector<double> ends = {0.0};
  for (int i = 0; i < spans; ++i)
    ends.push_back(ends.back() + std::pow(ratio, i / std::max(1.0, spans - 1.0)));
  for (double& end : ends) end /= ends.back();
  ends.back() = 1;
  std::vector<double> knots;
  for (int k = degree; k > 0; --k)
    knots.push_back(periodic ? ends[static_cast<std::size_t>(spans - k)] - 1 : 0.0);
  knots.insert(knots.end(), ends.begin(), ends.end());
  for (int k = 1; k <= degree; ++k) knots.push_back(periodic ? 1 + ends[static_cast<std::size_t>(k)] : 1.0);
  return (periodic ? KnotVector::periodic(degree, std::move(knots))
                   : KnotVector::open(degree, std::move(knots)))
      .value();
}

/// "csff": clamped and supported along u, free along v.
inline SculptSupports supports_of(const std::string& sides) {
  const auto support = [&](std::size_t i) {
    return sides[i] == 'f' ? Support::free : sides[i] == 's' ? Support::supported : Support::clamped;
  };
  return {support(0), support(1), support(2), support(3)};
}

/// Tied at four control points in about the corners.
inline void ground(StiffnessProblem& problem, double stiffness) {
  const auto rows = static_cast<std::uint32_t>(problem.u.control_count()),
             columns = static_cast<std::uint32_t>(problem.v.control_count());
  problem.grounded = {0, columns - 1, (rows - 1) * columns, rows * columns - 1};
  problem.ground_stiffness = stiffness;
}

/// A point load somewhat off the middle, spread over three by three control points.
inline Eigen::VectorXd point_load(const StiffnessProblem& problem) {
  const std::vector<std::uint32_t> points = unknowns(problem);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(points.size()));
  const std::array<double, 3> weights = {1.0 / 6, 2.0 / 3, 1.0 / 6};
  const int rows = problem.u.control_count(), columns = problem.v.control_count();
  const int first_row = static_cast<int>(0.37 * rows), first_column = static_cast<int>(0.61 * columns);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const auto point = static_cast<std::uint32_t>((first_row + static_cast<int>(i)) * columns +
                                                    first_column + static_cast<int>(j));
      const auto at = std::lower_bound(points.begin(), points.end(), point);
      if (at != points.end() && *at == point) f[at - points.begin()] = weights[i] * weights[j];
    }
  }
  return f;
}

/// Tasks on two threads, odd ones on the other.
inline void on_two_threads(std::size_t count, const std::function<void(std::size_t)>& task) {
  std::thread other([&] {
    for (std::size_t i = 1; i < count; i += 2) task(i);
  });
  for (std::size_t i = 0; i < count; i += 2) task(i);
  other.join();
}

}  // namespace handloft::geometry
