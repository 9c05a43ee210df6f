// Surfaces that curves and regions hold, by iteration (stiffness_pins.h), and regions of large surfaces,
// against dense algebra.

#include "server-model/geometry/stiffness_pins.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/unit/server-model/geometry/stiffness_problems.h"

namespace handloft::geometry {
namespace {

IterativeOptions exact() {
  IterativeOptions options;
  options.relative_residual = 1e-11;
  return options;
}

/// The control points of rows and columns first..last.
std::vector<std::uint32_t> block(const StiffnessProblem& problem, std::uint32_t first, std::uint32_t last) {
  std::vector<std::uint32_t> points;
  const auto columns = static_cast<std::uint32_t>(problem.v.control_count());
  for (std::uint32_t i = first; i <= last; ++i)
    for (std::uint32_t j = first; j <= last; ++j) points.push_back(i * columns + j);
  return points;
}

/// A line of places along v at about a third of u, as a curve icon has them: each the sum of 3 x 3 points.
std::vector<SurfaceFunctional> line(const StiffnessProblem& problem, std::uint32_t row, std::uint32_t from,
                                    std::uint32_t to) {
  std::vector<SurfaceFunctional> rows;
  const auto columns = static_cast<std::uint32_t>(problem.v.control_count());
  for (std::uint32_t j = from; j <= to; ++j) {
    SurfaceFunctional place;
    for (std::uint32_t a = 0; a < 3; ++a)
      for (std::uint32_t b = 0; b < 3; ++b) {
        place.point.push_back((row + a) * columns + j + b);
        place.value.push_back((a == 1 ? 2.0 / 3 : 1.0 / 6) * (b == 1 ? 2.0 / 3 : 1.0 / 6));
      }
    rows.push_back(std::move(place));
  }
  return rows;
}

struct Dense {
  Eigen::MatrixXd k, c;
};
Dense dense(const StiffnessProblem& problem, const StiffnessPins& pins) {
  const std::vector<std::uint32_t> points = unknowns(problem);
  Dense result;
  result.k = Eigen::MatrixXd(principal_part(stiffness(problem.u, problem.v, problem.energy), points));
  std::vector<SurfaceFunctional> all;
  for (const std::uint32_t point : pins.points) all.push_back({{point}, {1.0}});
  all.insert(all.end(), pins.rows.begin(), pins.rows.end());
  result.c = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(all.size()), result.k.rows());
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t n = 0; n < all[i].point.size(); ++n) {
      const auto at = std::lower_bound(points.begin(), points.end(), all[i].point[n]);
      if (at != points.end() && *at == all[i].point[n])
        result.c(static_cast<Eigen::Index>(i), at - points.begin()) = all[i].value[n];
    }
  return result;
}
Eigen::VectorXd solution(const Dense& system, const Eigen::VectorXd& f, const Eigen::VectorXd& d) {
  const Eigen::Index n = system.k.rows(), m = system.c.rows();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n + m, n + m);
  all << system.k, system.c.transpose(), system.c, Eigen::MatrixXd::Zero(m, m);
  Eigen::VectorXd right(n + m);
  right << f, d;
  return all.fullPivLu().solve(right).head(n);
}

class Pins : public testing::TestWithParam<const char*> {
 protected:
  StiffnessProblem problem() const {
    StiffnessProblem result{graded_knots(3, 19, 3), graded_knots(3, 17, 1), {}, supports_of(GetParam())};
    if (std::string(GetParam()) == "ffff") ground(result, 10);
    return result;
  }
};
INSTANTIATE_TEST_SUITE_P(Sides, Pins, testing::Values("cccc", "cfsf", "ffff"));

// D9, D11: the same as all equations together, for loads and for pins that move. With free sides the ties of
// the preconditioner do not show.
TEST_P(Pins, AreHeldAndFollowedAsInDenseAlgebra) {
  const StiffnessProblem asked = problem();
  for (const bool curve : {false, true}) {
    SCOPED_TRACE(curve);
    StiffnessPins pins{block(asked, 5, 13), {}};  // 9 x 9: the middle 3 x 3 do not touch the rest.
    if (curve) pins = {block(asked, 4, 6), line(asked, 10, 3, 12)};
    const auto solver = make_pinned_solver(asked, pins, {}, exact());
    ASSERT_TRUE(solver.ok()) << solver.error().describe();
    EXPECT_TRUE((*solver)->dependent().empty());
    const Dense all = dense(asked, pins);
    Eigen::VectorXd f = point_load(asked), d(static_cast<Eigen::Index>(pins.size()));
    for (Eigen::Index i = 0; i < f.size(); i += 7) f[i] += 0.01;
    for (Eigen::Index i = 0; i < d.size(); ++i) d[i] = std::cos(0.3 * static_cast<double>(i));
    const Eigen::VectorXd none_f = Eigen::VectorXd::Zero(f.size()), none_d = Eigen::VectorXd::Zero(d.size());
    const auto loaded = (*solver)->solve(f);
    ASSERT_TRUE(loaded.ok()) << loaded.error().describe();
    const Eigen::VectorXd expected = solution(all, f, none_d);
    EXPECT_LE((loaded->col(0) - expected).norm(), 1e-8 * expected.norm());
    EXPECT_LE((all.c * loaded->col(0)).cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff() + 1e-15);
    const auto moved = (*solver)->follow(d);
    ASSERT_TRUE(moved.ok()) << moved.error().describe();
    const Eigen::VectorXd wanted = solution(all, none_f, d);
    EXPECT_LE((moved->col(0) - wanted).norm(), 1e-8 * wanted.norm());
    EXPECT_LE((all.c * moved->col(0) - d).cwiseAbs().maxCoeff(), 1e-11);
    EXPECT_LE((*solver)->report().iterations, 30);
    // What pins bear is no residual; what they do not, is.
    Eigen::MatrixXd off = all.k * moved->col(0);
    (*solver)->release(off);
    EXPECT_LE(off.norm(), 1e-9 * (all.k * moved->col(0)).norm());
    Eigen::MatrixXd unborne = f;
    (*solver)->release(unborne);
    EXPECT_GT(unborne.norm(), 0.01 * f.norm());
  }
}

TEST_P(Pins, TellWhatFollowsFromThem) {
  const StiffnessProblem asked = problem();
  const StiffnessPins pins{block(asked, 4, 8), line(asked, 10, 3, 12)};
  StiffnessPins twice = pins;
  twice.rows.push_back(pins.rows[3]);
  twice.rows.push_back({{5 * 17 + 5, 5 * 17 + 6}, {0.5, 0.5}});  // Within the region.
  const auto solver = make_pinned_solver(asked, twice, {}, exact());
  ASSERT_TRUE(solver.ok()) << solver.error().describe();
  const std::size_t first = pins.size();
  EXPECT_EQ((*solver)->dependent(), (std::vector<std::size_t>{first, first + 1}));
  const std::vector<std::uint32_t> points = unknowns(asked);
  const auto at = [&](const SurfaceFunctional& row) {
    std::vector<Eigen::Index> places;
    for (const std::uint32_t point : row.point)
      places.push_back(std::lower_bound(points.begin(), points.end(), point) - points.begin());
    return places;
  };
  EXPECT_LE((*solver)->freedom(at(pins.rows[3]), pins.rows[3].value), 1e-11);
  EXPECT_LE((*solver)->freedom(at(twice.rows.back()), twice.rows.back().value), 1e-11);
  EXPECT_GT((*solver)->freedom({static_cast<Eigen::Index>(points.size()) - 1}, {1.0}), 1e-3);
}

// D9: the bands of a thousand beams have a condition of 1e12, which leaves one projection some five digits.
TEST(PinnedSolver, FollowsLongCurvesToTheDigitsOfTheirPlaces) {
  const StiffnessProblem problem{graded_knots(3, 40, 1), graded_knots(3, 1000, 1), {}, supports_of("cccc")};
  const StiffnessPins pins{{}, line(problem, 20, 400, 600)};
  IterativeOptions options;
  options.relative_residual = 1e-8;
  const auto solver = make_pinned_solver(problem, pins, {}, options);
  ASSERT_TRUE(solver.ok()) << solver.error().describe();
  const auto moved = (*solver)->follow(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(pins.size())));
  ASSERT_TRUE(moved.ok()) << moved.error().describe();
  EXPECT_LE((*solver)->report().relative_residual, 1e-6);
  EXPECT_LE((*solver)->report().iterations, 40);
  const std::vector<std::uint32_t> points = unknowns(problem);
  for (const SurfaceFunctional& row : pins.rows) {
    double place = 0;
    for (std::size_t i = 0; i < row.point.size(); ++i) {
      const auto at = std::lower_bound(points.begin(), points.end(), row.point[i]) - points.begin();
      place += row.value[i] * (*moved)(at, 0);
    }
    EXPECT_NEAR(place, 1, 1e-9);
  }
}

TEST(PinnedSolver, BitsDoNotDependOnThreads) {
  StiffnessProblem problem{graded_knots(3, 141, 4), graded_knots(3, 137, 1), {}, supports_of("cccc")};
  const StiffnessPins pins{block(problem, 30, 60), line(problem, 80, 20, 100)};
  IterativeOptions options;
  options.relative_residual = 1e-7;
  const auto one = make_pinned_solver(problem, pins, {}, options).value();
  options.parallel = on_two_threads;
  const auto two = make_pinned_solver(problem, pins, {}, options).value();
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(pins.size()));
  EXPECT_TRUE((one->follow(ones)->array() == two->follow(ones)->array()).all());
  EXPECT_TRUE((one->solve(point_load(problem))->array() == two->solve(point_load(problem))->array()).all());
  EXPECT_LE(one->report().iterations, 25);
}

TEST(PinnedSolver, RefusesWhatItCannotHold) {
  const KnotVector knots = graded_knots(3, 24, 1);
  const StiffnessProblem problem{knots, knots, {}, {}};
  const auto code = [&](const StiffnessPins& pins) {
    const auto solver = make_pinned_solver(problem, pins, {}, exact());
    return solver.ok() ? ErrorCode::internal : solver.error().code;
  };
  EXPECT_EQ(code({{5, 5}, {}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{24 * 24}, {}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{}, {{{24 * 24}, {1.0}}}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{}, {{{300}, {std::numeric_limits<double>::quiet_NaN()}}}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{}, {{{300, 301}, {1.0}}}}), ErrorCode::invalid_argument);
  const auto solver = make_pinned_solver(problem, {{300}, {}}, {}, exact()).value();
  EXPECT_EQ(solver->follow(Eigen::VectorXd::Ones(2)).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(
      solver->follow(Eigen::VectorXd::Constant(1, std::numeric_limits<double>::infinity())).error().code,
      ErrorCode::invalid_argument);
  EXPECT_EQ(solver->solve(Eigen::VectorXd::Ones(2)).error().code, ErrorCode::invalid_argument);
}

// The inside of a region of a large surface: iterated as factorised, sides that are left free by it or held.
TEST(StiffnessIterative, D11_InsidesOfRegionsAreGridsOfTheirOwn) {
  for (const bool periodic : {false, true}) {
    StiffnessProblem problem{
        graded_knots(3, 20, 2, periodic), graded_knots(2, 18, 1), {}, supports_of("ffff")};
    const std::vector<std::uint32_t> inside = block(problem, periodic ? 3 : 0, 12);
    for (std::uint32_t point = 0; point < 20 * 18; ++point)
      if (!std::binary_search(inside.begin(), inside.end(), point)) problem.held.push_back(point);
    const auto direct = make_direct_solver(problem);
    const auto iterative = make_iterative_solver(problem, exact());
    ASSERT_TRUE(direct.ok()) << direct.error().describe();
    ASSERT_TRUE(iterative.ok()) << iterative.error().describe();
    Eigen::VectorXd f((*direct)->size());
    for (Eigen::Index i = 0; i < f.size(); ++i) f[i] = std::sin(static_cast<double>(i * i));
    const Eigen::MatrixXd x = (*direct)->solve(f).value(), y = (*iterative)->solve(f).value();
    EXPECT_LE((x - y).norm(), 1e-9 * x.norm()) << periodic;
  }
  StiffnessProblem ragged{graded_knots(3, 20, 1), graded_knots(3, 20, 1), {}, {}, {}, 0, {150}};
  EXPECT_EQ(make_iterative_solver(ragged).error().code, ErrorCode::unsupported);
  EXPECT_TRUE(make_direct_solver(ragged).ok());
}

}  // namespace
}  // namespace handloft::geometry
