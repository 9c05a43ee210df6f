// Constraints that repeat, follow from or contradict each other (D20).

#include <gtest/gtest.h>
#include <algorithm>

#include <random>

#include "tests/unit/server-model/geometry/sculpt_shapes.h"

namespace handloft::geometry {
namespace {

SculptRow drag(const BSplineSurface& rest, const Vec2& uv, const Vec3& by) {
  return point_row(rest, uv, PointAspect::position, rest.evaluate(uv.x(), uv.y()) + by).value();
}

SculptSetup edges(Support support) {
  SculptSetup setup;
  setup.supports = {support, support, support, support};
  return setup;
}

class ConstraintRank : public testing::TestWithParam<Support> {
 protected:
  BSplineSurface rest_ = curved_surface();
  SculptSystem system_ = SculptSystem::create(rest_, edges(GetParam())).value();

  Vec3 moved(const SculptSolution& solution, const Vec2& uv) const {
    return with_control(rest_, solution.control).evaluate(uv.x(), uv.y()) - rest_.evaluate(uv.x(), uv.y());
  }
};

TEST_P(ConstraintRank, DuplicatesAreHarmless) {
  const SculptRow row = drag(rest_, {0.7, 1.1}, Vec3(0.01, 0.02, 0.1));
  const SculptRow other = drag(rest_, {1.5, 0.6}, Vec3(0, 0, -0.03));
  const SculptSolution once = system_.solve(std::vector{row, other}, {}, ConflictPolicy::refuse).value();
  const Result<SculptSolution> thrice =
      system_.solve(std::vector{row, row, other, row}, {}, ConflictPolicy::refuse);
  ASSERT_TRUE(thrice.ok()) << thrice.error().describe();
  EXPECT_LE(largest_difference(thrice->control, once.control), 1e-12);
  ASSERT_EQ(thrice->dependent.size(), 2u);
  EXPECT_EQ(thrice->dependent[0].row, 1u);
  EXPECT_EQ(thrice->dependent[0].on, std::vector<std::size_t>{0});
  EXPECT_EQ(thrice->dependent[1].row, 3u);
  EXPECT_TRUE(thrice->conflicts.empty());
  const SculptResidual residual = system_.residual(std::vector{row, row, other, row}, {}, *thrice);
  EXPECT_LE(residual.stationarity, 1e-10);
  EXPECT_LE(residual.constraints, 1e-10);
}

TEST_P(ConstraintRank, ConflictsAreRefusedByNameOrMetHalfway) {
  const SculptRow row = drag(rest_, {0.7, 1.1}, Vec3(0, 0, 0.1));
  const SculptRow other = drag(rest_, {1.5, 0.6}, Vec3(0, 0, -0.03));
  const SculptRow contrary = drag(rest_, {0.7, 1.1}, Vec3(0, 0, 0.2));
  const std::vector<SculptRow> rows{other, row, contrary};
  const Result<SculptSolution> refused = system_.solve(rows, {}, ConflictPolicy::refuse);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(refused.error().field, "rows[2]");
  EXPECT_NE(refused.error().message.find("rows[1]"), std::string::npos) << refused.error().message;
  EXPECT_EQ(refused.error().message.find("rows[0]"), std::string::npos) << "has no part in it";

  const SculptSolution nearest = system_.solve(rows, {}, ConflictPolicy::least_squares).value();
  EXPECT_NEAR(moved(nearest, {0.7, 1.1}).z(), 0.15, 1e-11);
  EXPECT_NEAR(moved(nearest, {1.5, 0.6}).z(), -0.03, 1e-11) << "what can be met is met";
  ASSERT_EQ(nearest.conflicts.size(), 2u);
  EXPECT_EQ(nearest.conflicts[0].row, 1u);
  EXPECT_EQ(nearest.conflicts[1].row, 2u);
  EXPECT_NEAR(nearest.conflicts[1].off, 0.05, 1e-11);
  EXPECT_LE(system_.residual(rows, {}, nearest).stationarity, 1e-10);
}

TEST_P(ConstraintRank, ToleranceSaysWhatIsAConflict) {
  SculptRow row = drag(rest_, {0.7, 1.1}, Vec3(0, 0, 0.1));
  SculptRow contrary = drag(rest_, {0.7, 1.1}, Vec3(0, 0, 0.101));
  EXPECT_FALSE(system_.solve(std::vector{row, contrary}, {}, ConflictPolicy::refuse).ok());
  row.tolerance = contrary.tolerance = 0.00051;
  const Result<SculptSolution> solution =
      system_.solve(std::vector{row, contrary}, {}, ConflictPolicy::refuse);
  ASSERT_TRUE(solution.ok());
  EXPECT_NEAR(moved(*solution, {0.7, 1.1}).z(), 0.1005, 1e-11);
}

TEST_P(ConstraintRank, RowsThatFollowFromSeveralAreFound) {
  // More positions in one span of a parameter line than its four functions: the fifth follows.
  std::vector<SculptRow> rows{drag(rest_, {1.5, 0.2}, Vec3(0.01, 0, 0))};
  for (int i = 0; i < 5; ++i) rows.push_back(drag(rest_, {0.8, 0.72 + 0.05 * i}, Vec3(0, 0, 0.05)));
  const Result<SculptSolution> solution = system_.solve(rows, {}, ConflictPolicy::refuse);
  ASSERT_TRUE(solution.ok()) << solution.error().describe();
  ASSERT_EQ(solution->dependent.size(), 1u);
  EXPECT_EQ(solution->dependent[0].on.size(), 4u);
  for (const std::size_t on : solution->dependent[0].on) EXPECT_NE(on, 0u);
  rows[3].target += Vec3(0, 0, 0.02);  // Now they bend more than four functions can.
  const Result<SculptSolution> refused = system_.solve(rows, {}, ConflictPolicy::refuse);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message.find("rows[0]"), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("rows[3]"), std::string::npos) << refused.error().message;
}

TEST_P(ConstraintRank, NormalRowsAlreadyMetByTangentsFollow) {
  const SurfaceDerivatives d = rest_.derivatives(1, 1, 1);
  std::vector<SculptRow> rows{point_row(rest_, {1, 1}, PointAspect::tangent_u, d.su).value(),
                              point_row(rest_, {1, 1}, PointAspect::tangent_v, d.sv).value(),
                              drag(rest_, {0.5, 0.6}, Vec3(0, 0, 0.02))};
  append(rows, normal_rows(rest_, {1, 1}, rest_.normal(1, 1)).value());
  const Result<SculptSolution> solution = system_.solve(rows, {}, ConflictPolicy::refuse);
  ASSERT_TRUE(solution.ok()) << solution.error().describe();
  EXPECT_EQ(solution->dependent.size(), 2u);
  rows.back().along = Vec3(0.5, 0.1, 1);  // Another normal than the tangents have.
  EXPECT_FALSE(system_.solve(rows, {}, ConflictPolicy::refuse).ok());
  EXPECT_TRUE(system_.solve(rows, {}, ConflictPolicy::least_squares).ok());
}

TEST_P(ConstraintRank, ClosePairsAreNotMistakenForDuplicates) {
  const std::vector<SculptRow> rows{drag(rest_, {0.7, 1.1}, Vec3(0, 0, 0.1)),
                                    drag(rest_, {0.7, 1.1001}, Vec3(0, 0, 0.1001))};
  const Result<SculptSolution> solution = system_.solve(rows, {}, ConflictPolicy::refuse);
  ASSERT_TRUE(solution.ok()) << solution.error().describe();
  EXPECT_TRUE(solution->dependent.empty());
  EXPECT_LE(system_.residual(rows, {}, *solution).constraints, 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Edges, ConstraintRank,
                         testing::Values(Support::clamped, Support::supported, Support::free),
                         [](const testing::TestParamInfo<Support>& parameter) -> std::string {
                           if (parameter.param == Support::clamped) return "clamped";
                           return parameter.param == Support::supported ? "supported" : "free";
                         });

TEST(ConstraintRankOfSupports, RowsOnClampedSidesFollowFromThem) {
  const BSplineSurface rest = curved_surface();
  SculptSystem system = SculptSystem::create(rest, {}).value();
  const SculptRow on_side = drag(rest, {0, 1}, Vec3::Zero());
  const Result<SculptSolution> solution = system.solve(std::vector{on_side}, {}, ConflictPolicy::refuse);
  ASSERT_TRUE(solution.ok());
  ASSERT_EQ(solution->dependent.size(), 1u);
  EXPECT_TRUE(solution->dependent[0].on.empty()) << "from the support alone";
  const Result<SculptSolution> torn =
      system.solve(std::vector{drag(rest, {0, 1}, Vec3(0, 0, 0.1))}, {}, ConflictPolicy::refuse);
  ASSERT_FALSE(torn.ok());
  EXPECT_EQ(torn.error().field, "rows[0]");
}

TEST(ConstraintFactor, MatchesDenseAlgebraWithModes) {
  // 5 rows, 2 modes; row 4 = row 1 + row 2, given by a Gram matrix of random vectors.
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd c(5, 8);
  for (double& value : c.reshaped()) value = normal(random);
  Eigen::MatrixXd b(5, 2);
  for (double& value : b.reshaped()) value = normal(random);
  c.row(4) = c.row(1) + c.row(2);
  b.row(4) = b.row(1) + b.row(2);
  ConstraintFactor factor(c * c.transpose(), b);
  ASSERT_EQ(factor.dependent().size(), 1u);
  EXPECT_GE(factor.dependent()[0], 1);
  EXPECT_NE(factor.dependent()[0], 3);
  const std::vector<Eigen::Index> on = factor.combination(0);
  EXPECT_EQ(on.size(), 2u);
  Eigen::VectorXd d(5);
  d << 1, -2, 0.5, 3, -1.5;
  const Eigen::Vector2d loads(0.3, -0.7);
  const ConstraintFactor::Multipliers found = factor.solve(d, loads);
  EXPECT_LE(factor.residual(found, d).norm(), 1e-11);
  EXPECT_LE((b.transpose() * found.rows + loads).norm(), 1e-11);
  // A contradiction of 0.3 is shared: the least change of d in scaled units.
  d[4] += 0.3;
  const ConstraintFactor::Multipliers nearest = factor.solve_least_squares(d, loads);
  const Eigen::VectorXd off = factor.residual(nearest, d);
  EXPECT_LE((b.transpose() * nearest.rows + loads).norm(), 1e-11);
  const Eigen::VectorXd scale = (c * c.transpose()).diagonal().cwiseSqrt();
  // Least squares under off_4 - off_1 - off_2 = -0.3: off_i proportional to scale_i^2 times +-1.
  const double all = scale[1] * scale[1] + scale[2] * scale[2] + scale[4] * scale[4];
  EXPECT_NEAR(off[4], -0.3 * scale[4] * scale[4] / all, 1e-11);
  EXPECT_NEAR(off[1], 0.3 * scale[1] * scale[1] / all, 1e-11);
  EXPECT_NEAR(off[0], 0, 1e-11);
  EXPECT_NEAR(off[3], 0, 1e-11);
}

// More rows than one block of the elimination, of less rank, hard ones and soft: what is kept is independent,
// the hard ones first, and what follows is met with it.
TEST(ConstraintFactor, ManyRowsOfLessRankAreMetByThoseKept) {
  constexpr Eigen::Index rank = 90, count = 200;
  std::uint32_t state = 7;
  const auto next = [&state] {
    state = state * 1664525U + 1013904223U;
    return static_cast<double>(state >> 8U) / static_cast<double>(1U << 24U) - 0.5;
  };
  Eigen::MatrixXd c(count, rank);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < rank; ++j) c(i, j) = next();
  c.row(3) = c.row(1);  // Of hard duplicates the later one follows.
  std::vector<bool> soft(count, true);
  for (std::size_t i = 0; i < 70; ++i) soft[i] = false;
  const ConstraintFactor factor(c * c.transpose(), Eigen::MatrixXd(count, 0), soft);
  ASSERT_EQ(factor.kept().size(), static_cast<std::size_t>(rank));
  for (Eigen::Index i = 0; i < 70; ++i)
    EXPECT_EQ(std::binary_search(factor.kept().begin(), factor.kept().end(), i), i != 3) << i;
  ASSERT_EQ(factor.dependent().front(), 3);
  EXPECT_EQ(factor.combination(0), std::vector<Eigen::Index>{1});
  Eigen::VectorXd x(rank);
  for (Eigen::Index j = 0; j < rank; ++j) x[j] = next();
  const Eigen::VectorXd values = c * x;
  const ConstraintFactor::Multipliers found = factor.solve(values, Eigen::MatrixXd(0, 1));
  EXPECT_LT(factor.residual(found, values).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((c.transpose() * found.rows - x).norm(), 1e-8);
}

TEST(ConstraintFactor, TellsLoadsThatNoRowBears) {
  const Eigen::Matrix2d s = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d b;
  b << 1, 1, 2, 2;  // Both rows see the modes' sum only.
  const ConstraintFactor factor(s, b);
  EXPECT_NEAR(factor.unborne(Eigen::Vector2d(1, 1)), 0, 1e-15);
  EXPECT_NEAR(factor.unborne(Eigen::Vector2d(1, -1)), 1, 1e-15);
}

}  // namespace
}  // namespace handloft::geometry
