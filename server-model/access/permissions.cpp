#include "server-model/access/permissions.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <array>

namespace handloft::access {

namespace {

constexpr std::string_view operation = "operation", query = "query", message = "message";
constexpr std::string_view text_part = "text", resolved_part = "resolved";
constexpr v1::Role viewer = v1::ROLE_VIEWER, commenter = v1::ROLE_COMMENTER, editor = v1::ROLE_EDITOR,
                   owner = v1::ROLE_OWNER, nobody = v1::ROLE_UNSPECIFIED;

std::vector<Rule> make_table() {
  // clang-format off
  return {
      {operation, "create_dual_shape", "", editor, editor},
      {operation, "add_points", "", editor, editor},
      {operation, "set_symmetry", "", editor, editor},
      {operation, "fit", "", editor, editor},
      {operation, "set_superellipse", "", editor, editor},
      {operation, "set_representation", "", editor, editor},
      {operation, "rename", "", editor, editor},
      {operation, "delete", "", editor, editor},
      {operation, "undo", "", editor, editor},
      {operation, "redo", "", editor, editor},
      {operation, "import_strokes", "", editor, editor},
      {operation, "export", "", editor, editor},
      {operation, "refit_plane", "", editor, editor},
      {operation, "push_points", "", editor, editor},
      {operation, "modify_profile", "", editor, editor},
      {operation, "set_boundary", "", editor, editor},
      {operation, "delete_points", "", editor, editor},
      {operation, "move_points", "", editor, editor},
      {operation, "transform", "", editor, editor},
      {operation, "duplicate", "", editor, editor},
      {operation, "import_reference", "", editor, editor},
      {operation, "new_alternative", "", editor, editor},
      {operation, "switch_alternative", "", editor, editor},
      {operation, "restore_alternative", "", editor, editor},
      {operation, "delete_alternative", "", editor, editor},
      {operation, "create_sculpt_surface", "", editor, editor},
      {operation, "set_sculpting", "", editor, editor},
      {operation, "add_icon", "", editor, editor},
      {operation, "change_icon", "", editor, editor},
      {operation, "drag_icon", "", editor, editor},
      {operation, "delete_icon", "", editor, editor},
      {operation, "commit_sculpting", "", editor, editor},
      {operation, "recover_sculpting", "", editor, editor},
      {operation, "refine_surface", "", editor, editor},
      {operation, "import_model", "", editor, editor},
      {operation, "name_version", "", editor, editor},
      {operation, "restore_version", "", editor, editor},
      {operation, "delete_version", "", owner, owner},
      {operation, "add_comment", "", commenter, commenter},
      {operation, "change_comment", "text", commenter, nobody},
      {operation, "change_comment", "resolved", commenter, editor},
      {operation, "delete_comment", "", commenter, owner},
      {query, "surface", "", viewer, viewer},
      {query, "evaluate", "", viewer, viewer},
      {query, "points", "", viewer, viewer},
      {query, "entities", "", viewer, viewer},
      {query, "hash", "", viewer, viewer},
      {query, "history", "", viewer, viewer},
      {query, "alternatives", "", viewer, viewer},
      {query, "compare", "", viewer, viewer},
      {query, "distance", "", viewer, viewer},
      {query, "pick", "", viewer, viewer},
      {query, "sculpt", "", viewer, viewer},
      {query, "control_net", "", viewer, viewer},
      {query, "versions", "", viewer, viewer},
      {query, "difference", "", viewer, viewer},
      {query, "comments", "", viewer, viewer},
      {query, "people", "", viewer, viewer},
      {query, "models", "", viewer, viewer},
      {message, "hello", "", nobody, nobody},
      {message, "welcome", "", nobody, nobody},
      {message, "failure", "", viewer, viewer},
      {message, "ping", "", viewer, viewer},
      {message, "pong", "", viewer, viewer},
      {message, "subscribe", "", nobody, nobody},
      {message, "tracking", "", editor, editor},
      {message, "glove_feedback", "", nobody, nobody},
      {message, "join", "", viewer, viewer},
      {message, "snapshot", "", nobody, nobody},
      {message, "delta", "", nobody, nobody},
      {message, "presence", "", viewer, viewer},
      {message, "submit", "", commenter, commenter},
      {message, "ack", "", nobody, nobody},
      {message, "ask", "", viewer, viewer},
      {message, "answer", "", nobody, nobody},
      {message, "hand_command", "", editor, editor},
      {message, "joined", "", nobody, nobody},
      {message, "people", "", nobody, nobody},
      {message, "lease", "", editor, editor},
      {message, "pair", "", nobody, nobody},
      {message, "paired", "", nobody, nobody},
  };
  // clang-format on
}

/// The name of a field of the oneof; empty: unknown.
std::string_view name_of(const google::protobuf::Descriptor* descriptor, int number) {
  const auto* field = descriptor->FindFieldByNumber(number);
  return field == nullptr ? std::string_view() : std::string_view(field->name());
}

const Rule* find_rule(std::string_view kind, std::string_view name, std::string_view part = {}) {
  const std::vector<Rule>& table = permission_table();
  const auto found = std::find_if(table.begin(), table.end(), [&](const Rule& rule) {
    return rule.kind == kind && rule.name == name && rule.part == part;
  });
  return found == table.end() ? nullptr : &*found;
}

/// The least role; nobody for what the table has not.
v1::Role needed(const Rule* rule, Ownership whose) {
  if (rule == nullptr) return nobody;
  return whose == Ownership::own ? rule->own : rule->others;
}

struct Verdict {
  v1::Role needed = nobody;
  std::string_view part = {};
};

/// Of all parts the one that is hardest to be allowed.
Verdict judge(const v1::Operation& what, Ownership whose) {
  const std::string_view name = name_of(v1::Operation::descriptor(), what.body_case());
  if (!what.has_change_comment()) return {needed(find_rule(operation, name), whose), {}};
  const v1::ChangeComment& change = what.change_comment();
  // Without a part it changes nothing; it is judged as if it had the easier one.
  Verdict verdict{needed(find_rule(operation, name, resolved_part), whose), resolved_part};
  if (change.has_text()) {
    const v1::Role text = needed(find_rule(operation, name, text_part), whose);
    if (!change.has_resolved() || text == nobody || rank(text) > rank(verdict.needed))
      verdict = {text, text_part};
  }
  return verdict;
}

Status refusal(v1::Role role, v1::Role least, const std::string& what) {
  return make_error(ErrorCode::permission_denied,
                    least == nobody
                        ? fmt::format("nobody may {}", what)
                        : fmt::format("{} may not {}, expected {}", role_name(role), what, role_name(least)),
                    "role");
}

}  // namespace

const std::vector<Rule>& permission_table() {
  static const std::vector<Rule> table = make_table();
  return table;
}

bool allows(v1::Role role, const v1::Operation& what, Ownership whose) {
  return at_least(role, judge(what, whose).needed);
}

bool allows(v1::Role role, const v1::Query& what) {
  return at_least(
      role, needed(find_rule(query, name_of(v1::Query::descriptor(), what.body_case())), Ownership::own));
}

bool allows(v1::Role role, v1::Envelope::BodyCase what) {
  return at_least(role,
                  needed(find_rule(message, name_of(v1::Envelope::descriptor(), what)), Ownership::own));
}

Status check(v1::Role role, const v1::Operation& what, Ownership whose) {
  const Verdict verdict = judge(what, whose);
  if (at_least(role, verdict.needed)) return {};
  const std::string_view name = name_of(v1::Operation::descriptor(), what.body_case());
  return refusal(
      role, verdict.needed,
      fmt::format("do {}{}{}{}", name.empty() ? "this" : name, verdict.part.empty() ? "" : ".", verdict.part,
                  whose == Ownership::others ? " to what somebody else has made" : ""));
}

Status check(v1::Role role, const v1::Query& what) {
  if (allows(role, what)) return {};
  const std::string_view name = name_of(v1::Query::descriptor(), what.body_case());
  const v1::Role least = needed(find_rule(query, name), Ownership::own);
  return refusal(role, least, fmt::format("ask for {}", name.empty() ? "this" : name));
}

Status check(v1::Role role, v1::Envelope::BodyCase what) {
  if (allows(role, what)) return {};
  const std::string_view name = name_of(v1::Envelope::descriptor(), what);
  const v1::Role least = needed(find_rule(message, name), Ownership::own);
  return refusal(role, least, fmt::format("send {}", name.empty() ? "this" : name));
}

std::optional<std::string> comment_of(const v1::Operation& what) {
  if (what.has_change_comment()) return what.change_comment().id();
  if (what.has_delete_comment()) return what.delete_comment().id();
  return std::nullopt;
}

Ownership ownership_of(const v1::Operation& what, std::string_view user, const AuthorOf& author_of) {
  const auto comment = comment_of(what);
  if (!comment) return Ownership::own;
  const auto author = author_of(*comment);
  return !author || *author == user ? Ownership::own : Ownership::others;
}

}  // namespace handloft::access
