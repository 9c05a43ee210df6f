// The sculpting energy's matrix (D2, D3) against hand values and against what plates and polynomials demand.

#include "server-model/geometry/sculpt_energy.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>

namespace handloft::geometry {
namespace {

KnotVector uneven_knots(int degree) {
  std::vector<double> knots(static_cast<std::size_t>(degree) + 1, 0.0);
  for (const double inner : {0.1, 0.35, 0.4, 0.8}) knots.push_back(inner);
  knots.insert(knots.end(), static_cast<std::size_t>(degree) + 1, 1.0);
  return KnotVector::open(degree, knots).value();
}

Eigen::VectorXd greville(const KnotVector& knots) {
  Eigen::VectorXd places(knots.control_count());
  for (int i = 0; i < knots.control_count(); ++i) places[i] = knots.greville(i);
  return places;
}

// Control values of f(u) g(v) in the order of a surface's control points.
Eigen::VectorXd product(const Eigen::VectorXd& f, const Eigen::VectorXd& g) {
  Eigen::VectorXd all(f.size() * g.size());
  for (Eigen::Index i = 0; i < f.size(); ++i) all.segment(i * g.size(), g.size()) = f[i] * g;
  return all;
}

TEST(SculptEnergy, GramMatricesOfHatFunctionsAreTheKnownOnes) {  // Hand values: linear elements of length h.
  const KnotVector knots = KnotVector::uniform(1, 5).value();
  const double h = 0.25;
  const Eigen::MatrixXd mass = gram_matrix(knots, 0, 0);
  EXPECT_NEAR(mass(0, 0), h / 3, 1e-16);
  EXPECT_NEAR(mass(2, 2), 2 * h / 3, 1e-16);
  EXPECT_NEAR(mass(2, 3), h / 6, 1e-16);
  EXPECT_EQ(mass(1, 3), 0);
  const Eigen::MatrixXd slope = gram_matrix(knots, 1, 1);
  EXPECT_NEAR(slope(2, 2), 2 / h, 1e-13);
  EXPECT_NEAR(slope(2, 3), -1 / h, 1e-13);
  const Eigen::MatrixXd mixed = gram_matrix(knots, 1, 0);
  EXPECT_NEAR(mixed(2, 3), -0.5, 1e-15);  // N2' is -1/h where N3 is there, whose integral is h / 2.
  EXPECT_NEAR(mixed(3, 2), 0.5, 1e-15);
}

TEST(SculptEnergy, GaussRuleIsExactForEveryDegree) {  // The mass of all products is the domain's length.
  for (int degree = 1; degree <= KnotVector::max_degree; ++degree) {
    const KnotVector knots = KnotVector::uniform(degree, degree + 4).value();
    const Eigen::SparseMatrix<double> mass = gram_matrix(knots, 0, 0);
    EXPECT_NEAR(mass.sum(), 1, 1e-12) << degree;
    if (degree < 2) continue;
    // u^2 has the second derivative 2 everywhere: control values by blossoming.
    Eigen::VectorXd square(knots.control_count());
    for (int i = 0; i < knots.control_count(); ++i) {
      double sum = 0;
      for (int a = 1; a <= degree; ++a)
        for (int b = a + 1; b <= degree; ++b)
          sum +=
              knots.knots()[static_cast<std::size_t>(i + a)] * knots.knots()[static_cast<std::size_t>(i + b)];
      square[i] = 2 * sum / (degree * (degree - 1.0));
    }
    EXPECT_NEAR(square.dot(gram_matrix(knots, 2, 2) * square), 4, 1e-8) << degree;
    EXPECT_NEAR(square.dot(gram_matrix(knots, 1, 1) * square), 4.0 / 3, 1e-10) << degree;
    EXPECT_NEAR(square.dot(mass * square), 0.2, 1e-12) << degree;
  }
}

TEST(SculptEnergy, StiffnessIsSymmetricToTheBitAndPositiveSemidefinite) {  // D3
  SculptEnergy energy;
  energy.a11 = 0.3;
  energy.a12 = -0.1;
  energy.b22 = 2;
  for (const bool periodic : {false, true}) {
    const KnotVector u = periodic ? KnotVector::uniform_periodic(3, 5).value() : uneven_knots(3);
    const KnotVector v = uneven_knots(2);
    const Eigen::MatrixXd k = stiffness(u, v, energy);
    EXPECT_TRUE((k.array() == k.transpose().array()).all());
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(k);
    EXPECT_GT(eigen.eigenvalues()[0], -1e-12 * eigen.eigenvalues().tail(1)[0]);
    EXPECT_GT(eigen.eigenvalues()[1], 1e-9 * eigen.eigenvalues().tail(1)[0]) << "only constants are free";
  }
}

TEST(SculptEnergy, WithoutMembraneTheNullSpaceIsTheThreeLinearFunctions) {  // D3
  SculptEnergy plate;
  plate.a11 = plate.a22 = 0;
  const KnotVector u = uneven_knots(3);
  const KnotVector v = uneven_knots(3);
  const Eigen::MatrixXd k = stiffness(u, v, plate);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(k);
  const double largest = eigen.eigenvalues().tail(1)[0];
  EXPECT_LT(std::abs(eigen.eigenvalues()[2]), 1e-13 * largest);
  EXPECT_GT(eigen.eigenvalues()[3], 1e-8 * largest);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(u.control_count());
  EXPECT_LT((k * product(greville(u), one)).norm(), 1e-12 * largest);
  EXPECT_LT((k * product(one, greville(v))).norm(), 1e-12 * largest);
}

TEST(SculptEnergy, EveryTermWeighsItsIntegral) {  // D2: w = u v and w = u^2 over [0,1]^2, one term at a time.
  const KnotVector u = KnotVector::uniform(2, 3).value();  // Bezier: u has 0, 1/2, 1; u^2 has 0, 0, 1.
  Eigen::VectorXd linear(3);
  linear << 0, 0.5, 1;
  Eigen::VectorXd square(3);
  square << 0, 0, 1;
  const Eigen::VectorXd twisted = product(linear, linear);
  const Eigen::VectorXd bent = product(square, Eigen::VectorXd::Ones(3));
  const auto energy_of = [&](SculptEnergy energy, const Eigen::VectorXd& x) -> double {
    return x.dot(stiffness(u, u, energy) * x);
  };
  EXPECT_NEAR(energy_of({1, 0, 0, 0, 0, 0}, twisted), 1.0 / 3, 1e-14);  // v^2
  EXPECT_NEAR(energy_of({0, 0, 1, 0, 0, 0}, twisted), 1.0 / 3, 1e-14);
  EXPECT_NEAR(energy_of({0, 1, 0, 0, 0, 0}, twisted), 0.5, 1e-14);  // 2 a12 u v
  EXPECT_NEAR(energy_of({0, 0, 0, 0, 1, 0}, twisted), 2, 1e-13);    // 2 b12
  EXPECT_NEAR(energy_of({0, 0, 0, 1, 0, 0}, bent), 4, 1e-13);
  EXPECT_NEAR(energy_of({0, 0, 0, 0, 0, 1}, bent), 0, 1e-13);
  EXPECT_NEAR(energy_of({0, 0, 0, 0, 0, 1}, product(Eigen::VectorXd::Ones(3), square)), 4, 1e-13);
}

TEST(SculptEnergy, ProductWithoutMatrixIsTheMatrix) {
  SculptEnergy energy;
  energy.a12 = 0.02;
  energy.b11 = 0.5;
  const KnotVector u = KnotVector::uniform_periodic(3, 9).value();
  const KnotVector v = uneven_knots(4);
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  Eigen::VectorXd x(u.control_count() * v.control_count());
  for (double& value : x) value = normal(random);
  const Eigen::VectorXd direct = stiffness(u, v, energy) * x;
  EXPECT_LT((StiffnessProduct(u, v, energy)(x) - direct).norm(), 1e-13 * direct.norm());
}

TEST(SculptEnergy, CurveEnergyIsThatOfItsDerivatives) {  // D1: w = u^2 on [0,1]: alpha 4/3 + beta 4.
  const KnotVector knots = KnotVector::uniform(2, 3).value();
  Eigen::VectorXd square(3);
  square << 0, 0, 1;
  EXPECT_NEAR(square.dot(curve_stiffness(knots, 3, 0.5) * square), 3 * 4.0 / 3 + 0.5 * 4, 1e-13);
}

TEST(SculptEnergy, SupportsHoldTheirRows) {
  const KnotVector u = KnotVector::uniform(3, 6).value();
  const KnotVector v = KnotVector::uniform(3, 5).value();
  const SculptSupports supports{Support::clamped, Support::free, Support::supported, Support::clamped};
  const std::vector<std::uint32_t> movable = movable_points(u, v, supports);
  ASSERT_EQ(movable.size(), 4u * 2u);
  EXPECT_EQ(movable.front(), 2u * 5 + 1);
  EXPECT_EQ(movable.back(), 5u * 5 + 2);
  EXPECT_EQ(movable_points(KnotVector::uniform_periodic(3, 6).value(), v, supports).size(), 6u * 2u)
      << "a periodic direction has no sides";
}

TEST(SculptEnergy, RefusesWhatIsNoEnergy) {  // D2: a11 a22 >= a12^2, b >= 0
  EXPECT_TRUE(check(SculptEnergy{}).ok());
  for (const SculptEnergy& wrong :
       {SculptEnergy{1, 1.1, 1, 1, 1, 1}, SculptEnergy{1, 0, 1, -1, 1, 1}, SculptEnergy{0, 0, 0, 0, 0, 0},
        SculptEnergy{-1, 0, 1, 1, 1, 1}, SculptEnergy{1, 0, 1, 1, std::numeric_limits<double>::infinity(), 1},
        SculptEnergy{1, std::numeric_limits<double>::quiet_NaN(), 1, 1, 1, 1}}) {
    const Status status = check(wrong);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().field.rfind("energy.", 0), 0u) << status.error().describe();
  }
}

}  // namespace
}  // namespace handloft::geometry
