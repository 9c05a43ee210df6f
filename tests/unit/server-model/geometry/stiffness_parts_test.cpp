// The parts of the iterative solver: loops, band matrices, the bordered factor, the product, the
// preconditioner.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "server-model/geometry/bordered_cholesky.h"
#include "server-model/geometry/mode_preconditioner.h"
#include "server-model/geometry/stiffness_axis.h"
#include "server-model/geometry/stiffness_loops.h"
#include "tests/unit/server-model/geometry/stiffness_problems.h"

namespace handloft::geometry {
namespace {

std::vector<double> numbers(std::size_t count, double seed) {
  std::vector<double> result(count);
  for (std::size_t i = 0; i < count; ++i)
    result[i] = std::sin(seed + 1.7 * static_cast<double>(i * i % 1009));
  return result;
}

// X2: whatever the width of the registers, the bits are those of the plain sums.
TEST(StiffnessLoops, AddInTheOrderThatIsWritten) {
  const StiffnessLoops& loops = stiffness_loops();
  constexpr std::size_t depth = 37;
  const std::vector<double> a = numbers(depth * panel_lanes, 1), b = numbers(depth * block_columns, 2);
  std::vector<double> c = numbers(panel_lanes * block_columns, 3), expected = c;
  loops.multiply(a.data(), b.data(), depth, c.data());
  for (std::size_t j = 0; j < block_columns; ++j)
    for (std::size_t k = 0; k < depth; ++k)
      for (std::size_t i = 0; i < panel_lanes; ++i)
        expected[j * panel_lanes + i] += a[k * panel_lanes + i] * b[k * block_columns + j];
  EXPECT_EQ(c, expected);

  for (const std::size_t length : {1U, 7U, 8U, 29U}) {
    const std::vector<double> rows = numbers(3 * length, 4), weights = {0.3, -2.0, 1.1},
                              in = numbers(length + 2, 5);
    const std::vector<const double*> starts = {rows.data(), rows.data() + length, rows.data() + 2 * length};
    std::vector<double> out(length), band = numbers(length, 6), sum(length), added = band;
    loops.combine(starts.data(), weights.data(), 3, length, out.data());
    loops.add_band(starts.data(), 3, in.data(), length, band.data());
    for (std::size_t j = 0; j < length; ++j) {
      sum[j] = weights[0] * rows[j] + weights[1] * rows[length + j] + weights[2] * rows[2 * length + j];
      for (std::size_t d = 0; d < 3; ++d) added[j] += rows[d * length + j] * in[j + d];
    }
    EXPECT_EQ(out, sum);
    EXPECT_EQ(band, added);
  }
}

TEST(BorderedCholesky, SolvesAsADenseFactor) {
  for (const std::size_t border : {0U, 2U, 5U, 9U}) {
    constexpr std::size_t size = 9, reach = 2;
    const std::vector<double> entries = numbers(size * size, 7);
    BorderedCholesky<double> factor(size, reach, border);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = factor.start(i); j <= i; ++j) {
        const double value = i == j ? 9.0 : entries[i * size + j];
        factor.at(i, j) = value;
        dense(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = value;
        dense(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = value;
      }
    }
    ASSERT_TRUE(factor.factor());
    Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(size, -1, 2);
    const Eigen::VectorXd expected = dense.ldlt().solve(x);
    factor.solve(x.data());
    EXPECT_LE((x - expected).norm(), 1e-14);
  }
  BorderedCholesky<double> indefinite(2, 1, 0);
  indefinite.at(0, 0) = indefinite.at(1, 1) = 1;
  indefinite.at(1, 0) = 2;
  EXPECT_FALSE(indefinite.factor());
}

struct Parts {
  StiffnessProblem problem;
  StiffnessAxis u, v;
};
std::vector<Parts> some_parts() {
  std::vector<Parts> result;
  const auto add = [&](const KnotVector& u, const KnotVector& v, const char* sides) {
    const SculptSupports supports = supports_of(sides);
    result.push_back({{u, v, {0.3, -0.2, 0.4, 1.5, 0.8, 0.6}, supports},
                      stiffness_axis(u, supports.u_lower, supports.u_upper),
                      stiffness_axis(v, supports.v_lower, supports.v_upper)});
  };
  add(graded_knots(3, 12, 5), graded_knots(2, 17, 1), "csfc");
  add(graded_knots(3, 12, 5, true), graded_knots(5, 9, 1), "fffs");
  add(graded_knots(4, 9, 1), graded_knots(3, 6, 2, true), "scff");
  return result;
}

TEST(StiffnessOperator, D3IsTheMatrix) {
  for (const Parts& parts : some_parts()) {
    const StiffnessOperator k(parts.u, parts.v, parts.problem.energy, {{3, 2.5}});
    Eigen::SparseMatrix<double> matrix = principal_part(
        stiffness(parts.problem.u, parts.problem.v, parts.problem.energy), unknowns(parts.problem));
    matrix.coeffRef(3, 3) += 2.5;
    ASSERT_EQ(k.size(), static_cast<std::size_t>(matrix.rows()));
    const std::vector<double> x = numbers(k.size(), 8);
    std::vector<double> y(k.size()), bound(k.size()), size(x);
    k.apply(x, y, run_in_turn);
    for (double& value : size) value = std::abs(value);
    k.absolute().apply(size, bound, run_in_turn);
    const Eigen::VectorXd expected =
        matrix * Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
    for (std::size_t i = 0; i < y.size(); ++i) {
      EXPECT_NEAR(y[i], expected[static_cast<Eigen::Index>(i)], 1e-14 * bound[i]);
      EXPECT_LE(std::abs(y[i]), bound[i]);
    }
  }
}

// Symmetric, positive, and as near to K as the header says: P^-1 K has its eigenvalues in about 0.5 .. 3.
TEST(ModePreconditioner, IsSymmetricPositiveAndLikeK) {
  for (const Parts& parts : some_parts()) {
    SculptEnergy energy = parts.problem.energy;
    energy.a12 = 0;
    const auto preconditioner = ModePreconditioner::create(parts.u, parts.v, energy, {}, run_in_turn);
    ASSERT_TRUE(preconditioner.ok()) << preconditioner.error().describe();
    const StiffnessOperator k(parts.u, parts.v, energy, {});
    const auto n = static_cast<Eigen::Index>(k.size());
    Eigen::MatrixXd inverse(n, n), stiffness_matrix(n, n);
    std::vector<double> unit(k.size()), image(k.size());
    for (Eigen::Index column = 0; column < n; ++column) {
      std::fill(unit.begin(), unit.end(), 0.0);
      unit[static_cast<std::size_t>(column)] = 1;
      preconditioner->apply(unit, image, run_in_turn);
      inverse.col(column) = Eigen::Map<const Eigen::VectorXd>(image.data(), n);
      k.apply(unit, image, run_in_turn);
      stiffness_matrix.col(column) = Eigen::Map<const Eigen::VectorXd>(image.data(), n);
    }
    EXPECT_LE((inverse - inverse.transpose()).cwiseAbs().maxCoeff(), 1e-11 * inverse.cwiseAbs().maxCoeff());
    const Eigen::MatrixXd symmetric = (inverse + inverse.transpose()) / 2;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
        symmetric, (stiffness_matrix + stiffness_matrix.transpose()) / 2,
        Eigen::ABx_lx | Eigen::EigenvaluesOnly);
    EXPECT_GT(eigen.eigenvalues().minCoeff(), 0.5);
    EXPECT_LT(eigen.eigenvalues().maxCoeff(), 3);
  }
}

}  // namespace
}  // namespace handloft::geometry
