// create, rename, delete, superellipse (A22), representation, and what apply() says of operations that are
// not its own.

#include <limits>

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

TEST(CreateDualShape, TakesIdNameAndDegree) {
  v1::Operation operation = create("top", 3);
  operation.mutable_create_dual_shape()->set_name("Oberseite \xc3\xbc");
  const auto result = apply({}, operation);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->changes.created, std::vector<std::string>{"top"});
  const DualPtr shape = result->document.find_dual("top");
  EXPECT_EQ(shape->name, "Oberseite \xc3\xbc");
  EXPECT_EQ(shape->requested_degree, 3U);
  EXPECT_FALSE(shape->fitted());
  EXPECT_EQ(shape->representation, Representation::points);
  EXPECT_EQ(shape->superellipse_exponent, 2.0);
}

TEST(CreateDualShape, DefaultsAreDegreeTwoAndTheNextFreeId) {
  const Document document = applied({}, {create("shape-2"), create(""), create("")});
  ASSERT_EQ(document.entities.size(), 3U);
  EXPECT_TRUE(document.find_dual("shape-3"));
  EXPECT_TRUE(document.find_dual("shape-4"));
  EXPECT_EQ(document.find_dual("shape-3")->requested_degree, 2U);
  EXPECT_EQ(document.find_dual("shape-3")->name, "shape-3");
}

TEST(CreateDualShape, NeverGivesAnIdTwice) {
  Document document = applied({}, {create("top")});
  expect_refused(document, create("top"), ErrorCode::already_exists, "create_dual_shape.id");
  document = applied(document, {remove("top")});
  expect_refused(document, create("top"), ErrorCode::already_exists, "create_dual_shape.id");
}

TEST(CreateDualShape, RefusesBadIdsNamesAndDegrees) {
  for (const std::string& id : {std::string("a b"), std::string("\xc3\xbc"), std::string("a/b"),
                                std::string(65, 'a'), std::string("a\0b", 3)}) {
    expect_refused({}, create(id), ErrorCode::invalid_argument, "create_dual_shape.id");
  }
  EXPECT_TRUE(apply({}, create(std::string(64, 'a'))).ok());
  expect_refused({}, create("top", 7), ErrorCode::invalid_argument, "create_dual_shape.degree");
  // Overlong, surrogate, cut, lone continuation, control characters, too long.
  for (const std::string& name :
       {std::string("\xc0\xaf"), std::string("\xed\xa0\x80"), std::string("\xe2\x82"), std::string("\x80"),
        std::string("a\nb"), std::string("\x7f"), std::string("\xf4\x90\x80\x80"), std::string(257, 'x')}) {
    v1::Operation operation = create("top");
    operation.mutable_create_dual_shape()->set_name(name);
    expect_refused({}, operation, ErrorCode::invalid_argument, "create_dual_shape.name");
  }
}

TEST(CreateDualShape, KeepsWithinTheLimits) {
  ApplyContext context;
  context.limits.max_entities = 2;
  expect_refused(applied({}, {create("a"), create("b")}), create("c"), ErrorCode::resource_exhausted,
                 "create_dual_shape.id", context);
  context.limits.max_entities = 10;
  context.limits.max_used_ids = 2;
  expect_refused(applied({}, {create("a"), create("b"), remove("a")}), create("c"),
                 ErrorCode::resource_exhausted, "create_dual_shape.id", context);
}

TEST(Rename, ChangesTheNameAlone) {
  const Document before = applied({}, {create("top"), add("top", saddle_points())});
  const Document after = applied(before, {rename("top", "Top surface")});
  EXPECT_EQ(after.find_dual("top")->name, "Top surface");
  EXPECT_TRUE(after.find_dual("top")->points.shares_all_with(before.find_dual("top")->points));
  expect_refused(before, rename("top", ""), ErrorCode::invalid_argument, "rename.name");
  expect_refused(before, rename("side", "x"), ErrorCode::not_found, "rename.entity");
}

TEST(Delete, RemovesTheEntityAndSharesTheRest) {
  const Document before = applied({}, {create("a"), create("b")});
  const auto result = apply(before, remove("a"));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->changes.removed, std::vector<std::string>{"a"});
  EXPECT_FALSE(result->document.find_dual("a"));
  EXPECT_EQ(result->document.find_dual("b"), before.find_dual("b"));
  expect_refused(result->document, remove("a"), ErrorCode::not_found, "delete.entity");
}

TEST(SetSuperellipse, A22TakesExponentsFromAFifthToTwenty) {
  const Document document = applied({}, {create("top")});
  for (const double exponent : {0.2, 1.0, 2.5, 20.0}) {
    EXPECT_EQ(applied(document, {superellipse("top", exponent)}).find_dual("top")->superellipse_exponent,
              exponent);
  }
  for (const double exponent : {0.0, 0.199, 20.001, -2.0, std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()}) {
    expect_refused(document, superellipse("top", exponent), ErrorCode::invalid_argument,
                   "set_superellipse.exponent");
  }
  expect_refused(document, superellipse("side", 2), ErrorCode::not_found, "set_superellipse.entity");
}

TEST(SetRepresentation, SwitchesAndKeepsBoth) {
  Document document = applied({}, {create("top"), add("top", saddle_points())});
  expect_refused(document, represent("top", v1::REPRESENTATION_SURFACE), ErrorCode::failed_precondition,
                 "set_representation.entity");
  expect_refused(document, represent("top", v1::REPRESENTATION_UNSPECIFIED), ErrorCode::invalid_argument,
                 "set_representation.representation");
  document = applied(document, {fit("top")});
  EXPECT_EQ(document.find_dual("top")->representation, Representation::both);
  document = applied(document, {represent("top", v1::REPRESENTATION_SURFACE)});
  EXPECT_EQ(document.find_dual("top")->representation, Representation::surface);
  EXPECT_EQ(document.find_dual("top")->points.size(), 30U);  // A28
  document = applied(document, {represent("top", v1::REPRESENTATION_POINTS)});
  EXPECT_TRUE(document.find_dual("top")->fitted());  // A28
}

TEST(Apply, RefusesWhatIsNotForADocument) {
  expect_refused({}, undo(), ErrorCode::failed_precondition, "");
  expect_refused({}, redo(), ErrorCode::failed_precondition, "");
  v1::Operation to_file;
  to_file.mutable_export_()->set_path("a.step");
  expect_refused({}, to_file, ErrorCode::failed_precondition, "");
  expect_refused({}, v1::Operation(), ErrorCode::invalid_argument, "");
}

TEST(Apply, KeepsTheClientsIdsForTheLog) {
  v1::Operation operation = create("top");
  operation.set_client_id(3);
  operation.set_client_op_id(4);
  const auto result = apply({}, operation);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->effective.client_id(), 3U);
  EXPECT_EQ(result->effective.client_op_id(), 4U);
  EXPECT_EQ(result->effective.create_dual_shape().degree(), 2U);
}

TEST(Difference, NamesWhatWasCreatedChangedAndRemoved) {
  const Document before = applied({}, {create("a"), create("b"), create("c")});
  const Document after = applied(before, {remove("a"), rename("b", "B"), create("d")});
  const Changes changes = difference(before, after);
  EXPECT_EQ(changes.created, std::vector<std::string>{"d"});
  EXPECT_EQ(changes.changed, std::vector<std::string>{"b"});
  EXPECT_EQ(changes.removed, std::vector<std::string>{"a"});
  EXPECT_EQ(changes.all(), (std::vector<std::string>{"a", "b", "d"}));
  EXPECT_TRUE(difference(after, after).empty());
}

}  // namespace
}  // namespace handloft::model
