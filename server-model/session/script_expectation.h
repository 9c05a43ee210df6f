#pragma once
// Expectations of a script: what a query's answer must hold, or how an operation must fail.

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "common/base/result.h"
#include "server-model/session/script_target.h"

namespace handloft::model {

/// What a script's expectations have remembered, by name.
using Remembered = std::map<std::string, nlohmann::json>;

/// Checks {"query", "path", and "equals" | "near" + "tolerance" | "atMost" | "atLeast" | "count" | "remember"
/// | "equalsRemembered"} or {"fails", "code", "field"}. Returns what was found, for the answer line; what is
/// to be remembered is so only if all else holds. failed_precondition says what was found and what was
/// expected; invalid_argument that the expectation itself is wrong.
Result<nlohmann::json> check_expectation(const nlohmann::json& expectation, ScriptTarget& target,
                                         Remembered& remembered);

}  // namespace handloft::model
