#pragma once
// What each role may do (U2, A3): one table over every operation, query and message of the protocol. A body
// that proto/ has and the table has not is refused for everybody, and fails a test. README.md shows the whole
// table.

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "proto/query.pb.h"
#include "proto/session.pb.h"
#include "server-model/access/roles.h"

namespace handloft::access {

/// Whose the thing is that an operation acts on. Designs belong to everybody on the model; comments to their
/// authors.
enum class Ownership { own, others };

/// A row of the table.
struct Rule {
  std::string_view kind;  ///< "operation", "query" or "message": the oneof `body` that `name` is a field of.
  std::string_view name;  ///< As in proto/: "add_points".
  std::string_view part;  ///< Of what is judged by its parts: "text" and "resolved" of change_comment.
  v1::Role own;           ///< The least role on what one made oneself, and on what has no author.
  v1::Role others;        ///< On what somebody else made. ROLE_UNSPECIFIED: nobody.
};

/// All of it, in the order of proto/.
const std::vector<Rule>& permission_table();

/// Whether `role` may. An operation of several parts needs all of them.
bool allows(v1::Role role, const v1::Operation& operation, Ownership whose);
bool allows(v1::Role role, const v1::Query& query);
/// The message itself; of a Submit or Ask also what it holds must be asked about.
bool allows(v1::Role role, v1::Envelope::BodyCase message);

/// As allows(), with the reason in words. Errors: permission_denied.
Status check(v1::Role role, const v1::Operation& operation, Ownership whose);
Status check(v1::Role role, const v1::Query& query);
Status check(v1::Role role, v1::Envelope::BodyCase message);

/// The comment that an operation changes or deletes, whose author decides Ownership; nullopt: there is none,
/// and it is everybody's own.
std::optional<std::string> comment_of(const v1::Operation& operation);
/// The author of a comment; nullopt: there is no such comment, and the model refuses the operation itself.
using AuthorOf = std::function<std::optional<std::string>(const std::string& comment)>;
/// `user` is Operation.author of what is theirs.
Ownership ownership_of(const v1::Operation& operation, std::string_view user, const AuthorOf& author_of);

}  // namespace handloft::access
