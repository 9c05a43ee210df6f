#include "server-model/session/script_json.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace handloft::model
