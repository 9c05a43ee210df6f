// What panels ask for, as operations (U6, V7).

#include "client-hmd/main/panel_operations.h"

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

namespace handloft::client {
namespace {

std::string json_of(const PanelRequest& request) {
  const std::optional<v1::Operation> operation = operation_of(request);
  if (!operation) return "none";
  std::string text;
  EXPECT_TRUE(google::protobuf::util::MessageToJsonString(*operation, &text).ok());
  return text;
}

TEST(PanelOperations, AreTheSameWordsAsAScripts_U6) {
  EXPECT_EQ(json_of(KeepVersion{"For the client"}), R"({"nameVersion":{"name":"For the client"}})");
  EXPECT_EQ(json_of(RestoreNamed{"v1"}), R"({"restoreVersion":{"name":"v1"}})");
  EXPECT_EQ(json_of(BranchFrom{"v1"}), R"({"newAlternative":{"version":"v1"}})");
  EXPECT_EQ(json_of(DeleteNamed{"v1"}), R"({"deleteVersion":{"name":"v1"}})");
  EXPECT_EQ(json_of(CommentOn{"seat", "too flat"}), R"({"addComment":{"text":"too flat","entity":"seat"}})");
  EXPECT_EQ(json_of(CommentOn{"", "hello"}), R"({"addComment":{"text":"hello","place":{}}})");
  EXPECT_EQ(json_of(ReplyTo{"c-1", "yes"}), R"({"addComment":{"text":"yes","replyTo":"c-1"}})");
  EXPECT_EQ(json_of(ResolveComment{"c-1", true}), R"({"changeComment":{"id":"c-1","resolved":true}})");
  EXPECT_EQ(json_of(ResolveComment{"c-1", false}), R"({"changeComment":{"id":"c-1","resolved":false}})");
  EXPECT_EQ(json_of(DeleteRemark{"c-1"}), R"({"deleteComment":{"id":"c-1"}})");
}

TEST(PanelOperations, OfShapes_V7) {
  EXPECT_EQ(json_of(RenameShape{"s", "Seat"}), R"({"rename":{"entity":"s","name":"Seat"}})");
  EXPECT_EQ(json_of(DeleteShape{"s"}), R"({"delete":{"entity":"s"}})");
  EXPECT_EQ(json_of(ShowShape{"s", Representation::surface}),
            R"({"setRepresentation":{"entity":"s","representation":"REPRESENTATION_SURFACE"}})");
  EXPECT_EQ(json_of(SwitchAlternative{"edgy"}), R"({"switchAlternative":{"name":"edgy"}})");
}

TEST(PanelOperations, AreNoneForQuestionsAndTheView) {
  EXPECT_EQ(json_of(CompareVersions{"v1", ""}), "none");
  EXPECT_EQ(json_of(ChangeView{}), "none");
  EXPECT_EQ(json_of(ChangeSettings{}), "none");
  EXPECT_EQ(json_of(DesktopCommand{}), "none");
}

}  // namespace
}  // namespace handloft::client
