// Every query with hand values.

#include "server-model/model/query.h"

#include <limits>

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

Model with_saddle() {
  Model model;
  for (const auto& operation : {create("top"), add("top", saddle_points()), fit("top")}) {
    EXPECT_TRUE(model.submit(operation).ok());
  }
  return model;
}

Result<v1::QueryResult> ask_surface(const Model& model, const std::string& id) {
  v1::Query query;
  query.mutable_surface()->set_entity(id);
  return model.query(query);
}

TEST(Query, A4SurfaceGivesTheCoefficientsInTheOrderOfEquationTwo) {
  const auto result = ask_surface(with_saddle(), "top");
  ASSERT_TRUE(result.ok());
  const v1::SurfaceResult& surface = result->surface();
  EXPECT_EQ(surface.degree(), 2U);
  EXPECT_EQ(surface.point_count(), 30U);
  ASSERT_EQ(surface.coefficients_size(), 6);
  // z = 0.01 + 2 x^2 - y^2 about the centroid's height.
  EXPECT_NEAR(surface.frame().z().z(), 1.0, 1e-14);
  EXPECT_NEAR(surface.coefficients(0) + surface.frame().origin().z(), 0.01, 1e-15);
  EXPECT_NEAR(surface.coefficients(1), 0.0, 1e-13);
  EXPECT_NEAR(surface.coefficients(2), 0.0, 1e-13);
  EXPECT_NEAR(surface.coefficients(3), 0.0, 1e-12);
  EXPECT_NEAR(surface.coefficients(4), 2.0, 1e-12);
  EXPECT_NEAR(surface.coefficients(5), -1.0, 1e-12);
  EXPECT_EQ(surface.superellipse_exponent(), 2.0);
  EXPECT_FALSE(surface.stale());
}

TEST(Query, SurfaceOfWhatIsNotFittedIsRefused) {
  Model model;
  ASSERT_TRUE(model.submit(create("top")).ok());
  EXPECT_EQ(ask_surface(model, "top").error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(ask_surface(model, "side").error().code, ErrorCode::not_found);
  EXPECT_EQ(ask_surface(model, "side").error().field, "surface.entity");
}

TEST(Query, A11EvaluateGivesPlacesNormalsAndOpacityAnywhere) {
  const Model model = with_saddle();
  v1::Query query;
  query.mutable_evaluate()->set_entity("top");
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, std::pair{0.01, 0.02}, std::pair{0.25, 0.2}}) {
    auto& at = *query.mutable_evaluate()->add_at();
    at.set_x(x);
    at.set_y(y);
  }
  const auto result = model.query(query);
  ASSERT_TRUE(result.ok());
  const v1::EvaluateResult& values = result->evaluate();
  ASSERT_EQ(values.positions_size(), 3);
  ASSERT_EQ(values.normals_size(), 3);
  ASSERT_EQ(values.opacity_size(), 3);
  EXPECT_NEAR(values.positions(0).z(), 0.01, 1e-14);
  EXPECT_NEAR(values.normals(0).z(), 1.0, 1e-14);
  EXPECT_NEAR(values.opacity(0), 1.0, 1e-15);
  EXPECT_NEAR(values.positions(1).z(), 0.01 + 2e-4 - 4e-4, 1e-14);
  // Ten boxes away: the polynomial, invisible (A23).
  EXPECT_NEAR(values.positions(2).z(), 0.01 + 2 * 0.0625 - 0.04, 1e-12);
  EXPECT_LT(values.opacity(2), 1e-12);
}

TEST(Query, X5EvaluateRefusesPlacesThatAreNone) {
  const Model model = with_saddle();
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e5}) {
    v1::Query query;
    query.mutable_evaluate()->set_entity("top");
    query.mutable_evaluate()->add_at();
    query.mutable_evaluate()->add_at()->set_y(bad);
    const auto result = model.query(query);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().field, "evaluate.at[1].y");
  }
}

TEST(Query, A8PointsGivesResidualsAlongTheFramesZ) {
  Model model;
  auto points = saddle_points();
  points[0].mutable_position()->set_z(points[0].position().z() + 0.001);
  for (const auto& operation : {create("top"), add("top", points)}) ASSERT_TRUE(model.submit(operation).ok());
  v1::Query query;
  query.mutable_points()->set_entity("top");
  auto result = model.query(query);
  ASSERT_TRUE(result.ok());
  EXPECT_FALSE(result->points().fitted());
  EXPECT_EQ(result->points().points(0).residual_m(), 0.0);
  ASSERT_TRUE(model.submit(fit("top")).ok());
  ASSERT_TRUE(model.submit(add("top", {point(0, 0, 1)})).ok());
  result = model.query(query);
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->points().points_size(), 31);
  EXPECT_TRUE(result->points().fitted());
  EXPECT_EQ(result->points().points(3).pressure(), points[3].pressure());
  EXPECT_EQ(result->points().points(3).position().z(), points[3].position().z());
  EXPECT_EQ(result->points().points(30).residual_m(), 0.0);  // Newer than the fit.
  EXPECT_EQ(result->points().points(30).stroke(), 2U);
  const FittedSurface& fitted = *model.document().find_dual("top")->fit;
  for (int i = 0; i < 30; ++i) {
    const auto& at = points[static_cast<std::size_t>(i)].position();
    const geometry::Vec3 local = fitted.frame.to_local({at.x(), at.y(), at.z()});
    EXPECT_NEAR(result->points().points(i).residual_m(),
                local.z() - fitted.surface.value(local.x(), local.y()), 1e-16);
  }
  EXPECT_GT(result->points().points(0).residual_m(), 1e-4);
}

TEST(Query, EntitiesListsAll) {
  Model model = with_saddle();
  ASSERT_TRUE(model.submit(create("side", 3)).ok());
  ASSERT_TRUE(model.submit(symmetry("side", v1::SetSymmetry::PARTNER)).ok());
  ASSERT_TRUE(model.submit(add("side", {point(1, 0, 0)})).ok());
  v1::Query query;
  query.mutable_entities();
  const auto result = model.query(query);
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->entities().entities_size(), 3);
  const auto& side = result->entities().entities(0);
  EXPECT_EQ(side.id(), "side");
  EXPECT_EQ(side.symmetry(), "partner");
  EXPECT_EQ(side.partner(), "side-mirror");
  EXPECT_EQ(side.degree(), 3U);
  EXPECT_EQ(side.point_count(), 1U);
  EXPECT_FALSE(side.fitted());
  EXPECT_EQ(side.representation(), v1::REPRESENTATION_POINTS);
  const auto& top = result->entities().entities(2);
  EXPECT_EQ(top.id(), "top");
  EXPECT_EQ(top.kind(), "dual_shape");
  EXPECT_TRUE(top.fitted());
  EXPECT_EQ(top.representation(), v1::REPRESENTATION_BOTH);
  EXPECT_LT(top.revision(), side.revision());
}

TEST(Query, HashAndHistory) {
  Model model = with_saddle();
  v1::Query query;
  query.mutable_hash();
  EXPECT_EQ(model.query(query)->hash().sha256(), document_hash(model.document()));
  ASSERT_TRUE(model.submit(undo()).ok());
  query.mutable_history();
  const auto result = model.query(query);
  ASSERT_TRUE(result.ok());
  const v1::HistoryResult& history = result->history();
  ASSERT_EQ(history.applied_size(), 2);
  EXPECT_EQ(history.applied(0), "Create \"top\"");
  EXPECT_EQ(history.applied(1), "Add 30 points to \"top\"");
  EXPECT_EQ(history.undo_steps(), 2U);
  EXPECT_EQ(history.redo_steps(), 1U);
  EXPECT_EQ(history.next_undo(), "Add 30 points to \"top\"");
  EXPECT_EQ(history.next_redo(), "Fit \"top\"");
}

TEST(Query, AnEmptyQueryIsRefused) {
  EXPECT_EQ(Model().query({}).error().code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace handloft::model
