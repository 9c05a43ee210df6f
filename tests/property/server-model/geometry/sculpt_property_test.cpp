// D20: whatever constraints and loads come together, the answer is finite, is a minimum, meets what can be
// met, and is the same in any order.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/unit/server-model/geometry/sculpt_shapes.h"

namespace handloft::geometry {
namespace {

struct Problem {
  SculptSetup setup;
  std::vector<SculptRow> rows;
  std::vector<SculptLoad> loads;
};

// Places lie on a grid that is coarse enough for rows to meet there, with the same target or another.
Problem random_problem(const BSplineSurface& rest) {
  Problem problem;
  const auto support = [] { return *rc::gen::element(Support::free, Support::supported, Support::clamped); };
  problem.setup.supports = {support(), support(), support(), support()};
  if (*rc::gen::inRange(0, 3) == 0) problem.setup.energy.a11 = problem.setup.energy.a22 = 0;
  if (*rc::gen::inRange(0, 4) == 0) problem.setup.mode = SculptMode::absolute_fairing;
  const auto place = [] { return Vec2(0.25 * *rc::gen::inRange(0, 9), 0.25 * *rc::gen::inRange(0, 9)); };
  const auto offset = [] {
    return Vec3(0.01 * *rc::gen::inRange(-5, 6), 0.01 * *rc::gen::inRange(-5, 6),
                0.02 * *rc::gen::inRange(-5, 6));
  };
  const int rows = *rc::gen::inRange(0, 14);
  for (int i = 0; i < rows; ++i) {
    const Vec2 uv = place();
    const SurfaceDerivatives d = rest.derivatives(uv.x(), uv.y(), 2);
    switch (*rc::gen::inRange(0, 6)) {
      case 0:
        problem.rows.push_back(point_row(rest, uv, PointAspect::tangent_u, d.su + offset()).value());
        break;
      case 1:
        problem.rows.push_back(point_row(rest, uv, PointAspect::twist, d.suv + offset()).value());
        break;
      case 2:
        append(problem.rows, normal_rows(rest, uv, rest.normal(uv.x(), uv.y()) + offset()).value());
        break;
      default:
        problem.rows.push_back(point_row(rest, uv, PointAspect::position, d.s + offset()).value());
    }
  }
  const int loads = *rc::gen::inRange(0, 3);
  for (int i = 0; i < loads; ++i) problem.loads.push_back(point_load(rest, place(), offset()).value());
  return problem;
}

RC_GTEST_PROP(SculptProperty, D20_AnyConstraintsGiveAFiniteMinimum, ()) {
  const BSplineSurface rest = curved_surface();
  const Problem problem = random_problem(rest);
  SculptSystem system = SculptSystem::create(rest, problem.setup).value();
  const Result<SculptSolution> solution =
      system.solve(problem.rows, problem.loads, ConflictPolicy::least_squares);
  if (!solution.ok()) {  // The only reason: loads on a surface that nothing holds.
    RC_ASSERT(solution.error().field == "supports");
    RC_ASSERT(!problem.loads.empty());
    return;
  }
  for (const Vec3& point : solution->control) RC_ASSERT(point.allFinite());
  const SculptResidual residual = system.residual(problem.rows, problem.loads, *solution);
  RC_ASSERT(residual.stationarity <= 1e-9);
  if (solution->conflicts.empty()) RC_ASSERT(residual.constraints <= 1e-9);
  const Result<SculptSolution> refused = system.solve(problem.rows, problem.loads, ConflictPolicy::refuse);
  RC_ASSERT(refused.ok() == solution->conflicts.empty());
  if (refused.ok()) RC_ASSERT(same_bits(refused->control, solution->control));
}

RC_GTEST_PROP(SculptProperty, D20_OrderOfRowsDoesNotMatter, ()) {
  const BSplineSurface rest = curved_surface();
  const Problem problem = random_problem(rest);
  SculptSystem system = SculptSystem::create(rest, problem.setup).value();
  const Result<SculptSolution> solution =
      system.solve(problem.rows, problem.loads, ConflictPolicy::least_squares);
  RC_PRE(solution.ok());
  std::vector<SculptRow> shuffled = problem.rows;
  std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
  for (std::size_t i = shuffled.size(); i > 1; --i) std::swap(shuffled[i - 1], shuffled[random() % i]);
  const Result<SculptSolution> other = system.solve(shuffled, problem.loads, ConflictPolicy::least_squares);
  RC_ASSERT(other.ok());
  double farthest = 1;
  for (const Vec3& point : solution->control) farthest = std::max(farthest, point.norm());
  // Rows that nearly follow from each other throw the surface, some metres large, far away, and rounding as
  // many times farther: then more rows than those that contradict may count as missed.
  constexpr double thrown_away = 100;
  RC_ASSERT(other->conflicts.size() == solution->conflicts.size() || farthest > thrown_away);
  RC_ASSERT(largest_difference(other->control, solution->control) <= 1e-9 * farthest * farthest);
}

}  // namespace
}  // namespace handloft::geometry
