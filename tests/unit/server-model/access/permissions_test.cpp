// A3: who may do what, every cell of role x body x whose it is. What is expected stands here, written by hand
// and apart from the table in permissions.cpp: viewer, commenter, editor, owner, '-' for those who may not.

#include "server-model/access/permissions.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <array>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>

namespace handloft::access {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using ::testing::HasSubstr;

struct Expected {
  std::string body;
  std::string own;
  std::string others;
};

constexpr std::array roles{v1::ROLE_VIEWER, v1::ROLE_COMMENTER, v1::ROLE_EDITOR, v1::ROLE_OWNER};
constexpr std::string_view letters = "VCEO";

// clang-format off
const std::vector<Expected> operations = {
      {"create_dual_shape", "--EO", "--EO"},
      {"add_points", "--EO", "--EO"},
      {"set_symmetry", "--EO", "--EO"},
      {"fit", "--EO", "--EO"},
      {"set_superellipse", "--EO", "--EO"},
      {"set_representation", "--EO", "--EO"},
      {"rename", "--EO", "--EO"},
      {"delete", "--EO", "--EO"},
      {"undo", "--EO", "--EO"},
      {"redo", "--EO", "--EO"},
      {"import_strokes", "--EO", "--EO"},
      {"export", "--EO", "--EO"},
      {"refit_plane", "--EO", "--EO"},
      {"push_points", "--EO", "--EO"},
      {"modify_profile", "--EO", "--EO"},
      {"set_boundary", "--EO", "--EO"},
      {"delete_points", "--EO", "--EO"},
      {"move_points", "--EO", "--EO"},
      {"transform", "--EO", "--EO"},
      {"duplicate", "--EO", "--EO"},
      {"import_reference", "--EO", "--EO"},
      {"new_alternative", "--EO", "--EO"},
      {"switch_alternative", "--EO", "--EO"},
      {"restore_alternative", "--EO", "--EO"},
      {"delete_alternative", "--EO", "--EO"},
      {"create_sculpt_surface", "--EO", "--EO"},
      {"set_sculpting", "--EO", "--EO"},
      {"add_icon", "--EO", "--EO"},
      {"change_icon", "--EO", "--EO"},
      {"drag_icon", "--EO", "--EO"},
      {"delete_icon", "--EO", "--EO"},
      {"commit_sculpting", "--EO", "--EO"},
      {"recover_sculpting", "--EO", "--EO"},
      {"refine_surface", "--EO", "--EO"},
      {"import_model", "--EO", "--EO"},
      {"name_version", "--EO", "--EO"},
      {"restore_version", "--EO", "--EO"},
      {"delete_version", "---O", "---O"},
      {"add_comment", "-CEO", "-CEO"},
      {"change_comment", "-CEO", "--EO"},
      {"delete_comment", "-CEO", "---O"},
};
const std::vector<Expected> queries = {
      {"surface", "VCEO", "VCEO"},
      {"evaluate", "VCEO", "VCEO"},
      {"points", "VCEO", "VCEO"},
      {"entities", "VCEO", "VCEO"},
      {"hash", "VCEO", "VCEO"},
      {"history", "VCEO", "VCEO"},
      {"alternatives", "VCEO", "VCEO"},
      {"compare", "VCEO", "VCEO"},
      {"distance", "VCEO", "VCEO"},
      {"pick", "VCEO", "VCEO"},
      {"sculpt", "VCEO", "VCEO"},
      {"control_net", "VCEO", "VCEO"},
      {"versions", "VCEO", "VCEO"},
      {"difference", "VCEO", "VCEO"},
      {"comments", "VCEO", "VCEO"},
      {"people", "VCEO", "VCEO"},
      {"models", "VCEO", "VCEO"},
};
// What a client may send to a model server after it has come in.
const std::vector<Expected> messages = {
      {"hello", "----", "----"},
      {"welcome", "----", "----"},
      {"failure", "VCEO", "VCEO"},
      {"ping", "VCEO", "VCEO"},
      {"pong", "VCEO", "VCEO"},
      {"subscribe", "----", "----"},
      {"tracking", "--EO", "--EO"},
      {"glove_feedback", "----", "----"},
      {"join", "VCEO", "VCEO"},
      {"snapshot", "----", "----"},
      {"delta", "----", "----"},
      {"presence", "VCEO", "VCEO"},
      {"submit", "-CEO", "-CEO"},
      {"ack", "----", "----"},
      {"ask", "VCEO", "VCEO"},
      {"answer", "----", "----"},
      {"hand_command", "--EO", "--EO"},
      {"joined", "----", "----"},
      {"people", "----", "----"},
      {"lease", "--EO", "--EO"},
      {"pair", "----", "----"},
      {"paired", "----", "----"},
};
// clang-format on

std::vector<const FieldDescriptor*> bodies(const Descriptor* descriptor) {
  const auto* oneof = descriptor->FindOneofByName("body");
  std::vector<const FieldDescriptor*> fields;
  for (int i = 0; i < oneof->field_count(); ++i) fields.push_back(oneof->field(i));
  return fields;
}

void set_body(Message& message, const FieldDescriptor* field) {
  message.GetReflection()->MutableMessage(&message, field);
}

const Expected& expectation(const std::vector<Expected>& all, const std::string& name) {
  static const Expected none{"", "?", "?"};
  for (const Expected& each : all) {
    if (each.body == name) return each;
  }
  ADD_FAILURE() << name << " is in proto/ and not in this test";
  return none;
}

void expect_cell(const std::string& expected, std::size_t role, bool allowed, const std::string& what) {
  ASSERT_EQ(expected.size(), roles.size()) << what;
  ASSERT_TRUE(expected[role] == '-' || expected[role] == letters[role]) << what;
  EXPECT_EQ(allowed, expected[role] != '-') << what << " by " << role_name(roles.at(role));
}

TEST(Permissions, EveryCellOfOperationsIsAsExpected_A3) {
  int cells = 0;
  for (const FieldDescriptor* field : bodies(v1::Operation::descriptor())) {
    v1::Operation operation;
    set_body(operation, field);
    const Expected& expected = expectation(operations, field->name());
    for (std::size_t role = 0; role < roles.size(); ++role) {
      expect_cell(expected.own, role, allows(roles.at(role), operation, Ownership::own),
                  field->name() + ", own");
      expect_cell(expected.others, role, allows(roles.at(role), operation, Ownership::others),
                  field->name() + ", others'");
      cells += 2;
    }
  }
  EXPECT_EQ(cells, static_cast<int>(operations.size()) * 8);
  RecordProperty("cells", cells);
}

TEST(Permissions, EveryCellOfQueriesIsAsExpected_A3) {
  for (const FieldDescriptor* field : bodies(v1::Query::descriptor())) {
    v1::Query query;
    set_body(query, field);
    const Expected& expected = expectation(queries, field->name());
    for (std::size_t role = 0; role < roles.size(); ++role)
      expect_cell(expected.own, role, allows(roles.at(role), query), field->name());
  }
  EXPECT_EQ(bodies(v1::Query::descriptor()).size(), queries.size());
}

TEST(Permissions, EveryCellOfMessagesIsAsExpected_A3) {
  for (const FieldDescriptor* field : bodies(v1::Envelope::descriptor())) {
    const Expected& expected = expectation(messages, field->name());
    for (std::size_t role = 0; role < roles.size(); ++role)
      expect_cell(expected.own, role,
                  allows(roles.at(role), static_cast<v1::Envelope::BodyCase>(field->number())),
                  field->name());
  }
  EXPECT_EQ(bodies(v1::Envelope::descriptor()).size(), messages.size());
}

// A new body in proto/ without a row, or a row of what proto/ has no more, fails here.
TEST(Permissions, TheTableHasARowForEveryBodyAndNoOther) {
  const std::map<std::string, const Descriptor*, std::less<>> kinds = {
      {"operation", v1::Operation::descriptor()},
      {"query", v1::Query::descriptor()},
      {"message", v1::Envelope::descriptor()}};
  std::set<std::string> rows;
  for (const Rule& rule : permission_table()) {
    const auto kind = kinds.find(rule.kind);
    ASSERT_NE(kind, kinds.end()) << rule.kind;
    EXPECT_NE(kind->second->FindFieldByName(std::string(rule.name)), nullptr) << rule.name;
    EXPECT_TRUE(
        rows.insert(std::string(rule.kind) + " " + std::string(rule.name) + " " + std::string(rule.part))
            .second)
        << "twice: " << rule.name;
    if (rule.others != v1::ROLE_UNSPECIFIED) {
      EXPECT_GE(rank(rule.others), rank(rule.own))
          << rule.name << ": others' things are no easier than one's own";
    }
  }
  for (const auto& [kind, descriptor] : kinds) {
    for (const FieldDescriptor* field : bodies(descriptor)) {
      const std::string row = kind + " " + field->name() + " ";
      EXPECT_TRUE(rows.contains(row) || rows.contains(row + "text")) << row;
    }
  }
}

TEST(Permissions, RolesThatAreNoneOfAModelMayNothing) {
  for (const v1::Role role : {v1::ROLE_UNSPECIFIED, v1::ROLE_SUBSCRIBER, static_cast<v1::Role>(77)}) {
    for (const FieldDescriptor* field : bodies(v1::Operation::descriptor())) {
      v1::Operation operation;
      set_body(operation, field);
      EXPECT_FALSE(allows(role, operation, Ownership::own)) << field->name();
    }
    for (const FieldDescriptor* field : bodies(v1::Envelope::descriptor()))
      EXPECT_FALSE(allows(role, static_cast<v1::Envelope::BodyCase>(field->number()))) << field->name();
  }
}

TEST(Permissions, WhatHasNoBodyIsRefusedToEverybody) {
  EXPECT_FALSE(allows(v1::ROLE_OWNER, v1::Operation(), Ownership::own));
  EXPECT_FALSE(allows(v1::ROLE_OWNER, v1::Query()));
  EXPECT_FALSE(allows(v1::ROLE_OWNER, v1::Envelope::BODY_NOT_SET));
}

TEST(Permissions, OnlyItsAuthorChangesWhatACommentSays) {
  v1::Operation operation;
  operation.mutable_change_comment()->set_id("comment-1");
  operation.mutable_change_comment()->set_text("other words");
  for (const v1::Role role : roles) {
    EXPECT_FALSE(allows(role, operation, Ownership::others)) << role_name(role);
    EXPECT_EQ(allows(role, operation, Ownership::own), role != v1::ROLE_VIEWER) << role_name(role);
  }
  // With `resolved` beside it no part becomes easier.
  operation.mutable_change_comment()->set_resolved(true);
  EXPECT_FALSE(allows(v1::ROLE_OWNER, operation, Ownership::others));
  operation.mutable_change_comment()->clear_text();
  EXPECT_TRUE(allows(v1::ROLE_EDITOR, operation, Ownership::others));
  EXPECT_FALSE(allows(v1::ROLE_COMMENTER, operation, Ownership::others));
  EXPECT_TRUE(allows(v1::ROLE_COMMENTER, operation, Ownership::own));
}

TEST(Permissions, ARefusalSaysWhatIsMissing) {
  v1::Operation operation;
  operation.mutable_fit();
  const Status status = check(v1::ROLE_VIEWER, operation, Ownership::own);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::permission_denied);
  EXPECT_EQ(status.error().message, "viewer may not do fit, expected editor");
  operation.mutable_delete_comment();
  EXPECT_THAT(check(v1::ROLE_EDITOR, operation, Ownership::others).error().message,
              HasSubstr("to what somebody else has made, expected owner"));
  EXPECT_EQ(check(v1::ROLE_OWNER, v1::Envelope::kWelcome).error().message, "nobody may send welcome");
  EXPECT_TRUE(check(v1::ROLE_OWNER, operation, Ownership::others).ok());
}

TEST(Permissions, ACommentIsItsAuthors) {
  v1::Operation operation;
  operation.mutable_delete_comment()->set_id("comment-1");
  const AuthorOf by_ann = [](const std::string& id) {
    return id == "comment-1" ? std::optional<std::string>("ann") : std::nullopt;
  };
  EXPECT_EQ(ownership_of(operation, "ann", by_ann), Ownership::own);
  EXPECT_EQ(ownership_of(operation, "bob", by_ann), Ownership::others);
  operation.mutable_delete_comment()->set_id("comment-2");  // Which the model itself refuses.
  EXPECT_EQ(ownership_of(operation, "bob", by_ann), Ownership::own);
  operation.mutable_add_comment()->set_reply_to("comment-1");
  EXPECT_EQ(ownership_of(operation, "bob", by_ann), Ownership::own);
}

TEST(Roles, AreOrderedAndNamed) {
  for (std::size_t i = 0; i < roles.size(); ++i) {
    EXPECT_EQ(*parse_role(role_name(roles.at(i))), roles.at(i));
    for (std::size_t j = 0; j < roles.size(); ++j) EXPECT_EQ(at_least(roles.at(i), roles.at(j)), i >= j);
  }
  EXPECT_EQ(role_name(v1::ROLE_SUBSCRIBER), "none");
  EXPECT_FALSE(parse_role("none").ok());
  EXPECT_FALSE(parse_role("Owner").ok());
  EXPECT_FALSE(at_least(v1::ROLE_OWNER, v1::ROLE_UNSPECIFIED));
  EXPECT_FALSE(at_least(v1::ROLE_SUBSCRIBER, v1::ROLE_SUBSCRIBER));
  EXPECT_EQ(lesser(v1::ROLE_OWNER, v1::ROLE_VIEWER), v1::ROLE_VIEWER);
  EXPECT_EQ(lesser(v1::ROLE_VIEWER, v1::ROLE_OWNER), v1::ROLE_VIEWER);
  EXPECT_EQ(lesser(v1::ROLE_SUBSCRIBER, v1::ROLE_OWNER), v1::ROLE_UNSPECIFIED);
}

// The table in the room's README says what the code does.
TEST(Permissions, TheReadmeShowsTheTable) {
  std::ifstream file("server-model/access/README.md");
  std::stringstream text;
  text << file.rdbuf();
  const auto cell = [](v1::Role role) {
    return role == v1::ROLE_UNSPECIFIED ? "nobody" : std::string(role_name(role));
  };
  for (const Rule& rule : permission_table()) {
    const std::string name = std::string(rule.name) + (rule.part.empty() ? "" : "." + std::string(rule.part));
    EXPECT_THAT(text.str(), HasSubstr("| " + std::string(rule.kind) + " | `" + name + "` | " +
                                      cell(rule.own) + " | " + cell(rule.others) + " |"));
  }
}

}  // namespace
}  // namespace handloft::access
