// A1: points with their certainty; thinning; strokes; limits.

#include <limits>

#include "server-model/model/provisional.h"
#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

TEST(AddPoints, A1KeepsPositionPressureTimeAndStroke) {
  auto one = point(0.1, -0.2, 0.3, 512.0 / 1023.0);
  one.set_time_ns(42);
  const Document document = applied({}, {create("top"), add("top", {one}), add("top", {point(1, 2, 3, 0)})});
  const DualPtr shape = document.find_dual("top");
  ASSERT_EQ(shape->points.size(), 2U);
  EXPECT_EQ(shape->points[0].position(), geometry::Vec3(0.1, -0.2, 0.3));
  EXPECT_EQ(shape->points[0].pressure, 512.0 / 1023.0);
  EXPECT_EQ(shape->points[0].time_ns, 42);
  EXPECT_EQ(shape->points[0].stroke, 1U);
  EXPECT_EQ(shape->points[1].stroke, 2U);
  EXPECT_EQ(shape->stroke_count, 2U);
  EXPECT_EQ(shape->mirror_partner(0), DualPoint::no_partner);
}

TEST(AddPoints, ContinuesAStrokeThatIsNamed) {
  const Document document = applied({}, {create("top"), add("top", {point(0, 0, 0)}),
                                         add("top", {point(1, 0, 0)}), add("top", {point(2, 0, 0)}, 1)});
  EXPECT_EQ(document.find_dual("top")->points[2].stroke, 1U);
  EXPECT_EQ(document.find_dual("top")->stroke_count, 2U);
}

TEST(AddPoints, TheLogKnowsTheStrokeThatWasChosen) {
  const auto result = apply(applied({}, {create("top")}), add("top", {point(0, 0, 0)}));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->effective.add_points().stroke(), 1U);
  EXPECT_EQ(result->changes.changed, std::vector<std::string>{"top"});
  EXPECT_EQ(result->words, "Add 1 point to \"top\"");
}

TEST(AddPoints, A1ThinsByDistanceFromTheLastPointKept) {
  std::vector<v1::Point> points;
  for (int i = 0; i < 10; ++i) points.push_back(point(0.001 * i, 0, 0));
  auto operation = add("top", points);
  operation.mutable_add_points()->set_min_spacing_m(0.0025);
  // Kept: 0, 3, 6 and 9 mm.
  const Document document = applied({}, {create("top"), operation});
  const DualPtr shape = document.find_dual("top");
  ASSERT_EQ(shape->points.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(shape->points[i].x, 0.001 * 3 * static_cast<double>(i));
}

TEST(AddPoints, A1ThinningMakesTheFitIndependentOfTheFrameRate) {
  // The same path, slow in the middle, at 30 and 90 frames a second: without thinning the slow part weighs
  // more.
  const auto path = [](int frames) {
    std::vector<v1::Point> points;
    for (int i = 0; i <= frames; ++i) {
      const double t = static_cast<double>(i) / frames;
      const double along = 0.1 * (4 * std::pow(t - 0.5, 3) + 0.5);
      const double across = 0.03 * std::sin(40 * along);
      points.push_back(point(along, across, 0.3 * along * along + 0.1 * across));
    }
    return points;
  };
  const auto fitted = [&](int frames, double spacing_m) {
    auto operation = add("top", path(frames));
    operation.mutable_add_points()->set_min_spacing_m(spacing_m);
    return applied({}, {create("top"), operation, fit("top", 2)});
  };
  // How far the surfaces are apart over the same places of the world, of the 0.1 m that they are long.
  const auto apart = [](const Document& one, const Document& other) {
    const FittedSurface& a = *one.find_dual("top")->fit;
    const FittedSurface& b = *other.find_dual("top")->fit;
    double largest = 0;
    for (int i = -4; i <= 4; ++i) {
      for (int j = -2; j <= 2; ++j) {
        const geometry::Vec3 world = a.surface.world_point(a.frame, 0.01 * i, 0.01 * j);
        const geometry::Vec3 local = b.frame.to_local(world);
        largest = std::max(largest, std::abs(b.surface.value(local.x(), local.y()) - local.z()));
      }
    }
    return largest / 0.1;
  };
  EXPECT_LE(apart(fitted(300, 0.002), fitted(900, 0.002)), 1e-3);
}

TEST(AddPoints, MarksTheFitStale) {
  Document document = applied({}, {create("top"), add("top", saddle_points()), fit("top")});
  EXPECT_FALSE(document.find_dual("top")->stale);
  const auto before = document.find_dual("top")->fit;
  document = applied(document, {add("top", {point(0, 0, 0)})});
  EXPECT_TRUE(document.find_dual("top")->stale);
  EXPECT_EQ(document.find_dual("top")->fit, before);  // A28: the surface stays as it is.
}

TEST(AddPoints, NoPointsChangeNothing) {
  const Document document = applied({}, {create("top")});
  const auto result = apply(document, add("top", {}));
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(result->changes.empty());
}

TEST(AddPoints, TheFirstStrokeMayMakeItsShape) {
  auto operation = add("", saddle_points());
  operation.mutable_add_points()->mutable_create()->set_degree(3);
  auto& symmetry_request = *operation.mutable_add_points()->mutable_symmetry();
  symmetry_request.set_mode(v1::SetSymmetry::SAME_SHAPE);
  symmetry_request.mutable_plane()->mutable_normal()->set_x(1);
  const auto result = apply({}, operation);
  ASSERT_TRUE(result.ok()) << result.error().describe();
  EXPECT_EQ(result->changes.created, std::vector<std::string>{"shape-1"});
  EXPECT_EQ(result->effective.add_points().entity(), "shape-1");
  const DualPtr shape = result->document.find_dual("shape-1");
  EXPECT_EQ(shape->requested_degree, 3U);
  EXPECT_EQ(shape->points.size(), 60U);
  // What the log stores does the same.
  EXPECT_EQ(document_hash(applied({}, {result->effective})), document_hash(result->document));
}

TEST(AddPoints, AShapeThatIsMadeMustBeTheOneThatGetsThePoints) {
  auto operation = add("top", saddle_points());
  operation.mutable_add_points()->mutable_create()->set_id("side");
  expect_refused({}, operation, ErrorCode::invalid_argument, "add_points.create.id");
  operation.mutable_add_points()->mutable_create()->set_id("top");
  expect_refused(applied({}, {create("top")}), operation, ErrorCode::already_exists,
                 "add_points.create_dual_shape.id");
}

TEST(AddPoints, X5RefusesNumbersThatAreNone) {
  const Document document = applied({}, {create("top")});
  for (const double bad : {nan_value, infinity, -infinity, 1.1e4, -1e300}) {
    expect_refused(document, add("top", {point(0, 0, 0), point(bad, 0, 0)}), ErrorCode::invalid_argument,
                   "add_points.points[1].position.x");
    expect_refused(document, add("top", {point(0, bad, 0)}), ErrorCode::invalid_argument,
                   "add_points.points[0].position.y");
    expect_refused(document, add("top", {point(0, 0, bad)}), ErrorCode::invalid_argument,
                   "add_points.points[0].position.z");
  }
  for (const double bad : {nan_value, infinity, -0.001, 1.001}) {
    expect_refused(document, add("top", {point(0, 0, 0, bad)}), ErrorCode::invalid_argument,
                   "add_points.points[0].pressure");
  }
  for (const double bad : {nan_value, infinity, -1.0}) {
    auto operation = add("top", {point(0, 0, 0)});
    operation.mutable_add_points()->set_min_spacing_m(bad);
    expect_refused(document, operation, ErrorCode::invalid_argument, "add_points.min_spacing_m");
  }
  v1::Operation without_position = add("top", {point(0, 0, 0)});
  without_position.mutable_add_points()->mutable_points(0)->clear_position();
  expect_refused(document, without_position, ErrorCode::invalid_argument, "add_points.points[0].position");
}

TEST(AddPoints, RefusesUnknownEntitiesAndStrokes) {
  const Document document = applied({}, {create("top")});
  expect_refused(document, add("side", {point(0, 0, 0)}), ErrorCode::not_found, "add_points.entity");
  expect_refused(document, add("", {point(0, 0, 0)}), ErrorCode::not_found, "add_points.entity");
  expect_refused(document, add("top", {point(0, 0, 0)}, 2), ErrorCode::invalid_argument, "add_points.stroke");
  expect_refused(document, add("top", {point(0, 0, 0)}, 0xffffffffU), ErrorCode::invalid_argument,
                 "add_points.stroke");
}

TEST(AddPoints, KeepsWithinTheLimits) {
  ApplyContext context;
  context.limits.max_points_per_operation = 3;
  context.limits.max_points_per_shape = 4;
  const std::vector<v1::Point> three(3, point(0, 0, 0));
  Document document = applied({}, {create("top")});
  expect_refused(document, add("top", std::vector<v1::Point>(4, point(0, 0, 0))),
                 ErrorCode::resource_exhausted, "add_points.points", context);
  document = applied(document, {add("top", three)});
  expect_refused(document, add("top", three), ErrorCode::resource_exhausted, "add_points.points", context);
  EXPECT_TRUE(apply(document, add("top", {point(0, 0, 0)}), context).ok());
}

TEST(ImportStrokes, AddsEachStrokeAsAStrokeOfItsOwn) {
  v1::Operation operation;
  auto& request = *operation.mutable_import_strokes();
  request.set_entity("top");
  for (int s = 0; s < 2; ++s) {
    auto& stroke = *request.add_resolved();
    for (int i = 0; i < 3; ++i) *stroke.add_points() = point(i, s, 0, 0.5);
  }
  const Document document = applied({}, {create("top"), operation});
  const DualPtr shape = document.find_dual("top");
  ASSERT_EQ(shape->points.size(), 6U);
  EXPECT_EQ(shape->points[2].stroke, 1U);
  EXPECT_EQ(shape->points[3].stroke, 2U);
  request.mutable_resolved(1)->mutable_points(2)->set_pressure(7);
  expect_refused(document, operation, ErrorCode::invalid_argument,
                 "import_strokes.resolved[1].points[2].pressure");
  request.clear_resolved();
  expect_refused(document, operation, ErrorCode::failed_precondition, "import_strokes.resolved");
}

}  // namespace
}  // namespace handloft::model
