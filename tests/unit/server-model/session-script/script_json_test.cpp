#include "server-model/session/script_json.h"

#include <gtest/gtest.h>

#include <cmath>

#include "proto/operation.pb.h"
#include "proto/query.pb.h"

namespace handloft::model {
namespace {

using nlohmann::json;

TEST(ScriptJson, FindsByDotsAndByPointer) {
  const json whole = json::parse(R"({"a":{"bigList":[1,{"c":2}]},"x_y":3})");
  EXPECT_EQ(*find_path(whole, "a.bigList.1.c"), 2);
  EXPECT_EQ(*find_path(whole, "a.big_list.0"), 1);
  EXPECT_EQ(*find_path(whole, "/a/bigList/1/c"), 2);
  EXPECT_EQ(*find_path(whole, "x_y"), 3);
  EXPECT_EQ(find_path(whole, ""), &whole);
  for (const char* nothing : {"a.bigList.2", "a.bigList.-1", "a.bigList.1x", "a.bigList.", "b", "a..b",
                              "x_y.z", "/", "a.bigList.99999999999999999999"}) {
    EXPECT_EQ(find_path(whole, nothing), nullptr) << nothing;
  }
}

TEST(ScriptJson, NamesTheMembersOnTop) {
  EXPECT_EQ(*top_level_members(R"({"b":{"c":[{"d":1}]},"a":2})"), (std::vector<std::string>{"b", "a"}));
  EXPECT_TRUE(top_level_members("{}")->empty());
  EXPECT_FALSE(top_level_members("").ok());
  EXPECT_FALSE(top_level_members("[{}]").ok());
  EXPECT_FALSE(top_level_members(R"({"a":1,"a":2})").ok());
}

TEST(ScriptJson, NestingIsBounded) {
  const auto nested = [](int depth) {
    return R"({"a":)" + std::string(static_cast<std::size_t>(depth), '[') +
           std::string(static_cast<std::size_t>(depth), ']') + "}";
  };
  EXPECT_TRUE(top_level_members(nested(max_json_depth - 1)).ok());
  EXPECT_FALSE(top_level_members(nested(max_json_depth)).ok());
}

TEST(ScriptJson, WritesZerosAndEmptyListsToo) {
  handloft::v1::QueryResult result;
  result.mutable_points()->set_entity("a");
  EXPECT_EQ(*to_json(result), R"({"points":{"entity":"a","points":[],"fitted":false}})");
}

TEST(ScriptJson, AZeroKeepsItsSign) {
  handloft::v1::Operation operation;
  ASSERT_TRUE(from_json(R"({"movePoints":{"by":{"x":-0,"y":-0.0,"z": -0e5 }}})", operation).ok());
  const auto& by = operation.move_points().by();
  for (const double zero : {by.x(), by.y(), by.z()}) EXPECT_TRUE(zero == 0 && std::signbit(zero));
  EXPECT_EQ(*to_json(by), R"({"x":-0.0,"y":-0.0,"z":-0.0})");
  EXPECT_TRUE(std::signbit((*parse_json(R"({"x":-0})"))["x"].get<double>()));
  // A whole number has none.
  ASSERT_TRUE(
      from_json(R"({"clientId":-0,"addPoints":{"stroke":-0,"points":[{"timeNs":-0}]}})", operation).ok());
  EXPECT_EQ(operation.client_id(), 0U);
  EXPECT_EQ(operation.add_points().points(0).time_ns(), 0);
}

}  // namespace
}  // namespace handloft::model
