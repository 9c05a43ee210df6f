#pragma once
// Names that people give, and texts that strangers send.

#include <string>
#include <string_view>

#include "common/base/result.h"

namespace handloft::access {

/// 1 to 64 bytes without control characters, and not "*". Errors: invalid_argument.
Status check_name(std::string_view name, std::string_view field);
/// What a model may be called: 1 to 64 letters, digits, '-', '_' and '.', the first one a letter or digit.
/// Errors: invalid_argument.
Status check_model_name(std::string_view name, std::string_view field);
/// The same, or every_model; field "model".
Status check_model(std::string_view model);
/// At most `most` bytes, nothing that moves a terminal's cursor, and UTF-8: else '?'.
std::string plain(std::string_view text, std::size_t most = 128);

}  // namespace handloft::access
