// The iterative solver for very large surfaces against the direct one, against plates (D3), and its promises:
// iterations that do not grow with the surface, bits that do not depend on threads or neighbours.

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/server-model/geometry/stiffness_problems.h"

namespace handloft::geometry {
namespace {

std::string failure(const Result<std::unique_ptr<StiffnessSolver>>& solver) {
  return solver.ok() ? "solved" : solver.error().describe();
}

// To 1e-6 of the largest displacement: K's condition is 1e8 here, its residual 1e-10.
void expect_as_direct(const StiffnessProblem& problem) {
  const auto direct = make_direct_solver(problem);
  ASSERT_TRUE(direct.ok()) << failure(direct);
  const auto iterative = make_iterative_solver(problem);
  ASSERT_TRUE(iterative.ok()) << failure(iterative);
  ASSERT_EQ((*iterative)->size(), (*direct)->size());
  Eigen::MatrixXd f(point_load(problem).size(), 2);
  f.col(0) = point_load(problem);
  for (Eigen::Index i = 0; i < f.rows(); ++i) f(i, 1) = std::sin(0.7 * static_cast<double>(i * i));
  const Result<Eigen::MatrixXd> expected = (*direct)->solve(f), found = (*iterative)->solve(f);
  ASSERT_TRUE(expected.ok()) << expected.error().describe();
  ASSERT_TRUE(found.ok()) << found.error().describe();
  for (Eigen::Index column = 0; column < 2; ++column) {
    const double size = expected->col(column).cwiseAbs().maxCoeff();
    EXPECT_GT(size, 0);
    EXPECT_LE((found->col(column) - expected->col(column)).cwiseAbs().maxCoeff(), 1e-6 * size);
  }
  // Or what the factor reaches: a surface that hangs from one side moves far, and rounding x alone shows.
  EXPECT_LE((*iterative)->report().relative_residual,
            std::max(1e-10, 10 * (*direct)->report().relative_residual));
  EXPECT_GT((*iterative)->report().iterations, 0);
}

TEST(StiffnessIterative, D3AgreesWithTheFactorForAllSupports) {
  for (int combination = 0; combination < 81; ++combination) {
    std::string sides;
    for (int i = 0, rest = combination; i < 4; ++i, rest /= 3) sides += "csf"[rest % 3];
    SCOPED_TRACE(sides);
    StiffnessProblem problem{graded_knots(3, 13, 3), graded_knots(3, 16, 10), {}, supports_of(sides)};
    if (sides == "ffff") ground(problem, 5);
    expect_as_direct(problem);
  }
}

TEST(StiffnessIterative, D3AgreesWithTheFactorForOtherDegreesAndEnergies) {
  for (int degree = 2; degree <= 5; ++degree) {
    for (const double ratio : {1.0, 10.0}) {
      for (const char* sides : {"cccc", "ffff", "csff"}) {
        SCOPED_TRACE(testing::Message() << "degree " << degree << " ratio " << ratio << " " << sides);
        StiffnessProblem problem{graded_knots(degree, 18, ratio),
                                 graded_knots(degree == 2 ? 3 : 2, 15, ratio),
                                 {0.3, 0.1, 0.2, 2.0, 0.5, 0.7},
                                 supports_of(sides)};
        if (std::string(sides) == "ffff") ground(problem, 5);
        expect_as_direct(problem);
      }
    }
  }
  SCOPED_TRACE("membrane");
  expect_as_direct({graded_knots(3, 14, 1), graded_knots(3, 17, 2), {1, 0, 2, 0, 0, 0}, supports_of("sfsf")});
}

TEST(StiffnessIterative, D3AgreesWithTheFactorOnRings) {
  for (int degree = 2; degree <= 5; ++degree) {
    for (const int count : {degree + 1, 2 * degree + 1, 2 * degree + 2, 23}) {
      SCOPED_TRACE(testing::Message() << "degree " << degree << ", " << count << " control values round");
      const KnotVector ring = graded_knots(degree, count, 2, true);
      expect_as_direct({ring, graded_knots(3, 15, 3), {}, supports_of("ffcf")});
      expect_as_direct({graded_knots(3, 15, 3), ring, {}, supports_of("csff")});
      StiffnessProblem torus{ring, graded_knots(3, 12, 1, true), {}, {}};
      ground(torus, 5);
      expect_as_direct(torus);
    }
  }
}

TEST(StiffnessIterative, AFewUnknownsAreSolvedToo) {
  expect_as_direct({graded_knots(3, 5, 1), graded_knots(3, 30, 1), {}, {}});  // One row may move.
  StiffnessProblem patch{graded_knots(3, 4, 1), graded_knots(3, 4, 1), {}, supports_of("ffff")};
  ground(patch, 1);
  expect_as_direct(patch);
}

// Iterations stay the same from 32 x 32 to 256 x 256, for equal knots and for graded ones.
TEST(StiffnessIterative, IterationsDoNotGrowWithTheSurface) {
  for (const double ratio : {1.0, 10.0}) {
    for (const auto& [sides, most] : {std::pair{"cccc", 11}, {"ssss", 6}, {"cfff", 18}, {"ffff", 20}}) {
      for (const int n : {32, 64, 128, 256}) {
        SCOPED_TRACE(testing::Message() << sides << " " << n << " ratio " << ratio);
        StiffnessProblem problem{
            graded_knots(3, n, ratio), graded_knots(3, n, ratio), {}, supports_of(sides)};
        if (std::string(sides) == "ffff") ground(problem, 10);
        IterativeOptions options;
        options.relative_residual = 1e-7;
        const auto solver = make_iterative_solver(problem, options);
        ASSERT_TRUE(solver.ok()) << failure(solver);
        const auto x = (*solver)->solve(point_load(problem));
        ASSERT_TRUE(x.ok()) << x.error().describe();
        EXPECT_LE((*solver)->report().relative_residual, 1e-7);
        EXPECT_LE((*solver)->report().iterations, most);
      }
    }
  }
}

KnotVector stretched(const KnotVector& knots, double factor) {
  std::vector<double> longer = knots.knots();
  for (double& knot : longer) knot *= factor;
  return KnotVector::open(knots.degree(), std::move(longer)).value();
}

// Nor with how long the surface is, how much it stretches and how firmly it is tied.
TEST(StiffnessIterative, IterationsDoNotGrowWithSlendernessStretchingOrTies) {
  IterativeOptions options;
  options.relative_residual = 1e-6;
  const auto expect_few = [&](const StiffnessProblem& problem, int most) {
    const auto solver = make_iterative_solver(problem, options);
    ASSERT_TRUE(solver.ok()) << failure(solver);
    const auto x = (*solver)->solve(point_load(problem));
    ASSERT_TRUE(x.ok()) << x.error().describe();
    EXPECT_LE((*solver)->report().iterations, most);
  };
  const KnotVector knots = graded_knots(3, 64, 1);
  for (const char* sides : {"cccc", "cfff", "ffcf", "sfsf", "ffff"}) {
    for (const double slenderness : {5.0, 30.0}) {
      for (const double stretching : {0.0, 1000.0}) {
        SCOPED_TRACE(testing::Message() << sides << " " << slenderness << " " << stretching);
        StiffnessProblem problem{
            stretched(knots, slenderness), knots, {stretching, 0, stretching, 1, 1, 1}, supports_of(sides)};
        if (std::string(sides) == "ffff") ground(problem, 10 / slenderness);
        expect_few(problem, 18);
      }
    }
  }
  for (const double stiffness : {0.01, 1.0, 100.0, 1e5}) {
    SCOPED_TRACE(stiffness);
    StiffnessProblem problem{knots, knots, {}, supports_of("ffff")};
    ground(problem, stiffness);
    expect_few(problem, stiffness > 1000 ? 40 : 18);
  }
}

// The centre of a plate on the unit square under unit pressure.
double plate_centre(int spans, const char* sides) {
  SculptEnergy plate;
  plate.a11 = plate.a22 = 0;
  const KnotVector knots = graded_knots(3, spans + 3, 1);
  const StiffnessProblem problem{knots, knots, plate, supports_of(sides)};
  const auto solver = make_iterative_solver(problem).value();
  const auto n = static_cast<std::size_t>(knots.control_count());
  std::vector<double> weight(n), value(n);
  for (std::size_t i = 0; i < n; ++i) weight[i] = (knots.knots()[i + 4] - knots.knots()[i]) / 4;
  std::array<double, 4> basis{};
  const int span = knots.span(0.5);
  basis_functions(knots, span, 0.5, 0, basis);
  for (std::size_t k = 0; k < 4; ++k) value[static_cast<std::size_t>(span) - 3 + k] = basis[k];
  const std::vector<std::uint32_t> points = unknowns(problem);
  Eigen::VectorXd f(solver->size()), centre(solver->size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    f[static_cast<Eigen::Index>(k)] = weight[points[k] / n] * weight[points[k] % n];
    centre[static_cast<Eigen::Index>(k)] = value[points[k] / n] * value[points[k] % n];
  }
  return centre.dot(solver->solve(f).value().col(0));
}

TEST(StiffnessIterative, D3PlatesConvergeWithOrderFourToTheirSolutions) {
  constexpr double supported = 0.004062352661, clamped = 0.00126531909;
  for (const auto& [sides, exact] : {std::pair{"ssss", supported}, {"cccc", clamped}}) {
    double before = plate_centre(8, sides) - exact;
    for (const int spans : {16, 32}) {
      const double error = plate_centre(spans, sides) - exact;
      EXPECT_GT(std::abs(before), 12 * std::abs(error)) << sides << " " << spans;
      EXPECT_LT(std::abs(error), 1e-7) << sides << " " << spans;
      before = error;
    }
    EXPECT_NEAR(plate_centre(128, sides), exact, 2e-11) << sides;
  }
}

TEST(StiffnessIterative, BitsDoNotDependOnThreadsOrNeighbours) {
  StiffnessProblem problem{graded_knots(3, 141, 4), graded_knots(4, 137, 1), {}, supports_of("ffff")};
  ground(problem, 10);
  IterativeOptions options;
  options.relative_residual = 1e-7;
  const auto one = make_iterative_solver(problem, options).value();
  options.parallel = on_two_threads;
  const auto two = make_iterative_solver(problem, options).value();
  Eigen::MatrixXd f(one->size(), 3);
  f.col(0) = point_load(problem);
  f.col(1).setZero();
  for (Eigen::Index i = 0; i < f.rows(); ++i) f(i, 2) = std::cos(static_cast<double>(i));
  const Eigen::MatrixXd x = one->solve(f).value();
  EXPECT_TRUE((x.array() == two->solve(f).value().array()).all());
  EXPECT_TRUE((x.col(2).array() == two->solve(f.col(2)).value().array()).all());
  EXPECT_TRUE((x.col(1).array() == 0).all());
  EXPECT_GT(x.col(0).norm(), 0);
}

TEST(StiffnessIterative, RefusesWhatItCannotSolve) {
  const KnotVector knots = graded_knots(3, 12, 1);
  const auto code = [](const StiffnessProblem& problem, const IterativeOptions& options = {}) {
    const auto solver = make_iterative_solver(problem, options);
    return solver.ok() ? ErrorCode::internal : solver.error().code;
  };
  StiffnessProblem problem{knots, knots, {}, supports_of("ffff")};
  EXPECT_EQ(code(problem), ErrorCode::failed_precondition);  // Nothing holds it.
  problem.supports = {};
  problem.held = {30};
  EXPECT_EQ(code(problem), ErrorCode::unsupported);
  problem.held.clear();
  for (const std::vector<std::uint32_t>& grounded :
       std::vector<std::vector<std::uint32_t>>{{0}, {60, 60}, {1000}}) {
    problem.grounded = grounded;
    problem.ground_stiffness = 1;
    EXPECT_EQ(code(problem), ErrorCode::invalid_argument);
  }
  problem.grounded = {60};
  for (const double stiffness : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    problem.ground_stiffness = stiffness;
    EXPECT_EQ(code(problem), ErrorCode::invalid_argument);
  }
  problem.grounded.clear();
  IterativeOptions options;
  for (const double residual : {0.0, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    options.relative_residual = residual;
    EXPECT_EQ(code(problem, options), ErrorCode::invalid_argument);
  }
  options = {};
  options.max_iterations = 0;
  EXPECT_EQ(code(problem, options), ErrorCode::invalid_argument);
  problem.energy.b11 = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(code(problem), ErrorCode::invalid_argument);
  EXPECT_EQ(code({graded_knots(3, 4, 1), knots, {}, {}}), ErrorCode::invalid_argument);  // All held.
  EXPECT_EQ(code({graded_knots(1, 3200, 1), graded_knots(1, 3200, 1), {}, {}}),
            ErrorCode::resource_exhausted);
}

TEST(StiffnessIterative, SaysWhenItsResidualIsNotReached) {
  const StiffnessProblem problem{graded_knots(3, 40, 1), graded_knots(3, 40, 1), {}, supports_of("cfff")};
  IterativeOptions options;
  options.max_iterations = 3;
  const auto solver = make_iterative_solver(problem, options).value();
  Eigen::MatrixXd f = point_load(problem);
  const auto x = solver->solve(f);
  ASSERT_FALSE(x.ok());
  EXPECT_EQ(x.error().code, ErrorCode::failed_precondition);
  f(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solver->solve(f).error().code, ErrorCode::invalid_argument);
  f(0, 0) = 1e300;
  EXPECT_EQ(solver->solve(f).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(solver->solve(f.topRows(5)).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(solver->solve(f.leftCols(0)).value().cols(), 0);
}

// A plate hinged along one side turns without resistance: no answer is the answer.
TEST(StiffnessIterative, AHingeIsNoSupport) {
  SculptEnergy plate;
  plate.a11 = plate.a22 = 0;
  const StiffnessProblem problem{graded_knots(3, 24, 1), graded_knots(3, 24, 1), plate, supports_of("sfff")};
  const auto solver = make_iterative_solver(problem);
  if (!solver.ok()) {
    EXPECT_EQ(solver.error().code, ErrorCode::failed_precondition);
    return;
  }
  const auto x = (*solver)->solve(point_load(problem));
  EXPECT_FALSE(x.ok()) << (*solver)->report().relative_residual << " " << x->cwiseAbs().maxCoeff();
}

TEST(StiffnessSolver, LargeSurfacesAreSolvedByIteration) {
  const auto small = make_stiffness_solver({graded_knots(3, 20, 1), graded_knots(3, 20, 1), {}, {}}).value();
  EXPECT_TRUE(small->solve(Eigen::VectorXd::Ones(small->size())).ok());
  EXPECT_EQ(small->report().iterations, 0);
  // By what may move, not by what there is: a small region of a large surface is factorised.
  StiffnessProblem problem{graded_knots(2, 60, 1), graded_knots(2, 1100, 1), {}, {}};
  const auto large = make_stiffness_solver(problem).value();
  EXPECT_TRUE(large->solve(point_load(problem)).ok());
  EXPECT_GT(large->report().iterations, 0);
  for (std::uint32_t point = 1100 * 20; point < 1100 * 60; ++point) problem.held.push_back(point);
  const auto region = make_stiffness_solver(problem).value();
  EXPECT_TRUE(region->solve(Eigen::VectorXd::Ones(region->size())).ok());
  EXPECT_EQ(region->report().iterations, 0);
  IterativeOptions fewer;
  fewer.direct_unknowns = 10;
  const auto iterated =
      make_stiffness_solver({graded_knots(3, 20, 1), graded_knots(3, 20, 1), {}, {}}, fewer);
  EXPECT_TRUE((*iterated)->solve(Eigen::VectorXd::Ones((*iterated)->size())).ok());
  EXPECT_GT((*iterated)->report().iterations, 0);
}

}  // namespace
}  // namespace handloft::geometry
