#pragma once
// Roles and the people who have them (U2): viewer < commenter < editor < owner, each may all that the one
// below may. The names are those of scripts, commands and the wire's texts.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "proto/session.pb.h"

namespace handloft::access {

/// In place of a model's name: on every model.
inline constexpr std::string_view every_model = "*";

/// "viewer", "commenter", "editor", "owner"; "none" for every other value.
std::string_view role_name(v1::Role role);
/// Errors: invalid_argument (field "role") for any other word.
Result<v1::Role> parse_role(std::string_view name);
/// 1 viewer .. 4 owner; 0: may do nothing with a model.
int rank(v1::Role role);
/// Whether `role` may all that `needed` may; false where either is no role of a model.
bool at_least(v1::Role role, v1::Role needed);
/// The lesser of two: what a client that asked for `asked` gets of the `granted`.
v1::Role lesser(v1::Role asked, v1::Role granted);

/// How somebody has proved to be who they are.
enum class Proof {
  local_user,      ///< The kernel's word for the other end of a unix socket (SO_PEERCRED).
  certificate,     ///< TLS with a certificate that our authority signed at the pairing.
  unauthenticated  ///< Plain TCP, by loopback: nobody in particular.
};

/// Whoever a connection belongs to.
struct User {
  std::string name;  ///< A login name or the name of the invitation; "tcp" for plain TCP.
  Proof proof = Proof::unauthenticated;
  std::string device;                ///< Fingerprint of the certificate; else empty.
  std::string address;               ///< "192.0.2.7", for the audit log; empty for local users.
  std::optional<std::uint32_t> uid;  ///< Of local users.
  bool operator==(const User&) const = default;
};

}  // namespace handloft::access
