#pragma once
// Text of a stranger (a peer's reason, a name, a sentence) as it may be shown or logged.

#include <cstddef>
#include <string>
#include <string_view>

namespace handloft {

/// At most `most` bytes of it, cut between UTF-8 characters, and nothing that moves a terminal's cursor:
/// control characters become spaces.
std::string plain_text(std::string_view text, std::size_t most);

}  // namespace handloft
