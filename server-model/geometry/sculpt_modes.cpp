#include "server-model/geometry/sculpt_modes.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

namespace handloft::geometry {

namespace {

/// Conditions that weigh less than this part of the heaviest are rounding. Two held neighbours among a
/// thousand leave a hinge of 1e-6.
constexpr double least_condition = 1e-10;

using Vec4 = Eigen::Vector4d;
using Mat4 = Eigen::Matrix4d;

/// Where a control value acts, 0..1 of its direction; 0 of periodic ones, which have no linear functions.
std::vector<double> places(const KnotVector& knots) {
  std::vector<double> at(static_cast<std::size_t>(knots.control_count()), 0.0);
  if (knots.is_periodic()) return at;
  for (int i = 0; i < knots.control_count(); ++i)
    at[static_cast<std::size_t>(i)] = (knots.greville(i) - knots.lower()) / knots.length();
  return at;
}

void demand(Mat4& conditions, const Vec4& zero) {
  conditions += zero * zero.transpose();
}

// What the energy demands of the coefficients of 1, s, t, s t (s, t: 0..1 along u and v).
Mat4 energy_conditions(const KnotVector& u, const KnotVector& v, const SculptEnergy& energy) {
  Mat4 conditions = Mat4::Zero();
  const std::array<Vec4, 4> unit{Vec4::Unit(0), Vec4::Unit(1), Vec4::Unit(2), Vec4::Unit(3)};
  if (u.is_periodic() || v.is_periodic() || energy.b12 > 0) demand(conditions, unit[3]);
  if (u.is_periodic()) demand(conditions, unit[1]);
  if (v.is_periodic()) demand(conditions, unit[2]);
  if (energy.a11 > 0 || energy.a22 > 0) {
    demand(conditions, unit[3]);
    constexpr double rounding = 1e-12;
    const double product = energy.a11 * energy.a22;
    if (product - energy.a12 * energy.a12 > rounding * product) {
      demand(conditions, unit[1]);
      demand(conditions, unit[2]);
    } else {  // Stretched in one direction only.
      const double along_u = std::sqrt(energy.a11) / u.length();
      const double along_v = std::copysign(std::sqrt(energy.a22), energy.a12) / v.length();
      demand(conditions, Vec4(0, along_u, along_v, 0).normalized());
    }
  }
  return conditions;
}

// `functions` has the candidates at every control point, a row each.
Eigen::MatrixXd modes_of(Mat4 conditions, const Eigen::MatrixX4d& functions,
                         const std::vector<std::uint32_t>& unknowns) {
  std::size_t next = 0;
  for (Eigen::Index i = 0; i < functions.rows(); ++i) {
    if (next < unknowns.size() && unknowns[next] == static_cast<std::uint32_t>(i))
      ++next;
    else
      demand(conditions, functions.row(i).transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Mat4> eigen(conditions);
  const double heaviest = std::max(1.0, eigen.eigenvalues()[3]);
  int count = 0;
  while (count < 4 && eigen.eigenvalues()[count] <= least_condition * heaviest) ++count;
  const auto n = static_cast<Eigen::Index>(unknowns.size());
  count = static_cast<int>(std::min<Eigen::Index>(count, n));
  if (count == 0) return Eigen::MatrixXd(n, 0);
  Eigen::MatrixXd modes(n, count);
  for (Eigen::Index i = 0; i < n; ++i)
    modes.row(i) =
        functions.row(unknowns[static_cast<std::size_t>(i)]) * eigen.eigenvectors().leftCols(count);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(modes);
  return qr.householderQ() * Eigen::MatrixXd::Identity(n, count);
}

}  // namespace

Eigen::MatrixXd free_modes(const KnotVector& u, const KnotVector& v, const SculptEnergy& energy,
                           const std::vector<std::uint32_t>& unknowns) {
  const std::vector<double> s = places(u);
  const std::vector<double> t = places(v);
  Eigen::MatrixX4d functions(static_cast<Eigen::Index>(s.size() * t.size()), 4);
  Eigen::Index row = 0;
  for (const double a : s)
    for (const double b : t) functions.row(row++) << 1, a, b, a * b;
  return modes_of(energy_conditions(u, v, energy), functions, unknowns);
}

Eigen::MatrixXd free_modes(const KnotVector& knots, double alpha, [[maybe_unused]] double beta,
                           const std::vector<std::uint32_t>& unknowns) {
  Mat4 conditions = Mat4::Zero();
  demand(conditions, Vec4::Unit(2));
  demand(conditions, Vec4::Unit(3));
  if (alpha > 0 || knots.is_periodic()) demand(conditions, Vec4::Unit(1));
  const std::vector<double> s = places(knots);
  Eigen::MatrixX4d functions(static_cast<Eigen::Index>(s.size()), 4);
  for (std::size_t i = 0; i < s.size(); ++i) functions.row(static_cast<Eigen::Index>(i)) << 1, s[i], 0, 0;
  return modes_of(conditions, functions, unknowns);
}

std::vector<std::uint32_t> tie_points(const Eigen::MatrixXd& modes) {
  std::vector<std::uint32_t> points;
  if (modes.cols() == 0) return points;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> order(modes.transpose());
  for (Eigen::Index i = 0; i < modes.cols(); ++i)
    points.push_back(static_cast<std::uint32_t>(order.colsPermutation().indices()[i]));
  std::sort(points.begin(), points.end());
  return points;
}

}  // namespace handloft::geometry
