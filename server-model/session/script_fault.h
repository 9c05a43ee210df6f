#pragma once
// Says in the words of the .proto files why a JSON value is not a message: which field, what was found, what
// was expected. Protobuf's own parser tells this in its own terms, so it only decides, and this explains.

#include <google/protobuf/message.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "common/base/result.h"

namespace handloft::model {

/// The first mistake in `value` as JSON of `type`; nothing when there is none that this knows. Unknown
/// fields, wrong types, numbers out of range, unknown enum values and several members of a oneof are found.
std::optional<Error> find_fault(const nlohmann::json& value, const google::protobuf::Descriptor& type);

/// "add_points" for "addPoints".
std::string snake_case(std::string_view name);

}  // namespace handloft::model
