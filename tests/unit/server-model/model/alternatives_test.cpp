// A28: named alternatives of a design, and what differs between them.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "server-model/model/canonical.h"
#include "server-model/model/model.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;

class AlternativesTest : public ::testing::Test {
 protected:
  void lay(const std::string& id, double height, bool create) {
    v1::Operation operation;
    operation.mutable_add_points()->set_entity(id);
    if (create) operation.mutable_add_points()->mutable_create();
    for (int i = 0; i < 25; ++i) {
      v1::Point& point = *operation.mutable_add_points()->add_points();
      point.mutable_position()->set_x(0.02 * (i % 5) - 0.04);
      point.mutable_position()->set_y(0.015 * (i / 5) - 0.03);
      point.mutable_position()->set_z(height);
      point.set_pressure(1.0);
    }
    submit(operation);
  }
  void fit(const std::string& id) {
    v1::Operation operation;
    operation.mutable_fit()->set_entity(id);
    operation.mutable_fit()->set_degree(1);
    submit(operation);
  }
  Submitted submit(const v1::Operation& operation) {
    auto result = model_.submit(operation);
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().describe());
    return result ? *result : Submitted{};
  }
  Submitted make(const std::string& name) {
    v1::Operation operation;
    operation.mutable_new_alternative()->set_name(name);
    return submit(operation);
  }
  static v1::Operation to(const std::string& name) {
    v1::Operation operation;
    operation.mutable_switch_alternative()->set_name(name);
    return operation;
  }
  static v1::Operation restoring(const std::string& name) {
    v1::Operation operation;
    operation.mutable_restore_alternative()->set_name(name);
    return operation;
  }
  static v1::Operation deleting(const std::string& name) {
    v1::Operation operation;
    operation.mutable_delete_alternative()->set_name(name);
    return operation;
  }
  void undo() {
    v1::Operation operation;
    operation.mutable_undo();
    submit(operation);
  }
  v1::AlternativesResult list() const {
    v1::Query query;
    query.mutable_alternatives();
    return model_.query(query)->alternatives();
  }
  v1::CompareResult compare(const std::string& name) const {
    v1::Query query;
    query.mutable_compare()->set_alternative(name);
    const auto result = model_.query(query);
    EXPECT_TRUE(result.ok());
    return result ? result->compare() : v1::CompareResult();
  }
  std::string hash() const { return document_hash(model_.document()); }

  Model model_;
};

TEST_F(AlternativesTest, A28_ANewOneIsWorkedOnAndTheFormerIsKept) {
  lay("a", 0, true);
  EXPECT_EQ(list().present(), "main");
  const EntityPtr kept = model_.document().find("a");
  const Submitted made = make("");
  EXPECT_EQ(made.words, "New alternative \"alternative 2\" of \"main\"");
  EXPECT_NE(made.sequence, 0U);
  EXPECT_TRUE(made.changes.alternatives);
  EXPECT_EQ(list().present(), "alternative 2");
  EXPECT_EQ(model_.document().find("a"), kept) << "shared, not copied";
  lay("a", 0.01, false);
  lay("b", 0.05, true);
  const Submitted back = submit(to("main"));
  EXPECT_EQ(back.changes.changed, std::vector<std::string>{"a"});
  EXPECT_EQ(back.changes.removed, std::vector<std::string>{"b"});
  EXPECT_EQ(model_.document().find("a"), kept);
  submit(to("alternative 2"));
  EXPECT_EQ(model_.document().find_dual("a")->points.size(), 50U);
  ASSERT_EQ(list().names_size(), 2);
  EXPECT_EQ(list().names(0), "main");
  EXPECT_EQ(list().names(1), "alternative 2");
}

TEST_F(AlternativesTest, A28_UndoOfEachRestoresTheBitIdenticalDocument) {
  lay("a", 0, true);
  std::vector<std::string> hashes{hash()};
  const auto step = [&](const v1::Operation& operation) {
    submit(operation);
    hashes.push_back(hash());
  };
  v1::Operation made;
  made.mutable_new_alternative()->set_name("wide");
  step(made);
  lay("b", 0.05, true);
  hashes.push_back(hash());
  step(to("main"));
  step(restoring("wide"));
  step(deleting("wide"));
  for (std::size_t i = 1; i < hashes.size(); ++i) EXPECT_NE(hashes[i], hashes[i - 1]) << i;
  for (std::size_t i = hashes.size() - 1; i > 0; --i) {
    undo();
    EXPECT_EQ(hash(), hashes[i - 1]) << i;
  }
  EXPECT_EQ(list().names_size(), 1);
}

TEST_F(AlternativesTest, A28_RestoringMakesThePresentOneTheOther) {
  lay("a", 0, true);
  make("wide");
  lay("b", 0.05, true);
  submit(to("main"));
  EXPECT_EQ(model_.document().find("b"), nullptr);
  EXPECT_EQ(submit(restoring("wide")).words, "Restore alternative \"wide\" into \"main\"");
  EXPECT_NE(model_.document().find("b"), nullptr);
  EXPECT_EQ(list().present(), "main");
  EXPECT_EQ(compare("wide").differences_size(), 0);
}

TEST_F(AlternativesTest, A28_ComparesByIdWithDistances) {
  lay("a", 0, true);
  fit("a");
  lay("gone", 0.2, true);
  make("raised");
  // Every point once more, 0.01 higher: the mean surface rises by half of it.
  lay("a", 0.01, false);
  fit("a");
  lay("b", 0.05, true);
  v1::Operation remove;
  remove.mutable_delete_()->set_entity("gone");
  submit(remove);
  const v1::CompareResult result = compare("main");
  ASSERT_EQ(result.differences_size(), 3);
  EXPECT_EQ(result.differences(0).entity(), "a");
  EXPECT_EQ(result.differences(0).words(), "25 points more, fitted again");
  EXPECT_NEAR(result.differences(0).rms_surface_distance_m(), 0.005, 1e-12);
  EXPECT_EQ(result.differences(0).max_point_distance_m(), 0.0);
  EXPECT_EQ(result.differences(1).words(), "added");
  EXPECT_EQ(result.differences(2).words(), "removed");
  EXPECT_EQ(compare("raised").differences_size(), 0);
  submit(to("main"));
  EXPECT_EQ(compare("raised").differences(0).words(), "25 points fewer, fitted again");
}

TEST_F(AlternativesTest, IdsAreNeverUsedAgainInAnyAlternative) {
  make("wide");
  lay("a", 0, true);
  submit(to("main"));
  v1::Operation create;
  create.mutable_create_dual_shape()->set_id("a");
  const auto refused = model_.submit(create);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::already_exists);
}

TEST_F(AlternativesTest, RefusedWithTheField) {
  const auto refused = [&](const v1::Operation& operation) {
    const auto result = model_.submit(operation);
    return result ? std::string("accepted")
                  : std::string(to_string(result.error().code)) + " " + result.error().field;
  };
  v1::Operation again;
  again.mutable_new_alternative()->set_name("main");
  EXPECT_EQ(refused(again), "already_exists new_alternative.name");
  again.mutable_new_alternative()->set_name("a\nb");
  EXPECT_EQ(refused(again), "invalid_argument new_alternative.name");
  EXPECT_EQ(refused(to("none")), "not_found switch_alternative.name");
  EXPECT_EQ(refused(restoring("none")), "not_found restore_alternative.name");
  EXPECT_EQ(refused(deleting("none")), "not_found delete_alternative.name");
  EXPECT_EQ(refused(deleting("main")), "failed_precondition delete_alternative.name");
  EXPECT_EQ(submit(to("main")).sequence, 0U) << "nothing changes, so nothing is to be undone";
  for (std::size_t i = 1; i < Limits{}.max_alternatives; ++i) make("");
  v1::Operation more;
  more.mutable_new_alternative();
  EXPECT_EQ(refused(more), "resource_exhausted new_alternative.name");
  v1::Query query;
  query.mutable_compare()->set_alternative("none");
  EXPECT_EQ(model_.query(query).error().field, "compare.alternative");
}

// A gesture on an entity that the other alternative does not have cannot live on.
TEST_F(AlternativesTest, SwitchingCancelsGesturesWhoseEntityIsGone) {
  make("wide");
  lay("b", 0.05, true);
  v1::Operation gesture;
  gesture.mutable_add_points()->set_entity("b");
  const auto begun = model_.begin_provisional(gesture);
  ASSERT_TRUE(begun.ok());
  EXPECT_EQ(submit(to("main")).cancelled_gestures.size(), 1U);
  EXPECT_EQ(model_.provisional(*begun), nullptr);
}

}  // namespace
}  // namespace handloft::model
