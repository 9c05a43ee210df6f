// Soft leases (U1): who is refused, for how long, and when a lease ends.

#include "server-model/interaction/leases.h"

#include <gmock/gmock.h>

namespace handloft::interaction {
namespace {

using Kind = Leases::Kind;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct LeasesTest : ::testing::Test {
  ManualClock clock{from_ns(1'000'000'000'000)};
  Leases leases{[this] { return clock.now(); }, LeaseOptions{.max_asked = 3}};
};

TEST_F(LeasesTest, U1_others_are_refused_with_who_it_is_and_for_how_long) {
  leases.introduce(1, "Ann");
  ASSERT_TRUE(leases.take("seat", 1, Kind::asked).ok());
  clock.advance(std::chrono::milliseconds(1200));
  const Status refused = leases.take("seat", 2, Kind::gesture);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::failed_precondition);
  EXPECT_THAT(refused.error().message, HasSubstr("Ann shapes \"seat\""));
  EXPECT_THAT(refused.error().message, HasSubstr("another 4 s"));
  EXPECT_TRUE(leases.check("seat", 1).ok()) << "her own";
  EXPECT_TRUE(leases.check("back", 2).ok()) << "nobody's";
  EXPECT_EQ(leases.current().at("seat"), (Lease{1, "Ann"}));
}

TEST_F(LeasesTest, U1_it_ends_after_five_seconds_unless_it_is_renewed) {
  ASSERT_TRUE(leases.take("seat", 1, Kind::asked).ok());
  clock.advance(std::chrono::milliseconds(4999));
  EXPECT_FALSE(leases.check("seat", 2).ok());
  ASSERT_TRUE(leases.take("seat", 1, Kind::asked).ok());
  clock.advance(std::chrono::milliseconds(4999));
  EXPECT_FALSE(leases.check("seat", 2).ok());
  EXPECT_FALSE(leases.sweep());
  clock.advance(std::chrono::milliseconds(1));
  EXPECT_TRUE(leases.check("seat", 2).ok());
  EXPECT_THAT(leases.current(), IsEmpty());
  EXPECT_TRUE(leases.sweep());
  EXPECT_FALSE(leases.sweep());
  // The next one has it, and the first is refused.
  ASSERT_TRUE(leases.take("seat", 2, Kind::gesture).ok());
  EXPECT_FALSE(leases.take("seat", 1, Kind::asked).ok());
}

TEST_F(LeasesTest, U1_a_gesture_that_ends_leaves_what_was_asked_for) {
  ASSERT_TRUE(leases.take("seat", 1, Kind::asked).ok());
  ASSERT_TRUE(leases.take("seat", 1, Kind::gesture).ok());
  leases.release("seat", 1, Kind::gesture);
  EXPECT_FALSE(leases.check("seat", 2).ok());
  leases.release("seat", 2, Kind::asked);
  EXPECT_FALSE(leases.check("seat", 2).ok()) << "somebody else's is not released";
  leases.release("seat", 1, Kind::asked);
  EXPECT_TRUE(leases.check("seat", 2).ok());
}

TEST_F(LeasesTest, U1_who_goes_leaves_none_behind) {
  ASSERT_TRUE(leases.take("seat", 1, Kind::asked).ok());
  ASSERT_TRUE(leases.take("back", 1, Kind::gesture).ok());
  ASSERT_TRUE(leases.take("arm", 2, Kind::gesture).ok());
  leases.forget(1);
  EXPECT_THAT(leases.current(), ElementsAre(testing::Key("arm")));
}

TEST_F(LeasesTest, U1_one_client_cannot_ask_for_all) {
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(leases.take(id, 1, Kind::asked).ok());
  const Status refused = leases.take("d", 1, Kind::asked);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_TRUE(leases.take("c", 1, Kind::asked).ok()) << "renewed";
  EXPECT_TRUE(leases.take("d", 2, Kind::asked).ok());
  clock.advance(std::chrono::seconds(5));
  EXPECT_TRUE(leases.take("e", 1, Kind::asked).ok());
}

TEST_F(LeasesTest, U1_deformations_are_told_from_properties) {
  v1::Operation operation;
  operation.mutable_push_points()->add_entities("b");
  operation.mutable_push_points()->add_entities("a");
  operation.mutable_push_points()->add_entities("a");
  EXPECT_THAT(deformed_entities(operation), ElementsAre("a", "b"));
  v1::ModifyProfile& profile = *operation.mutable_modify_profile();
  profile.add_entities("c");
  profile.add_curves()->set_entity("d");
  profile.mutable_curves(0)->add_split_entities("");
  EXPECT_THAT(deformed_entities(operation), ElementsAre("c", "d"));
  operation.mutable_drag_icon()->set_entity("e");
  EXPECT_THAT(deformed_entities(operation), ElementsAre("e"));
  operation.mutable_move_points()->set_entity("f");
  EXPECT_THAT(deformed_entities(operation), ElementsAre("f"));
  operation.mutable_transform()->add_entities("g");
  EXPECT_THAT(deformed_entities(operation), ElementsAre("g"));
  operation.mutable_rename()->set_entity("h");
  EXPECT_THAT(deformed_entities(operation), IsEmpty());
  operation.mutable_add_points()->set_entity("h");
  EXPECT_THAT(deformed_entities(operation), IsEmpty()) << "points are added to what others do";
}

}  // namespace
}  // namespace handloft::interaction
