#pragma once
// Expectations of a script: what a query's answer must hold, or how an operation must fail.

#include <nlohmann/json.hpp>

#include "common/base/result.h"
#include "server-model/session/script_target.h"

namespace handloft::model {

/// Checks {"query", "path", and "equals" | "near" + "tolerance" | "atMost" | "atLeast" | "count"} or
/// {"fails", "code", "field"}. Returns what was found, for the answer line. failed_precondition says what was
/// found and what was expected; invalid_argument that the expectation itself is wrong.
Result<nlohmann::json> check_expectation(const nlohmann::json& expectation, ScriptTarget& target);

}  // namespace handloft::model
