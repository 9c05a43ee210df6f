#pragma once
// A script's lines as JSON: parsed with limits, mapped to protobuf in full double precision, the sign of zero
// included, and looked into by path.

#include <google/protobuf/message.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace handloft::model {

/// Nesting of a line; protobuf JSON of ours needs 6.
inline constexpr int max_json_depth = 32;

/// Checks that `text` is one JSON object (UTF-8, no member twice in one object, bounded depth) without
/// building it, and returns the names of its members. invalid_argument says where it goes wrong.
Result<std::vector<std::string>> top_level_members(std::string_view text);

/// Parses what top_level_members() has accepted.
Result<nlohmann::json> parse_json(std::string_view text);

/// From protobuf JSON; refusals name the field in `field`, what was found and what was expected.
Status from_json(std::string_view text, google::protobuf::Message& message);
/// To protobuf JSON on one line: lowerCamelCase, every scalar written, doubles to the last bit.
Result<std::string> to_json(const google::protobuf::Message& message);

/// What lies at a JSON pointer ("/surface/coefficients/0") or dotted path ("surface.coefficients.0"); members
/// may be named in snake_case. Empty: the whole. Null: nothing there.
const nlohmann::json* find_path(const nlohmann::json& json, std::string_view path);

}  // namespace handloft::model
