#include "server-model/access/roles.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace handloft::access {

namespace {
constexpr std::array<std::pair<v1::Role, std::string_view>, 4> by_rank{
    std::pair(v1::ROLE_VIEWER, "viewer"), std::pair(v1::ROLE_COMMENTER, "commenter"),
    std::pair(v1::ROLE_EDITOR, "editor"), std::pair(v1::ROLE_OWNER, "owner")};
}

std::string_view role_name(v1::Role role) {
  const int place = rank(role);
  return place == 0 ? "none" : by_rank.at(static_cast<std::size_t>(place) - 1).second;
}

Result<v1::Role> parse_role(std::string_view name) {
  const auto* found =
      std::find_if(by_rank.begin(), by_rank.end(), [&](const auto& each) { return each.second == name; });
  if (found == by_rank.end())
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found \"{}\", expected viewer, commenter, editor or owner", name.substr(0, 64)), "role");
  return found->first;
}

int rank(v1::Role role) {
  const auto* found =
      std::find_if(by_rank.begin(), by_rank.end(), [&](const auto& each) { return each.first == role; });
  return found == by_rank.end() ? 0 : static_cast<int>(found - by_rank.begin()) + 1;
}

bool at_least(v1::Role role, v1::Role needed) {
  return rank(needed) > 0 && rank(role) >= rank(needed);
}

v1::Role lesser(v1::Role asked, v1::Role granted) {
  if (rank(asked) == 0 || rank(granted) == 0) return v1::ROLE_UNSPECIFIED;
  return rank(asked) < rank(granted) ? asked : granted;
}

}  // namespace handloft::access
